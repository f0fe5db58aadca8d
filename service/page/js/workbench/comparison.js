// Two runs side by side: what differs in what they computed, then the figures of their results.

import { request } from "../network/api.js";
import { byId, el, show, table } from "../base/dom.js";
import { tell } from "../base/events.js";
import { number, quantity, when } from "../base/format.js";

const MOST = 60;

export async function compareRuns(a, b) {
  const host = byId("runs-compare");
  try {
    const found = await request(`/v1/runs/compare?a=${encodeURIComponent(a)}&b=${encodeURIComponent(b)}`);
    show(byId("runs-compare-body"), body(found));
    host.hidden = false;
    host.scrollIntoView({ block: "nearest" });
    byId("runs-compare-title").focus();
  } catch (error) {
    tell("notice", error.message);
  }
}

export function startComparison() {
  byId("runs-compare-close").addEventListener("click", () => {
    byId("runs-compare").hidden = true;
    show(byId("runs-compare-body"));
    tell("comparison-closed");
  });
}

const heading = (run) => `${run.name || `${run.kind} of ${run.scene ?? "a scene"}`}, ${when(run.created)}`;

function body({ a, b, inputs, more_inputs: further, results }) {
  const heads = (first) => [first, { text: heading(a), number: true }, { text: heading(b), number: true }];
  const differing = results.filter((one) => one.a !== one.b);
  const equal = results.length - differing.length;
  const rows = (figures) => figures.slice(0, MOST).map((one) => [one.name, told(one.name, one.a), told(one.name, one.b)]);
  return [
    el("h3", {}, "What differs in the inputs"),
    inputs.length
      ? scrolled("Inputs of two runs", table(heads("input"), inputs.map((one) => [one.path, told(one.path, one.a), told(one.path, one.b)]), "Inputs that differ"))
      : el("p", { class: "note" }, "Nothing: both computed the same."),
    further ? el("p", { class: "note" }, `${further} further inputs differ.`) : null,
    el("h3", {}, "Results"),
    differing.length ? scrolled("Results of two runs", table(heads("figure"), rows(differing), "Results that differ")) : el("p", { class: "note" }, "No figure differs."),
    differing.length > MOST ? el("p", { class: "note" }, `The first ${MOST} of ${differing.length}.`) : null,
    equal ? el("details", {}, el("summary", {}, `${equal} figures are equal`), scrolled("Equal results of two runs", table(heads("figure"), rows(results.filter((one) => one.a === one.b)), "Results that are equal"))) : null,
  ];
}

const scrolled = (label, node) => el("div", { class: "scroll", role: "region", "aria-label": label, tabindex: 0 }, node);

function told(path, value) {
  if (value === null || value === undefined) return { text: "not given", number: true };
  if (typeof value === "number") return { text: quantity(path, value), number: true };
  return { text: typeof value === "object" ? JSON.stringify(value) : String(value), number: true };
}
