// The Pareto front of peak against band; a click loads a design.

import { button, byId, el, numeric, scrolledTable } from "../base/dom.js";
import { hertz, length, number, seconds, shownUnit, valuesSaid } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { OF_THE_BAR } from "../scene/kinds.js";
import { load } from "./design.js";
import { view } from "./view.js";

const FAR_APART = 8;
let points = [];
let request = null;
let of = null; // what the peaks are of
let chosen = null;

export const front = view({
  kind: "pareto", id: "front", title: "Peak against band", tabs: "map", priority: 2,
  form: { words: "Compute the front", hide: OF_THE_BAR, top: ["limit", "points"], groups: [{ legend: "Limits, load cases, method", id: "more" }] },
  about: "Designs of which none has both a lower peak and a narrower band than another.",
  work: "front", goes: ({ took, points: count }) => `Front:${took}, ${count} evaluations.`,
  figure: (host) => chart(host, { label: "Front of peak against band", file: "front", onPick: (_point, at) => points[at] && take(at) }),
  scene() {
    [points, chosen] = [[], null];
  },
  result(result, _sweeps, job) {
    ({ request } = job);
    of = result.measured;
    points = [...result.points].sort((a, b) => a.band_hz - b.band_hz);
    if (!points.length) return front.say(result.status, true);
    chosen = null;
    draw();
    const measured = result.limit === null ? "half power of each peak" : length(result.limit);
    return front.say(`${points.length} designs${result.seconds ? ` in ${seconds(result.seconds)}` : ""}, the band at ${measured}. ${result.status}`);
  },
});

// A design of the front becomes that of the scene, and is marked.
function take(at) {
  chosen = at;
  load(points[at].values, request);
  const inside = byId("front-facts").contains(document.activeElement);
  draw();
  if (inside) byId("front-facts").querySelectorAll("button")[at].focus();
}

function draw() {
  const peaks = points.map((p) => p.peak);
  const unit = shownUnit(Math.max(...peaks));
  const log = Math.max(...peaks) > FAR_APART * Math.min(...peaks);
  const limit = request.limit ?? null;
  front.plot.draw({
    x: { name: "resonance band [Hz]", pad: 0.06 },
    y: { name: `highest peak, ${of?.name ?? "amplitude"} [${unit.name}]`, unit, log, pad: 0.12 },
    series: [{ name: "front", x: points.map((p) => p.band_hz), y: points.map((p) => p.peak * unit.perMetre), colour: 1, shape: "circle", size: 4.5 }],
    limits: limit !== null && limit >= 0.5 * Math.min(...peaks) && limit <= 2 * Math.max(...peaks) ? [{ y: limit * unit.perMetre, name: "the band is measured here" }] : [],
    marks: chosen === null ? [] : [{ x: points[chosen].band_hz, y: points[chosen].peak * unit.perMetre, shape: "diamond", colour: 2, text: "loaded" }],
    describe: (x, y, i) => `${valuesSaid(points[i].values)}: peak ${number(y)} ${unit.name}, band ${hertz(x)}. Enter or a click loads it.`,
  });
  front.facts(scrolledTable("Designs of the front", ["design", numeric("peak"), numeric("band"), ""], points.map(({ values, peak, band_hz: band }, i) => [
    el(i === chosen ? "strong" : "span", {}, valuesSaid(values)), numeric(length(peak)), numeric(`${hertz(band)}`),
    button(i === chosen ? "Loaded" : "Load", () => take(i), { "aria-label": `Load the design ${valuesSaid(values)}` })])));
}
