// The answer in large figures: what to build, the peak and the band before and after, how far to trust it.

import { on, state, tell } from "../base/state.js";
import { button, byId, el, note, show } from "../base/dom.js";
import { saveFrom } from "../base/exports.js";
import { errorOf, hertz, length, number, quantity, shownUnit } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { inUse, sameValues } from "../scene/inputs.js";
import { current, givenByScene, variable } from "../scene/scenes.js";
import { fillSettings } from "../scene/settings.js";
import { load } from "./design.js";
import { changedSince, isUnderway, pressTakes, staleWords } from "./study.js";

let designed = null;
let before = null;
let ask = null;

export function startAnswer() {
  ask = previewer("before", ({ peak, band_hz: band, n_harmonics: kept }, { token }) => {
    if (token !== key()) return;
    before = { ...designed.request, found: { peak, band_hz: band, kept } };
    draw();
  }, () => undefined);
  on("scene-left", () => {
    [designed, before] = [null, null];
    draw();
  });
  on("computed", ({ kind, request, result }) => {
    if (kind === "sweep" && !(before && designed && sameValues(before, designed.request))) before = { ...request, found: result };
    if (kind === "design" && result.optimum) designed = { request, result };
    if (designed && !known()) askBefore();
    draw();
  });
  for (const event of ["staleness", "scene"]) on(event, draw);
  on("cost", () => designed === null && draw());
}

const key = () => JSON.stringify([state.scene, designed?.request.set ?? {}, designed?.request.harmonics ?? 11]);
const known = () => before !== null && sameValues(before, designed.request);

// The response that the design began with, where the sweep at hand is of other values.
function askBefore() {
  const { set = {}, harmonics = 11 } = designed.request;
  ask({ kind: "sweep", scene: state.scene, set, harmonics }, key());
}

function draw() {
  const host = byId("answer-body");
  const empty = designed === null;
  byId("answer-actions").hidden = empty;
  byId("answer").classList.toggle("is-stale", !empty && changedSince("design").length > 0);
  if (empty) {
    show(host, note(isUnderway("design")
      ? "The search for the best damper is under way."
      : variable() ? `No design yet: Find the best damper searches ${variable()} over its range and draws the other views${pressTakes() && `, ${pressTakes()}`}.` : "No design: the scene has no contact to design."));
    show(byId("answer-stale"));
    return;
  }
  show(host, el("dl", { class: "figures" }, figures().map(([name, value, more, id]) =>
    el("div", { id: id ?? undefined }, el("dt", {}, name), el("dd", { class: "large" }, value), more ? el("dd", { class: "small", title: more }, more) : null))));
  actions();
}

function actions() {
  const { request, result } = designed;
  show(byId("answer-stale"), staleWords("design", changedSince("design"), "Find it again"), widened());
  const used = inUse(request, result.optimum);
  const use = byId("use-design");
  use.textContent = used ? "In use" : "Use";
  use.disabled = used || Object.keys(result.optimum).length === 0;
  use.onclick = () => load(result.optimum, request);
  byId("save-report").onclick = () => saveReport("save-report", "html", "text/html");
  byId("save-pdf").onclick = () => saveReport("save-pdf", "pdf", "application/pdf");
}

// A best value on its bound: what lies beyond is one press away, as far as the slider goes where that has no ratios.
function widened() {
  const { request: { variables = {} }, result: { conditions } } = designed;
  const [{ variable: path, side } = {}] = conditions?.bounds ?? [];
  const { slider } = current.parameters.get(path) ?? {};
  if (!slider || path !== variable() || !variables[path] || changedSince("design").length) return null;
  const [low, high] = variables[path];
  const range = (side === "upper" ? [low, slider.logarithmic ? 10 * high : slider.high] : [slider.logarithmic ? low / 10 : slider.low, high]).map((end) => Number(end.toPrecision(4)));
  const search = () => {
    state.range = range;
    fillSettings();
    tell("settings");
    tell("renew", "design");
  };
  const beyond = range[0] > 0 && (range[0] < low || range[1] > high);
  return [`Best at the ${side} bound, ${quantity(path, side === "upper" ? high : low)}. `, beyond ? button(`Widen to ${range.map((end) => quantity(path, end)).join(" – ")}, search again`, search, { id: "widen" }) : null];
}

