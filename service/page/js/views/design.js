// The best design: what holds it, what one per cent of each parameter does to it, and the plan of the scene.

import { on, state, tell } from "../base/state.js";
import { bad, button, byId, el, details, facts, note, numeric, scrolledTable, show, titled } from "../base/dom.js";
import { errorOf, hertz, length, measured, notes, number, quantity, seconds, valuesSaid } from "../base/format.js";
import { Problem, patiently, post } from "../network/api.js";
import { previewer } from "../network/previews.js";
import { asked } from "../scene/scenes.js";
import { putAll } from "./live.js";
import { statusPart, view } from "./view.js";

const FIRST = 6;
let token = 0;
let wish = "";
let cases = false;

export const design = view({
  kind: "design", id: "design", title: "Best design", tabs: "design", priority: 5,
  bar: { form: "problem-form", words: "Search this design" },
  about: "Not searched for yet.",
  work: "search", goes: ({ took, points }) => `Searching:${took}${points ? `, ${points} evaluations` : ""}.`,
  parts: () => [statusPart("design"), el("div", { id: "design-facts" }), el("div", { id: "design-sensitivities" }),
    el("details", { id: "plan" }, el("summary", {}, "Plan: effects in use and left out"), el("div", { id: "plan-facts" }))],
  start() {
    on("settled", plan);
    startSensitivities();
  },
  scene: plan,
  progress(job) {
    design.say(design.goes(job));
    if (job.best) showBest(job.best);
  },
  result(result, _sweeps, job) {
    const use = (these) => load(these, job.request);
    const values = Object.entries(result.optimum ?? {});
    const take = values.length ? button("Load this design", () => use(result.optimum)) : null;
    const found = values.map(([path, v]) => [path, el("strong", {}, quantity(path, v))]);
    if ("aim" in result) {
      design.say(result.status);
      return design.facts(facts(found), robustOf(result), take);
    }
    design.say(`Found in ${seconds(result.seconds)} with ${result.evaluations} responses. ${result.status}`);
    design.facts(
      facts([
        ...found,
        ["highest peak", result.peak ? `${measured(result.peak.value, "m", errorOf(result))} at ${hertz(result.peak.at)}` : "–"],
        ...Object.entries(result.plateau ?? {}).map(([path, [low, high]]) => [`${path}, as good`, `${quantity(path, low)} to ${quantity(path, high)}`]),
        ...(result.chosen_by ? [["chosen by", result.chosen_by]] : []),
        ...(result.warnings ?? []).map((words) => ["warning", bad(words)]),
        ...notes({ notes: result.notes, warnings: result.warnings }),
        ["resonance band", result.band_hz === null ? "–" : `${hertz(result.band_hz)} above ${length(result.limit)}`],
        ...furtherOf(result).map(({ quantity: name, value, unit, what }) => [name, `${measured(value, unit)}: ${what}`]),
        ["held by", `${(result.active ?? []).join(", ") || "nothing"}${heldIn(result)}`],
        ...(result.certainty ? [["certain", result.certainty]] : []),
        ...(result.looked_at?.length ? [["looked at", `${result.looked_at.length} designs over the whole range`]] : []),
      ]),
      take, limitsOf(result), basinsOf(result, use), conditionsOf(result),
    );
    if (values.length) tell("optimum", { values: Object.fromEntries(values), peak: result.peak });
    return undefined;
  },
  // Of a search that was stopped the best so far is all there is: it stays, and may be loaded.
  failed(text, _issues, job) {
    design.say(text, true);
    if (!job?.best) return;
    showBest(job.best);
    byId("design-best")?.append(button("Load the best so far", () => load(job.best.values, job.request)));
  },
});

// The best design so far, while the search goes on: what it is, how well it is known, and that it may be another in the end.
let seen = null;
function showBest(best) {
  const key = JSON.stringify(best);
  if (key === seen && byId("design-best")) return;
  seen = key;
  design.facts(el("div", { id: "design-best", class: "best-so-far", role: "status" },
    el("p", {}, el("strong", {}, "Best so far"), ` ${valuesSaid(best.values)}`, best.peak === null ? "" : `: peak ${length(best.peak)}`, `, after ${best.evaluations} evaluation${best.evaluations === 1 ? "" : "s"}`),
    note(el("span", { class: best.verified ? "chip good" : "chip" }, best.verified ? "verified" : "to be verified"),
      best.feasible ? null : el("span", { class: "chip bad" }, "breaks a limit"), ` ${best.words}`)));
}

