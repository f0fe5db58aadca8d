// A shape in space: what the service tells, repeated around the disk and moved through a period, drawn with WebGL.

import { cross, dot, turning, unit } from "../base/vectors.js";

const DRAWN = 0.1; // the largest motion, of the size of what is drawn
const BOX = 0.021; // half an edge of a mass, of that size
const MOST_POINTS = 150_000;
const FIELD = (35 * Math.PI) / 180;
const CORNERS = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, i >> 2].map((side) => 2 * side - 1));
const SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]].flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);

const tokens = (host, names) => {
  const probe = host.appendChild(document.createElement("i"));
  const found = names.map((name) => {
    probe.style.color = `var(${name})`;
    return getComputedStyle(probe).color;
  });
  probe.remove();
  return found;
};

// What is drawn of every sector: points, and the corners of boxes that stand for masses.
function layout(shape) {
  const shown = Math.min(shape.sectors, Math.max(1, Math.floor(MOST_POINTS / shape.points.length)));
  const pitch = (2 * Math.PI) / shape.sectors;
  const turns = Array.from({ length: shown }, (_, j) => turning(shape.axis, j * pitch));
  const at = (j, p) => turns[j].map((row) => dot(row, p));
  const ring = shape.points.flatMap((p) => turns.map((_, j) => at(j, p)));
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((i) => ring.reduce((best, p) => pick(best, p[i]), ring[0][i])));
  const size = Math.hypot(...high.map((v, i) => v - low[i])) || 1;
  const middle = low.map((v, i) => (v + high[i]) / 2);
  const reach = ring.reduce((most, p) => Math.max(most, Math.hypot(...p.map((v, i) => v - middle[i]))), 0) + DRAWN * size;
  const half = (BOX * size) / (shown > 12 ? 2 : 1);
  const places = shape.points.map((rest, point) => ({ point, rest }));
  const boxes = [];
  shape.roles.forEach((role, point) => {
    if (role !== "mass" && role !== "node") return;
    boxes.push(places.length);
    const wide = shape.to_scale ? half / 2 : half;
    for (const corner of CORNERS) places.push({ point, rest: shape.points[point].map((v, i) => v + wide * corner[i]) });
  });
  return { shown, turns, places, boxes, size, middle, reach };
}

function indices(shape, { shown, places, boxes }) {
  const n = places.length;
  const [lines, faces] = [[], []];
  for (let j = 0; j < shown; j += 1) {
    for (const [a, b] of shape.edges) lines.push(j * n + a, j * n + b);
    if (j + 1 < shown || shown === shape.sectors) for (const [a, b] of shape.ahead) lines.push(j * n + a, ((j + 1) % shown) * n + b);
    for (const face of shape.faces) faces.push(...face.map((p) => j * n + p));
    for (const first of boxes) faces.push(...SIDES.map((c) => j * n + first + c));
  }
  return { lines, faces };
}

// The motion of every point at the angle τ about its mean, and what its contacts do there.
function motionAt(shape, j, tau) {
  const s = shape.real.length > 1 ? j : 0;
  const moved = shape.points.map(() => [0, 0, 0]);
  shape.harmonics.forEach((k, h) => {
    if (k === 0) return;
    const [c, q] = [Math.cos(k * (tau + j * shape.turn)), Math.sin(k * (tau + j * shape.turn))];
    const [real, imag] = [shape.real[s][h], shape.imag[s][h]];
    for (let p = 0; p < moved.length; p += 1) for (let i = 0; i < 3; i += 1) moved[p][i] += real[p][i] * c - imag[p][i] * q;
  });
  return moved;
}

function contactAt({ motions, states }, { real, turn }, j, tau) {
  const s = real.length > 1 ? j : 0;
  const over = motions[s];
  if (!over) return states[s] ? { stuck: 0, closed: 0, separated: 2 }[states[s]] ?? 1 : null;
  const share = (tau + j * turn) / (2 * Math.PI);
  return over[Math.round((share - Math.floor(share)) * over.length) % over.length];
}

