// The frequency response of the study, drawn with the live one: points as they come, then peak, band, limits, files.

import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { saveFrom } from "../base/exports.js";
import { length, number, seconds } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { chosenContact } from "../scene/scenes.js";
import { state } from "../base/address.js";
import { saveToml } from "../base/toml.js";
import { betweenPoints, notes } from "../base/words.js";

const FORMS = [["CSV", "text/csv", "csv"], ["npz", "application/x-npz", "npz"], ["Parquet", "application/vnd.apache.parquet", "parquet"]];
let limits = null;
let last = null;
let asking = null;
let points = [];

export function startResponse() {
  asking = previewer("limits", (answer, { token }) => {
    if (token !== state.scene) return;
    limits = answer;
    redraw();
    if (last) describe();
  }, () => undefined);
  on("scene", () => {
    [limits, last, points] = [null, null, []];
    say("response-status", "No sweep yet: it is drawn with the live response, point by point, and stored.");
    show(byId("response-facts"));
    redraw();
  });
}

export const sweepView = {
  submitted(job) {
    points = [];
    const { scene, set, harmonics } = job.request;
    asking({ kind: "limits", scene, set: set ?? {}, harmonics: harmonics ?? 11, contact: chosenContact() }, state.scene);
  },
  waiting: () => say("response-status", "The sweep waits for a worker."),
  progress: ({ took, points: count }) => say("response-status", `Sweep:${took}; ${count} points.`),
  points({ start, points: more }) {
    points.length = Math.min(points.length, start);
    points.push(...more);
    partly();
  },
  result(result, sweeps, job) {
    last = { result, sweep: sweeps[0], request: job.request };
    say("response-status", `${result.points} points in ${seconds(result.seconds)}. ${result.status}`);
    redraw();
    describe();
    if (result.peak) tell("peak", result.peak.at);
  },
  failed: (text) => say("response-status", text, true),
};

// A line until it is done; then a response with its peak, its band and its linear limits.
function partly() {
  if (points.length > 1) tell("study-curve", { answer: null, line: { name: "on its way", x: points.map(([at]) => at), y: points.map(([, amplitude]) => amplitude), colour: 7 } });
}

function redraw() {
  tell("study-curve", last ? { answer: last.result, request: last.request, limits } : null);
}

function describe() {
  const { result, sweep } = last;
  const linearPeak = (name) => (limits?.[name]?.peak ? `${length(limits[name].peak.value)} at ${number(limits[name].peak.at, 5)} Hz` : "–");
  const rows = [
    [result.peak && !result.peaks.some((peak) => peak.at === result.peak.at) ? "highest, at an end" : "highest peak", result.peak ? `${length(result.peak.value)} at ${number(result.peak.at, 6)} Hz` : "–"],
    ["resonance band", result.band_hz === null ? "–" : `${number(result.band_hz)} Hz above ${length(result.band_limit)}`],
    ["error estimate", result.error_estimate === null ? "–" : length(result.error_estimate)],
    ...betweenPoints(result),
    ...notes(result),
    ...(result.marks ?? []).map((mark) => [mark.kind.replaceAll("_", " "), `${length(mark.amplitude)} at ${number(mark.at, 6)} Hz`]),
    ["removed, linear", linearPeak("free")],
    ["stuck, linear", linearPeak("stuck")],
  ];
  const files = sweep
    ? el("div", { class: "row" }, el("span", { class: "note" }, "Sweep with all its arrays:"),
        FORMS.map(([name, type, suffix]) =>
          el("button", { type: "button", onclick: () => saveFrom(`/v1/sweeps/${sweep.id}`, type, `sweep-${sweep.id}.${suffix}`) }, name)),
        el("button", { type: "button", onclick: () => saveToml(`sweep-${sweep.id}.toml`) }, "TOML that reproduces it"))
    : null;
  show(byId("response-facts"), facts(rows), files);
}
