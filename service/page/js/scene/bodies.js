// A scene whose places are known, drawn as bodies: platforms, dampers, shrouds and nodes on one scale, contact faces by
// what they do, forces and loads as arrows.

import { el, note, svg } from "../base/dom.js";
import { measured, number } from "../base/format.js";
import { cross, dot, turning, unit } from "../shape/stage.js";
import { labels } from "./labels.js";
import { classOf, ownName, pattern, plates, stateIn, stateKey, statesOf, wordsOf } from "./marks.js";
import { endsOf, facesOf, outlineOf, platformOf, topOf } from "./shapes.js";

const FEW_NODES = 8;
const [ABOVE, UNDER] = [30, 58]; // what is to scale, for arrows and words
const LONGEST = 90; // of the arrow of a load
const BELOW = 46;
const DOF = 34;
const BESIDE = [[1, 0], [-1, 0]];
const WORST = ["is-apart", "is-slip", "is-stick", "is-unknown"];
const times = (a, k) => a.map((value) => k * value);
const plus = (a, b) => a.map((value, i) => value + b[i]);
const minus = (a, b) => a.map((value, i) => value - b[i]);
const DIRECTIONS = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

// The place of an end, of another sector where that has it.
function placeOf({ nodes = [], bodies = [], structure }, end) {
  const [name, sector] = end.split("@");
  const found = [...nodes, ...bodies].find((each) => each.name === name || Object.values(each.dofs ?? {}).includes(name));
  if (!found) return null;
  const at = found.at ?? [0, 0, 0];
  const steps = { next: 1, previous: -1 }[sector] ?? 0;
  return steps ? turning(unit(structure.axis ?? [0, 0, 1]), (steps * 2 * Math.PI) / structure.sectors).map((row) => dot(row, at)) : at;
}

export const pointOf = (scene, { at, between }) => at ?? between.map((end) => placeOf(scene, end)).find(Boolean) ?? null;

// Whether everything that rubs has a place: the rest is drawn as chains.
export function hasPlaces(scene, joints) {
  const dampers = (scene.dampers ?? []).map(({ name }) => name);
  return (scene.nodes ?? []).length > 0 && joints.length > 0
    && joints.every((joint) => dampers.includes(joint.name) || pointOf(scene, (scene.contacts ?? []).find(({ name }) => name === joint.name) ?? joint));
}

// How it is looked at: across the damper and outward, onto shrouds from outside, else where the nodes are most apart.
function viewOf({ dampers = [], nodes }) {
  const shaped = dampers.filter(({ shape }) => shape !== "patch");
  const first = shaped.find(({ shape }) => shape !== "shroud") ?? shaped[0];
  if (first) {
    const [out, axial] = [unit(first.out ?? DIRECTIONS.y), unit(first.axial ?? DIRECTIONS.z)];
    return { origin: first.at ?? [0, 0, 0], right: cross(out, axial), up: first.shape === "shroud" ? times(axial, -1) : out, first };
  }
  const wide = [0, 1, 2].map((i) => Math.max(...nodes.map(({ at }) => at[i])) - Math.min(...nodes.map(({ at }) => at[i])));
  const [a, b] = [0, 1, 2].sort((i, j) => wide[j] - wide[i]).slice(0, 2).sort((i, j) => i - j);
  return { origin: nodes[0].at, right: Object.values(DIRECTIONS)[a], up: Object.values(DIRECTIONS)[b], first: null };
}

