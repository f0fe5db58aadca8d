// The drawing of a scene without places: masses, springs and contacts in chains from the ground, or rings of sectors.

import { svg } from "../base/dom.js";
import { measured } from "../base/format.js";
import { classOf, ownName, pattern, plates, stateIn, statesOf, wordsOf } from "./marks.js";

const GROUND = "ground";
const MOST_SECTORS = 24;
const SHOWN_OF_MANY = 3;
const HEIGHT = 250;

export function drawChain(scene, joints, states, width) {
  const parts = partsOf(scene, joints);
  const names = parts.contacts.map((c) => `${c.name} ${statesOf(states, c)}`).join(", ");
  const label = `${scene.name}: ${parts.cyclic ? `${parts.sectors} sectors of ` : ""}${parts.dofs.length} masses, ${parts.springs.length} springs; ${names || "no contacts"}`;
  const drawing = svg("svg", { role: "img", "aria-label": label }, pattern());
  if (parts.cyclic) disk(drawing, scene, parts, states);
  else lumped(drawing, scene, parts, states, width);
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

function mass(place, size, name, observed, text) {
  return [
    svg("circle", { class: observed ? "mass observed" : "mass", cx: place.x, cy: place.y, r: size }, svg("title", {}, name)),
    observed ? svg("circle", { class: "mass", cx: place.x, cy: place.y, r: Math.max(size - 4, 1.5) }) : null,
    text ? svg("text", { class: "halo", x: place.x, y: place.y + text.dy, "text-anchor": "middle" }, name) : null,
  ];
}

function arrow(place, size) {
  const { x, y } = place;
  const top = y - size - 3;
  return [
    svg("path", { class: "force", d: `M${x} ${top - 26}V${top - 6}` }),
    svg("path", { class: "force", d: `M${x - 4} ${top - 8}H${x + 4}L${x} ${top}Z` }),
    svg("text", { class: "halo", x: x - 8, y: top - 15, "text-anchor": "end" }, "force"),
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

function lumped(drawing, scene, parts, states, width) {
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
  for (const contact of parts.contacts) {
    drawing.append(...lumpedContact(contact, { places, size, width, held }, classOf(stateIn(states, contact)), `${contact.name} ${statesOf(states, contact)}`));
  }
  for (const dof of parts.dofs) {
    drawing.append(...mass(places.get(dof), size, dof, dof === ownName(scene.observe.dof), { dy: 4 }).filter(Boolean));
  }
  for (const force of forcesOf(scene)) {
    const place = places.get(ownName(force.dof));
    if (place) drawing.append(...arrow(place, size));
  }
}

// A contact to the ground hangs below its mass, one between masses is drawn above them; `held` counts those there.
function lumpedContact({ between }, { places, size, width, held }, state, words) {
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
    const left = x > width / 2 && before === 0;
    return [
      before ? svg("path", { class: "earth", d: `M${a.x} ${a.y + size + 4}H${x}` }) : null,
      plates({ x, y: top }, { x, y: bottom }, 20, state, words),
      hatched(x, bottom, 18),
      before
        ? svg("text", { class: "halo", x: Math.min(x + 40, width - 4), y: bottom + 22 + 15 * (before - 1), "text-anchor": "end" }, words)
        : svg("text", { class: "halo", x: x + (left ? -18 : 18), y: (top + bottom) / 2 + 4, "text-anchor": left ? "end" : "start" }, words),
    ].filter(Boolean);
  }
  const side = a.x < b.x ? 10 : -10;
  const y = Math.max(Math.min(a.y, b.y) - size - 20 - 34 * before, 24);
  const [p, q] = [{ x: a.x + side, y }, { x: b.x - side, y }];
  return [
    svg("path", { class: "earth", d: `M${p.x} ${a.y}V${y}M${q.x} ${b.y}V${y}` }),
    plates(p, q, 20, state, words),
    svg("text", { class: "halo", x: (p.x + q.x) / 2, y: y - 16, "text-anchor": "middle" }, words),
  ];
}

function disk(drawing, scene, parts, states) {
  const radius = 190;
  const { place, hub, shown, closed, size } = ring(parts, radius);
  const pad = 34;
  const depth = closed ? 2 * (radius + pad) : radius + 2 * pad + 26;
  drawing.setAttribute("viewBox", `${-radius - pad - 40} ${-radius - pad} ${2 * (radius + pad + 40)} ${depth}`);
  drawing.append(svg("circle", { class: "earth", r: radius * 0.12, "stroke-dasharray": "3 3" }), svg("text", { class: "soft", y: 4, "text-anchor": "middle" }, "hub"));
  if (!closed) drawing.append(svg("text", { class: "soft", y: radius * 0.12 + 16, "text-anchor": "middle" }, `${shown} of ${parts.sectors} sectors`));
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
  const observed = ownName(scene.observe.dof);
  const pushed = forcesOf(scene).map((force) => ownName(force.dof));
  for (const j of sectors) {
    for (const dof of parts.dofs) {
      const here = place(dof, j);
      drawing.append(...mass(here, size, dof, dof === observed, null).filter(Boolean));
      if (pushed.includes(dof)) drawing.append(push(here, size));
      const far = size + (closed && pushed.includes(dof) ? 21 : 5);
      if (j === 0) drawing.append(svg("text", { class: "halo", x: here.x + (closed ? far : -far), y: here.y + 4, "text-anchor": closed ? "start" : "end" }, dof));
    }
  }
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
