// A nonlinear mode as charts: frequency and damping over the amplitude, peaks, loops, shape.

import { hertz, largest, length, measured, number, shownUnit, times } from "../base/format.js";

const LINEAR = ["stuck", "separated", "closed"];
const GHOSTS = [7, 5, 4, 3];

// The amplitude as it is looked at: of the mode, or as the observed motion.
export function amplitudeOf(result, over) {
  if (over === "modal") return { name: "modal amplitude a [√kg m]", x: result.amplitude, of: (point) => point.amplitude, unit: undefined };
  const unit = shownUnit(largest(result.max_abs));
  return { name: `max |${result.dof}| [${unit.name}]`, unit, x: result.max_abs.map(times(unit.perMetre)), of: (point) => point.max_abs * unit.perMetre };
}

const isLinear = (states) => states.every((state) => LINEAR.includes(state));

// What the contacts do at a point, the same said once.
export function statesAt({ contacts, states }, i) {
  const said = states[i] ?? [];
  if (new Set(said).size <= 1) return said[0] ?? "";
  return contacts.map((name, at) => `${name} ${said[at]}`).join(", ");
}

const describe = (result, i) =>
  `a ${measured(result.amplitude[i], "√kg m")} · max |${result.dof}| ${length(result.max_abs[i])} · ${hertz(result.frequency[i])} · ζ ${number(100 * result.damping_ratio[i], 4)} % · ${statesAt(result, i)}`;

function curveOf(result, key, over, pins, factor = 1) {
  const { name, unit, x } = amplitudeOf(result, over);
  const y = result[key].map(times(factor));
  const stuck = result.states.map((states, i) => (isLinear(states) ? y[i] : null));
  return {
    x: { name, unit, log: true, pad: 0 },
    series: [
      { name: pins.length ? "now" : "contacts slip", x, y, colour: 1, shape: "circle", size: 2.2 },
      ...(stuck.some((v) => v !== null) ? [{ name: "linear", x, y: stuck, colour: 3, width: 4 }] : []),
      ...pins.map((pin, i) => {
        const there = amplitudeOf(pin.result, over);
        return { name: pin.name, x: there.x, y: pin.result[key].map(times(factor)), colour: GHOSTS[i], dash: "dotted", width: 1.6 };
      }),
    ],
    describe: (_x, _y, i) => describe(result, i),
  };
}

export const stabilityOf = ({ stable }) => (stable === null ? "stability not known" : stable ? "stable" : "unstable");

const cyclesOf = (result, over, y) => (result.limit_cycles?.cycles ?? []).map((cycle) => ({
  x: amplitudeOf(result, over).of(cycle), y: y(cycle), shape: cycle.stable ? "circle" : "diamond", colour: cycle.stable ? 3 : 2,
  text: stabilityOf(cycle),
}));

export const frequencyChart = (result, over, pins) => ({
  ...curveOf(result, "frequency", over, pins),
  y: { name: "frequency [Hz]", pad: 0.08 },
  marks: cyclesOf(result, over, (cycle) => cycle.frequency),
});

export function dampingChart(result, over, pins) {
  const aero = result.limit_cycles?.aero_damping;
  return {
    ...curveOf(result, "damping_ratio", over, pins, 100),
    y: { name: "damping ratio ζ [%]", zero: true, pad: 0.1 },
    limits: aero === undefined ? [] : [{ y: -100 * aero, name: `−ζ_aero = ${number(-100 * aero)} %` }],
    marks: cyclesOf(result, over, () => -100 * aero),
  };
}