// Every damper with its faces and what is drawn of them, in the plane of the view [m].
function partsOf(scene, view, value) {
  const flat = (at) => [dot(minus(at, view.origin), view.right), dot(minus(at, view.origin), view.up)];
  const dampers = (scene.dampers ?? []).map((damper) => {
    const of = (key) => value(`${damper.name}.${key}`) ?? damper[key];
    const [out, axial] = [unit(damper.out ?? DIRECTIONS.y), unit(damper.axial ?? DIRECTIONS.z)];
    const axes = [cross(out, axial), out, axial];
    const middle = damper.at ?? [0, 0, 0];
    const spatial = (place) => place.reduce((sum, part, i) => plus(sum, times(axes[i], part)), [0, 0, 0]);
    const seen = (place) => flat(plus(middle, spatial([...place, 0].slice(0, 3))));
    const flatly = (vector) => [dot(vector, view.right), dot(vector, view.up)];
    const way = (vector) => flatly(spatial(vector));
    const faces = facesOf(damper, of);
    const ends = (damper.between ?? []).map((end) => placeOf(scene, end));
    const local = (at) => [dot(minus(at, middle), axes[0]), dot(minus(at, middle), out)];
    return { damper, of, faces, seen, way, across: damper.normal && flatly(damper.normal), middle: flat(middle), nodes: ends.map((at) => at && local(at)), outline: outlineOf(damper, faces, of), patch: (damper.pairs ?? []).map(({ between, at }, i) => ({ name: `${damper.name}-${i}`, at: flat(at), between })) };
  });
  const own = (scene.contacts ?? []).filter(({ name }) => !dampers.some(({ faces }) => faces.some(({ points }) => points.some((point) => point.name === name))));
  const contacts = own.map((contact) => ({ contact, at: flat(pointOf(scene, contact)), normal: contact.normal ? [dot(contact.normal, view.right), dot(contact.normal, view.up)] : [1, 0] }));
  // A body whose shape nobody tells is drawn from one of its contacts to the next.
  const plain = (scene.bodies ?? []).map((body) => ({ body, ring: around(contacts.filter(({ contact }) => contact.between.includes(body.name)).map((each) => each.at)) })).filter(({ ring }) => ring.length > 1);
  const ends = new Set([...scene.nodes.map(({ name }) => name), ...(scene.dampers ?? []).flatMap(({ between = [] }) => between), ...own.flatMap(({ between }) => between)]);
  const nodes = [...ends].map((name) => ({ name, node: scene.nodes.find((each) => each.name === ownName(name)), place: placeOf(scene, name) })).filter(({ node, place }) => node && place).map((each) => ({ ...each, at: flat(each.place) }));
  return { dampers, contacts, nodes, plain };
}

// Places in their order round their middle.
function around(places) {
  const middle = times(places.reduce(plus, [0, 0]), 1 / places.length);
  return [...places].sort((a, b) => Math.atan2(a[1] - middle[1], a[0] - middle[0]) - Math.atan2(b[1] - middle[1], b[0] - middle[0]));
}

// What has to be seen: its least and largest place [m], and what of it may be cut at the sides.
function extentOf({ dampers, contacts, nodes }) {
  const seen = [...nodes.map(({ at }) => at), ...contacts.map(({ at }) => at)];
  for (const { faces, outline, seen: place, patch } of dampers) {
    seen.push(...[...(outline ?? []), ...faces.flatMap(endsOf)].map(place), ...patch.map(({ at }) => at));
  }
  const [xs, ys] = [0, 1].map((i) => seen.map((at) => at[i]));
  return { low: [Math.min(...xs), Math.min(...ys)], high: [Math.max(...xs), Math.max(...ys)] };
}

const path = (points, name, close = true) => svg("path", { class: name, d: `M${points.map(({ x, y }) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}${close ? "Z" : ""}` });

function arrow(from, to, name) {
  const length = Math.hypot(to.x - from.x, to.y - from.y) || 1;
  const [ux, uy] = [(to.x - from.x) / length, (to.y - from.y) / length];
  const head = Math.min(7, 0.6 * length);
  const [bx, by] = [to.x - head * ux, to.y - head * uy];
  return svg("g", { class: name }, path([from, { x: bx, y: by }], "shaft", false), path([to, { x: bx - 0.5 * head * uy, y: by + 0.5 * head * ux }, { x: bx + 0.5 * head * uy, y: by - 0.5 * head * ux }], "head"));
}

function mark({ x, y }, state, title) {
  const inside = svg("title", {}, title);
  if (state === "is-stick" || state === "is-unknown") return svg("circle", { class: `contact spot ${state}`, cx: x, cy: y, r: 5 }, inside);
  return svg("rect", { class: `contact spot ${state}`, x: x - 5, y: y - 5, width: 10, height: 10 }, inside);
}

// What points do together: the worst of it.
const worst = (states, points) => WORST.find((state) => points.some(({ name }) => classOf(stateIn(states, { contacts: [name] }, 0)) === state));

// Points that are seen at one place, as one.
function together(points) {
  const groups = [];
  for (const point of points) {
    const group = groups.find(({ at }) => Math.hypot(at.x - point.at.x, at.y - point.at.y) < 1);
    if (group) group.points.push(point);
    else groups.push({ at: point.at, points: [point] });
  }
  return groups;
}

