// The drawing of a scene without places: masses, springs and contacts in chains from the ground, or rings of sectors.

import { svg } from "../base/dom.js";
import { measured } from "../base/format.js";
import { labels } from "./labels.js";
import { classOf, ownName, pattern, plates, stateIn, statesOf, wordsOf } from "./marks.js";

const GROUND = "ground";
const MOST_SECTORS = 24;
const SHOWN_OF_MANY = 3;
const HEIGHT = 250;

export function drawChain(scene, joints, { states, value = () => undefined, width }) {
  const parts = partsOf(scene, joints);
  const names = parts.contacts.map((c) => `${c.name} ${statesOf(states, c)}`).join(", ");
  const label = `${scene.name}: ${parts.cyclic ? `${parts.sectors} sectors of ` : ""}${parts.dofs.length} masses, ${parts.springs.length} springs; ${names || "no contacts"}`;
  const drawing = svg("svg", { role: "img", "aria-label": label }, pattern());
  if (parts.cyclic) disk(drawing, scene, parts, { states, width });
  else lumped(drawing, scene, parts, { states, value, width });
  return drawing;
}

function zigzag(a, b, size) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const length = Math.hypot(dx, dy) || 1;
  const [ux, uy, px, py] = [dx / length, dy / length, -dy / length, dx / length];
  const lead = Math.min(0.25 * length, 8);
  const turns = Math.max(3, Math.min(7, Math.round((length - 2 * lead) / 7)));
  let d = `M${a.x.toFixed(1)} ${a.y.toFixed(1)}L${(a.x + lead * ux).toFixed(1)} ${(a.y + lead * uy).toFixed(1)}`;
  for (let i = 0; i < turns; i += 1) {
    const along = lead + ((i + 0.5) / turns) * (length - 2 * lead);
    const side = (i % 2 ? -1 : 1) * size;
    d += `L${(a.x + along * ux + side * px).toFixed(1)} ${(a.y + along * uy + side * py).toFixed(1)}`;
  }
  return `${d}L${(b.x - lead * ux).toFixed(1)} ${(b.y - lead * uy).toFixed(1)}L${b.x.toFixed(1)} ${b.y.toFixed(1)}`;
}

const spring = (a, b, size, title) =>
  svg("path", { class: "spring", d: zigzag(a, b, size) }, title ? svg("title", {}, title) : null);

function mass(place, size, name, observed) {
  return [
    svg("circle", { class: observed ? "mass observed" : "mass", cx: place.x, cy: place.y, r: size }, svg("title", {}, name)),
    ...(observed ? [svg("circle", { class: "mass", cx: place.x, cy: place.y, r: Math.max(size - 4, 1.5) })] : []),
  ];
}

function arrow(place, size) {
  const { x, y } = place;
  const top = y - size - 3;
  return [
    svg("path", { class: "force", d: `M${x} ${top - 26}V${top - 6}` }),
    svg("path", { class: "force", d: `M${x - 4} ${top - 8}H${x + 4}L${x} ${top}Z` }),
  ];
}

const hatched = (x, y, wide) => {
  let d = `M${x - wide} ${y}H${x + wide}`;
  for (let i = -wide; i < wide; i += 6) d += `M${x + i + 6} ${y}l-6 7`;
  return svg("path", { class: "earth", d });
};

// A structure given by matrices: its DOFs in one box.
function box(places, size) {
  const [xs, ys] = [[...places.values()].map((p) => p.x), [...places.values()].map((p) => p.y)];
  const [left, top] = [Math.min(...xs) - size - 16, Math.min(...ys) - size - 10];
  const [right, bottom] = [Math.max(...xs) + size + 16, Math.max(...ys) + size + 10];
  return [
    svg("rect", { class: "earth", x: left, y: top, width: right - left, height: bottom - top, rx: 10, "stroke-dasharray": "5 4" }),
    svg("text", { class: "soft", x: left + 6, y: bottom + 16 }, "given by its matrices, which tell no places"),
  ];
}

const forcesOf = (scene) =>
  (Array.isArray(scene.excitation) ? scene.excitation : [scene.excitation]).flatMap((force) =>
    force.dof ? [force] : Object.keys(force.forces ?? force.driven ?? {}).map((dof) => ({ ...force, dof })));

