// The Campbell diagram: where engine orders meet the peaks of the response with friction.

import { facts } from "../base/dom.js";
import { tell } from "../base/state.js";
import { hertz, length, notes, number, warnings } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { view } from "./view.js";

export const campbell = view({
  kind: "campbell", id: "campbell", title: "Campbell diagram", tabs: "disk", priority: 3, pressed: true,
  form: { words: "Draw the diagram", fold: "Settings" },
  about: "Where engine orders meet the peaks of the response with friction.",
  work: "diagram", goes: ({ took }) => `Orders:${took}.`,
  figure: (host) => chart(host, { label: "Campbell diagram", file: "campbell", height: 340, onPick: ({ y }) => tell("point", y) }),
  result(result) {
    const [low, high] = [Math.min(...result.speeds_rpm.map((r) => r[0])), Math.max(...result.speeds_rpm.map((r) => r[1]))];
    const top = result.orders.reduce((most, o) => Math.max(most, ...o.peaks.map((p) => p.at)), 0) * 1.35;
    const lines = result.orders.map((o, i) => ({
      name: `order ${o.order}`, x: [low, high], y: [(o.order * low) / 60, (o.order * high) / 60], colour: 1 + (i % 7), dash: [undefined, "dashed", "dotted"][i % 3], bare: true,
    }));
    const crossings = result.orders.flatMap((o) => o.crossings.map((c) => ({ ...c, order: o.order })));
    campbell.plot.draw({
      x: { name: "running speed [1/min]", low, high },
      y: { name: "frequency [Hz]", zero: true, low: 0, high: top },
      series: [
        { name: "peak met", x: crossings.map((c) => c.speed_rpm), y: crossings.map((c) => c.frequency_hz), colour: 7, shape: "diamond", size: 4.5, width: 0 },
        ...lines,
        natural(result, "stuck_hz", "all stuck", 3, low, high),
        natural(result, "open_hz", "all open", 4, low, high),
      ],
      bands: result.orders.flatMap((o) => o.exceeded_rpm),
      describe: (x, y, i) => `order ${crossings[i].order} meets ${length(crossings[i].amplitude)} at ${number(x, 5)} /min, ${hertz(y)}`,
    });
    campbell.say(`Shaded: speeds at which the amplitude is above ${result.limit === null ? "half power of the order's peak" : length(result.limit)}.`);
    campbell.facts(facts([
      ...crossings.map((c) => [`order ${c.order}`, `${length(c.amplitude)} at ${number(c.speed_rpm, 5)} /min, ${hertz(c.frequency_hz)}`]),
      ...notes({ notes: result.notes }), ...warnings(result.orders.map((o) => o.peak_certificate)),
    ]));
  },
});

// Natural frequencies of every order, each drawn around the speeds at which its order meets it.
function natural(result, name, words, colour, low, high) {
  const wide = 0.05 * (high - low);
  const all = result.orders.flatMap(({ order, [name]: frequencies }) => frequencies.map((f) => [(60 * f) / order, f]));
  const x = all.flatMap(([speed]) => [Math.max(speed - wide, low), Math.min(speed + wide, high), null]);
  return { name: words, x, y: all.flatMap(([, f]) => [f, f, null]), colour, bare: true, width: 3 };
}
