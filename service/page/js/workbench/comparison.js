// Two runs side by side: what differs in what they computed, then the figures of their results.

import { request } from "../network/api.js";
import { byId, el, show, table } from "../base/dom.js";
import { tell } from "../base/events.js";
import { length, number, quantity, seconds, when } from "../base/format.js";

const MOST = 60, LONGEST = 48;
// Units of settings and results, which may have the names of parameters of contacts but are others.
const LENGTH = /(^|\.)(peak\.value|limit|max_peak|error_estimate|max_abs|half_peak_to_peak)$/;
const HERTZ = /_hz$/, SECONDS = /(^|[._])seconds$/, PARAMETERS = /^(optimum|start|set)\./;

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
  const others = a.scene === b.scene ? inputs : inputs.filter((one) => !ofAScene(one));
  const scenes = a.scene === b.scene ? [] : inputs.filter(ofAScene);
  const inputTable = (label, found) => scrolled(label, table(heads("input"), found.map((one) => [one.path, toldInput(one, one.a), toldInput(one, one.b)]), "Inputs that differ"));
  const rows = (figures) => figures.slice(0, MOST).map((one) => [one.name, told(one.name, one.a), told(one.name, one.b)]);
  return [
    el("h3", {}, "What differs in the inputs"),
    scenes.length ? el("p", { class: "note" }, `The scenes are different ones: ${a.scene ?? "none"} and ${b.scene ?? "none"}.`) : null,
    inputs.length ? null : el("p", { class: "note" }, "Nothing: both computed the same."),
    others.length ? inputTable("Inputs of two runs", others) : null,
    scenes.length ? el("details", {}, el("summary", {}, `${scenes.length} values of the scenes`), inputTable("Values of two scenes", scenes)) : null,
    further ? el("p", { class: "note" }, `${further} further inputs differ.`) : null,
    el("h3", {}, "Results"),
    differing.length ? scrolled("Results of two runs", table(heads("figure"), rows(differing), "Results that differ")) : el("p", { class: "note" }, "No figure differs."),
    differing.length > MOST ? el("p", { class: "note" }, `The first ${MOST} of ${differing.length}.`) : null,
    equal ? el("details", {}, el("summary", {}, `${equal} figures are equal`), scrolled("Equal results of two runs", table(heads("figure"), rows(results.filter((one) => one.a === one.b)), "Results that are equal"))) : null,
  ];
}

const scrolled = (label, node) => el("div", { class: "scroll", role: "region", "aria-label": label, tabindex: 0 }, node);

// The values of two different scenes fill the table without telling much.
const ofAScene = ({ part }) => part === "scene";

function told(path, value) {
  if (value === null || value === undefined) return { text: "not given", number: true };
  if (typeof value === "number") return { text: figure(path, value), number: true };
  const words = typeof value === "object" ? JSON.stringify(value) : String(value);
  if (words.length <= LONGEST) return { text: words, number: true };
  return { text: `${words.slice(0, LONGEST)}…`, title: words.slice(0, 2000), number: true };
}

const toldInput = (one, value) => (ofAScene(one) && typeof value === "number" ? { text: quantity(one.path, value), number: true } : told(one.path, value));

function figure(path, value) {
  if (PARAMETERS.test(path)) return quantity(path, value);
  if (LENGTH.test(path)) return length(value);
  if (HERTZ.test(path)) return `${number(value, 5)} Hz`;
  return SECONDS.test(path) ? seconds(value) : number(value, 5);
}
