// The panel of a design problem: any variables, limits, load cases, uncertainty and method, as command and REST have them.

import { state } from "../base/address.js";
import { byId, el, say, show } from "../base/dom.js";
import { on } from "../base/events.js";
import { run } from "../network/jobs.js";
import { asked, chooseVariable, current, defaultRange, ranges, value, variable, variables, variedParts } from "../scene/scenes.js";
import { fillSettings, readSettings } from "../scene/settings.js";
import { VIEWS } from "../views.js";
import { Unreadable, bodyOf, fieldsOf } from "./body.js";
import { rowsOf } from "./rows.js";

const PRIORITY = 5;
const FIELDS = [
  ["limits", "max_peak", "Highest peak allowed [m]"], ["limits", "max_band_hz", "Widest band allowed [Hz]"], ["limits", "limit", "Amplitude at which the band is measured [m]"],
  ["limits", "forbidden_hz", "Forbidden ranges [Hz]", "520 to 560"], ["limits", "speeds_rpm", "Running speeds to keep clear [1/min]", "3000 to 3200"],
  ["limits", "max_friction_work", "Friction work allowed in a cycle [J]"],
  ["uncertainty", "quantile", "Quantile"], ["uncertainty", "samples", "Samples"], ["method", "basins", "Local optima looked for"],
];
const CHOICES = { method: ["", "auto", "tracked", "minimax", "ipopt"], aim: ["", "worst-case", "mean", "quantile"] };
const WEIGHTS = [["peak", "Weight of the peak [1/m]"], ["band", "Weight of the band [1/Hz]"]];
let lists = null;
// What is not known, in a form that the rows have no fields for: an ellipsoid, or samples.
let given = null;

export function startPanel() {
  const paths = () => [...variables(), ...variedParts().flatMap(ranges).map(({ path }) => path)].filter((path, i, all) => all.indexOf(path) === i);
  lists = {
    variables: rowsOf(byId("problem-variables"), { id: "problem-variables", one: "variable", least: 1, columns: [
      { key: "path", label: "Variable", type: "select", options: paths }, { key: "low", label: "from" }, { key: "high", label: "to" },
      { key: "how", label: "Steps", type: "select", options: () => ["auto", "linear", "logarithmic"] }] }),
    cases: rowsOf(byId("problem-cases"), { id: "problem-cases", one: "case", columns: [
      { key: "name", label: "Name", type: "text" },
      { key: "engine_order", label: "Engine order", off: () => current.body?.structure.kind !== "cyclic" }, { key: "order", label: "Excitations a revolution" },
      { key: "level", label: "Force [N]" }, { key: "low", label: "Band from [Hz]" }, { key: "high", label: "to [Hz]" },
      { key: "weight", label: "Weight", hint: "1" }, { key: "values", label: "Further values", type: "text", hint: "damper.mu = 0.3" }] }),
    uncertain: rowsOf(byId("problem-uncertain"), { id: "problem-uncertain", one: "uncertain parameter", columns: [
      { key: "path", label: "Parameter", type: "select", options: () => [...paths(), "excitation.amplitude"] },
      { key: "how", label: "Known", type: "select", options: () => ["between", "± share", "± value"] }, { key: "from", label: "from, or ±" }, { key: "to", label: "to" }] }),
  };
  for (const [group, key, words, hint] of FIELDS) byId(`problem-${group}`).append(plain(key, words, hint));
  for (const [key, words] of WEIGHTS) byId("problem-method").append(plain(`weight-${key}`, words));
  for (const [key, host] of [["aim", "uncertainty"], ["method", "method"]]) byId(`problem-${host}`).prepend(choice(key));
  byId("problem-form").addEventListener("submit", (event) => {
    event.preventDefault();
    submit();
  });
  on("scene", () => fill({}));
  on("uncertain-given", (found) => {
    lists.uncertain.fill([]);
    hold(found);
    byId("problem-uncertainty-fold").open = true;
  });
  on("scene-contact", () => lists.variables.count() <= 1 && fillVariables({}));
  // What is being typed is not taken away by a search that ends meanwhile.
  on("computed", ({ kind, request }) => kind === "design" && !byId("problem-form").contains(document.activeElement) && fill(request));
}

const plain = (key, words, hint) =>
  el("label", { class: "problem-field" }, el("span", {}, words), el("input", { id: `problem-${key}`, type: "text", inputmode: hint ? "text" : "decimal", placeholder: hint ?? "", spellcheck: false }));

const choice = (key) =>
  el("label", { class: "problem-field" }, el("span", {}, key === "aim" ? "What is minimised" : "Method"),
    el("select", { id: `problem-${key}` }, CHOICES[key].map((word) => el("option", { value: word }, word || "as usual"))));

