// What accuracy costs, and the Campbell diagram.

import { chart } from "../charts/chart.js";
import { byId, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { length, number } from "../base/format.js";
import { notes, warnings } from "../base/words.js";

let costs = null;
let speeds = null;

export function startStudies() {
  costs = chart(byId("accuracy-figure"), { label: "Error against time", file: "accuracy", height: 320 });
  speeds = chart(byId("campbell-figure"), { label: "Campbell diagram", file: "campbell", height: 340, onPick: ({ y }) => tell("point", y) });
  on("scene", () => {
    for (const plot of [costs, speeds]) {
      plot.clear();
    }
    say("accuracy-status", "Error against time for numbers of harmonics, in closed form and by samples.");
    say("campbell-status", "Where engine orders meet the peaks of the response with friction.");
    show(byId("campbell-facts"));
  });
}

export const accuracyView = {
  waiting: () => say("accuracy-status", "The study waits for a worker."),
  progress: ({ took }) => say("accuracy-status", `Measuring:${took}.`),
  result(result) {
    const rows = result.rows.filter((row) => row.error !== null && row.milliseconds !== null);
    const share = (row) => Math.max(row.error / result.reference, 1e-14);
    const exact = rows.filter((row) => row.evaluator === "closed form").sort((a, b) => a.harmonics - b.harmonics);
    const sampled = rows.filter((row) => row.samples > 0);
    const followed = rows.filter((row) => row.evaluator === "exact");
    costs.draw({
      x: { name: "time of a point [ms]", log: true, pad: 0.06 },
      y: { name: "relative error", log: true, pad: 0.08 },
      series: [
        { name: "closed form", x: exact.map((r) => r.milliseconds), y: exact.map(share), colour: 1, shape: "circle", size: 4 },
        { name: "by samples", x: sampled.map((r) => r.milliseconds), y: sampled.map(share), colour: 2, shape: "triangle", size: 3.5, width: 0 },
        { name: "exact", x: followed.map((r) => r.milliseconds), y: followed.map(share), colour: 3, shape: "square", size: 5, width: 0 },
      ],
      marks: exact.filter((_, i) => i === 0 || i === exact.length - 1).map((r) => ({ x: r.milliseconds, y: share(r), text: `H = ${r.harmonics}`, colour: 1 })),
      describe: (x, y, i) => `H = ${exact[i].harmonics}: ${number(100 * y, 3)} % in ${number(x, 3)} ms`,
    });
    say("accuracy-status", `At ${number(result.frequency_hz, 6)} Hz, against ${result.reference_harmonics ? `${result.reference_harmonics} harmonics` : "the exact solution"}. ${result.status ?? ""}`);
  },
  failed: (text) => say("accuracy-status", text, true),
};

export const campbellView = {
  waiting: () => say("campbell-status", "The diagram waits for a worker."),
  progress: ({ took }) => say("campbell-status", `Orders:${took}.`),
  result(result) {
    const [low, high] = [Math.min(...result.speeds_rpm.map((r) => r[0])), Math.max(...result.speeds_rpm.map((r) => r[1]))];
    const top = result.orders.reduce((most, o) => Math.max(most, ...o.peaks.map((p) => p.at)), 0) * 1.35;
    const lines = result.orders.map((o, i) => ({
      name: `order ${o.order}`, x: [low, high], y: [(o.order * low) / 60, (o.order * high) / 60], colour: 1 + (i % 7), dash: [undefined, "dashed", "dotted"][i % 3], bare: true,
    }));
    const crossings = result.orders.flatMap((o) => o.crossings.map((c) => ({ ...c, order: o.order })));
    speeds.draw({
      x: { name: "running speed [1/min]", low, high },
      y: { name: "frequency [Hz]", zero: true, low: 0, high: top },
      series: [
        { name: "peak met", x: crossings.map((c) => c.speed_rpm), y: crossings.map((c) => c.frequency_hz), colour: 7, shape: "diamond", size: 4.5, width: 0 },
        ...lines,
        natural(result, "stuck_hz", "all stuck", 3, low, high),
        natural(result, "open_hz", "all open", 4, low, high),
      ],
      bands: result.orders.flatMap((o) => o.exceeded_rpm),
      describe: (x, y, i) => `order ${crossings[i].order} meets ${length(crossings[i].amplitude)} at ${number(x, 5)} /min, ${number(y, 5)} Hz`,
    });
    say("campbell-status", `Shaded: speeds at which the amplitude is above ${result.limit === null ? "half power of the order's peak" : length(result.limit)}.`);
    show(byId("campbell-facts"), facts([
      ...crossings.map((c) => [`order ${c.order}`, `${length(c.amplitude)} at ${number(c.speed_rpm, 5)} /min, ${number(c.frequency_hz, 5)} Hz`]),
      ...notes({ notes: result.notes }), ...warnings(result.orders.map((o) => o.peak_certificate)),
    ]));
  },
  failed: (text) => say("campbell-status", text, true),
};

// Natural frequencies of every order, each drawn around the speeds at which its order meets it.
function natural(result, name, words, colour, low, high) {
  const [x, y] = [[], []];
  for (const o of result.orders) {
    for (const f of o[name]) {
      const speed = (60 * f) / o.order;
      const wide = 0.05 * (high - low);
      x.push(Math.max(speed - wide, low), Math.min(speed + wide, high), null);
      y.push(f, f, null);
    }
  }
  return { name: words, x, y, colour, bare: true, width: 3 };
}

