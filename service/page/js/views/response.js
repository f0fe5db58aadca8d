// The frequency response of the study, drawn with the live one: points as they come, then peak, band, limits, files.

import { state, tell } from "../base/state.js";
import { button, el, facts } from "../base/dom.js";
import { saveFrom, saveToml } from "../base/exports.js";
import { betweenPoints, hertz, length, measured, notes, seconds } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { OF_THE_BAR } from "../scene/kinds.js";
import { chosenContact, current } from "../scene/scenes.js";
import { view } from "./view.js";

const FORMS = [["CSV", "text/csv", "csv"], ["npz", "application/x-npz", "npz"], ["Parquet", "application/vnd.apache.parquet", "parquet"]];
let limits = null;
let last = null;
let asking = null;
let points = [];

export const response = view({
  kind: "sweep", id: "response", title: "Response of the study", tabs: "response", wide: true, priority: 6,
  form: { words: "Compute the response", hide: [...OF_THE_BAR, "frequency_hz"], fold: "Settings" },
  about: "No sweep yet: it is drawn with the live response, point by point, and stored.",
  work: "sweep", goes: ({ took, points: count }) => `Sweep:${took}; ${count} points.`,
  start() {
    asking = previewer("limits", (answer, { token }) => {
      if (token !== state.scene) return;
      limits = answer;
      redraw();
      if (last) describe();
    }, () => undefined);
  },
  scene() {
    [limits, last, points] = [null, null, []];
    redraw();
  },
  submitted(job) {
    points = [];
    const { scene, set, harmonics } = job.request;
    // Dampers move by themselves: without friction they have no place.
    if (!current.body.dampers?.length) asking({ kind: "limits", scene, set: set ?? {}, harmonics: harmonics ?? 11, contact: chosenContact() }, state.scene);
  },
  // A line until it is done; then a response with its peak, its band and its linear limits.
  points({ start, points: more }) {
    points.length = Math.min(points.length, start);
    points.push(...more);
    if (points.length > 1) tell("study-curve", { answer: null, line: { name: "on its way", x: points.map(([at]) => at), y: points.map(([, amplitude]) => amplitude), colour: 7 } });
  },
  result(result, sweeps, job) {
    last = { result, sweep: sweeps[0], request: job.request };
    response.say(`${result.points} points in ${seconds(result.seconds)}. ${result.status}`);
    redraw();
    describe();
    if (result.peak) tell("peak", result.peak.at);
  },
});

function redraw() {
  tell("study-curve", last ? { answer: last.result, request: last.request, limits } : null);
}

function describe() {
  const { result, sweep } = last;
  const linearPeak = (name) => (limits?.[name]?.peak ? `${length(limits[name].peak.value)} at ${hertz(limits[name].peak.at)}` : "–");
  const rows = [
    [result.peak && !result.peaks.some((peak) => peak.at === result.peak.at) ? "highest, at an end" : "highest peak", result.peak ? `${measured(result.peak.value, "m", result.error_estimate)} at ${hertz(result.peak.at)}` : "–"],
    ["resonance band", result.band_hz === null ? "–" : `${hertz(result.band_hz)} above ${length(result.band_limit)}`],
    ...betweenPoints(result),
    ...notes(result),
    ...(result.marks ?? []).map((mark) => [mark.kind.replaceAll("_", " "), `${length(mark.amplitude)} at ${hertz(mark.at)}`]),
    ...(limits ? [["removed, linear", linearPeak("free")], ["stuck, linear", linearPeak("stuck")]] : []),
  ];
  const files = sweep
    ? el("div", { class: "row" }, el("span", { class: "note" }, "Sweep with all its arrays:"),
        FORMS.map(([name, type, suffix]) => button(name, () => saveFrom(`/v1/sweeps/${sweep.id}`, type, `sweep-${sweep.id}.${suffix}`))),
        button("TOML that reproduces it", () => saveToml(`sweep-${sweep.id}.toml`)))
    : null;
  response.facts(facts(rows), files);
}