// Draws into a canvas; null where the browser has no WebGL.
export function stage(three, canvas, shape) {
  const context = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!context) return null;
  const plan = layout(shape);
  const { shown, turns, places, size } = plan;
  const renderer = new three.WebGLRenderer({ canvas, context, antialias: true, alpha: true });
  const scene = new three.Scene();
  const { lines, faces } = indices(shape, plan);
  const attribute = (count) => new three.BufferAttribute(new Float32Array(3 * count), 3);
  const [position, rest, colour] = [0, 0, 0].map(() => attribute(shown * places.length));
  const spots = [attribute(shown * shape.contacts.length), attribute(shown * shape.contacts.length)];
  const geometry = (at, index, paint) => {
    const made = new three.BufferGeometry();
    made.setAttribute("position", at);
    if (paint) made.setAttribute("color", paint);
    if (index) made.setIndex(index);
    return made;
  };
  const outline = new three.LineBasicMaterial({ transparent: true, opacity: 0.45 });
  const edges = new three.LineBasicMaterial({ vertexColors: true });
  const marks = new three.PointsMaterial({ vertexColors: true, size: 9, sizeAttenuation: false, depthTest: false, transparent: true });
  const drawn = [
    new three.LineSegments(geometry(rest, lines), outline),
    new three.LineSegments(geometry(position, lines, colour), edges),
    new three.Mesh(geometry(position, faces, colour), new three.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: three.DoubleSide })),
    new three.Points(geometry(spots[0], null, spots[1]), marks),
  ];
  for (const [i, each] of drawn.entries()) Object.assign(each, { frustumCulled: false, renderOrder: i });
  scene.add(new three.AmbientLight(0xffffff, 2), ...drawn);
  const light = new three.DirectionalLight(0xffffff, 1.6);
  scene.add(light);

  const largest = Math.max(...shape.amplitude.flat());
  const factor = largest > 0 ? (DRAWN * size) / largest : 0;
  const up = shape.sectors > 1 ? shape.axis : [0, 1, 0];
  const first = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1], up));
  const second = cross(up, first);
  const camera = new three.PerspectiveCamera((FIELD * 180) / Math.PI, 1, size / 100, size * 20);
  const view = shape.sectors > 1 ? { round: 0.6, over: 0.6, far: 1 } : { round: 1.25, over: 0.3, far: 1 };
  let paint = null;
  let by = "amplitude";
  let tau = 0;

  const put = (array, i, at) => array.set(at, 3 * i);
  places.forEach((place, v) => turns.forEach((rows, j) => put(rest.array, j * places.length + v, rows.map((row) => dot(row, place.rest)))));

  function recolour() {
    const read = (names) => tokens(canvas.parentElement, names).map((text) => new three.Color(text));
    paint = { ramp: read(["--a0", "--a1", "--a2", "--a3", "--a4", "--a5", "--a6", "--a7"]), states: read(["--stick", "--slip", "--apart"]), quiet: read(["--a1"])[0], unknown: read(["--ink-3"])[0] };
    outline.color = paint.unknown;
    turns.forEach((_, j) => places.forEach(({ point }, v) => {
      const share = largest > 0 ? (shape.amplitude[shape.amplitude.length > 1 ? j : 0][point] / largest) * (paint.ramp.length - 1) : 0;
      const low = Math.min(Math.floor(share), paint.ramp.length - 2);
      const mixed = by === "amplitude" ? paint.ramp[low].clone().lerp(paint.ramp[low + 1], share - low) : paint.quiet;
      put(colour.array, j * places.length + v, [mixed.r, mixed.g, mixed.b]);
    }));
    colour.needsUpdate = true;
  }

  function draw(now = tau) {
    tau = now;
    for (let j = 0; j < shown; j += 1) {
      const moved = motionAt(shape, j, tau);
      const turned = (p, v) => turns[j].map((row) => dot(row, [0, 1, 2].map((i) => p[i] + factor * v[i])));
      places.forEach(({ point, rest: from }, v) => put(position.array, j * places.length + v, turned(from, moved[point])));
      shape.contacts.forEach((contact, c) => {
        const i = j * shape.contacts.length + c;
        const state = contactAt(contact, shape, j, tau);
        const { r, g, b } = state === null ? paint.unknown : paint.states[state];
        put(spots[0].array, i, turned(shape.points[contact.point], moved[contact.point]));
        put(spots[1].array, i, [r, g, b]);
      });
    }
    for (const each of [position, ...spots]) each.needsUpdate = true;
    look();
  }

  function look() {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    // A ring that is seen from its side is wider than it is high.
    const far = (view.far * plan.reach) / Math.sin(FIELD / 2) / Math.min(camera.aspect, shape.sectors > 1 ? 1.4 : 1);
    const [c, s] = [Math.cos(view.over), Math.sin(view.over)];
    const from = [0, 1, 2].map((i) => c * (Math.sin(view.round) * first[i] - Math.cos(view.round) * second[i]) + s * up[i]);
    camera.up.set(...up);
    camera.position.set(...plan.middle.map((v, i) => v + far * from[i]));
    camera.lookAt(...plan.middle);
    camera.updateProjectionMatrix();
    light.position.copy(camera.position);
    renderer.render(scene, camera);
  }

  recolour();
  return {
    factor, shown, draw, look,
    // Where a point of a sector is drawn.
    at: (j, p) => [...position.array.slice(3 * (j * places.length + p), 3 * (j * places.length + p) + 3)],
    colourBy(what) {
      by = what;
      marks.size = what === "amplitude" ? 9 : 14;
      recolour();
      draw();
    },
    orbit(round, over, far = 1) {
      view.round += round;
      view.over = Math.min(Math.max(view.over + over, -1.5), 1.5);
      view.far = Math.min(Math.max(view.far * far, 0.2), 4);
      look();
    },
    close() {
      for (const each of drawn) {
        each.geometry.dispose();
        each.material.dispose();
      }
      renderer.dispose();
    },
  };
}
