// The card of the page that shows what accuracy costs.

import { hertz, number } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { view as viewOf } from "../views/view.js";

export const view = viewOf({
  kind: "accuracy", id: "accuracy", title: "What accuracy costs", tabs: "accuracy", priority: 3, pressed: true,
  form: { words: "Measure it", fold: "Settings" },
  about: "Error against time for numbers of harmonics, in closed form and by samples.",
  work: "study", goes: ({ took }) => `Measuring:${took}.`,
  figure: (host) => chart(host, { label: "Error against time", file: "accuracy", height: 320 }),
  result(result) {
    const rows = result.rows.filter((row) => row.error !== null && row.milliseconds !== null);
    const share = (row) => Math.max(row.error / result.reference, 1e-14);
    const exact = rows.filter((row) => row.evaluator === "closed form").sort((a, b) => a.harmonics - b.harmonics);
    const sampled = rows.filter((row) => row.samples > 0);
    const followed = rows.filter((row) => row.evaluator === "exact");
    view.plot.draw({
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
    view.say(`At ${hertz(result.frequency_hz)}, against ${result.reference_harmonics ? `${result.reference_harmonics} harmonics` : "the exact solution"}. ${result.status ?? ""}`);
  },
});
