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

export function startFront() {
  plot = chart(byId("front-figure"), {
    label: "Front of peak against band",
    file: "front",
    height: 300,
    onPick: (_point, at) => points[at] && load(points[at].values, request),
  });
  on("scene", () => {
    points = [];
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
    points = [...result.points].sort((a, b) => a.band_hz - b.band_hz);
    if (!points.length) return say("front-status", result.status, true);
    const peaks = points.map((p) => p.peak);
    const unit = lengthUnit(Math.max(...peaks));
    const log = Math.max(...peaks) > FAR_APART * Math.min(...peaks);
    const words = (p) => Object.entries(p.values).map(([path, v]) => `${path} ${quantity(path, v)}`).join(", ");
    plot.draw({
      x: { name: "resonance band [Hz]", pad: 0.06 },
      y: { name: `highest peak [${unit.name}]`, log, pad: 0.12 },
      series: [{ name: "front", x: points.map((p) => p.band_hz), y: points.map((p) => p.peak * unit.perMetre), colour: 1, shape: "circle", size: 4.5 }],
      describe: (x, y, i) => `${words(points[i])}: peak ${number(y)} ${unit.name}, band ${number(x)} Hz. Enter or a click loads it.`,
    });
    say("front-status", `${points.length} designs${result.seconds ? ` in ${seconds(result.seconds)}` : ""}. ${result.status}`);
    show(
      byId("front-facts"),
      el("div", { class: "scroll", role: "region", "aria-label": "Designs of the front", tabindex: 0 },
        table(["design", { text: "peak", number: true }, { text: "band", number: true }, ""],
          points.map((p) => [words(p), { text: length(p.peak), number: true }, { text: `${number(p.band_hz)} Hz`, number: true },
            el("button", { type: "button", "aria-label": `Load the design ${words(p)}`, onclick: () => load(p.values, request) }, "Load")]),
          "Designs of the front")),
    );
    return undefined;
  },
  failed: (text) => say("front-status", text, true),
};
