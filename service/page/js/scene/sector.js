// The sector of a disk from finite elements: the outline of its mesh, its boundaries and its contacts, in two views.

import { el, note, svg } from "../base/dom.js";
import { cross, dot, plus, times, turning, unit } from "../base/vectors.js";
import { labels } from "./labels.js";
import { classOf, pattern, plates, stateIn, stateKey, statesOf } from "./marks.js";

const HIGH = 330;
const PAD = 26;
const TURN = (50 * Math.PI) / 180;
const TILT = (22 * Math.PI) / 180;
const DOT = 2.6;
const PLATE = 11;

// Radius, circumference and axis where the sector is: blades stand upright in both views.
function frameOf(points, axis) {
  const along = unit(axis);
  const mean = times(points.reduce(plus, [0, 0, 0]), 1 / points.length);
  const out = plus(mean, times(along, -dot(mean, along)));
  const up = Math.hypot(...out) > 1e-9 ? unit(out) : unit(cross(along, Math.abs(along[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
  return { along, up, round: cross(along, up) };
}

const views = ({ along, up, round }) => [
  { words: "the axis towards you", at: (p) => [-dot(p, round), -dot(p, up)] },
  {
    words: "from the side",
    at(p) {
      const [r, t, a] = [dot(p, up), -dot(p, round), dot(p, along)];
      return [t * Math.cos(TURN) + a * Math.sin(TURN), -(r * Math.cos(TILT) + (t * Math.sin(TURN) - a * Math.cos(TURN)) * Math.sin(TILT))];
    },
  },
];

// Scale and shift that bring a view into its half of the drawing.
function fitted(view, points, left, width) {
  const flat = points.map(view.at);
  const [xs, ys] = [0, 1].map((i) => flat.map((p) => p[i]));
  const [low, high] = [[Math.min(...xs), Math.min(...ys)], [Math.max(...xs), Math.max(...ys)]];
  const scale = Math.min((width - 2 * PAD) / (high[0] - low[0] || 1), (HIGH - 2 * PAD) / (high[1] - low[1] || 1));
  const shift = [left + width / 2 - (scale * (low[0] + high[0])) / 2, HIGH / 2 - (scale * (low[1] + high[1])) / 2];
  return (p) => {
    const [x, y] = view.at(p);
    return { x: shift[0] + scale * x, y: shift[1] + scale * y };
  };
}

const lines = (edges, places) =>
  edges.map(([a, b]) => `M${places[a].x.toFixed(1)} ${places[a].y.toFixed(1)}L${places[b].x.toFixed(1)} ${places[b].y.toFixed(1)}`).join("");

const low = ({ x, y }) => svg("circle", { class: "f1", cx: x.toFixed(1), cy: y.toFixed(1), r: DOT });
const high = ({ x, y }) => svg("rect", { class: "f2", x: (x - DOT).toFixed(1), y: (y - DOT).toFixed(1), width: 2 * DOT, height: 2 * DOT });

// The drawing, its key and what it leaves out.
export function drawSector(scene, joints, { states, width }) {
  const { outline, sectors, cyclic } = scene.structure;
  const axis = cyclic?.axis ?? [0, 0, 1];
  // Where the next sector has it: turned by the pitch.
  const turn = turning(unit(axis), (2 * Math.PI) / sectors);
  const placed = joints.filter(({ at }) => at);
  const words = joints.map((joint) => `${joint.name} ${statesOf(states, joint)}`).join(", ");
  const drawing = svg("svg", {
    role: "img", viewBox: `0 0 ${width} ${HIGH + 18}`,
    "aria-label": `${scene.name}: one of ${sectors} sectors from finite elements, seen along the axis and from the side; ${outline.low.length} nodes on the boundary to the sector before, ${outline.high.length} on that to the next one; ${words || "no contacts"}`,
  }, pattern());
  const room = labels({ width, height: HIGH + 18 });
  const next = outline.points.map((p) => turn.map((row) => dot(row, p)));
  views(frameOf(outline.points, axis)).forEach((view, i) => {
    const at = fitted(view, i ? outline.points : [...outline.points, ...next], (i * width) / 2, width / 2);
    const places = outline.points.map(at);
    if (!i) drawing.append(svg("path", { class: "mesh next", d: lines(outline.edges, next.map(at)) }));
    drawing.append(svg("path", { class: "mesh", d: lines(outline.edges, places) }));
    if (!outline.edges.length) drawing.append(...places.map(({ x, y }) => svg("circle", { class: "mesh-node", cx: x.toFixed(1), cy: y.toFixed(1), r: 1 })));
    drawing.append(...outline.low.map((k) => low(places[k])), ...outline.high.map((k) => high(places[k])));
    drawing.append(room.put(view.words, { x: (i + 0.5) * (width / 2), y: HIGH }, { class: "soft", far: 0, sides: [[0, 1]] }) ?? "");
    drawing.append(...marks(placed, at, states, i === 1 && room));
  });
  return [drawing, legend(placed.length > 0), noted(outline, joints, placed)];
}

// Contacts as plates at their places, named where there is room for that.
function marks(placed, at, states, room) {
  if (room) for (const joint of placed) room.keep(at(joint.at), PLATE);
  return placed.flatMap((joint) => {
    const { x, y } = at(joint.at);
    const half = PLATE / 1.4;
    const [from, to] = [{ x: x - half, y }, { x: x + half, y }];
    return [
      plates(from, to, PLATE, classOf(stateIn(states, joint)), `${joint.name} ${statesOf(states, joint)}`),
      (room && room.put(joint.name, { x, y }, { far: PLATE + 3 })) || null,
    ].filter(Boolean);
  });
}

function legend(rubbing) {
  const entry = (shape, words) => el("li", {}, svg("svg", { width: 16, height: 16, class: "key", "aria-hidden": "true" }, shape), ` ${words}`);
  return el("ul", { class: "legend" },
    entry(low({ x: 8, y: 8 }), "boundary to the sector before"), entry(high({ x: 8, y: 8 }), "boundary to the next one"),
    entry(svg("path", { class: "mesh next", d: "M1 8H15" }), "the next sector"), rubbing ? stateKey() : null);
}

function noted(outline, joints, placed) {
  const missing = joints.filter((each) => !placed.includes(each)).map(({ name }) => name);
  const said = [
    outline.edges.length ? "" : "The deck tells no elements that can be drawn: the nodes stand for the mesh.",
    missing.length ? `Without a place, so not drawn: ${missing.join(", ")}.` : "",
  ].filter(Boolean);
  return said.length ? note(said.join(" ")) : null;
}