// The largest row of each criterion that is minimised besides peak and band.
function furtherOf({ rows }) {
  const largest = new Map();
  for (const row of rows ?? []) {
    const known = largest.get(row.quantity);
    if (row.weight > 0 && !["peak", "band"].includes(row.quantity) && !(known && known.weight * known.value >= row.weight * row.value)) largest.set(row.quantity, row);
  }
  return [...largest.values()];
}

// Of several load cases, the one that holds the design.
const heldIn = ({ held_by: held, peaks }) =>
  held && new Set((peaks ?? []).map((peak) => peak.case)).size > 1 ? ` (of ${held.case})` : "";

// Sets the values of a design with those it was computed with: of no other scene, and beside no other values.
export function load(values, { scene, set = {} }) {
  if (scene !== state.scene) return tell("notice", `This design is of the scene ${scene}, and ${state.scene} is shown: choose ${scene} first.`);
  const found = apart(values);
  // What was found comes last, as if it had been set last.
  return putAll({ ...Object.fromEntries(Object.entries(set).filter(([path]) => !(path in found))), ...found });
}

const several = (rows) => new Set(rows.map((row) => row.case)).size > 1;

// The limits with what is reached and what is left.
function limitsOf({ rows = [] }) {
  const limited = rows.filter(({ bound }) => bound !== null && bound !== undefined);
  if (!limited.length) return null;
  const of = several(rows);
  return titled("Limits", scrolledTable("Limits of the design", ["limit", ...(of ? ["case"] : []), ...["reached", "allowed", "left"].map(numeric)],
    limited.map((row) => [row.what, ...(of ? [row.case] : []), ...[row.value, row.bound, row.bound - row.value].map((value) => numeric(measured(value, row.unit)))])));
}

// The first-order conditions: which rows and bounds push against one another, and how strongly.
function conditionsOf({ conditions, rows = [] }) {
  if (!conditions) return null;
  const of = several(rows);
  const all = [
    ...conditions.rows.map(({ what, case: name, multiplier }) => [of ? `${what} of ${name}` : what, numeric(number(multiplier))]),
    ...conditions.bounds.map(({ variable, side, multiplier }) => [`${side} bound of ${variable}`, numeric(number(multiplier))]),
  ];
  return details("What holds it, and how strongly",
    note(`The multipliers of the first-order (Karush-Kuhn-Tucker) conditions; what is left of them is ${number(conditions.residual, 2)}.`),
    scrolledTable("Multipliers of the design", ["active", numeric("multiplier")], all));
}

// Every local optimum that was found, each to be loaded.
function basinsOf({ basins = [] }, use) {
  if (basins.length < 2) return null;
  return titled("Local optima", scrolledTable("Local optima", ["design", numeric("peak"), "keeps the limits", ""],
    basins.map(({ values, peak, feasible }) => [valuesSaid(values), numeric(length(peak)), feasible === false ? "no" : "yes",
      button("Load", () => use(values), { "aria-label": `Load the local optimum ${valuesSaid(values)}` })])));
}

// A design in spite of what is not known, beside the best of what is.
function robustOf(result) {
  const side = (name, { values, peak, worst, samples }) => [name, valuesSaid(values),
    ...[peak?.value, worst?.peak, samples?.mean].map((value) => numeric(length(value ?? null))), worst?.scenario?.words ?? "–"];
  return [
    facts([["what is minimised", result.aim], ["designs and responses", `${result.designs} and ${result.responses} in ${seconds(result.seconds)}`],
      ["gain in the worst case", result.gain === null ? "–" : `${number(100 * result.gain, 3)} %`], ["gap", result.gap === null ? "–" : `${number(100 * result.gap, 2)} % could still be missed`],
      ...result.warnings.map((text) => ["warning", bad(text)]), ...notes({ notes: result.notes, warnings: result.warnings })]),
    scrolledTable("Nominal and robust design", ["", "design", ...["peak, all nominal", "worst peak", "mean of samples"].map(numeric), "worst with"],
      [["robust", result.robust], ["nominal", result.nominal]].filter(([, found]) => found).map(([name, found]) => side(name, found))),
  ];
}