// The drawing, its key and its scale; `loads` are mean normal loads [N] by contact, `stale` if they are of other values.
export function drawBodies(scene, joints, { states, loads, stale, value = () => undefined, width, height, small }) {
  const view = viewOf(scene);
  const parts = partsOf(scene, view, value);
  const { low, high } = extentOf(parts);
  const size = Math.max(high[0] - low[0], high[1] - low[1]) || 1e-3;
  const bodies = parts.dampers.filter(({ outline }) => outline);
  const reach = Math.max(...bodies.flatMap(({ faces, outline, nodes }) => [...nodes.filter(Boolean).map(([x]) => Math.abs(x)), ...faces.map((face) => 1.05 * Math.abs(endsOf(face)[1][0])), ...outline.map(([x]) => Math.abs(x))]), 0);
  const [above, under] = small ? [8, 8] : [ABOVE, UNDER];
  const shrouds = !bodies.length && view.first ? Math.max(...parts.nodes.map((node) => Math.abs(node.at[0]))) : 0;
  const tall = Math.max(0.8 * shrouds, high[1] - low[1] || size / 4) + (bodies.length ? 0.55 * reach : 0);
  const wide = bodies.length ? 2 * 1.62 * reach + (high[0] - low[0] - 2 * reach > 0 ? high[0] - low[0] - 2 * reach : 0) : high[0] - low[0] || size;
  const scale = Math.min((height - above - under) / tall, (width - (bodies.length || small ? 0 : shrouds ? 96 : 120)) / wide);
  const centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2 + (bodies.length ? 0.275 * reach : 0)];
  const at = ([x, y]) => ({ x: width / 2 + scale * (x - centre[0]), y: above + (height - above - under) / 2 - scale * (y - centre[1]) });
  const words = labels({ width, height });
  const drawing = svg("svg", { role: "img", viewBox: `0 0 ${width} ${height}`, class: "bodies", "aria-label": `${scene.name}, to scale: ${joints.map((joint) => `${joint.name}, ${statesOf(states, joint)}`).join("; ")}` }, small ? null : pattern());
  // Numbers are placed first, names of nodes where room is left.
  const told = [[], []];
  const label = (text, place, more) => told[more.name ? 1 : 0].push([text, place, more]);
  const bottom = centre[1] - (0.5 * height) / scale - reach;

  for (const { damper, faces, seen, nodes, outline } of bodies) {
    const top = Math.max(...faces.map((face, i) => topOf(face, nodes[i]?.[1] ?? 0, reach)));
    const platforms = faces.map((face) => platformOf(damper, face, { top, reach, bottom }));
    const line = (points, name) => path(points.map((point) => at(seen(point))), name);
    drawing.append(...platforms.filter(({ blade }) => blade).map(({ blade }) => line(blade, "blade")), ...platforms.map(({ body }) => line(body, "platform")));
    drawing.append(line(outline, "damper"));
  }
  for (const { damper, faces, seen, nodes } of parts.dampers.filter((each) => each.damper.shape === "shroud")) drawShroud(drawing, { damper, faces, seen, nodes, at });
  for (const { body, ring } of parts.plain) {
    drawing.append(path(ring.map(at), "damper"));
    label(body.name, at(times(ring.reduce(plus, [0, 0]), 1 / ring.length)), { name: true, class: "halo soft", far: 4 });
  }
  // What a point is moved by: nodes, over arms that do not bend.
  const tie = (ends, place) => drawing.append(...parts.nodes.filter(({ name }) => ends.includes(name)).map((node) => path([at(node.at), at(place)], "earth link", false)));
  for (const { damper, faces, seen } of bodies) for (const { side, points } of faces) for (const point of points) tie([damper.between[side < 0 ? 0 : 1]], seen(point.at));
  const forces = small ? [] : forcesOn(scene, parts, view, value);
  const press = bodies.map((part) => ({ ...part, load: pressOf(part, value) })).filter(({ load }) => load > 0);
  // One scale for all arrows of force but the excitation: that of what presses a body begins below it.
  const deep = ({ outline, seen, middle }) => Math.max(...outline.map((place) => at(seen(place)).y)) - at(middle).y;
  const largest = Math.max(...Object.values(loads ?? {}), 0);
  const perNewton = Math.min(...press.map((part) => (deep(part) + BELOW) / part.load), largest ? LONGEST / largest : 1);

  for (const { faces, seen, way, across, patch } of parts.dampers) {
    for (const face of faces) {
      const [inner, outer] = endsOf(face).map((place) => at(seen(place)));
      const points = face.points.map((point) => ({ ...point, at: at(seen(point.at)) }));
      faceLines(drawing, inner, outer, points, states);
      words.keepLine(inner, outer, 4);
      if (!small) drawPoints(drawing, together(points), { states, loads, stale, normal: way(face.normal), perNewton, words, label });
    }
    if (patch.length) {
      for (const { at: place, between } of patch) tie(between, place);
      drawPoints(drawing, together(patch.map((point) => ({ ...point, at: at(point.at) }))), { states, loads: patch.length > FEW_NODES || small ? null : loads, stale, normal: across, perNewton, words, label });
    }
  }
  for (const { contact, at: place, normal } of parts.contacts) {
    const here = at(place);
    const along = Math.hypot(...normal) > 0.2 ? unit(normal) : [1, 0];
    const [from, to] = [-9, 9].map((by) => ({ x: here.x + by * along[0], y: here.y - by * along[1] }));
    const state = stateIn(states, { contacts: [contact.name] }, 0);
    tie(contact.between, place);
    drawing.append(plates(from, to, 12, classOf(state), `${contact.name} ${wordsOf(state)}`));
    words.keep(here, 10);
    if (!small && loads?.[contact.name] > 0 && contact.normal) pressed(drawing, here, loads[contact.name], { normal: along, stale, perNewton, words, label });
    label(contact.name, here, { far: 12 });
  }
  const few = parts.nodes.length <= FEW_NODES;
  for (const each of parts.nodes) drawNode(drawing, each, { scene, view, middle: centre[0], at, words, label, forces, few, small });
  if (!small) {
    for (const part of bodies) measure(drawing, part, { at, label, words });
    for (const { load, of, middle } of press) {
      const tip = at(middle);
      const from = { x: tip.x, y: tip.y + Math.max(perNewton * load, 12) };
      drawing.append(arrow(from, tip, "press"), svg("circle", { class: "press dot", cx: tip.x, cy: tip.y, r: 3 }));
      words.keepLine(from, tip);
      label(`m r Ω² = ${measured(load, "N", null, 3)}`, { x: from.x, y: from.y - 17 }, { bold: true, sides: BESIDE });
      label(`${measured(of("mass"), "kg", null, 3)} at ${measured(of("radius_of_rotation"), "m", null, 3)}, ${number(value("speed") ?? 0)} 1/min`, { x: from.x, y: from.y - 2 }, { class: "halo soft", sides: BESIDE });
    }
    for (const [text, place, more] of told.flat()) drawing.append(words.put(text, place, more) ?? "");
    if (!bodies.length) bar(drawing, scale, width, height, words);
  }
  return small ? [drawing] : [drawing, keyOf(forces.length, Boolean(loads)), leftOut(scene, parts)];
}

