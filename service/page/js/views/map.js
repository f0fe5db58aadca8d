// The map of the response over load and frequency, with the ridge of its peaks and the optimum.

import { byId, facts, note } from "../base/dom.js";
import { on, tell } from "../base/state.js";
import { length, nearestIn, notes, number, quantity, seconds, warnings, withUnit } from "../base/format.js";
import { heatmap, shadeStrip } from "../charts/heatmap.js";
import { OF_THE_BAR } from "../scene/kinds.js";
import { load } from "./design.js";
import { view } from "./view.js";

let last = null;
let request = null;
let optimum = null;

export const map = view({
  kind: "map", id: "map", title: "Map of load and frequency", tabs: "map", priority: 4, pressed: true,
  form: { words: "Draw the map", hide: OF_THE_BAR, fold: "Settings" },
  about: "60 loads × 400 frequencies, with the peaks followed from load to load.",
  work: "map", goes: ({ took, points }) => `Map:${took}; ${points} points.`,
  figure: (host) => heatmap(host, { label: "Map of amplitude over frequency and load", file: "map", height: 420, onPick({ x, y }) {
    load({ [last.parameter_path]: y }, request);
    tell("point", x);
  } }),
  start: () => on("optimum", (found) => {
    optimum = found;
    if (last) draw();
  }),
  scene() {
    [last, optimum] = [null, null];
  },
  result(result, _sweeps, job) {
    ({ request } = job);
    last = result;
    draw();
    const count = result.parameter.length * result.frequency.length;
    map.say(`${count} points in ${seconds(result.seconds)}, drawn in ${number(map.plot.milliseconds, 3)} ms. ${result.status}`);
    byId("map-figure").dataset.milliseconds = map.plot.milliseconds.toFixed(1);
  },
});

function draw() {
  const { parameter_path: path, ridge } = last;
  const values = last.parameter;
  const log = values[0] > 0 && values[values.length - 1] / values[0] > 5;
  const at = ridge?.optimum ?? null;
  const marks = [];
  if (at) marks.push({ x: ridge.frequency[nearestIn(ridge.parameter, at.at)], y: at.at, text: `least peak ${length(at.peak)}` });
  else if (optimum?.values[path] && optimum.peak) marks.push({ x: optimum.peak.at, y: optimum.values[path], text: "optimum" });
  map.plot.draw({
    x: { name: "frequency [Hz]", values: last.frequency },
    y: { name: withUnit(path), values, log },
    rows: last.amplitude,
    lines: ridge ? [...(ridge.competing ?? []).map((line) => ({ x: line.frequency, y: line.parameter, dash: true })), broken(ridge)] : [],
    marks,
  });
  const rows = [["ridge", ridge ? "solid: the highest peak; dashed: peaks that compete" : "not tracked"]];
  if (at) rows.push(["least peak", `${length(at.peak)} at ${quantity(path, at.at)}`]);
  if (at?.plateau) rows.push(["as good", at.plateau.map((v) => quantity(path, v)).join(" to ")], ["chosen by", at.chosen_by]);
  rows.push(...notes({ notes: last.notes }), ...warnings((ridge?.peaks_open ?? []).map((reason) => ({ known: false, reason }))));
  map.facts(shadeStrip(map.plot.range), facts(rows),
    note("A click loads the load there and shows its loops at that frequency. A rectangle drawn with the mouse is zoomed, Shift and a drag move the map."));
}

// The ridge with gaps where another peak becomes the highest.
function broken({ frequency, parameter, exchanges }) {
  const gap = (i) => i && exchanges.some(({ at }) => at >= parameter[i - 1] && at <= parameter[i]);
  const [x, y] = [frequency, parameter].map((all) => all.flatMap((value, i) => (gap(i) ? [null, value] : [value])));
  return { x, y };
}
