// What the page draws of the worst mistuning, in the card of other studies.

import { number } from "../base/format.js";
import { view as viewOf } from "../views/view.js";

export const view = viewOf({ kind: "worst-mistuning", drawings: drawn });

// The factors of the worst pattern blade by blade, and what patterns make of the tuned peak.
function drawn(result) {
  if (!result.worst) return [];
  const blades = (one, name, more) => ({ name, x: one.factors.map((_, i) => i), y: one.factors.map((factor) => 100 * (factor - 1)), colour: 1, ...more });
  const also = result.residual ? [blades(result.residual, "with forces left in contacts", { colour: 2, shape: "diamond", size: 4.5, width: 0 })] : [];
  const wide = 100 * result.within;
  const rows = [
    { name: "worst", alone: result.worst.magnification, top: null },
    ...(result.residual ? [{ name: "forces left", alone: result.residual.magnification, top: null }] : []),
    ...result.patterns.map((one) => ({ name: one.pattern, alone: one.disk.magnification, top: one.worst?.magnification ?? null })),
  ];
  const places = rows.map((_, i) => i);
  const bounds = [["whitehead", "Whitehead's bound"], ["martel", "Martel's bound"]].filter(([key]) => result[key] !== null && result[key] < 2 * result.whitehead);
  const top = Math.max(...rows.map((row) => Math.max(row.alone, row.top ?? 0)), ...bounds.map(([key]) => result[key]));
  return [
    {
      label: "Factors of the worst disk", file: "worst-factors",
      draw: {
        x: { name: "blade", low: -0.6, high: result.worst.factors.length - 0.4, whole: true },
        y: { name: `factor of ${result.of.join(", ")} − 1 [%]`, low: -1.1 * wide, high: 1.1 * wide },
        series: [blades(result.worst, "worst", { bars: true, width: 0 }), ...also],
        describe: (i, y) => `blade ${i}: ${number(y, 4)} %`,
      },
    },
    {
      label: "Magnification of the peak", file: "worst-magnification",
      draw: {
        x: { name: "", low: -0.6, high: rows.length - 0.4, whole: true, names: Object.fromEntries(rows.map((row, i) => [i, row.name])) },
        y: { name: "peak / tuned peak", low: 0, high: 1.12 * top },
        series: [
          { name: "alone", x: places, y: rows.map((row) => row.alone), colour: 1, bars: true, width: 0 },
          ...(rows.some((row) => row.top !== null) ? [{ name: "with the worst mistuning on top", x: places, y: rows.map((row) => row.top), colour: 2, shape: "triangle", size: 5, width: 0 }] : []),
        ],
        limits: [{ y: 1, name: "tuned" }, ...bounds.map(([key, name]) => ({ y: result[key], name }))],
        describe: (i, y) => `${rows[i].name}: ${number(y, 4)}`,
      },
    },
  ];
}