// The service makes it, from the job of the design: of the problem that was solved, whatever is set now.
async function saveReport(id, form, type) {
  const button = byId(id);
  const words = button.textContent;
  button.disabled = true;
  button.textContent = "Being made …";
  await saveFrom(`/v1/jobs/${state.jobs.design}/report?format=${form}`, type, `report-${state.scene}.${form}`);
  button.disabled = false;
  button.textContent = words;
  button.focus();
}

const arrow = (was, is) => (was === null ? is : `${was} → ${is}`);

function peakFigure({ peak }, was) {
  if (!peak) return ["Highest peak", "–", "", "answer-peak"];
  if (!was?.peak) return ["Highest peak", length(peak.value), `at ${hertz(peak.at)}`, "answer-peak"];
  const { name, perMetre } = shownUnit(Math.max(was.peak.value, peak.value));
  const share = peak.value / was.peak.value - 1;
  const change = `${share > 0 ? "+" : "−"}${number(100 * Math.abs(share), 2)} %`;
  return ["Highest peak", `${arrow(number(was.peak.value * perMetre), number(peak.value * perMetre))} ${name}`, `${change}, at ${hertz(peak.at)}${fewer(was)}`, "answer-peak"];
}

const fewer = ({ kept }) => (kept && kept < (designed.request.harmonics ?? 11) ? `; before with ${kept} harmonics` : "");

function bandFigure({ band_hz: band, limit }, was) {
  const comparable = was && was.band_hz !== null && designed.request.limit === undefined;
  const value = band === null ? "–" : `${arrow(comparable ? number(was.band_hz) : null, number(band))} Hz`;
  return ["Resonance band", value, band === null ? "" : `above ${length(limit)}`, "answer-band"];
}

function errorFigure({ peak, ...told }) {
  const error = errorOf({ peak, ...told });
  if (typeof error !== "number") return ["Error estimate", "–", "not known", "answer-error"];
  return ["Error estimate", length(error), peak ? `${number((100 * error) / peak.value, 2)} % of the peak` : "", "answer-error"];
}

// That it can not be lowered further was shown for what it was computed for, and for nothing else.
function certificate({ reached, status, optimality, warnings = [], basins = [] }) {
  if (changedSince("design").length) return ["Certificate", "for earlier values", "not for those set now", "answer-certificate"];
  const residual = typeof optimality === "number" ? ` Optimality residual ${number(optimality, 2)}.` : "";
  const doubts = warnings.length ? ` ${warnings.length === 1 ? "A warning" : `${warnings.length} warnings`}, on the tab Design.` : "";
  const [best, more] = basins.length > 1 ? [`best of ${basins.length}`, " optima found"] : ["optimum", " found"];
  return ["Certificate", reached ? [best, el("span", { class: "beside" }, `${more}${warnings.length ? ", with warnings" : ""}`)] : "not reached", `${status}${residual}${doubts}`, "answer-certificate"];
}

// In spite of what is not known: the worst case of the best nominal design, and of this one.
function robustFigures({ aim, nominal, robust }) {
  const [was, is] = [nominal, robust].map((side) => side?.worst?.peak ?? null);
  const { name, perMetre } = shownUnit(Math.max(was ?? 0, is ?? 0));
  const text = (value) => (value === null ? null : number(value * perMetre));
  return [
    ["Worst peak", is === null ? "–" : `${arrow(text(was), text(is))} ${name}`, robust?.worst?.scenario?.words ? `with ${robust.worst.scenario.words}; before: the nominal design` : aim, "answer-peak"],
    ["Peak, all nominal", robust?.peak ? length(robust.peak.value) : "–", robust?.peak ? `at ${hertz(robust.peak.at)}` : "", "answer-nominal"],
  ];
}

function figures() {
  const { result, request } = designed;
  const was = known() && !request.cases ? before.found : null;
  const loads = Object.entries(result.optimum).map(([path, value]) => {
    const from = request.set?.[path] ?? givenByScene(path);
    return [path, quantity(path, value), from === undefined || from === null ? "" : `from ${quantity(path, from)}`];
  });
  if ("aim" in result) return [...loads, ...robustFigures(result), certificate(result)];
  return [...loads, peakFigure(result, was), bandFigure(result, was), errorFigure(result), certificate(result)];
}
