// What the page draws of a study of wear, in the card of other studies.

import { number, times } from "../base/format.js";
import { known, scaled, seriesColour } from "../charts/curves.js";
import { view as viewOf } from "../views/view.js";

export const view = viewOf({ kind: "wear", drawings: drawn });

// Amplitude, loads and depths of worn contacts over hours.
function drawn(result) {
  const height = scaled([result.amplitude, [result.limit]], "m");
  const depth = scaled(result.depths, "m");
  const x = { name: "running time [h]" };
  const ofContacts = (rows, by) => rows.map((row, i) => ({ name: result.contacts[i], x: result.hours, y: row.map(times(by)), colour: seriesColour(i) }));
  const one = (label, file, name, rows, by, unit) => ({ label, file, draw: { x, y: { name, unit, zero: true }, series: ofContacts(rows, by) } });
  return [
    {
      label: "Amplitude over the life", file: "wear",
      draw: {
        x, y: { name: `${result.measured?.name ?? result.dof} [${height.name}]`, unit: height.unit, pad: 0.1 },
        series: [{ x: result.hours, y: result.amplitude.map(times(height.factor)), colour: 1 }],
        limits: [
          ...(result.limit === null ? [] : [{ y: result.limit * height.factor, name: "limit" }]),
          ...result.switches.map((at, i) => ({ x: at, name: i ? "" : "another peak" })),
        ],
        marks: result.hours_to_limit === null ? [] : [{ x: result.hours_to_limit, y: result.limit * height.factor, text: `${number(result.hours_to_limit, 4)} h` }],
      },
    },
    ...(known(result.loads).length ? [one("Loads over the life", "wear-loads", "N0 [N]", result.loads, 1)] : []),
    ...(known(result.used ?? []).length ? [{
      label: "Share of the stress allowed", file: "wear-used",
      draw: {
        x, y: { name: "share of what is allowed", zero: true, low: 0 }, series: [{ x: result.hours, y: result.used, colour: 1 }],
        limits: [{ y: 1, name: "margin 1" }],
        marks: result.hours_to_margin === null ? [] : [{ x: result.hours_to_margin, y: 1, text: `${number(result.hours_to_margin, 4)} h` }],
      },
    }] : []),
    one("Depths over the life", "wear-depths", `wear depth [${depth.name}]`, result.depths, depth.factor, depth.unit),
  ];
}