function lumped(drawing, scene, parts, { states, value, width }) {
  const words = labels({ width, height: HEIGHT });
  const { places, size, ground } = chain(parts, width, HEIGHT);
  drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  const end = (name, other, count) =>
    name === GROUND ? { x: ground.x, y: (places.get(ownName(other)) ?? { y: 0 }).y + 10 * count } : places.get(ownName(name));
  if (parts.matrices) drawing.append(...box(places, size));
  const wall = [...places.values()].map((p) => p.y);
  const [low, high] = [Math.min(...wall) - 26, Math.max(...wall) + 26];
  if (!parts.matrices) drawing.append(svg("g", { transform: `rotate(90 ${ground.x} ${(low + high) / 2})` }, hatched(ground.x, (low + high) / 2, (high - low) / 2)));
  parts.springs.forEach((s) => {
    const [a, b] = [end(s.between[0], s.between[1], 0), end(s.between[1], s.between[0], 0)];
    if (a && b) drawing.append(spring(a, b, 6, `${s.name ?? "spring"}: ${measured(s.k, "N/m")}`));
  });
  const held = new Map();
  const told = [];
  const label = (...more) => told.push(more);
  for (const contact of parts.contacts) {
    drawing.append(...lumpedContact(contact, { places, size, width, held, words, label }, classOf(stateIn(states, contact)), `${contact.name} ${statesOf(states, contact)}`));
  }
  for (const dof of parts.dofs) {
    const place = places.get(dof);
    drawing.append(...mass(place, size, dof, dof === ownName(scene.observe.dof)));
    drawing.append(words.put(dof, place, { far: size + 3, sides: [[0, 0], [0, 1], [0, -1], [1, 0], [-1, 0]] }) ?? "");
    words.keep(place, size);
  }
  const forces = forcesOf(scene);
  for (const { dof, amplitude } of forces) {
    const place = places.get(ownName(dof));
    if (!place) continue;
    drawing.append(...arrow(place, size));
    words.keep({ x: place.x, y: place.y - size - 16 }, 12);
    const force = forces.length === 1 ? value("excitation.amplitude") ?? amplitude : amplitude;
    label(typeof force === "number" ? measured(force, "N", null, 3) : "force", { x: place.x, y: place.y - size - 18 }, { far: 8, class: "halo green", bold: true, sides: [[-1, 0], [1, 0], [0, -1]] });
  }
  drawing.append(...told.map((each) => words.put(...each) ?? ""));
}

// A contact to the ground hangs below its mass, one between masses is drawn above them; `held` counts those there.
function lumpedContact({ between }, { places, size, width, held, words, label }, state, said) {
  const free = ownName(between.find((name) => name !== GROUND));
  const grounded = between.includes(GROUND);
  const [a, b] = [places.get(free), places.get(ownName(between[grounded ? 0 : 1])) ?? places.get(free)];
  if (!a || !b) return [];
  const where = grounded ? free : "above";
  const before = held.get(where) ?? 0;
  held.set(where, before + 1);
  if (grounded) {
    const x = a.x + 48 * before;
    const [top, bottom] = [a.y + size, HEIGHT - 42];
    const left = x > width / 2 ? -1 : 1;
    words.keep({ x, y: (top + bottom) / 2 }, 14);
    label(said, { x, y: (top + bottom) / 2 }, { far: 18, sides: [[left, 0], [-left, 0], [-left, 0.8], [left, 0.8], [0, 1]] });
    return [
      before ? svg("path", { class: "earth", d: `M${a.x} ${a.y + size + 4}H${x}` }) : null,
      plates({ x, y: top }, { x, y: bottom }, 20, state, said),
      hatched(x, bottom, 18),
    ].filter(Boolean);
  }
  const side = a.x < b.x ? 10 : -10;
  const y = Math.max(Math.min(a.y, b.y) - size - 20 - 34 * before, 24);
  const [p, q] = [{ x: a.x + side, y }, { x: b.x - side, y }];
  words.keep({ x: (p.x + q.x) / 2, y }, 12);
  label(said, { x: (p.x + q.x) / 2, y }, { far: 14, sides: [[0, -1], [0, 1], [-1, 0], [1, 0]] });
  return [svg("path", { class: "earth", d: `M${p.x} ${a.y}V${y}M${q.x} ${b.y}V${y}` }), plates(p, q, 20, state, said)];
}

