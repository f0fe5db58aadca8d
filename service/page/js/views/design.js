// The best design, and the plan of the scene.

import { Problem, patiently, post } from "../network/api.js";
import { state } from "../base/address.js";
import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { length, number, quantity, seconds } from "../base/format.js";
import { notes } from "../base/words.js";
import { putAll } from "./live.js";
import { asked } from "../scene/scenes.js";
import { basinsOf, conditionsOf, limitsOf, robustOf } from "./held.js";

let token = 0;

export function startDesign() {
  on("scene", () => {
    say("design-status", "Not searched for yet.");
    show(byId("design-facts"));
    plan();
  });
  on("settled", plan);
}

export const designView = {
  waiting: () => say("design-status", "The search waits for a worker."),
  progress({ took, points, best }) {
    say("design-status", `Searching:${took}${points ? `, ${points} evaluations` : ""}.`);
    if (best) showBest(best);
  },
  result(result, _sweeps, job) {
    const use = (found) => load(found, job.request);
    const values = Object.entries(result.optimum ?? {});
    const button = values.length ? el("button", { type: "button", onclick: () => use(result.optimum) }, "Load this design") : null;
    if ("aim" in result) {
      say("design-status", result.status);
      show(byId("design-facts"), facts(values.map(([path, v]) => [path, el("strong", {}, quantity(path, v))])), robustOf(result), button);
      return;
    }
    say("design-status", `Found in ${seconds(result.seconds)} with ${result.evaluations} responses. ${result.status}`);
    show(
      byId("design-facts"),
      facts([
        ...values.map(([path, v]) => [path, el("strong", {}, quantity(path, v))]),
        ["highest peak", result.peak ? `${length(result.peak.value)} at ${number(result.peak.at, 6)} Hz` : "–"],
        ...Object.entries(result.plateau ?? {}).map(([path, [low, high]]) => [`${path}, as good`, `${quantity(path, low)} to ${quantity(path, high)}`]),
        ...(result.chosen_by ? [["chosen by", result.chosen_by]] : []),
        ...(typeof result.error_estimate === "number" ? [["estimated error", length(result.error_estimate)]] : []),
        ...(result.warnings ?? []).map((words) => ["warning", el("span", { class: "bad" }, words)]),
        ...notes({ notes: result.notes, warnings: result.warnings }),
        ["resonance band", result.band_hz === null ? "–" : `${number(result.band_hz)} Hz above ${length(result.limit)}`],
        ...furtherOf(result).map(({ quantity: name, value, unit, what }) => [name, `${unit === "m" ? length(value) : `${number(value)} ${unit}`}: ${what}`]),
        ["held by", `${(result.active ?? []).join(", ") || "nothing"}${heldIn(result)}`],
        ...(result.certainty ? [["certain", result.certainty]] : []),
        ...(result.looked_at?.length ? [["looked at", `${result.looked_at.length} designs over the whole range`]] : []),
      ]),
      button, limitsOf(result), basinsOf(result, use), conditionsOf(result),
    );
    if (values.length) tell("optimum", { values: Object.fromEntries(values), peak: result.peak });
  },
  // Of a search that was stopped the best so far is all there is: it stays, and may be loaded.
  failed(text, _issues, job) {
    say("design-status", text, true);
    if (!job?.best) return;
    showBest(job.best);
    byId("design-best")?.append(el("button", { type: "button", onclick: () => load(job.best.values, job.request) }, "Load the best so far"));
  },
};

// The best design so far, while the search goes on: what it is, how well it is known, and that it may be another in the end.
let seen = null;
function showBest(best) {
  const key = JSON.stringify(best);
  if (key === seen && byId("design-best")) return;
  seen = key;
  const values = Object.entries(best.values).map(([path, v]) => `${path} ${quantity(path, v)}`).join(", ");
  show(byId("design-facts"), el("div", { id: "design-best", class: "best-so-far", role: "status" },
    el("p", {}, el("strong", {}, "Best so far"), ` ${values}`, best.peak === null ? "" : `: peak ${length(best.peak)}`, `, after ${best.evaluations} evaluation${best.evaluations === 1 ? "" : "s"}`),
    el("p", { class: "note" }, el("span", { class: best.verified ? "chip good" : "chip" }, best.verified ? "verified" : "to be verified"),
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
  const own = { ...set };
  for (const [names, value] of Object.entries(values)) {
    for (const path of names.split(",").map((name) => name.trim())) {
      delete own[path];
      own[path] = value;
    }
  }
  putAll(own);
  return undefined;
}

async function plan() {
  const mine = (token += 1);
  try {
    const found = await patiently(() => post("/v1/plan", asked()));
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
      others.length ? el("details", {}, el("summary", {}, `and ${others.length} further sector${others.length > 1 ? "s" : ""}`), others.map((each) => el("p", {}, each))) : null);
  show(
    byId("plan-facts"),
    el("p", { class: "note" }, `${unknowns} unknowns for ${dofs} linear DOFs; about ${seconds(cost)} a point.`),
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
