// The drawing of a scene, by what is known of its places, and the card that shows it with what its contacts do.

import { byId, note, numeric, show, table } from "../base/dom.js";
import { on } from "../base/state.js";
import { hertz, number } from "../base/format.js";
import { drawChain } from "./chain.js";
import { legend, statesOf } from "./marks.js";
import { current, value } from "./scenes.js";
import { drawSector } from "./sector.js";

const WIDEST = 560;
const NARROWEST = 320;
let states = null;
let at = null;
let drawn = "";

// The contacts and dampers of a scene of which the service has said nothing yet.
const jointsOf = ({ contacts = [], dampers = [], nodes = [] }) => {
  const dofOf = (end) => {
    const [name, sector] = end.split("@");
    const node = nodes.find((each) => each.name === name);
    return node ? [Object.values(node.dofs)[0], sector].filter(Boolean).join("@") : end;
  };
  return [...contacts, ...dampers].filter(({ between }) => between).map(({ name, law, shape, between }) => ({ name, law: shape ?? law, between: between.map(dofOf), at: null, contacts: [name] }));
};

// Draws a scene into `host`: `joints` as the service tells them, `states` of its contacts by name; or `small`, as a
// picture on a card, without words.
export function drawScene(host, scene, { joints = jointsOf(scene), states: found = null, small = false } = {}) {
  const width = small ? NARROWEST : Math.min(Math.max(host.clientWidth, NARROWEST), WIDEST);
  const parts = scene.structure.outline ? drawSector(scene, joints, found) : [drawChain(scene, joints, found, width), legend()];
  if (small) for (const words of parts[0].querySelectorAll("text, defs")) words.remove();
  return show(host, small ? parts[0] : parts);
}

// The card follows the scene and what its contacts do; under a slider that changes seldom.
export function startStructure() {
  on("scene", () => {
    drawn = "";
    told({ states: null, at: null });
  });
  on("states", told);
}

function told(found) {
  ({ states, at } = found);
  const now = JSON.stringify([current.body.name, states]);
  if (now !== drawn) drawScene(byId("structure-figure"), current.body, { joints: current.joints, states });
  drawn = now;
  show(byId("structure-states"), contactTable());
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
    ...columns.map(({ name, unit }) => {
      const path = `${joint.name}.${name}`;
      return numeric(own(current.parameters.get(path) ?? {}) ? `${number(value(path))} ${unit}`.trim() : "");
    }),
  ]);
  const heads = columns.map(({ symbol }) => numeric(symbol));
  return table(["contact", "between", at ? `at ${hertz(at)}` : "state", ...(laws ? ["law"] : []), ...heads], rows, at ? `Contacts at ${hertz(at)}` : "Contacts");
}
