// A scene whose places are known, drawn as bodies: platforms, dampers, shrouds and nodes on one scale, contact faces by
// what they do, forces and loads as arrows.

import { el, note, svg } from "../base/dom.js";
import { measured, number } from "../base/format.js";
import { unit } from "../base/vectors.js";
import { labels } from "./labels.js";
import { classOf, ownName, pattern, plates, stateIn, stateKey, statesOf, wordsOf } from "./marks.js";
import { fitted, middleOf, partsOf } from "./place.js";
import { endsOf, platformOf, topOf } from "./shapes.js";

const FEW = 8; // nodes with their names and DOFs, points of a patch with their loads
const LONGEST = 90; // arrow of a load
const BELOW = 46; // a body begins the arrow of what presses it
const EDGE_ON = 0.3; // of a direction, what is left of it in the view
const SOFT = { class: "halo soft" };
const WORST = ["is-apart", "is-slip", "is-stick", "is-unknown"];
const newtons = (value) => measured(value, "N", null, 3);

// The drawing, its key and what it leaves out; `loads` are mean normal loads [N] by contact, `stale` if of other values.
export function drawBodies(scene, joints, { states, loads, stale, value = () => undefined, width, height, small }) {
  const parts = partsOf(scene, value);
  const fit = fitted(parts, { width, height, ...(small ? { above: 8, under: 8 } : { above: 30, under: 58 }) });
  const drawing = svg("svg", { role: "img", viewBox: `0 0 ${width} ${height}`, class: "bodies", "aria-label": `${scene.name}, to scale: ${joints.map((joint) => `${joint.name}, ${statesOf(states, joint)}`).join("; ")}` }, pattern());
  const words = labels({ width, height });
  // Numbers are placed first, names where room is left.
  const told = [[], []];
  const pen = {
    ...fit, words, loads, stale, value, width, height, few: parts.nodes.length <= FEW,
    add: (...nodes) => drawing.append(...nodes),
    label: (text, place, more = {}) => told[more.name ? 1 : 0].push([text, place, more]),
    line: (places, name, open = false) => drawing.append(path(places.map(fit.at), name, open)),
    arrow(from, to, name) {
      drawing.append(arrow(from, to, name));
      words.keepLine(from, to);
    },
    stateOf: (name) => stateIn(states, { contacts: [name] }, 0),
    tie: (ends, place) => parts.nodes.filter(({ name }) => ends.includes(name)).forEach(({ at }) => pen.line([at, place], "earth link", true)),
  };
  const bodies = parts.dampers.filter(({ outline }) => outline);
  for (const body of bodies) drawBody(pen, body);
  for (const each of parts.dampers) if (each.damper.shape === "shroud") drawShrouds(pen, each);
  for (const { name, ring } of parts.rings) {
    pen.line(ring, "damper");
    pen.label(name, fit.at(middleOf(ring)), { ...SOFT, name: true, far: 4 });
  }
  // One scale for all arrows of force but the excitation: that of what presses a body begins below it.
  const press = bodies.map((body) => ({ body, load: pressOf(body, value), deep: lowest(pen, body) - fit.at(body.middle).y + BELOW })).filter(({ load }) => load > 0);
  const largest = Math.max(...Object.values(loads ?? {}), 0);
  pen.perNewton = Math.min(...press.map(({ load, deep }) => deep / load), largest ? LONGEST / largest : 1);
  for (const each of parts.dampers) drawFaces(pen, each);
  for (const each of parts.contacts) drawContact(pen, each);
  const forces = forcesOf(scene, parts.nodes, value);
  const observed = ownName(scene.observe.dof);
  for (const node of parts.nodes) drawNode(pen, node, observed, forces);
  for (const body of bodies) measure(pen, body);
  for (const each of press) drawPress(pen, each);
  if (!bodies.length) bar(pen);
  drawing.append(...told.flat().map((each) => words.put(...each) ?? ""));
  return [drawing, keyOf(forces.length, Boolean(loads)), leftOut(scene, parts.nodes)];
}

const path = (points, name, open = false) => svg("path", { class: name, d: `M${points.map(({ x, y }) => `${x.toFixed(1)} ${y.toFixed(1)}`).join("L")}${open ? "" : "Z"}` });
const moved = ({ x, y }, [across, up], by) => ({ x: x + by * across, y: y - by * up });

