// What the stress margins of dampers are drawn as, in the card of other studies.

import { known, seriesColour, scaled } from "../charts/curves.js";
import { number, times } from "../base/format.js";
import { view } from "./view.js";

export const margin = view({ kind: "margin", drawings: drawn });

// A curve with the excitation that is allowed among its points.
function through(x, y, one, of) {
  const after = one.allowed === null ? -1 : x.findIndex((level) => level > one.allowed);
  return after < 0 ? { x, y } : { x: x.toSpliced(after, 0, one.allowed), y: y.toSpliced(after, 0, of(one)) };
}

// Stress over the excitation of several dampers, and its share of what is allowed.
function drawn(result) {
  const { name, factor, unit } = scaled(result.stress, result.unit);
  const what = result.judged_by === "utilisation" ? "alternating stress" : "amplitude";
  const x = { name: `excitation [${result.level_unit}]`, log: true };
  const lines = (rows, by, of) => rows.map((row, i) => ({ name: result.allowed[i].name, ...through(result.level, row.map(times(by)), result.allowed[i], of), colour: seriesColour(i), shape: "circle", size: 2.4 }));
  const marks = result.allowed.flatMap((one, i) => (one.allowed === null ? [] : [{ ...one, colour: seriesColour(i) }]));
  const drawings = [{
    label: `${what[0].toUpperCase()}${what.slice(1)} over the excitation`, file: "margin",
    draw: {
      x, y: { name: `${what} [${name}]`, unit, zero: true, low: 0, pad: 0.08 }, series: lines(result.stress, factor, (one) => one.value * factor),
      marks: marks.map((one) => ({ x: one.allowed, y: one.value * factor, colour: one.colour })),
    },
  }];
  if (!known(result.used).length) return drawings;
  return [...drawings, {
    label: "Share of what is allowed", file: "margin-used",
    draw: {
      x, y: { name: "share of what is allowed", low: 0, high: Math.min(Math.max(...known(result.used), 1.1), 3) }, series: lines(result.used, 1, () => 1),
      limits: [{ y: 1, name: "margin 1" }],
      marks: marks.map((one) => ({ x: one.allowed, y: 1, colour: one.colour, text: `${number(one.allowed, 4)} ${result.level_unit}` })),
    },
  }];
}