function fillVariables(request) {
  const given = fieldsOf(request).variables;
  const own = variable();
  lists.variables.fill(given.length ? given : own ? [{ path: own, low: (state.range ?? defaultRange())[0], high: (state.range ?? defaultRange())[1], how: "auto" }] : []);
}

function hold(found) {
  given = found;
  show(byId("problem-given"), given ? el("p", { class: "row" }, el("span", { class: "chip good" }, given.words), el("span", { class: "note" }, "in place of intervals"),
    el("button", { type: "button", onclick: () => { hold(null); byId("problem-uncertain-add").focus(); } }, "Take it out")) : null);
}

function fill(request) {
  const { cases, uncertain, fields, contacts, weights } = fieldsOf(request);
  fillVariables(request);
  lists.cases.fill(cases);
  lists.uncertain.fill(uncertain);
  hold(request.uncertain && !uncertain.length ? { uncertain: request.uncertain, words: Array.isArray(request.uncertain) ? `${request.uncertain.length} samples` : `an ellipsoid of ${Object.keys(request.uncertain.centre ?? request.uncertain.half_axes ?? {}).join(", ") || "deviations"}` } : null);
  for (const [key, text] of Object.entries(fields)) byId(`problem-${key}`).value = String(text);
  for (const [key] of WEIGHTS) byId(`problem-weight-${key}`).value = String(weights[key] ?? "");
  show(byId("problem-contacts"), (current.body?.contacts ?? []).map(({ name }) =>
    el("label", { class: "pair" }, el("input", { type: "checkbox", name, checked: contacts.includes(name) }), `${name} must not open`)));
  byId("problem-submit").disabled = !variable();
  for (const [id, used] of [["limits", contacts.length || ["max_peak", "max_band_hz", "limit", "forbidden_hz", "speeds_rpm", "max_friction_work"].some((key) => fields[key])], ["cases", cases.length], ["uncertainty", uncertain.length || given], ["method", fields.method || fields.basins || Object.keys(weights).length]]) {
    if (used) byId(`problem-${id}-fold`).open = true;
  }
  complain([]);
}

const text = (id) => byId(`problem-${id}`).value.trim();

const asFields = () => ({
  variables: lists.variables.read(), cases: lists.cases.read(), uncertain: lists.uncertain.read(),
  fields: Object.fromEntries([...FIELDS.map(([, key]) => key), "method", "aim"].map((key) => [key, text(key)])),
  contacts: [...byId("problem-contacts").querySelectorAll("input:checked")].map(({ name }) => name),
  weights: Object.fromEntries(WEIGHTS.map(([key]) => [key, text(`weight-${key}`)])),
});

async function submit() {
  complain([]);
  let body;
  try {
    body = bodyOf(asFields());
    if (given) {
      if (body.uncertain) throw new Unreadable("/uncertain", "Intervals and what was identified do not go together: take one of them out.");
      body.uncertain = given.uncertain;
      if (text("aim")) body.aim = text("aim");
    }
  } catch (error) {
    if (!(error instanceof Unreadable)) throw error;
    return complain(error.errors);
  }
  // One variable of the scene is the one above too: both then speak of the same range.
  const [[path, range], ...others] = Object.entries(body.variables);
  if (!others.length && variables().includes(path)) {
    chooseVariable(path);
    state.range = range;
    fillSettings();
  }
  if (!readSettings()) return undefined;
  const view = { ...VIEWS.design, failed(words, errors = []) {
    VIEWS.design.failed(words, errors);
    complain(errors);
  } };
  await run("design", { ...asked(), ...body }, view, PRIORITY);
  return undefined;
}

// Says what is wrong beside the part it is about, and marks the field.
function complain(errors) {
  const form = byId("problem-form");
  for (const node of form.querySelectorAll("[aria-invalid]")) node.removeAttribute("aria-invalid");
  say("problem-wrong", errors.map(({ pointer, detail }) => `${nameOf(pointer)}: ${detail}`).join(" "), true);
  for (const { pointer } of errors) {
    const [top, which, key] = pointer.split("/").slice(1);
    const row = top === "cases" ? lists.cases.row(Number(which))
      : top === "variables" ? [...byId("problem-variables").querySelectorAll(".problem-row")].find((each) => each.querySelector("[name=path]").value === which) : null;
    const field = row?.querySelector(`[name="${key === "band" ? "low" : key}"]`) ?? row?.querySelector("input") ?? byId(`problem-${top}`);
    if (!field?.matches?.("input, select")) continue;
    field.setAttribute("aria-invalid", "true");
    field.closest("details")?.setAttribute("open", "");
  }
  form.querySelector("[aria-invalid]")?.focus();
}

const nameOf = (pointer) => pointer.split("/").slice(1).map((part) => (/^\d+$/.test(part) ? Number(part) + 1 : part.replaceAll("_", " "))).join(" ") || "problem";
