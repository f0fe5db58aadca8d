// The panel of a design problem: its form by the schema of the service, the problem in words above it; what is not known in
// it: intervals and deviations as rows, or what an identification gave, held as it is.

import { button, byId, el, show } from "../base/dom.js";
import { on, state } from "../base/state.js";
import { numberOf, Unreadable } from "../forms/fields.js";
import { schemaForm } from "../forms/form.js";
import { boundsTold, namesOfTable, rowsOf, rowsOfTable } from "../forms/rows.js";
import { run } from "../network/jobs.js";
import { askedFor } from "../scene/kinds.js";
import { chooseVariable, defaultRange, fieldUnit, inField, ofField, variable, variables } from "../scene/scenes.js";
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

const ownVariable = () => (variable() ? rowsOfTable({ main: { key: "variables" }, beside: [] }, { variables: { [variable()]: state.range ?? defaultRange() } }) : []);

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
  const over = form.rows("variables").read().map(({ path, low, high }) => link(`${path} (${`${low ?? "…"} – ${high ?? "…"} ${fieldUnit(path).name}`.trim()})`, "variables"));
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
const HOW = { "± share": "deviation", "± value": "absolute_deviation" };

function intervalOf({ path, how, from, to }) {
  const read = (text, label) => (how === "± share" ? (_, share) => share : ofField)(path, numberOf(text, `/uncertain/${path}`, `${path}, ${label},`));
  const ends = [read(from, "from or ±"), ...(how === "between" || to !== undefined ? [read(to, "to")] : [])];
  return how === "between" ? ends : { [HOW[how]]: ends.length > 1 ? ends : ends[0] };
}

function rowOf([path, how]) {
  const [word, ends] = Array.isArray(how) ? ["between", how] : "deviation" in how ? ["± share", how.deviation] : ["± value", how.absolute_deviation];
  const [from, to] = [ends].flat().map((end) => (word === "± share" ? end : inField(path, end)));
  return { path, how: word, from, ...(Array.isArray(ends) ? { to } : {}) };
}

const isListed = (uncertain) => uncertain && !Array.isArray(uncertain) && Object.values(uncertain).every((how) => Array.isArray(how) || "deviation" in Object(how) || "absolute_deviation" in Object(how));
const wordsOf = (uncertain) => (Array.isArray(uncertain) ? `${uncertain.length} samples` : `an ellipsoid of ${Object.keys(uncertain.centre ?? uncertain.half_axes ?? {}).join(", ") || "deviations"}`);

// The part of a form for the key `uncertain`, whose schema takes any table.
function uncertainPart(id) {
  let rows = null;
  let given = null;

  function hold(found) {
    given = found;
    show(byId(`${id}-given`), given ? el("p", { class: "row" }, el("span", { class: "chip good" }, given.words), el("span", { class: "note" }, "in place of intervals"),
      button("Take it out", () => { hold(null); byId(`${id}-uncertain-add`).focus(); })) : null);
  }

  return {
    node(field) {
      const inner = el("div", { id: `${id}-uncertain` });
      rows = rowsOf(inner, { id: inner.id, one: "uncertain parameter", told: (path, changed) => {
        const { low, high, ...told } = boundsTold("uncertain", path, changed);
        return low === undefined ? told : { ...told, from: low, to: high };
      }, columns: [
        { name: "path", label: "quantity", type: "select", options: () => namesOfTable("uncertain") }, { name: "now", label: "now", type: "now" },
        { name: "how", label: "known", type: "select", options: () => ["between", ...Object.keys(HOW)] }, { name: "from", label: "from, or ±" }, { name: "to", label: "to" }, { name: "unit", label: "unit", type: "now" }] });
      return el("fieldset", {}, el("legend", { title: field.words }, "Not known"), el("div", { id: `${id}-given` }), inner);
    },
    read() {
      const found = rows.read();
      if (given && found.length) throw new Unreadable("/uncertain", "Intervals and what was identified do not go together: take one of them out.");
      return given ? { uncertain: given.uncertain } : found.length ? { uncertain: Object.fromEntries(found.map((row) => [row.path, intervalOf(row)])) } : {};
    },
    fill({ uncertain }) {
      const listed = isListed(uncertain);
      rows.fill(listed ? Object.entries(uncertain).map(rowOf) : []);
      hold(uncertain && !listed ? { uncertain, words: wordsOf(uncertain) } : null);
    },
    blame: (which, words) => Boolean(which) && rows.blame(which, "from", words),
    hold(found) {
      rows.fill([]);
      hold(found);
    },
    words: () => (given ? [given.words] : rows.read().map(({ path, how, from, to }) => `${path} ${how === "between" ? `in ${from ?? "…"} – ${to ?? "…"}` : `${how.replace("±", `± ${from ?? "…"}`)}`} ${how === "± share" ? "" : fieldUnit(path).name}`.trim())),
  };
}
