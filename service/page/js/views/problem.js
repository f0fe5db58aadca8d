// The panel of a design problem: its form by the schema of the service, and the problem in words above it.

import { on, state } from "../base/state.js";
import { byId, el, show } from "../base/dom.js";
import { unitOf } from "../base/format.js";
import { schemaForm } from "../forms/form.js";
import { uncertainPart } from "../forms/uncertain.js";
import { run } from "../network/jobs.js";
import { askedFor } from "../scene/kinds.js";
import { chooseVariable, defaultRange, variable, variables } from "../scene/scenes.js";
import { fillSettings, readSettings } from "../scene/settings.js";
import { design } from "./design.js";
import { complaining, formPart, view } from "./view.js";

const LEVEL = "excitation.amplitude";
const GROUPS = [
  { legend: "Load cases: engine orders, levels, bands", id: "cases", keys: ["cases"] },
  { legend: "Limits", id: "limits" },
  { legend: "What is not known", id: "uncertainty", keys: ["uncertain", "aim", "quantile", "samples", "seed"] },
  { legend: "Method and what is minimised", id: "method", keys: ["method", "basins", "tolerance", "weights", "certify"] },
];
let form = null;
let uncertain = null;

export const problem = view({
  id: "problem", title: "Design problem", tabs: "design",
  parts: () => [el("p", { id: "problem-words", class: "in-words", role: "status" }), formPart("problem")],
  clear() {},
  start() {
    uncertain = uncertainPart("problem");
    const host = byId("problem-form");
    form = schemaForm(host, "design", { id: "problem", top: ["variables"], groups: GROUPS, paths: [LEVEL], own: { uncertain }, submit, words: design.bar.words, primary: true });
    for (const event of ["input", "change", "click"]) host.addEventListener(event, () => setTimeout(inWords));
    on("uncertain-given", (found) => {
      uncertain.hold(found);
      byId("problem-uncertainty-fold").open = true;
      inWords();
    });
    for (const event of ["scene-contact", "settings"]) on(event, () => form.rows("variables").count() <= 1 && fillVariables({}));
    on("resubmit", (kind) => kind === "design" && host.requestSubmit());
    // What is being typed is not taken away by a search that ends meanwhile.
    on("computed", ({ kind, request }) => kind === "design" && !host.contains(document.activeElement) && fill(request));
  },
  scene: () => fill({}),
});

const ownVariable = () => (variable() ? [{ path: variable(), low: (state.range ?? defaultRange())[0], high: (state.range ?? defaultRange())[1] }] : []);

function fillVariables({ variables: given }) {
  if (!given) form.rows("variables").fill(ownVariable());
  inWords();
}

function fill(request) {
  form.fill(request);
  fillVariables(request);
  byId("problem-submit").disabled = !variable();
}

async function submit(body) {
  // One variable of the scene is the one above too: both then speak of the same range.
  const [[path, range] = [], ...others] = Object.entries(body.variables ?? {});
  if (path && !others.length && variables().includes(path)) {
    chooseVariable(path);
    state.range = range;
    fillSettings();
  }
  if (!readSettings()) return;
  byId("design").scrollIntoView({ block: "nearest" });
  await run("design", { ...askedFor("design"), ...body }, complaining(design, form), design.priority);
}

// The problem as a sentence, each phrase of which leads to its fields.
function inWords() {
  const { body } = form.read();
  const link = (words, key, fold) => el("button", { type: "button", class: "link", onclick: () => {
    if (fold) byId(`problem-${fold}-fold`).open = true;
    const part = byId(`problem-${key}`);
    (part?.matches("input, select") ? part : part?.querySelector("input, select") ?? byId(`problem-${key}-add`))?.focus();
  } }, words);
  const over = form.rows("variables").read().map(({ path, low, high }) => link(`${path} (${low ?? "…"} – ${high ?? "…"}${unitOf(path) ? ` ${unitOf(path)}` : ""})`, "variables"));
  const limits = limitWords(body).map(([words, key]) => link(words, key, "limits"));
  const open = uncertain.words();
  const cases = body.cases?.length ?? 0;
  const goal = body.weights ? Object.entries(body.weights).map(([name, weight]) => `${weight} × ${name}`).join(" + ") : "highest peak";
  show(byId("problem-words"), "Minimise the ", link(goal, "weights-peak", "method"), cases ? [" of ", link(`${cases} load case${cases > 1 ? "s" : ""}`, "cases", "cases")] : "", over.length ? [" over ", joined(over)] : "",
    limits.length ? [", ", joined(limits)] : "", open.length ? [", whatever ", joined(open.map((words) => link(words, "uncertain", "uncertainty"))), " is"] : "", ".");
}

function unitAt(key) {
  const unit = byId(`problem-${key}`).parentElement.querySelector(".unit");
  return unit?.value ?? unit?.textContent ?? "";
}

function limitWords(body) {
  const ranges = (list) => list.map((pair) => pair.join(" – ")).join(", ");
  return Object.entries(body).flatMap(([key, value]) => (
    key.startsWith("max_") && typeof value === "number" ? [[`${key.slice(4).replace("_hz", "").replaceAll("_", " ")} ≤ ${byId(`problem-${key}`).value} ${unitAt(key)}`.trim(), key]]
      : key === "forbidden_hz" ? [[`clear of ${ranges(value)} Hz`, key]] : key === "speeds_rpm" ? [[`clear of ${ranges(value)} /min`, key]]
        : key === "contact_states" ? [[`${Object.keys(value).join(", ")} never open${Object.keys(value).length > 1 ? "" : "s"}`, key]] : []));
}

const joined = (nodes) => nodes.flatMap((node, i) => (i === 0 ? [node] : [i === nodes.length - 1 ? " and " : ", ", node]));