function arrow(from, to, name) {
  const way = unit([to.x - from.x, from.y - to.y]);
  const head = Math.min(7, 0.6 * Math.hypot(to.x - from.x, to.y - from.y));
  const neck = moved(to, way, -head);
  return svg("g", { class: name }, path([from, neck], "shaft", true), path([to, ...[-0.5, 0.5].map((side) => moved(neck, [way[1], -way[0]], side * head))], "head"));
}

// A body between its platforms, whose nodes move its points over arms that do not bend.
function drawBody(pen, { damper, faces, seen, nodes, outline }) {
  const top = Math.max(...faces.map((face, i) => topOf(face, nodes[i]?.[1] ?? 0, pen.reach)));
  const platforms = faces.map((face) => platformOf(damper, face, { ...pen, top, sky: pen.top }));
  for (const { blade } of platforms) if (blade) pen.line(blade.map(seen), "blade");
  for (const { body } of platforms) pen.line(body.map(seen), "platform");
  pen.line(outline.map(seen), "damper");
  for (const { side, points } of faces) for (const { at } of points) pen.tie([damper.between[side < 0 ? 0 : 1]], seen(at));
}

// Two shrouds that touch, seen from outside, with the sections of their blades.
function drawShrouds(pen, { faces, seen, nodes }) {
  const [a, b] = endsOf(faces[0]).map((end) => [end[0], end[2]]);
  const line = (points, name) => pen.line(points.map(([across, along]) => seen([across, 0, along])), name);
  for (const [x] of nodes.filter(Boolean)) {
    const [far, chord] = [1.3 * x, 0.75 * Math.abs(x)];
    line([a, b, [far, b[1]], [far, a[1]]], "platform");
    line(Array.from({ length: 24 }, (_, k) => {
      const [c, s] = [Math.cos((Math.PI * k) / 12), Math.sin((Math.PI * k) / 12)];
      const [along, thick] = [0.5 * chord * c, 0.07 * chord * s * (1.4 - 0.6 * c)];
      return [x + 0.35 * along - 0.94 * thick, 0.94 * along + 0.35 * thick];
    }), "blade");
  }
}

function drawFaces(pen, { faces, seen, way, patch, normal }) {
  const at = (place) => pen.at(seen(place));
  for (const face of faces) {
    const points = face.points.map((point) => ({ ...point, at: at(point.at) }));
    const groups = together(points);
    // Each point has its part of the face; a line of points is one.
    const [from, to] = face.side < 0 ? endsOf(face).reverse().map(at) : endsOf(face).map(at);
    const between = (share) => ({ x: from.x + share * (to.x - from.x), y: from.y + share * (to.y - from.y) });
    groups.forEach((group, i) => {
      const ends = [i, i + 1].map((k) => between(k / groups.length));
      const state = worst(pen, group.points);
      pen.add(path(ends, `face ${state}`, true), state === "is-slip" ? path(ends, "face hatched", true) : "");
    });
    pen.words.keepLine(from, to, 4);
    for (const group of groups) drawPoint(pen, group, way(face.normal));
  }
  for (const { between, at: place } of patch) pen.tie(between, place);
  for (const group of together(patch.map((point) => ({ ...point, at: pen.at(point.at) })))) drawPoint(pen, group, patch.length <= FEW ? normal : null);
}

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

const worst = ({ stateOf }, points) => WORST.find((state) => points.some(({ name }) => classOf(stateOf(name)) === state));

// Points of a face with what they do, and the load that presses them.
function drawPoint(pen, { at, points }, normal) {
  const { loads, stateOf } = pen;
  const said = points.map(({ name }) => `${name} ${wordsOf(stateOf(name))}${loads?.[name] === undefined ? "" : `, ${newtons(loads[name])}`}`).join("; ");
  const state = worst(pen, points);
  const title = svg("title", {}, said);
  const round = state === "is-stick" || state === "is-unknown";
  pen.words.keep(at, 7);
  pressed(pen, at, points.reduce((sum, { name }) => sum + (loads?.[name] ?? 0), 0), normal);
  pen.add(round ? svg("circle", { class: `contact spot ${state}`, cx: at.x, cy: at.y, r: 5 }, title) : svg("rect", { class: `contact spot ${state}`, x: at.x - 5, y: at.y - 5, width: 10, height: 10 }, title));
}