// What one per cent more of each parameter does to the design: to its peaks and to its band.
function startSensitivities() {
  const ask = previewer("sensitivities", (found, { token: of }) => of === wish && drawSensitivities(found), (error, of) => {
    if (of === wish) show(byId("design-sensitivities"), note(`Sensitivities: ${error.message}`));
  });
  const clear = () => {
    wish = "";
    show(byId("design-sensitivities"));
  };
  on("scene-left", clear);
  on("job-begun", (kind) => kind === "design" && clear());
  on("computed", ({ kind, request, result }) => {
    if (kind !== "design" || !Object.keys(result.optimum ?? {}).length) return;
    const body = { kind: "sensitivities", scene: state.scene, set: { ...request.set, ...apart(result.optimum) }, harmonics: request.harmonics ?? 11 };
    if (result.limit) body.limit = result.limit;
    wish = JSON.stringify(body);
    cases = Boolean(request.cases?.length);
    ask(body, wish);
  });
}

// Values by paths of which several that share one are separated by commas, each by its own.
const apart = (values) => Object.fromEntries(Object.entries(values).flatMap(([names, value]) => names.split(",").map((path) => [path.trim(), value])));
const percent = (share) => numeric(share === null ? "–" : `${share > 0 ? "+" : share < 0 ? "−" : ""}${number(Math.abs(share), 3)} %`);

function drawSensitivities({ peaks, rows, left_out: without, band_hz: band, limit, n_harmonics: kept, status, reached }) {
  const host = byId("design-sensitivities");
  if (!reached || !rows.length) return show(host, note(`Sensitivities: ${status}`));
  const heads = ["parameter", ...["value", ...peaks.map(({ at }) => `peak at ${hertz(at)}`), "band"].map(numeric)];
  const lines = rows.map(({ path, value, unit, peaks_percent: each, band_percent: width }) => [path, numeric(measured(value, unit)), ...each.map(percent), percent(width)]);
  const part = (some, name) => scrolledTable(name, heads, some);
  const of = [`For one per cent more of a parameter${band === null ? "" : `; the band is measured at ${length(limit)}`}.`, `${kept} harmonics.`,
    cases ? "Of the scene as it is set, without the load cases." : ""].filter(Boolean).join(" ");
  return show(host, el("h3", {}, "Sensitivities at the design"), note(of), part(lines.slice(0, FIRST), "Sensitivities at the design"),
    lines.length > FIRST ? details(`${lines.length - FIRST} further parameters, which matter less`, part(lines.slice(FIRST), "Further sensitivities")) : null,
    without.map(({ path, reason }) => note(`Left out: ${path}: ${reason}`)));
}

async function plan() {
  const [mine, body] = [(token += 1), asked()];
  try {
    const found = await patiently(() => post("/v1/plan", body));
    if (mine === token) describe(found);
  } catch (error) {
    if (mine === token && error instanceof Problem) show(byId("plan-facts"), el("p", { class: "bad" }, error.message));
  }
}

function describe({ effects, unknowns, linear_dofs: dofs, estimated_seconds_a_point: cost }) {
  tell("cost", cost);
  const item = ({ name, used, reason, others = [] }) =>
    el("li", { class: used ? "used" : "left" },
      el("span", { class: "sign", "aria-hidden": "true" }, used ? "✓" : "–"),
      el("strong", {}, name), ` ${used ? "in use" : "left out"}: ${reason}`,
      others.length ? details(`and ${others.length} further sector${others.length > 1 ? "s" : ""}`, others.map((each) => el("p", {}, each))) : null);
  show(
    byId("plan-facts"),
    note(`${unknowns} unknowns for ${dofs} linear DOFs; about ${seconds(cost)} a point.`),
    el("ul", { class: "effects" }, grouped(effects).sort((a, b) => b.used - a.used).map(item)),
  );
}

// Of a disk written out, the same effect of all its sectors as one.
function grouped(effects) {
  const groups = new Map();
  for (const effect of effects) {
    const key = `${effect.name.replace(/@\d+$/, "@")} ${effect.used}`;
    const first = effect.name.includes("@") ? groups.get(key) : undefined;
    if (first) first.others.push(effect.reason);
    else groups.set(effect.name.includes("@") ? key : effect.name, { ...effect, others: [] });
  }
  return [...groups.values()];
}
