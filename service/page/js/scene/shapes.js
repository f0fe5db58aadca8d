// Dampers by their shape, as the solver has them (solver/scene/bodies/body_shapes.py): faces with their points and
// normals, and the outlines that are drawn of them. Places are [across, outward, axial] from the middle of the damper.

import { plus, times } from "../base/vectors.js";

const spread = (points) => Array.from({ length: points }, (_, i) => (i + 0.5) / points - 0.5);
const along = (mid, way, by) => plus(mid, times(way, by));
const LEAST = 0.15; // of a width, the half length of a face that has none

// A flat face whose middle is half the width to one side, -1 left, 1 right; its points lie down it.
function flat({ name, points = 1 }, side, angle, width, length) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const face = { side, mid: [(side * width) / 2, 0, 0], way: [c, -side * s, 0], normal: [side * s, c, 0], half: length / 2 || LEAST * width };
  return { ...face, points: spread(points).map((share, i) => ({ name: `${name}-${side < 0 ? "left" : "right"}-${i}`, at: along(face.mid, face.way, length * share) })) };
}

// The line on which something round touches a face; its points lie along the axis.
function line({ name, points = 1 }, side, angle, radius, length) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const mid = [side * radius * s, radius * c, 0];
  return {
    side, mid, way: [c, -side * s, 0], normal: [side * s, c, 0], half: 0.4 * radius,
    points: spread(points).map((share, i) => ({ name: `${name}-${side < 0 ? "left" : "right"}-${i}`, at: along(mid, [0, 0, 1], length * share) })),
  };
}

function shroud({ name, points = 1 }, { angle, length }) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const way = [-s, 0, c];
  return [{ side: 1, mid: [0, 0, 0], way, normal: [c, 0, s], half: length / 2 || 1e-3, points: spread(points).map((share, i) => ({ name: `${name}-${i}`, at: along([0, 0, 0], way, length * share) })) }];
}

const FACES = {
  "wedge": (damper, { angle, width, length }) => [-1, 1].map((side) => flat(damper, side, angle, width, length)),
  "cylinder": (damper, { angle, radius, length }) => [-1, 1].map((side) => line(damper, side, angle, radius, length)),
  "asymmetric": (damper, { angle, curved_angle: curved, width, radius, length }) => [flat(damper, -1, angle, width, length), line(damper, 1, curved, radius, length)],
  "split-ring": (damper, { width }) => [-1, 1].map((side) => flat(damper, side, 0, width / 2, width / 2)),
  shroud,
};

const GEOMETRY = ["angle", "curved_angle", "width", "radius", "length"];

// The faces of a damper; `of(key)` is the value of one of its numbers.
export const facesOf = (damper, of) => FACES[damper.shape]?.(damper, Object.fromEntries(GEOMETRY.map((key) => [key, of(key) ?? 0]))) ?? [];

// The two ends of a face, the inner and the outer one; those of two faces do not cross in the middle.
export function endsOf({ mid, way, half, side }) {
  const most = way[0] ? Math.abs(mid[0] / way[0]) : half;
  return [along(mid, way, -side * Math.min(half, most || half)), along(mid, way, side * half)];
}

const arc = (radius, from, to, steps = 24) => Array.from({ length: steps + 1 }, (_, i) => {
  const angle = from + ((to - from) * i) / steps;
  return [radius * Math.cos(angle), radius * Math.sin(angle)];
});

// Below its faces a body is drawn a quarter of its width deep, because no data say more.
function below(top, depth) {
  const [first, last] = [top[0], top[top.length - 1]];
  const bottom = Math.min(first[1], last[1]) - depth;
  const chamfer = 0.35 * depth;
  return [...top, [last[0], bottom + chamfer], [last[0] - chamfer, bottom], [first[0] + chamfer, bottom], [first[0], bottom + chamfer]];
}

const OUTLINES = {
  "wedge": (faces, of) => below([endsOf(faces[0])[1], endsOf(faces[0])[0], ...endsOf(faces[1])], of("width") / 4),
  "cylinder": (_faces, of) => arc(of("radius"), 0, 2 * Math.PI, 48),
  "asymmetric": (faces, of) => below([endsOf(faces[0])[1], endsOf(faces[0])[0], ...arc(of("radius"), Math.PI / 2, 0)], of("width") / 4),
  "split-ring": (_faces, of) => [[-1, 0], [1, 0], [1, -0.25], [-1, -0.25]].map(([x, y]) => [(x * of("width")) / 2, (y * of("width")) / 2]),
};

// The outline of the body of a damper, as places across and outward; none of one that has no body.
export const outlineOf = (damper, faces, of) => OUTLINES[damper.shape]?.(faces, of) ?? null;

// How high a platform is over a face and its node at `height`; by the `reach` of the damper or its nodes.
export const topOf = (face, height, reach) => Math.max(height + 0.2 * reach, endsOf(face)[0][1] + 0.32 * reach);

// A platform over a face, to beyond its node, with the shank below and the blade above as symbols.
export function platformOf({ shape }, face, { top, reach, bottom, sky }) {
  const { side } = face;
  const [inner, outer] = endsOf(face);
  const low = Math.min(inner[1], outer[1]);
  const at = (x, y) => [side * x * reach, y];
  if (shape === "split-ring") return { body: [[0, 0], at(1.6, 0), at(1.6, top), [0, top]], blade: null };
  // The underside goes on along the face to near the other platform.
  const gap = (Math.abs(inner[0]) > 0.12 * reach ? 0.1 : 0.04) * reach;
  const lip = along(inner, face.way, (gap - Math.abs(inner[0])) * (side / face.way[0]));
  const past = along(outer, face.way, side * 0.08 * reach);
  // The blade bends over 2.6 times the reach; what is beyond the sky is cut.
  const high = Math.min(Math.max((sky - top) / reach, 0.3), 2.6);
  const edge = (turn) => Array.from({ length: 13 }, (_, i) => (i / 12) * high).map((up) => at(1.75 - 0.16 * Math.sin((Math.PI * up) / 2.6) + turn * (0.2 + 0.08 * (1 - up / 2.6) ** 4), top + up * reach));
  return {
    body: [at(0.04, top), at(0.04, lip[1]), lip, past, at(1.45, past[1]), at(1.45, bottom), at(2.05, bottom), at(2.05, low), at(2.9, low), at(2.9, top)],
    blade: [...edge(-1), ...edge(1).reverse()],
  };
}