// A contact that stands by itself, as two plates across its normal.
function drawContact(pen, { contact: { name, between, normal: given }, at: place, normal }) {
  const here = pen.at(place);
  const along = Math.hypot(...normal) > EDGE_ON ? unit(normal) : [1, 0];
  const state = pen.stateOf(name);
  pen.tie(between, place);
  pen.add(plates(moved(here, along, -9), moved(here, along, 9), 12, classOf(state), `${name} ${wordsOf(state)}`));
  pen.words.keep(here, 10);
  if (given) pressed(pen, here, pen.loads?.[name] ?? 0, normal);
  pen.label(name, here, { far: 12 });
}

// The load of a point, as an arrow along the normal that ends on it.
function pressed(pen, at, load, normal) {
  if (!(load > 0) || !normal || Math.hypot(...normal) < EDGE_ON) return;
  const way = unit(normal);
  const from = moved(at, way, Math.max(pen.perNewton * load, 10) + 7);
  pen.arrow(from, moved(at, way, 7), pen.stale ? "load stale" : "load");
  const side = Math.sign(way[0]);
  pen.label(newtons(load), from, { far: 4, bold: true, sides: [[0.9 * side, -0.8], [side, 0], [0, -1], [-side, 0]] });
}

// What presses a body outward as it turns [N].
const pressOf = ({ of }, value) => (of("mass") ?? 0) * (of("radius_of_rotation") ?? 0) * (((value("speed") ?? 0) * 2 * Math.PI) / 60) ** 2;

function drawPress(pen, { load, body: { of, middle } }) {
  const tip = pen.at(middle);
  const from = { x: tip.x, y: tip.y + Math.max(pen.perNewton * load, 12) };
  pen.arrow(from, tip, "press");
  pen.add(svg("circle", { class: "press dot", cx: tip.x, cy: tip.y, r: 3 }));
  const sides = [[1, 0], [-1, 0]];
  pen.label(`m r Ω² = ${newtons(load)}`, { x: from.x, y: from.y - 17 }, { bold: true, sides });
  pen.label(`${measured(of("mass"), "kg", null, 3)} at ${measured(of("radius_of_rotation"), "m", null, 3)}, ${number(pen.value("speed"))} 1/min`, { x: from.x, y: from.y - 2 }, { ...SOFT, sides });
}

// Forces on DOFs by their names; one of the opposite phase pulls.
function forcesOf(scene, nodes, value) {
  const rows = [scene.excitation].flat().filter(({ dof }) => nodes.some(({ own, dofs }) => own && dofs.some((each) => each.dof === dof)));
  const set = [scene.excitation].flat().length === 1 ? value("excitation.amplitude") : undefined;
  return rows.map(({ dof, amplitude, phase = 0 }) => ({ dof, pulls: Math.cos(phase) < 0, words: newtons(set ?? amplitude) }));
}

// A node with an arrow for each of its DOFs, two rings where it is observed, and the forces on it.
function drawNode(pen, { name, at: place, dofs, own }, observed, forces) {
  const { few, words, label } = pen;
  const here = pen.at(place);
  const seen = own && dofs.some(({ dof }) => dof === observed);
  const loaded = own ? forces.filter((force) => dofs.some(({ dof }) => dof === force.dof)) : [];
  const radius = few || seen || loaded.length ? 5 : 2.5;
  const clear = seen ? 10 : 7;
  const outward = place[0] > pen.middle ? 1 : -1;
  if (seen) pen.add(svg("circle", { class: "node", cx: here.x, cy: here.y, r: radius + 3.5 }));
  pen.add(svg("circle", { class: "node full", cx: here.x, cy: here.y, r: radius }, svg("title", {}, `${name}: ${dofs.map(({ dof }) => dof).join(", ")}`)));
  words.keep(here, radius + 4);
  for (const { dof, pulls, words: text } of loaded) {
    const { way } = dofs.find((each) => each.dof === dof);
    if (Math.hypot(...way) < EDGE_ON) continue;
    const ends = [moved(here, unit(way), -clear - 38), moved(here, unit(way), -clear)];
    pen.arrow(...(pulls ? ends.reverse() : ends), "force");
    label(text, moved(here, unit(way), -clear - 19), { class: "halo green", far: 6, bold: true, sides: [[0, -1], [0, 1], [outward, 0]] });
  }
  if (few || radius === 5) label(name, here, { ...SOFT, name: true, far: radius + 6, sides: [[0.8 * outward, 0.8], [0, 1], [0.8 * outward, -0.8], [-0.8 * outward, 0.8], [-0.8 * outward, -0.8]] });
  if (!few || !own) return;
  for (const { dof, way } of dofs) {
    if (Math.hypot(...way) < EDGE_ON) {
      const there = moved(here, [outward, -1], 13);
      pen.add(svg("circle", { class: "dof", cx: there.x, cy: there.y, r: 4 }), svg("circle", { class: "dof dot", cx: there.x, cy: there.y, r: 1.4 }));
      words.keep(there, 5);
      label(dof, there, { ...SOFT, far: 7, more: 1, sides: [[outward, 0], [0, 1], [-outward, 0]] });
    } else {
      pen.arrow(moved(here, way, clear), moved(here, way, 34), "dof");
      label(dof, moved(here, way, 34), { ...SOFT, far: 4, more: 2 });
    }
  }
}

