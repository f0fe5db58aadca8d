// Where the parts of a scene are: how it is looked at, and what of it lies in that plane [m].

import { cross, dot, minus, plus, times, turning, unit } from "../base/vectors.js";
import { ownName } from "./marks.js";
import { endsOf, facesOf, outlineOf } from "./shapes.js";

export const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

// The place of an end, of another sector where that has it; none of one that no node or body has.
function placeOf({ nodes = [], bodies = [], structure }, end) {
  const [name, sector] = end.split("@");
  const found = [...nodes, ...bodies].find((each) => each.name === name || Object.values(each.dofs ?? {}).includes(name));
  const at = found && (found.at ?? [0, 0, 0]);
  const steps = { next: 1, previous: -1 }[sector];
  return at && steps ? turning(unit(structure.axis ?? AXES.z), (steps * 2 * Math.PI) / structure.sectors).map((row) => dot(row, at)) : at;
}

export const pointOf = (scene, { at, between }) => at ?? between.map((end) => placeOf(scene, end)).find(Boolean) ?? null;

// Whether everything that rubs has a place: the rest is drawn as chains.
export function hasPlaces(scene, joints) {
  const { nodes = [], dampers = [], contacts = [] } = scene;
  return nodes.length > 0 && joints.length > 0
    && joints.every((joint) => dampers.some(({ name }) => name === joint.name) || pointOf(scene, contacts.find(({ name }) => name === joint.name) ?? joint));
}

// It is looked at along the axis, up is outward; onto shrouds from outside; else where the nodes are most apart.
function viewOf({ dampers = [], nodes }) {
  const shaped = dampers.filter(({ shape }) => shape !== "patch");
  const first = shaped.find(({ shape }) => shape !== "shroud") ?? shaped[0];
  if (first) {
    const { right, out, axial } = axesOf(first);
    return { origin: first.at ?? [0, 0, 0], right, up: first.shape === "shroud" ? times(axial, -1) : out };
  }
  const apart = ([, axis]) => Math.max(...nodes.map(({ at }) => dot(at, axis))) - Math.min(...nodes.map(({ at }) => dot(at, axis)));
  const [a, b] = Object.entries(AXES).sort((one, other) => apart(other) - apart(one)).slice(0, 2).sort().map(([, axis]) => axis);
  return { origin: nodes[0].at, right: a, up: b };
}

function axesOf(damper) {
  const [out, axial] = [unit(damper.out ?? AXES.y), unit(damper.axial ?? AXES.z)];
  return { right: cross(out, axial), out, axial };
}

// A damper with its faces: `seen` and `way` bring its own places and directions into the view.
function damperOf(scene, damper, value, { flat, turned }) {
  const of = (key) => value(`${damper.name}.${key}`) ?? damper[key];
  const [axes, middle, faces] = [axesOf(damper), damper.at ?? [0, 0, 0], facesOf(damper, of)];
  const spatial = ([across, outward, along = 0]) => plus(plus(times(axes.right, across), times(axes.out, outward)), times(axes.axial, along));
  const nodes = (damper.between ?? []).map((end) => placeOf(scene, end)).map((at) => at && [axes.right, axes.out].map((axis) => dot(minus(at, middle), axis)));
  const patch = (damper.pairs ?? []).map(({ between, at }, i) => ({ name: `${damper.name}-${i}`, at: flat(at), between }));
  return { damper, of, faces, nodes, patch, middle: flat(middle), outline: outlineOf(damper, faces, of), seen: (at) => flat(plus(middle, spatial(at))), way: (vector) => turned(spatial(vector)), normal: damper.normal && turned(damper.normal) };
}

// What is drawn: dampers, contacts that stand by themselves, nodes, and bodies that only contacts tell.
export function partsOf(scene, value) {
  const view = viewOf(scene);
  const turned = (vector) => [dot(vector, view.right), dot(vector, view.up)];
  const flat = (at) => turned(minus(at, view.origin));
  const { dampers: shaped = [], contacts: all = [], bodies = [] } = scene;
  const dampers = shaped.map((damper) => damperOf(scene, damper, value, { flat, turned }));
  const brought = dampers.flatMap(({ faces }) => faces.flatMap(({ points }) => points.map(({ name }) => name)));
  const contacts = all.filter(({ name }) => !brought.includes(name)).map((contact) => ({ contact, at: flat(pointOf(scene, contact)), normal: turned(contact.normal ?? view.right) }));
  const ends = new Set([...scene.nodes.map(({ name }) => name), ...[...shaped, ...contacts.map(({ contact }) => contact)].flatMap(({ between = [] }) => between)]);
  const nodes = [...ends].map((name) => ({ name, node: scene.nodes.find((each) => each.name === ownName(name)) })).filter(({ node }) => node)
    .map(({ name, node: { dofs } }) => ({ name, own: !name.includes("@"), at: flat(placeOf(scene, name)), dofs: Object.entries(dofs).filter(([direction]) => AXES[direction]).map(([direction, dof]) => ({ dof, way: turned(AXES[direction]) })) }));
  const rings = bodies.map(({ name }) => ({ name, ring: around(contacts.filter(({ contact }) => contact.between.includes(name)).map(({ at }) => at)) })).filter(({ ring }) => ring.length > 1);
  return { dampers, contacts, nodes, rings };
}

export const middleOf = (places) => times(places.reduce(plus), 1 / places.length);

// Places in their order round their middle.
function around(places) {
  const angle = (at) => Math.atan2(...minus(at, middleOf(places)).reverse());
  return [...places].sort((a, b) => angle(a) - angle(b));
}

// The scale, and where the view has a place in a drawing: dampers and nodes fill it, blades are cut where it is narrow.
export function fitted({ dampers, contacts, nodes }, { width, height, above, under }) {
  const seen = [...nodes, ...contacts, ...dampers.flatMap(({ patch }) => patch)].map(({ at }) => at)
    .concat(dampers.flatMap(({ faces, outline, seen: place }) => [...(outline ?? []), ...faces.flatMap(endsOf)].map(place)));
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1].map((i) => pick(...seen.map((at) => at[i]))));
  const [wide, tall] = minus(high, low);
  const bodies = dampers.filter(({ outline }) => outline);
  // How far a damper or its nodes are from its middle: what is drawn as a symbol goes by that.
  const reach = Math.max(0, ...bodies.flatMap(({ faces, outline, nodes: ends }) => [...ends.filter(Boolean), ...outline, ...faces.map((face) => times(endsOf(face)[1], 1.05))].map(([across]) => Math.abs(across))));
  const chord = dampers.some(({ damper }) => damper.shape === "shroud") ? 0.4 * wide : 0;
  const room = [reach ? width : width - 110, height - above - under];
  const scale = Math.min(room[0] / (Math.max(3.24 * reach, wide) || tall || 1e-3), room[1] / (Math.max(chord, tall || wide / 4 || 1e-3) + 0.55 * reach));
  const centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2 + 0.275 * reach];
  const at = ([x, y]) => ({ x: width / 2 + scale * (x - centre[0]), y: above + room[1] / 2 - scale * (y - centre[1]) });
  return { scale, reach, at, middle: centre[0], top: centre[1] + (above + room[1] / 2) / scale, bottom: centre[1] - (under + room[1] / 2) / scale };
}
