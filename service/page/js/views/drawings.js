// Drawings of studies that the card "Other studies" shows: a further one is a function here, by the kind's name.

import { lengthUnit, largest, number } from "../base/format.js";

const COLOURS = 6;
const colour = (i) => 1 + (i % COLOURS);
const known = (rows) => rows.flat().filter((value) => value !== null);
const times = (factor) => (value) => (value === null ? null : factor * value);

// An amplitude in the length that suits it, a stress in MPa, anything else as it is.
function scaled(rows, unit) {
  if (unit === "Pa") return { name: "MPa", factor: 1e-6 };
  if (unit !== "m") return { name: unit, factor: 1 };
  const scale = lengthUnit(largest(known(rows)));
  return { name: scale.name, factor: scale.perMetre, unit: scale };
}

// A curve with the excitation that is allowed among its points.
function through(x, y, one, of) {
  const after = one.allowed === null ? -1 : x.findIndex((level) => level > one.allowed);
  return after < 0 ? { x, y } : { x: x.toSpliced(after, 0, one.allowed), y: y.toSpliced(after, 0, of(one)) };
}

// Stress over the excitation of several dampers, and its share of what is allowed.
function margin(result) {
  const { name, factor, unit } = scaled(result.stress, result.unit);
  const what = result.judged_by === "utilisation" ? "alternating stress" : "amplitude";
  const x = { name: `excitation [${result.level_unit}]`, log: true };
  const lines = (rows, by, of) => rows.map((row, i) => ({ name: result.allowed[i].name, ...through(result.level, row.map(times(by)), result.allowed[i], of), colour: colour(i), shape: "circle", size: 2.4 }));
  const marks = result.allowed.flatMap((one, i) => (one.allowed === null ? [] : [{ ...one, colour: colour(i) }]));
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

// Amplitude, loads and depths of worn contacts over hours.
function wear(result) {
  const height = scaled([result.amplitude, [result.limit]], "m");
  const depth = scaled(result.depths, "m");
  const x = { name: "running time [h]" };
  const ofContacts = (rows, by) => rows.map((row, i) => ({ name: result.contacts[i], x: result.hours, y: row.map(times(by)), colour: colour(i) }));
  const one = (label, file, name, rows, by, unit) => ({ label, file, draw: { x, y: { name, unit, zero: true }, series: ofContacts(rows, by) } });
  return [
    {
      label: "Amplitude over the life", file: "wear",
      draw: {
        x, y: { name: `${result.measured?.name ?? result.dof} [${height.name}]`, unit: height.unit, pad: 0.1 },
        series: [{ x: result.hours, y: result.amplitude.map(times(height.factor)), colour: 1 }],
        limits: [
          ...(result.limit === null ? [] : [{ y: result.limit * height.factor, name: "limit" }]),
          ...result.switches.map((at) => ({ x: at, name: "another peak" })),
        ],
        marks: result.hours_to_limit === null ? [] : [{ x: result.hours_to_limit, y: result.limit * height.factor, text: `${number(result.hours_to_limit, 4)} h` }],
      },
    },
    ...(known(result.loads).length ? [one("Loads over the life", "wear-loads", "normal load [N]", result.loads, 1)] : []),
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

// The factors of the worst pattern blade by blade, and what patterns make of the tuned peak.
function worstMistuning(result) {
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

export const DRAWINGS = { margin, wear, "worst-mistuning": worstMistuning };
