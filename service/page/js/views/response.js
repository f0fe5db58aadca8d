// The frequency response of the study: points as they come, then peak, band, linear limits, files.

import { chart } from "../charts/chart.js";
import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { saveFrom } from "../base/exports.js";
import { length, number, seconds } from "../base/format.js";
import { responseOf, throughPeak } from "../charts/curves.js";
import { previewer } from "../network/previews.js";
import { chosenContact, current } from "../scene/scenes.js";
import { state } from "../base/address.js";
import { saveToml } from "../base/toml.js";
import { betweenPoints, notes } from "../base/words.js";

const FORMS = [["CSV", "text/csv", "csv"], ["npz", "application/x-npz", "npz"], ["Parquet", "application/vnd.apache.parquet", "parquet"]];
let plot = null;
let limits = null;
let last = null;
let asking = null;
let points = [];

export function startResponse() {
  plot = chart(byId("response-figure"), {
    label: "Frequency response",
    file: "response",
    height: 320,
    link: "frequency",
    onPick: ({ x }) => tell("point", x),
  });
  asking = previewer("limits", (answer, { token }) => {
    if (token !== state.scene) return;
    limits = answer;
    redraw();
    if (last) describe();
  }, () => undefined);
  on("scene", () => {
    [limits, last, points] = [null, null, []];
    say("response-status", "Press the button above: the sweep arrives here point by point.");
    show(byId("response-facts"));
    plot.clear();
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
  result(result, sweeps) {
    last = { result, sweep: sweeps[0] };
    say("response-status", `${result.points} points in ${seconds(result.seconds)}. ${result.status}`);
    redraw();
    describe();
    if (result.peak) tell("peak", result.peak.at);
  },
  failed: (text) => say("response-status", text, true),
};

function partly() {
  if (points.length < 2) return;
  const amplitude = points.map((p) => p[1]);
  const highest = Math.max(...amplitude);
  const at = points[amplitude.indexOf(highest)][0];
  plot.draw({ ...responseOf({ parameter: points.map((p) => p[0]), amplitude, peak: { value: highest, at } }), marks: [] });
}

// A narrow resonance may lie between two points of a linear response: the line goes to its top all the same.
function lineOf(answer) {
  const { parameter: x, amplitude: y } = throughPeak(answer);
  return { x, y };
}

// The linear limits rise far above: the frame stays with the response with friction.
function redraw() {
  if (!last || !current.body) return;
  const { result } = last;
  const more = limits
    ? [
        { name: "removed (linear)", ...lineOf(limits.free), colour: 7, dash: "dotted", bare: true },
        { name: "stuck (linear)", ...lineOf(limits.stuck), colour: 3, dash: "dashed", bare: true },
      ]
    : [];
  const shown = responseOf(result, more);
  const own = shown.series.filter((line) => !line.bare).flatMap((line) => line.y);
  const top = own.reduce((a, b) => Math.max(a, b), 0) * (more.length ? 1.7 : 1.15);
  plot.draw({ ...shown, y: { ...shown.y, high: top } });
}

function describe() {
  const { result, sweep } = last;
  const linearPeak = (name) => (limits?.[name]?.peak ? `${length(limits[name].peak.value)} at ${number(limits[name].peak.at, 5)} Hz` : "–");
  const rows = [
    ["highest peak", result.peak ? `${length(result.peak.value)} at ${number(result.peak.at, 6)} Hz` : "–"],
    ["resonance band", result.band_hz === null ? "–" : `${number(result.band_hz)} Hz above ${length(result.band_limit)}`],
    ["error estimate", result.error_estimate === null ? "–" : length(result.error_estimate)],
    ...betweenPoints(result),
    ...notes([...(result.mean_undetermined ? ["mean_undetermined"] : []), ...(result.flags ?? [])]),
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