const lowest = ({ at }, { outline, seen }) => Math.max(...outline.map((place) => at(seen(place)).y));
const dimension = (d, dashed = "") => svg("path", { class: `dimension ${dashed}`, d });
const between = (from, to, y) => dimension(`M${from} ${y - 4}V${y + 4}M${to} ${y - 4}V${y + 4}M${from} ${y}H${to}`);

// What a body is wide, below it: between the middles of the faces of a wedge, else from side to side; how its face slants.
function measure(pen, body) {
  const { damper: { shape }, of, faces, seen, outline } = body;
  const xs = shape === "wedge" ? faces.map(({ mid }) => mid[0]) : [Math.min, Math.max].map((pick) => pick(...outline.map(([x]) => x)));
  const [from, to] = xs.map((x) => pen.at(seen([x, 0])).x);
  const y = lowest(pen, body) + 10;
  pen.add(between(from, to, y));
  pen.words.keepLine({ x: from, y }, { x: to, y }, 4);
  pen.label(`${shape === "cylinder" ? "⌀ " : ""}${measured(xs[1] - xs[0], "m", null, 3)}`, { x: from + 0.25 * (to - from), y: y + 4 }, { ...SOFT, far: 2, sides: [[0, 1], [-0.8, 0.8]] });
  if (shape !== "wedge" && shape !== "asymmetric") return;
  const foot = pen.at(seen(endsOf(faces[0])[1]));
  pen.add(dimension(`M${foot.x} ${foot.y}h44`, "dashed"));
  pen.label(`${number((180 * of("angle")) / Math.PI, 3)}°`, { x: foot.x + 44, y: foot.y }, { ...SOFT, far: 4, sides: [[1, 0], [0, 1]] });
}

// A length to compare with, where no body tells one.
function bar(pen) {
  const step = 10 ** Math.floor(Math.log10(60 / pen.scale));
  const length = [5, 2, 1].map((k) => k * step).find((each) => each * pen.scale <= 60);
  const [x, y] = [pen.width - 16 - length * pen.scale, pen.height - 10];
  pen.add(between(x, x + length * pen.scale, y));
  pen.label(measured(length, "m", null, 3), { x, y }, { ...SOFT, far: 6, sides: [[-1, 0]] });
}

function keyOf(forced, loaded) {
  const entry = (name, words) => el("li", {}, svg("svg", { width: 30, height: 16, class: "bodies", "aria-hidden": "true" }, arrow({ x: 3, y: 8 }, { x: 27, y: 8 }, name)), ` ${words}`);
  return el("ul", { class: "legend" }, stateKey(), loaded ? entry("load", "normal load, mean") : null, forced ? entry("force", "force") : null, el("li", {}, "double ring: observed · to scale"));
}

// What is asked about DOFs that no node has.
function leftOut(scene, nodes) {
  const asked = [...[scene.excitation].flat().map(({ dof }) => dof), ownName(scene.observe.dof)].filter((dof) => dof && !nodes.some(({ dofs }) => dofs.some((each) => each.dof === dof)));
  return asked.length ? note(`Without a place, so not drawn: ${[...new Set(asked)].join(", ")}.`) : null;
}
