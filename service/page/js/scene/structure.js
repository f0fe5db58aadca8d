// The drawing of a scene, by what is known of its places, and the card that shows it with what its contacts do.

import { byId, note, numeric, show, table } from "../base/dom.js";
import { on } from "../base/state.js";
import { hertz, number } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { drawBodies } from "./bodies.js";
import { drawChain } from "./chain.js";
import { legend, ownName, statesOf } from "./marks.js";
import { hasPlaces, pointOf } from "./place.js";
import { asked, current, fieldUnit, inField, value } from "./scenes.js";
import { drawSector } from "./sector.js";

const WIDEST = 560;
const NARROWEST = 320;
const [SMALL, LOW, HIGH] = [180, 230, 256];
let states = null;
let at = null;
let loads = null;
let drawn = "";
let ask = null;
// Loads are asked for once the slider rests.
const REST_MS = 200;
let resting = 0;

// The contacts and dampers of a scene of which the service has said nothing yet.
function jointsOf(scene) {
  const { contacts = [], dampers = [], nodes = [] } = scene;
  const dofOf = (end) => {
    const [name, sector] = end.split("@");
    const node = nodes.find((each) => each.name === name);
    return node ? [Object.values(node.dofs)[0], sector].filter(Boolean).join("@") : end;
  };
  return [...contacts, ...dampers].map((each) => {
    const { between, at } = { ...each.pairs?.[0], ...each };
    return { name: each.name, law: each.shape ?? each.law, between: between.map(dofOf), at: pointOf(scene, { at, between }), contacts: [each.name] };
  });
}

// Draws a scene into `host`: `joints` as the service tells them, `states` and mean normal `loads` of its contacts by name,
// `value` of a path as it is set; or `small`, as a picture on a card, without words.
export function drawScene(host, scene, { joints = jointsOf(scene), small = false, ...look } = {}) {
  const width = Math.max(small ? 0 : host.clientWidth, NARROWEST);
  const drawing = scene.structure.outline ? drawSector(scene, joints, { ...look, width: Math.min(width, WIDEST) })
    : hasPlaces(scene, joints) ? drawBodies(scene, joints, { ...look, small, width, height: small ? SMALL : width > WIDEST ? HIGH : LOW })
      : [drawChain(scene, joints, { ...look, width: Math.min(width, WIDEST) }), legend(), note("No [[nodes]]: not to scale.")];
  if (small) for (const words of drawing[0].querySelectorAll("text, title, defs, .dimension, .spot, :is(g, circle):is(.dof, .force, .press)")) words.remove();
  return show(host, small ? drawing[0] : drawing);
}

// The card follows the scene, its values and what its contacts do.
export function startStructure() {
  const told = (token, found) => {
    if (token !== wish()) return;
    loads = { of: token, ...found };
    draw();
  };
  ask = previewer("loads", ({ converged, status, period }, { token }) => told(token, converged ? { by: loadsOf(period) } : { wrong: status }), (error, token) => told(token, { wrong: error.message }));
  on("scene", () => {
    [states, at, loads, drawn] = [null, null, null, ""];
    // What is drawn in place stands beside its sliders, below the curve.
    const card = byId("structure");
    if (drawnInPlace()) byId("live").after(card);
    else byId("shape").after(card);
    draw();
  });
  on("scene-left", () => clearTimeout(resting));
  on("values", draw);
  on("states", (found) => {
    ({ states, at } = found);
    clearTimeout(resting);
    if (found.period) loads = { of: wish(), by: loadsOf(found.period) };
    else if (at && drawnInPlace() && loads?.of !== wish()) resting = setTimeout(ask, REST_MS, { kind: "point", ...asked(), frequency_hz: at }, wish());
    draw();
  });
  new ResizeObserver(() => { drawn = ""; draw(); }).observe(byId("structure-figure"));
}

const drawnInPlace = () => !current.body.structure.outline && hasPlaces(current.body, current.joints);
const wish = () => JSON.stringify([asked(), at]);
const loadsOf = ({ contacts }) => Object.fromEntries(contacts.map(({ name, load }) => [ownName(name), load.slice(1).reduce((sum, one) => sum + one, 0) / (load.length - 1)]));

function draw() {
  if (!current.body) return;
  // Under a slider only what stands in place changes, and elsewhere the force that is written.
  const now = JSON.stringify([current.body.name, states, drawnInPlace() ? [loads, wish()] : value("excitation.amplitude")]);
  if (now !== drawn) drawScene(byId("structure-figure"), current.body, { joints: current.joints, states, value, loads: loads?.by, stale: loads?.of !== wish() });
  drawn = now;
  show(byId("structure-states"), loads?.wrong ? note(`No loads: ${loads.wrong}`) : null, contactTable());
}

// The contacts as a table, with what they do at the frequency `at` [Hz].
function contactTable() {
  const { joints } = current;
  if (!joints.length) return note("The scene has no contacts: it is linear.");
  const own = ({ slider, otherwise }) => slider && !otherwise;
  const columns = [...new Map([...current.parameters.values()].filter((each) => own(each) && joints.some(({ name }) => name === each.part)).map((each) => [each.name, each])).values()];
  const laws = new Set(joints.map(({ law }) => law)).size > 1;
  const rows = joints.map((joint) => [
    joint.name, joint.between.join(" – "), statesOf(states, joint), ...(laws ? [joint.law] : []),
    ...columns.map(({ name }) => {
      const path = `${joint.name}.${name}`;
      return numeric(own(current.parameters.get(path) ?? {}) ? `${number(inField(path, value(path)))} ${fieldUnit(path).name}`.trim() : "");
    }),
  ]);
  const heads = columns.map(({ symbol }) => numeric(symbol));
  return table(["contact", "between", at ? `at ${hertz(at)}` : "state", ...(laws ? ["law"] : []), ...heads], rows, at ? `Contacts at ${hertz(at)}` : "Contacts");
}