// The resonance peak of the one mode, over the excitation or over the loads, beside those of whole responses.
export function performanceChart({ performance, dof }, by) {
  const loads = by === "load" && performance.scales;
  const factors = loads ? performance.load : performance.excitation;
  const peaks = loads ? performance.peak_at_load : performance.peak;
  const exact = (performance.exact ?? []).filter(({ peak }) => peak !== null).map((one) => (loads ? { x: 1 / one.excitation, y: one.peak / one.excitation } : { x: one.excitation, y: one.peak }));
  const heights = [...peaks, ...exact.map(({ y }) => y)].filter((v) => v !== null && v > 0).sort((a, b) => a - b);
  const unit = shownUnit(heights[Math.floor(heights.length / 2)] ?? 1);
  const up = times(unit.perMetre);
  const least = loads ? performance.least : null;
  return {
    x: { name: loads ? "loads, × as they are" : "excitation, × as it is", log: true },
    y: { name: `peak of |${dof}| [${unit.name}]`, unit, log: true, pad: 0.06 },
    series: [
      { name: "from the mode", x: factors, y: peaks.map(up), colour: 1 },
      ...(exact.length ? [{ name: "whole responses", x: exact.map(({ x }) => x), y: exact.map(({ y }) => up(y)), colour: 2, width: 0, shape: "diamond", size: 4 }] : []),
    ],
    limits: [{ x: 1, name: "as it is" }],
    marks: least ? [{ x: least.load, y: up(least.peak), text: `least ${length(least.peak)} at × ${number(least.load, 3)}`, colour: 3 }] : [],
    describe: (x, y) => `× ${number(x, 4)}: ${number(y, 4)} ${unit.name}`,
  };
}

export function loopChart({ motions }, at, contact) {
  const loop = motions.loops[contact];
  const unit = shownUnit(largest(loop.motion[at]));
  return {
    x: { name: `motion of ${loop.contact} [${unit.name}]`, unit, pad: 0.06 },
    y: { name: "force [N]", pad: 0.08 },
    series: [{ name: "", x: loop.motion[at].map(times(unit.perMetre)), y: loop.force[at], colour: 1, width: 2.4 }],
  };
}

// A shape with the phase of its largest part taken out: what is left beside it moves at another time.
function turned(real, imag) {
  const sizes = real.map((v, i) => Math.hypot(v, imag[i]));
  const most = sizes.indexOf(Math.max(...sizes));
  const [c, s] = sizes[most] > 0 ? [real[most] / sizes[most], imag[most] / sizes[most]] : [1, 0];
  return [real.map((v, i) => v * c + imag[i] * s), imag.map((v, i) => v * c - real[i] * s)];
}

export function shapeChart({ motions }, at) {
  const [real, imag] = turned(motions.shapes.real[at], motions.shapes.imag[at]);
  const place = real.map((_, i) => i + 1);
  return {
    x: { name: "degree of freedom", whole: true, low: 0.4, high: real.length + 0.6, names: ["", ...motions.dofs] },
    y: { name: "harmonic 1 over a [1/√kg]", pad: 0.1 },
    series: [
      { name: "with the largest", x: place, y: real, colour: 1, shape: "square", size: 3.4, width: 0 },
      { name: "90° later", x: place, y: imag.map((v) => -v), colour: 2, shape: "circle", size: 3, width: 0 },
      // Lines from nothing: between degrees of freedom there is none.
      { name: "", x: place.flatMap((v) => [v, v, null]), y: real.flatMap((v) => [0, v, null]), colour: 1, width: 1.6, bare: true },
    ],
    describe: (x, y, i) => `${motions.dofs[i]}: ${number(real[i], 4)} with the largest, ${number(-imag[i], 4)} 90° later`,
  };
}

// Everything of the curve as a table: a point a row, a column for each contact.
export const columnsOf = (result) => [
  ["amplitude [sqrt(kg) m]", result.amplitude], [`max |${result.dof}| [m]`, result.max_abs],
  ["frequency [Hz]", result.frequency], ["frequency error [Hz]", result.frequency_error],
  ["damping ratio", result.damping_ratio], ["damping error", result.damping_error],
  ...result.contacts.map((name, i) => [`state of ${name}`, result.states.map((states) => states[i])]),
];
