// The studies behind the one button, each also alone: their bodies, their order, what became of them.

import { state, write } from "../base/address.js";
import { byId, say } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { interferenceBody, isDisk } from "../disk/interference.js";
import { run } from "../network/jobs.js";
import { asked, current, variable } from "../scene/scenes.js";
import { readSettings } from "../scene/settings.js";
import { VIEWS } from "../views.js";
import { referee } from "./point.js";
import { computedFor } from "./renewal.js";
import { campbellBody } from "./studies.js";

// The most wanted first.
const PRIORITY = { sweep: 6, design: 5, map: 4, accuracy: 3, campbell: 3, interference: 3, pareto: 2 };
const NOT_ASKED_AGAIN = ["kind", "fresh", "priority", "scene", "set", "harmonics", "project", "name", "notes", "tags"];
const OF_THE_FORM = ["variables", "parameter", "from", "to", "steps", "frequencies", "ridge", "speeds_rpm", "orders", "band_hz"];
const OWN_FORM = ["modes", "identify"];
let studies = 0;
// The amplitude [m] at which the band of the best design was measured.
let bandAt = null;

export function startStudy() {
  byId("study").addEventListener("click", study);
  on("renew", renew);
  on("front-wanted", front);
  on("computed", ({ kind, result }) => {
    if (kind === "design" && result.limit) bandAt = Number(result.limit.toPrecision(4));
  });
  on("scene-left", () => {
    studies += 1;
    bandAt = null;
    say("study-status", "");
  });
}

function bodyOf(kind) {
  const [low, high] = state.range ?? [];
  const path = variable();
  const body = asked();
  const { scene, set } = body;
  // Peaks are followed where every contact is plain friction; a map without them is for all laws.
  const { contacts = [], dampers = [] } = current.body;
  const tracked = !dampers.length && contacts.every((contact) => (contact.law ?? "coulomb") === "coulomb");
  const bodies = {
    sweep: () => body,
    design: () => ({ ...body, variables: { [path]: [low, high] } }),
    map: () => ({ ...body, parameter: path, from: low, to: high, steps: 60, frequencies: 400, ridge: tracked }),
    accuracy: () => ({ scene, set }),
    campbell: () => ({ ...body, ...campbellBody() }),
    interference: () => ({ scene, set, ...interferenceBody() }),
    pareto: () => ({ ...body, variables: { [path]: [low, high] }, ...ofTheFront({ limit: bandAt }) }),
  };
  return bodies[kind]();
}

const begin = (kind, body = bodyOf(kind)) => run(kind, body, VIEWS[kind], PRIORITY[kind]);

// The one button: every study of the scene.
function study() {
  if (!readSettings()) return;
  state.at = null;
  write();
  const mine = (studies += 1);
  const designed = begin("design");
  const all = [
    begin("sweep").then(async (done) => done && (await referee(5))),
    designed,
    ...["map", "accuracy", "campbell", ...(isDisk() ? ["interference"] : [])].map((kind) => begin(kind)),
    frontAfter(designed, mine),
  ];
  say("study-status", `${all.length} jobs are under way.`);
  Promise.all(all).then((done) => {
    const short = done.filter((each) => !each).length;
    if (mine !== studies) return;
    if (short) say("study-status", `${short} of ${all.length} studies did not come to their end: each says why.`, true);
    else say("study-status", "Everything is there.");
  });
}

// The front after the best design, which tells a fixed amplitude for the band: at half power of each peak, the
// highest peaks would have the narrowest bands, and the front would praise designs that damp nothing.
async function frontAfter(designed, mine) {
  say("front-status", "The front waits for the best design: its band is measured at half power of that peak.");
  await designed;
  return mine === studies && begin("pareto");
}

// The front again, with the amplitude at which the band is measured and as many designs as are asked for.
function front({ limit, points }) {
  if (!readSettings()) return;
  const before = computedFor("pareto");
  const several = Object.keys(before?.variables ?? {}).length > 1 ? { variables: before.variables } : {};
  begin("pareto", { ...bodyOf("pareto"), limit: undefined, ...several, ...ofTheFront({ limit, points }) });
}

const ofTheFront = ({ limit, points }) => Object.fromEntries(Object.entries({ limit, points }).filter(([, value]) => value !== undefined && value !== null));

// One study again, with what is set now. A problem that the form can not say, as of several variables or with limits, stays as it was.
function renew(kind) {
  // Kinds with a form of their own are asked again as it stands.
  if (OWN_FORM.includes(kind)) return tell("resubmit", kind);
  if (!readSettings()) return undefined;
  const before = computedFor(kind);
  const own = Object.fromEntries(Object.entries(before ?? {}).filter(([key]) => !NOT_ASKED_AGAIN.includes(key)));
  const further = Object.keys(before?.variables ?? {}).length > 1 || (kind === "design" && Object.keys(own).some((key) => !OF_THE_FORM.includes(key) || key === "speeds_rpm"));
  begin(kind, further ? { ...asked(), ...own } : { ...bodyOf(kind), ...(kind === "pareto" && before ? { limit: undefined, ...ofTheFront(own) } : {}) });
  return undefined;
}
