// The studies behind the one button, each also alone with a form of its keys: their bodies, their order, what became of them.

import { state, write } from "../base/address.js";
import { byId, say } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { schemaForm } from "../forms/form.js";
import { run } from "../network/jobs.js";
import { askedFor, ofTheBar, proposed, refusedFor, takes } from "../scene/kinds.js";
import { variable } from "../scene/scenes.js";
import { readSettings } from "../scene/settings.js";
import { VIEWS } from "../views.js";
import { PRESS } from "../workbench/run_list.js";
import { referee } from "./point.js";
import { computedFor } from "./renewal.js";

// The most wanted first.
const PRIORITY = { sweep: 6, design: 5, map: 4, modes: 4, accuracy: 3, campbell: 3, interference: 3, pareto: 2 };
// What the bar says has no field a second time.
const OF_THE_BAR = ["parameter", "from", "to", "variables", "scaling", "start"];
const FORMS = {
  sweep: { id: "response", words: "Compute the response", hide: [...OF_THE_BAR, "frequency_hz"], fold: "Settings" },
  map: { id: "map", words: "Draw the map", hide: OF_THE_BAR, fold: "Settings" },
  pareto: { id: "front", words: "Compute the front", hide: OF_THE_BAR, top: ["limit", "points"], groups: [{ legend: "Limits, load cases, method", id: "more" }] },
  accuracy: { id: "accuracy", words: "Measure it", fold: "Settings" },
  campbell: { id: "campbell", words: "Draw the diagram", fold: "Settings" },
  interference: { id: "interference", words: "Show", top: ["speed_rpm", "within"], groups: [{ legend: "Orders, families, frequencies", id: "more" }] },
  modes: { id: "modes", words: "Follow the mode", primary: true, top: ["mode", "from", "to", "nodal_diameter", "aero_damping", "exact_peaks"], groups: [{ legend: "Loops, peaks, disturbances, phase resonance", id: "more" }] },
};
// Where a view is about one study, the button of the bar is that of its form.
const OF_TAB = { design: ["problem-form", "Search this design", "design"], identify: ["identify-form", "Identify", "identify"], modes: ["modes-form", "Follow the mode", "modes"] };
const WITHOUT_VARIABLE = ["identify", "modes"];
const OF_THE_BUTTON = ["map", "accuracy", "campbell", "interference"];
// How long all that one press begins takes, about.
export const pressTakes = () => takes("sweep", "design", "pareto", ...OF_THE_BUTTON.filter((kind) => !refusedFor(kind)));
const forms = new Map();
let studies = 0;
// The amplitude [m] at which the band of the best design was measured.
let bandAt = null;

export function startStudy() {
  for (const [kind, { id, hide = [], ...how }] of Object.entries(FORMS)) {
    const submit = (body) => ask(kind, body);
    forms.set(kind, schemaForm(byId(`${id}-form`), kind, { id, submit, keys: (key) => !hide.includes(key), ...how }));
  }
  byId("study").addEventListener("click", () => (OF_TAB[state.tab] ? byId(OF_TAB[state.tab][0]).requestSubmit() : study()));
  const named = () => {
    byId("study").textContent = OF_TAB[state.tab]?.[1] ?? "Find the best damper";
    byId("study").title = OF_TAB[state.tab] ? takes(OF_TAB[state.tab][2]) : pressTakes();
    byId("study").disabled = !variable() && !WITHOUT_VARIABLE.includes(state.tab);
  };
  for (const event of ["tab-shown", "scene", "scene-contact"]) on(event, named);
  // What a study takes is said beside its button, by the plan of the scene.
  on("cost", () => {
    for (const [kind, { id }] of Object.entries(FORMS)) byId(`${id}-takes`).textContent = takes(kind);
    named();
  });
  on("renew", renew);
  on("computed", ({ kind, request, result }) => {
    if (kind === "design" && result.limit) bandAt = Number(result.limit.toPrecision(4));
    fill(kind, request);
  });
  on("scene", () => {
    for (const kind of forms.keys()) fill(kind, proposed(kind));
  });
  on("scene-left", () => {
    studies += 1;
    bandAt = null;
    say("study-status", "");
  });
}

// What is being typed is not taken away by a study that ends meanwhile.
function fill(kind, body) {
  if (forms.has(kind) && !byId(`${FORMS[kind].id}-form`).contains(document.activeElement)) forms.get(kind).fill(body);
}

// A problem of several variables is not what the bar says: it stays what it was.
const several = (kind) => {
  const { variables } = computedFor(kind) ?? {};
  return Object.keys(variables ?? {}).length > 1 ? { variables } : {};
};

// A body of the bar and of the form, null where the form says what is wrong.
function bodyOf(kind) {
  const { body, wrong } = forms.get(kind)?.read() ?? { body: {}, wrong: [] };
  forms.get(kind)?.complain(wrong);
  return wrong.length ? null : { ...askedFor(kind), ...ofTheBar(kind), ...body };
}

function begin(kind, body = bodyOf(kind)) {
  if (!body) return Promise.resolve(false);
  const view = { ...VIEWS[kind], failed(words, errors = [], job) {
    VIEWS[kind].failed(words, errors, job);
    forms.get(kind)?.complain(errors);
  } };
  return run(kind, body, view, PRIORITY[kind]);
}

const withTags = (body, tags) => body && { ...body, tags };

const ask = (kind, body) => readSettings() && begin(kind, { ...askedFor(kind), ...ofTheBar(kind), ...several(kind), ...body });

// The one button: every study of the scene.
function study() {
  if (!readSettings()) return;
  state.at = null;
  write();
  const mine = (studies += 1);
  // What one press began is folded together among the runs.
  const tags = [`${PRESS}${Date.now().toString(36)}`];
  const tagged = (kind) => begin(kind, withTags(bodyOf(kind), tags));
  const designed = tagged("design");
  const all = [
    tagged("sweep").then(async (done) => done && (await referee(5, tags))),
    designed,
    ...OF_THE_BUTTON.filter((kind) => !refusedFor(kind)).map(tagged),
    frontAfter(designed, mine, tags),
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
async function frontAfter(designed, mine, tags) {
  say("front-status", "The front waits for the best design: its band is measured at half power of that peak.");
  await designed;
  const body = mine === studies && withTags(bodyOf("pareto"), tags);
  return body && begin("pareto", bandAt === null ? body : { ...body, limit: bandAt });
}

// One study again, with what is set now; those with a form elsewhere are asked as it stands.
function renew(kind) {
  if (!forms.has(kind)) return tell("resubmit", kind);
  const body = readSettings() && bodyOf(kind);
  return body && begin(kind, { ...body, ...several(kind) });
}