// What is asked about DOFs that no node has.
function leftOut(scene, { nodes }) {
  const placed = nodes.flatMap(({ node }) => Object.values(node.dofs));
  const asked = [...[scene.excitation ?? []].flat().map(({ dof }) => dof), ownName(scene.observe.dof)].filter((dof) => dof && !placed.includes(dof));
  return asked.length ? note(`Without a place, so not drawn: ${[...new Set(asked)].join(", ")}.`) : null;
}

function keyOf(forced, loaded) {
  const entry = (name, words) => el("li", {}, svg("svg", { width: 30, height: 16, class: "bodies", "aria-hidden": "true" }, arrow({ x: 3, y: 8 }, { x: 27, y: 8 }, name)), ` ${words}`);
  return el("ul", { class: "legend" }, stateKey(), loaded ? entry("load", "normal load, mean") : null, forced ? entry("force", "force") : null, el("li", {}, "double ring: observed · to scale"));
}

// Segments of a face, each by what its point does; a line of points does what the worst does.
function faceLines(drawing, inner, outer, points, states) {
  const apart = together(points).length === points.length;
  const ways = apart ? points : [points];
  const [from, to] = apart && points.length > 1 && Math.hypot(points[0].at.x - inner.x, points[0].at.y - inner.y) > Math.hypot(points[0].at.x - outer.x, points[0].at.y - outer.y) ? [outer, inner] : [inner, outer];
  ways.forEach((one, i) => {
    const state = worst(states, [one].flat());
    const ends = [i, i + 1].map((k) => ({ x: from.x + (k / ways.length) * (to.x - from.x), y: from.y + (k / ways.length) * (to.y - from.y) }));
    drawing.append(path(ends, `face ${state}`, false));
    if (state === "is-slip") drawing.append(path(ends, "face hatched", false));
  });
}