function disk(drawing, scene, parts, { states, width }) {
  const pad = 34;
  const side = parts.sectors > MOST_SECTORS ? pad + 40 : pad;
  const radius = Math.min(190, width / 2 - side);
  const { place, hub, shown, closed, size } = ring(parts, radius);
  const depth = closed ? 2 * (radius + pad) : radius + 2 * pad + 26;
  const frame = { left: -radius - side, top: -radius - pad, width: 2 * (radius + side), height: depth };
  const words = labels(frame);
  drawing.setAttribute("viewBox", Object.values(frame).join(" "));
  drawing.append(svg("circle", { class: "earth", r: radius * 0.12, "stroke-dasharray": "3 3" }), words.put("hub", { x: 0, y: 0 }, { far: 0, class: "soft", sides: [[0, 0]] }));
  if (!closed) drawing.append(words.put(`${shown} of ${parts.sectors} sectors`, { x: 0, y: radius * 0.12 + 6 }, { class: "soft", far: 2, sides: [[0, 1]] }));
  const end = (name, j) => {
    const next = name.endsWith("@next") ? 1 : 0;
    return name === GROUND ? hub(j) : place(ownName(name), j + next);
  };
  const sectors = Array.from({ length: shown }, (_, j) => j);
  const reach = (between, j) => closed || j + 1 < shown || !between.some((name) => name.endsWith("@next"));
  for (const j of sectors) {
    for (const s of parts.springs) {
      if (reach(s.between, j)) drawing.append(spring(end(s.between[0], j), end(s.between[1], j), 3.2, j ? null : `${s.name ?? "spring"}: ${measured(s.k, "N/m")}`));
    }
  }
  for (const j of sectors) {
    for (const c of parts.contacts) {
      if (!reach(c.between, j)) continue;
      const found = stateIn(states, c, j);
      const words = `${c.name} ${wordsOf(found)}`;
      const ends = [end(c.between[0], j), end(c.between[1], j)];
      const [a, b] = beside(...ends, size);
      if (a !== ends[0]) drawing.append(svg("path", { class: "earth", d: `M${ends[0].x} ${ends[0].y}L${a.x} ${a.y}M${ends[1].x} ${ends[1].y}L${b.x} ${b.y}` }));
      drawing.append(plates(a, b, Math.max(size * 0.95, 8), classOf(found), words));
    }
  }
  const named = [];
  const observed = ownName(scene.observe.dof);
  const pushed = forcesOf(scene).map((force) => ownName(force.dof));
  for (const j of sectors) {
    for (const dof of parts.dofs) {
      const here = place(dof, j);
      drawing.append(...mass(here, size, dof, dof === observed));
      words.keep(here, size);
      if (pushed.includes(dof)) drawing.append(push(here, size));
      const far = size + (closed && pushed.includes(dof) ? 21 : 5);
      if (j === 0) named.push([dof, here, { far, more: 1, sides: closed ? [[1, 0], [0.8, -0.8], [0.8, 0.8], [-1, 0], [0, -1]] : [[-1, 0], [1, 0]] }]);
    }
  }
  drawing.append(...named.map((each) => words.put(...each) ?? ""));
}

// A contact between two rings of the same blade is drawn beside the spring there.
function beside(a, b, size) {
  const across = Math.abs(Math.sin((a.angle ?? 0) - (b.angle ?? 0))) > 1e-6;
  if (across) return [a, b];
  const shift = 1.35 * size;
  const [px, py] = [-Math.sin(a.angle) * shift, Math.cos(a.angle) * shift];
  return [{ x: a.x - px, y: a.y - py }, { x: b.x - px, y: b.y - py }];
}

function push({ x, y, angle }, size) {
  const [tx, ty] = [-Math.sin(angle), Math.cos(angle)];
  const [bx, by] = [x + tx * (size + 2), y + ty * (size + 2)];
  const [fx, fy] = [bx + tx * 14, by + ty * 14];
  const [nx, ny] = [Math.cos(angle) * 3, Math.sin(angle) * 3];
  return svg("path", { class: "force", d: `M${fx} ${fy}L${bx} ${by}M${bx} ${by}l${tx * 6 + nx} ${ty * 6 + ny}l${-2 * nx} ${-2 * ny}Z` });
}

