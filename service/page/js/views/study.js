// The studies behind the one button, each also alone with a form of its keys: their bodies, their order, what became of
// them. Cards whose inputs changed since they were computed say so, with one click to compute them again.

import { button, byId, el, say, show } from "../base/dom.js";
import { on, state, tell, write } from "../base/state.js";
import { schemaForm } from "../forms/form.js";
import { run } from "../network/jobs.js";
import { differences } from "../scene/inputs.js";
import { askedFor, ofTheBar, proposed, refusedFor, secondsOf, takes } from "../scene/kinds.js";
import { variable } from "../scene/scenes.js";
import { readSettings } from "../scene/settings.js";
import { STUDIES, viewOf } from "../views.js";
import { PRESS } from "../workbench/run_list.js";
import { referee } from "./point.js";
import { complaining } from "./view.js";

// Where a tab is about one study, the button of the bar is that of its form.
const ofTab = () => STUDIES.find(({ bar, tabs }) => bar && tabs === state.tab);
// From there on a study that nobody asked for by name is offered, not started [s].
const LONG = 60;
const isLong = (kind) => secondsOf(kind) > LONG;
const pressed = () => STUDIES.filter((view) => view.pressed && !refusedFor(view.kind)).map(({ kind }) => kind);
// What one press begins behind what it is about, the cheapest first.
const further = () => [...pressed(), "pareto"].filter((kind) => !isLong(kind)).sort((a, b) => secondsOf(a) - secondsOf(b));
// How long all that takes, about.
export const pressTakes = () => takes("sweep", "design", ...further());
const forms = new Map();
let studies = 0;
// The amplitude [m] at which the band of the best design was measured.
let bandAt = null;

export function startStudy() {
  for (const { kind, id, form } of STUDIES.filter((view) => view.form)) {
    const { hide = [], ...how } = form;
    forms.set(kind, schemaForm(byId(`${id}-form`), kind, { id, submit: (body) => ask(kind, body), keys: (key) => !hide.includes(key), ...how }));
  }
  byId("study").addEventListener("click", () => (ofTab() ? byId(ofTab().bar.form).requestSubmit() : study()));
  const named = () => {
    const here = ofTab();
    byId("study").textContent = here?.bar.words ?? "Find the best damper";
    byId("study").title = here ? takes(here.kind) : pressTakes();
    byId("study").disabled = !variable() && !here?.bar.free;
  };
  for (const event of ["tab-shown", "scene", "scene-contact"]) on(event, named);
  // What a study takes is said beside its button, by the plan of the scene.
  on("cost", () => {
    for (const kind of forms.keys()) byId(`${viewOf(kind).id}-takes`).textContent = takes(kind);
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
  if (forms.has(kind) && !byId(`${viewOf(kind).id}-form`).contains(document.activeElement)) forms.get(kind).fill(body);
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

const begin = (kind, body = bodyOf(kind), priority = viewOf(kind).priority) =>
  (body ? run(kind, body, complaining(viewOf(kind), forms.get(kind)), priority) : Promise.resolve(false));

const withMore = (body, more) => body && { ...body, ...more };
const ask = (kind, body) => readSettings() && begin(kind, { ...askedFor(kind), ...ofTheBar(kind), ...several(kind), ...body });

// The one button: every study of the scene.
function study() {
  if (!readSettings()) return;
  state.at = null;
  write();
  const mine = (studies += 1);
  // What one press began is folded together among the runs.
  const tags = [`${PRESS}${Date.now().toString(36)}`];
  const rest = further();
  const tagged = (kind, more = {}) => begin(kind, withMore(bodyOf(kind), { ...more, tags }), rest.includes(kind) ? -rest.indexOf(kind) : viewOf(kind).priority);
  const designed = tagged("design");
  const all = [
    tagged("sweep").then(async (done) => done && (isLong("march") || await referee(-rest.length, tags))),
    designed,
    ...rest.map((kind) => (kind === "pareto" ? frontAfter(designed, mine, tagged) : tagged(kind))),
  ];
  for (const kind of [...pressed(), "pareto"].filter(isLong)) viewOf(kind).say(`Not begun with the others: it takes ${takes(kind)}.`);
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
async function frontAfter(designed, mine, tagged) {
  viewOf("pareto").say("The front waits for the best design: its band is measured at half power of that peak.");
  await designed;
  return mine === studies && tagged("pareto", bandAt === null ? {} : { limit: bandAt });
}

// One study again, with what is set now; those with a form elsewhere are asked as it stands.
function renew(kind) {
  if (!forms.has(kind)) return tell("resubmit", kind);
  const body = readSettings() && bodyOf(kind);
  return body && begin(kind, { ...body, ...several(kind) });
}

const WAYS = ["settled", "values", "settings", "contact", "scene-contact"];
const computed = new Map();
const underway = new Set();

// The request that what is seen of a kind was computed for.
const computedFor = (kind) => computed.get(kind) ?? null;

// What changed since, in words; empty if what is seen is of the present values, or if nothing is seen.
export const changedSince = (kind) => (computed.has(kind) ? differences(kind, computed.get(kind)) : []);
export const isUnderway = (kind) => underway.has(kind);

export function startRenewal() {
  const then = (change) => (told) => {
    change(told);
    update();
  };
  on("scene-left", then(() => [computed, underway].forEach((each) => each.clear())));
  on("job-begun", then((kind) => underway.add(kind)));
  on("job-over", then((kind) => underway.delete(kind)));
  on("computed", then(({ kind, request }) => computed.set(kind, request)));
  for (const way of WAYS) on(way, update);
}

// A button that computes a kind again with what is set now.
const renewButton = (kind, words = "Compute again") =>
  button(isUnderway(kind) ? "Being computed …" : words, () => tell("renew", kind), { class: "renew", disabled: isUnderway(kind) });

// What a card that is stale says.
export const staleWords = (kind, changed, words) => (changed.length ? [el("strong", {}, "Stale"), el("span", {}, ` computed for ${changed.join("; ")}. `), renewButton(kind, words)] : []);

function update() {
  for (const { kind, id } of STUDIES) {
    const changed = changedSince(kind);
    const bar = byId(`${id}-stale`);
    const now = `${changed.join("; ")} ${isUnderway(kind)}`;
    byId(id).classList.toggle("is-stale", changed.length > 0);
    bar.hidden = changed.length === 0;
    // A bar that says the same keeps its button, and with it the focus.
    if (bar.dataset.says === now) continue;
    bar.dataset.says = now;
    show(bar, staleWords(kind, changed));
  }
  tell("staleness");
}