// A load that presses a point, as an arrow along the normal that ends on it.
function pressed(drawing, at, load, { normal, stale, perNewton, words, label }) {
  if (Math.hypot(...normal) < 0.2) return;
  const [ux, uy] = unit(normal);
  const [from, to] = [Math.max(perNewton * load, 10) + 7, 7].map((by) => ({ x: at.x + by * ux, y: at.y - by * uy }));
  drawing.append(arrow(from, to, stale ? "load stale" : "load"));
  words.keepLine(from, to);
  label(measured(load, "N", null, 3), from, { far: 4, bold: true, sides: [[0.9 * Math.sign(ux), -0.8], [Math.sign(ux), 0], [0, -1], [-Math.sign(ux), 0]] });
}

// Points of a face with what they do, and the load that presses them.
function drawPoints(drawing, groups, { states, loads, stale, normal, perNewton, words, label }) {
  for (const { at, points } of groups) {
    const load = loads ? points.reduce((sum, { name }) => sum + (loads[name] ?? 0), 0) : 0;
    words.keep(at, 7);
    if (load > 0) pressed(drawing, at, load, { normal, stale, perNewton, words, label });
    const said = points.map(({ name }) => `${name} ${wordsOf(stateIn(states, { contacts: [name] }, 0))}${loads?.[name] === undefined ? "" : `, ${measured(loads[name], "N", null, 3)}`}`);
    drawing.append(mark(at, worst(states, points), said.join("; ")));
  }
}

// Two shrouds that touch, seen from outside, with their blades.
function drawShroud(drawing, { faces, seen, nodes, at }) {
  const [a, b] = endsOf(faces[0]).map((end) => [end[0], end[2]]);
  const line = (points, name) => drawing.append(path(points.map(([x, z]) => at(seen([x, 0, z]))), name));
  nodes.filter(Boolean).forEach(([x], i) => {
    const side = Math.sign(x) || (i ? 1 : -1);
    const chord = 0.75 * Math.abs(x);
    const profile = Array.from({ length: 25 }, (_, k) => {
      const angle = (2 * Math.PI * k) / 24;
      const [along, thick] = [(chord / 2) * Math.cos(angle), 0.07 * chord * Math.sin(angle) * (1.4 - Math.cos(angle) * 0.6)];
      return [x + along * 0.35 - thick * 0.94, along * 0.94 + thick * 0.35];
    });
    line([a, b, [x + side * 0.3 * Math.abs(x), b[1]], [x + side * 0.3 * Math.abs(x), a[1]]], "platform");
    line(profile, "blade");
  });
}

// What presses a body outward as it turns [N].
function pressOf({ of }, value) {
  const speed = ((value("speed") ?? 0) * 2 * Math.PI) / 60;
  return (of("mass") ?? 0) * (of("radius_of_rotation") ?? 0) * speed ** 2;
}

// Forces on DOFs of nodes: node, direction in the view, words.
function forcesOn(scene, { nodes }, view, value) {
  const rows = [scene.excitation ?? []].flat();
  return rows.filter(({ dof }) => dof).flatMap((row) => {
    for (const { name, node, place } of nodes) {
      const [direction] = Object.entries(node.dofs).find(([, dof]) => dof === row.dof) ?? [];
      if (!DIRECTIONS[direction] || name.includes("@")) continue;
      const way = DIRECTIONS[direction];
      const amplitude = rows.length === 1 ? value("excitation.amplitude") ?? row.amplitude : row.amplitude;
      return [{ name, place, way: [dot(way, view.right), dot(way, view.up)], pulls: Math.cos(row.phase ?? 0) < 0, words: measured(amplitude, "N", null, 3) }];
    }
    return [];
  });
}

