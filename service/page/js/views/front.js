// The Pareto front of peak against band; a click loads a design.

import { chart } from "../charts/chart.js";
import { load } from "./design.js";
import { byId, el, say, show, table } from "../base/dom.js";
import { on } from "../base/events.js";
import { length, lengthUnit, number, quantity, seconds } from "../base/format.js";

const FAR_APART = 8;
let plot = null;
let points = [];
let request = null;
let of = null; // what the peaks are of

let chosen = null;

export function startFront() {
  plot = chart(byId("front-figure"), {
    label: "Front of peak against band",
    file: "front",
    height: 300,
    onPick: (_point, at) => points[at] && take(at),
  });
  on("scene", () => {
    [points, chosen] = [[], null];
    plot.clear();
    say("front-status", "Designs of which none has both a lower peak and a narrower band than another.");
    show(byId("front-facts"));
  });
}

export const frontView = {
  waiting: () => say("front-status", "The front waits for a worker."),
  progress: ({ took, points: count }) => say("front-status", `Front:${took}, ${count} evaluations.`),
  result(result, _sweeps, job) {
    ({ request } = job);
    of = result.measured;
    points = [...result.points].sort((a, b) => a.band_hz - b.band_hz);
    if (!points.length) return say("front-status", result.status, true);
    chosen = null;
    draw();
    const measured = result.limit === null ? "half power of each peak" : length(result.limit);
    say("front-status", `${points.length} designs${result.seconds ? ` in ${seconds(result.seconds)}` : ""}, the band at ${measured}. ${result.status}`);
    return undefined;
  },
  failed: (text) => say("front-status", text, true),
};

const words = (p) => Object.entries(p.values).map(([path, v]) => `${path} ${quantity(path, v)}`).join(", ");

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
  const unit = lengthUnit(Math.max(...peaks));
  const log = Math.max(...peaks) > FAR_APART * Math.min(...peaks);
  const limit = request.limit ?? null;
  plot.draw({
    x: { name: "resonance band [Hz]", pad: 0.06 },
    y: { name: `highest peak, ${of?.name ?? "amplitude"} [${unit.name}]`, unit, log, pad: 0.12 },
    series: [{ name: "front", x: points.map((p) => p.band_hz), y: points.map((p) => p.peak * unit.perMetre), colour: 1, shape: "circle", size: 4.5 }],
    limits: limit !== null && limit >= 0.5 * Math.min(...peaks) && limit <= 2 * Math.max(...peaks) ? [{ y: limit * unit.perMetre, name: "the band is measured here" }] : [],
    marks: chosen === null ? [] : [{ x: points[chosen].band_hz, y: points[chosen].peak * unit.perMetre, shape: "diamond", colour: 2, text: "loaded" }],
    describe: (x, y, i) => `${words(points[i])}: peak ${number(y)} ${unit.name}, band ${number(x)} Hz. Enter or a click loads it.`,
  });
  show(
    byId("front-facts"),
    el("div", { class: "scroll", role: "region", "aria-label": "Designs of the front", tabindex: 0 },
      table(["design", { text: "peak", number: true }, { text: "band", number: true }, ""],
        points.map((p, i) => [el(i === chosen ? "strong" : "span", {}, words(p)), { text: length(p.peak), number: true }, { text: `${number(p.band_hz)} Hz`, number: true },
          el("button", { type: "button", "aria-label": `Load the design ${words(p)}`, onclick: () => take(i) }, i === chosen ? "Loaded" : "Load")]),
        "Designs of the front")),
  );
}
