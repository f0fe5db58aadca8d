// The map of the response over load and frequency, with the ridge of its peaks and the optimum.

import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { length, number, quantity, seconds, withUnit } from "../base/format.js";
import { heatmap, shadeStrip } from "../charts/heatmap.js";
import { load } from "./design.js";
import { notes, warnings } from "../base/words.js";

let plot = null;
let last = null;
let request = null;
let optimum = null;

export function startMap() {
  plot = heatmap(byId("map-figure"), {
    label: "Map of amplitude over frequency and load",
    file: "map",
    height: 420,
    onPick: ({ x, y }) => {
      load({ [last.parameter_path]: y }, request);
      tell("point", x);
    },
  });
  on("scene", () => {
    [last, optimum] = [null, null];
    plot.clear();
    say("map-status", "60 loads × 400 frequencies, with the peaks followed from load to load.");
    show(byId("map-facts"));
  });
  on("optimum", (found) => {
    optimum = found;
    if (last) draw();
  });
}

export const mapView = {
  waiting: () => say("map-status", "The map waits for a worker."),
  progress: ({ took, points }) => say("map-status", `Map:${took}; ${points} points.`),
  result(result, _sweeps, job) {
    ({ request } = job);
    last = result;
    draw();
    const count = result.parameter.length * result.frequency.length;
    say("map-status", `${count} points in ${seconds(result.seconds)}, drawn in ${number(plot.milliseconds, 3)} ms. ${result.status}`);
    byId("map-figure").dataset.milliseconds = plot.milliseconds.toFixed(1);
  },
  failed: (text) => say("map-status", text, true),
};

function draw() {
  const { parameter_path: path, ridge } = last;
  const values = last.parameter;
  const log = values[0] > 0 && values[values.length - 1] / values[0] > 5;
  const at = ridge?.optimum ?? null;
  const marks = [];
  if (at) marks.push({ x: frequencyAt(ridge, at.at), y: at.at, text: `least peak ${length(at.peak)}` });
  else if (optimum?.values[path] && optimum.peak) marks.push({ x: optimum.peak.at, y: optimum.values[path], text: "optimum" });
  plot.draw({
    x: { name: "frequency [Hz]", values: last.frequency },
    y: { name: withUnit(path), values, log },
    rows: last.amplitude,
    lines: ridge
      ? [
          ...(ridge.competing ?? []).map((line) => ({ x: line.frequency, y: line.parameter, dash: true })),
          broken(ridge),
        ]
      : [],
    marks,
  });
  const rows = [["ridge", ridge ? "solid: the highest peak; dashed: peaks that compete" : "not tracked"]];
  if (at) rows.push(["least peak", `${length(at.peak)} at ${quantity(path, at.at)}`]);
  if (ridge?.optimum?.plateau) rows.push(["as good", ridge.optimum.plateau.map((v) => quantity(path, v)).join(" to ")], ["chosen by", ridge.optimum.chosen_by]);
  rows.push(...notes({ notes: last.notes }), ...warnings((ridge?.peaks_open ?? []).map((reason) => ({ known: false, reason }))));
  show(byId("map-facts"), shadeStrip(plot.range), facts(rows),
    el("p", { class: "note" }, "A click loads the load there and shows its loops at that frequency. A rectangle drawn with the mouse is zoomed, Shift and a drag move the map."));
}

// The ridge with gaps where another peak becomes the highest.
function broken({ frequency, parameter, exchanges }) {
  const [x, y] = [[], []];
  parameter.forEach((value, i) => {
    const before = parameter[i - 1];
    if (i && exchanges.some(({ at }) => at >= before && at <= value)) {
      x.push(null);
      y.push(null);
    }
    x.push(frequency[i]);
    y.push(value);
  });
  return { x, y };
}

function frequencyAt({ parameter, frequency }, wanted) {
  let best = 0;
  parameter.forEach((value, i) => {
    if (Math.abs(value - wanted) < Math.abs(parameter[best] - wanted)) best = i;
  });
  return frequency[best];
}