function drawNode(drawing, { name, node, at: place }, { scene, view, middle, at, words, label, forces, few, small }) {
  const here = at(place);
  const observed = Object.values(node.dofs).includes(ownName(scene.observe.dof)) && !name.includes("@");
  const own = forces.filter((force) => force.name === name);
  const radius = few || observed || own.length ? 5 : 2.5;
  if (observed) drawing.append(svg("circle", { class: "node", cx: here.x, cy: here.y, r: radius + 3.5 }));
  drawing.append(svg("circle", { class: "node full", cx: here.x, cy: here.y, r: radius }, svg("title", {}, `${name}: ${Object.values(node.dofs).join(", ")}`)));
  words.keep(here, radius + 4);
  if (small) return;
  const clear = observed ? 10 : 7;
  const outward = place[0] > middle ? 1 : -1;
  for (const { way, pulls, words: text } of own) {
    if (Math.hypot(...way) < 0.3) continue;
    const [ux, uy] = unit(way);
    const [from, to] = [clear + 38, clear].map((by) => ({ x: here.x - by * ux, y: here.y + by * uy }));
    drawing.append(pulls ? arrow(to, from, "force") : arrow(from, to, "force"));
    words.keepLine(from, to);
    label(text, { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 }, { class: "halo green", far: 6, bold: true, sides: [[0, -1], [0, 1], [-Math.sign(ux) || 1, 0]] });
  }
  if (few || observed || own.length) label(name, here, { name: true, class: "halo soft", far: radius + 6, sides: [[0.8 * outward, 0.8], [0, 1], [0.8 * outward, -0.8], [-0.8 * outward, 0.8], [-0.8 * outward, -0.8]] });
  if (!few || name.includes("@")) return;
  for (const [direction, dof] of Object.entries(node.dofs)) {
    const axis = DIRECTIONS[direction];
    if (!axis) continue;
    const way = [dot(axis, view.right), dot(axis, view.up)];
    if (Math.hypot(...way) < 0.5) {
      const there = { x: here.x + 13 * outward, y: here.y + 13 };
      drawing.append(svg("circle", { class: "dof", cx: there.x, cy: there.y, r: 4 }), svg("circle", { class: "dof dot", cx: there.x, cy: there.y, r: 1.4 }));
      words.keep(there, 5);
      label(dof, there, { far: 7, class: "halo soft", more: 1, sides: [[outward, 0], [0, 1], [-outward, 0]] });
      continue;
    }
    const [from, to] = [clear, DOF].map((by) => ({ x: here.x + by * way[0], y: here.y - by * way[1] }));
    drawing.append(arrow(from, to, "dof"));
    words.keepLine(from, to);
    label(dof, to, { far: 4, class: "halo soft", more: 2 });
  }
}

// What a body is wide, below it: between the middles of the faces of a wedge, else from side to side.
function measure(drawing, { damper, of, faces, seen, outline }, { at, label, words }) {
  const ends = damper.shape === "wedge" ? faces.map(({ mid }) => mid) : [Math.min, Math.max].map((pick) => [pick(...outline.map(([x]) => x)), 0]);
  const [from, to] = ends.map((place) => at(seen(place)).x);
  const y = Math.max(...outline.map((place) => at(seen(place)).y)) + 10;
  const inclined = damper.shape === "cylinder" || damper.shape === "split-ring" ? 0 : of("angle");
  if (inclined) {
    const foot = at(seen(endsOf(faces[0])[1]));
    drawing.append(svg("path", { class: "dimension dashed", d: `M${foot.x} ${foot.y}h44` }));
    label(`${number((180 * inclined) / Math.PI, 3)}°`, { x: foot.x + 44, y: foot.y }, { class: "halo soft", far: 4, sides: [[1, 0], [0, 1]] });
  }
  const wide = damper.shape === "cylinder" ? 2 * of("radius") : ends[1][0] - ends[0][0];
  drawing.append(svg("path", { class: "dimension", d: `M${from} ${y - 5}V${y + 5}M${to} ${y - 5}V${y + 5}M${from} ${y}H${to}` }));
  words.keepLine({ x: from, y }, { x: to, y }, 4);
  label(`${damper.shape === "cylinder" ? "⌀ " : ""}${measured(wide, "m", null, 3)}`, { x: from + 0.25 * (to - from), y: y + 4 }, { class: "halo soft", far: 2, sides: [[0, 1], [-0.8, 0.8]] });
}

// A length to compare with, where no body tells one.
function bar(drawing, scale, width, height, words) {
  const wanted = 60 / scale;
  const step = 10 ** Math.floor(Math.log10(wanted));
  const length = [5, 2, 1].map((k) => k * step).find((each) => each <= wanted);
  const [x, y] = [width - 16 - length * scale, height - 10];
  drawing.append(svg("path", { class: "dimension", d: `M${x} ${y - 4}V${y + 4}M${x + length * scale} ${y - 4}V${y + 4}M${x} ${y}H${x + length * scale}` }));
  drawing.append(words.put(measured(length, "m", null, 3), { x, y }, { class: "soft", far: 6, sides: [[-1, 0]] }) ?? "");
}
