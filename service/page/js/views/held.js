// What holds a design: its limits, the conditions at the optimum, the other local optima; of a robust one its scenarios.

import { el, facts, table } from "../base/dom.js";
import { length, number, quantity, seconds } from "../base/format.js";
import { notes } from "../base/words.js";

const measured = (value, unit) => (unit === "m" ? length(value) : `${number(value)} ${unit}`);

const words = (values) => Object.entries(values).map(([path, value]) => `${path} ${quantity(path, value)}`).join(", ");

const several = (rows) => new Set(rows.map((row) => row.case)).size > 1;

// The limits with what is reached and what is left.
export function limitsOf({ rows = [] }) {
  const limited = rows.filter(({ bound }) => bound !== null && bound !== undefined);
  if (!limited.length) return null;
  const of = several(rows);
  return el("div", {}, el("h3", {}, "Limits"), scrolled("Limits of the design", table(["limit", ...(of ? ["case"] : []), { text: "reached", number: true }, { text: "allowed", number: true }, { text: "left", number: true }],
    limited.map((row) => [row.what, ...(of ? [row.case] : []), ...[row.value, row.bound, row.bound - row.value].map((value) => ({ text: measured(value, row.unit), number: true }))]), "Limits of the design")));
}

// The first-order conditions: which rows and bounds push against one another, and how strongly.
export function conditionsOf({ conditions, rows = [] }) {
  if (!conditions) return null;
  const of = several(rows);
  const all = [
    ...conditions.rows.map(({ what, case: name, multiplier }) => [of ? `${what} of ${name}` : what, { text: number(multiplier), number: true }]),
    ...conditions.bounds.map(({ variable, side, multiplier }) => [`${side} bound of ${variable}`, { text: number(multiplier), number: true }]),
  ];
  return el("details", {}, el("summary", {}, "What holds it, and how strongly"),
    el("p", { class: "note" }, `The multipliers of the first-order (Karush-Kuhn-Tucker) conditions; what is left of them is ${number(conditions.residual, 2)}.`),
    scrolled("Multipliers of the design", table(["active", { text: "multiplier", number: true }], all, "Multipliers of the design")));
}

// Every local optimum that was found, each to be loaded.
export function basinsOf({ basins = [] }, load) {
  if (basins.length < 2) return null;
  return el("div", {}, el("h3", {}, "Local optima"), scrolled("Local optima", table(["design", { text: "peak", number: true }, "keeps the limits", ""],
    basins.map((basin) => [words(basin.values), { text: length(basin.peak), number: true }, basin.feasible === false ? "no" : "yes",
      el("button", { type: "button", "aria-label": `Load the local optimum ${words(basin.values)}`, onclick: () => load(basin.values) }, "Load")]), "Local optima")));
}

// A design in spite of what is not known, beside the best of what is.
export function robustOf(result) {
  const side = (name, { values, peak, worst, samples }) => [name, words(values),
    ...[peak?.value, worst?.peak, samples?.mean].map((value) => ({ text: length(value ?? null), number: true })), worst?.scenario?.words ?? "–"];
  return [
    facts([["what is minimised", result.aim], ["designs and responses", `${result.designs} and ${result.responses} in ${seconds(result.seconds)}`],
      ["gain in the worst case", result.gain === null ? "–" : `${number(100 * result.gain, 3)} %`], ["gap", result.gap === null ? "–" : `${number(100 * result.gap, 2)} % could still be missed`],
      ...result.warnings.map((text) => ["warning", el("span", { class: "bad" }, text)]), ...notes({ notes: result.notes, warnings: result.warnings })]),
    scrolled("Nominal and robust design", table(["", "design", { text: "peak, all nominal", number: true }, { text: "worst peak", number: true }, { text: "mean of samples", number: true }, "worst with"],
      [["robust", result.robust], ["nominal", result.nominal]].filter(([, found]) => found).map(([name, found]) => side(name, found)), "Nominal and robust design")),
  ];
}

const scrolled = (label, node) => el("div", { class: "scroll", role: "region", "aria-label": label, tabindex: 0 }, node);