// Where parts are drawn: chains from the ground outwards, disks as rings of sectors.

// Distance of every DOF from the ground over the springs; what hangs on contacts alone is one farther than its
// neighbour, and what hangs on nothing comes last.
function layersOf(dofs, springs, contacts) {
  const layers = new Map([[GROUND, 0]]);
  spread(layers, springs);
  spread(layers, [...springs, ...contacts]);
  let last = Math.max(...layers.values());
  for (const dof of dofs) if (!layers.has(dof)) layers.set(dof, (last += 1));
  return layers;
}

function spread(layers, joints) {
  for (let more = true; more; ) {
    more = false;
    const found = new Map();
    for (const { between } of joints) {
      const [a, b] = between.map(ownName);
      for (const [from, to] of [[a, b], [b, a]]) {
        if (layers.has(from) && !layers.has(to)) found.set(to, Math.min(layers.get(from) + 1, found.get(to) ?? Infinity));
      }
    }
    for (const [name, layer] of found) {
      layers.set(name, layer);
      more = true;
    }
  }
}

// What a scene's structure consists of, whatever its kind.
function partsOf({ structure, observe }, contacts) {
  const masses = structure.masses ? Object.keys(structure.masses) : Object.keys(structure.dofs ?? {});
  const used = [...contacts.flatMap((c) => c.between), observe.dof].map(ownName);
  const dofs = masses.length ? masses : [...new Set(used)].filter((name) => name !== GROUND);
  return {
    dofs: dofs.map(ownName).filter((name, i, all) => all.indexOf(name) === i),
    springs: structure.springs ?? [],
    contacts,
    sectors: structure.kind === "cyclic" ? structure.sectors : 1,
    cyclic: structure.kind === "cyclic",
    matrices: structure.kind === "matrices",
  };
}

function chain(parts, width, height) {
  const inOrder = new Map(parts.dofs.map((dof, i) => [dof, i + 1]));
  const layers = parts.matrices ? inOrder : layersOf(parts.dofs, parts.springs, parts.contacts);
  const above = parts.contacts.some((c) => !c.between.includes(GROUND)) ? 22 : 0;
  const columns = new Map();
  for (const dof of parts.dofs) {
    const layer = layers.get(dof);
    columns.set(layer, [...(columns.get(layer) ?? []), dof]);
  }
  const last = Math.max(...columns.keys(), 1);
  const places = new Map();
  for (const [layer, names] of columns) {
    names.forEach((name, i) => {
      const x = 54 + (layer / (last + 0.35)) * (width - 90);
      places.set(name, { x, y: (height * (i + 1)) / (names.length + 1) - 18 + above });
    });
  }
  const size = Math.min(24, (0.36 * (width - 90)) / (last + 1), (0.3 * height) / Math.max(...[...columns.values()].map((n) => n.length)));
  return { places, size: Math.max(size, 5), ground: { x: 22 } };
}

// The places of sector j's DOFs on their rings; of very many sectors only the first few, widely fanned.
function ring(parts, radius) {
  const layers = layersOf(parts.dofs, parts.springs, parts.contacts);
  const last = Math.max(...layers.values(), 1);
  const all = parts.sectors <= MOST_SECTORS;
  const shown = all ? parts.sectors : SHOWN_OF_MANY;
  const step = all ? (2 * Math.PI) / Math.max(parts.sectors, 2) : Math.PI / 5;
  const start = all ? -Math.PI / 2 : -Math.PI / 2 - step;
  const inner = 0.3;
  const place = (dof, j) => {
    const share = inner + ((1 - inner) * (layers.get(dof) - 1)) / Math.max(last - 1, 1);
    const angle = start + j * step;
    return { x: radius * share * Math.cos(angle), y: radius * share * Math.sin(angle), angle };
  };
  const hub = (j) => {
    const angle = start + j * step;
    return { x: radius * 0.12 * Math.cos(angle), y: radius * 0.12 * Math.sin(angle), angle };
  };
  const size = Math.min(15, (0.3 * radius * (1 - inner)) / last, 0.32 * radius * inner * step + 4);
  return { place, hub, shown, closed: all, size: Math.max(size, 3.5) };
}
