// A response as a chart: its curve through its polished peak, stable and not, its band.

import { hertz, largest, length, number, shownUnit, times } from "../base/format.js";

// The amplitudes of the points that are stable, and of those that are not with their neighbours; null elsewhere.
function byStability({ amplitude, unstable }) {
  if (!unstable?.length) return { stable: amplitude, unstable: null };
  const inside = (i, more) => unstable.some(([first, last]) => i >= first - more && i <= last + more);
  return { stable: amplitude.map((a, i) => (inside(i, 0) ? null : a)), unstable: amplitude.map((a, i) => (inside(i, 1) ? a : null)) };
}

// The points of a response with its polished peak among them, which lies between two of them: the curve goes through it.
export function throughPeak({ parameter, amplitude, peak, unstable }) {
  const same = { parameter, amplitude, unstable };
  if (!peak || parameter.includes(peak.at)) return same;
  let after = -1;
  for (let i = 1; i < parameter.length; i += 1) {
    const between = (parameter[i - 1] - peak.at) * (parameter[i] - peak.at) < 0;
    // Of the branches over a frequency the peak is on the highest.
    if (between && (after < 0 || Math.max(amplitude[i - 1], amplitude[i]) > Math.max(amplitude[after - 1], amplitude[after]))) after = i;
  }
  if (after < 0) return same;
  const moved = (i) => (i >= after ? i + 1 : i);
  return { parameter: parameter.toSpliced(after, 0, peak.at), amplitude: amplitude.toSpliced(after, 0, peak.value), unstable: unstable?.map(([first, last]) => [moved(first), moved(last)]) };
}

// A response as a chart: curve, peak, band. `more` are further curves.
export function responseOf(answer, more = []) {
  const scale = shownUnit(answer.peak?.value ?? 1);
  const up = (values) => values.map(times(scale.perMetre));
  const points = throughPeak(answer);
  const parts = byStability(points);
  const name = answer.measured?.name ?? "amplitude";
  return {
    x: { name: "frequency [Hz]" },
    y: { name: `${name} [${scale.name}]`, unit: scale, zero: true, low: 0, pad: 0.14 },
    series: [
      { name: more.length ? "with friction" : parts.unstable ? "stable" : "", x: points.parameter, y: up(parts.stable), colour: 1 },
      ...(parts.unstable ? [{ name: "not stable", x: points.parameter, y: up(parts.unstable), colour: 1, dash: "dashed" }] : []),
      ...more.map((line) => ({ ...line, y: up(line.y) })),
    ],
    bands: answer.band_intervals_hz ?? [],
    marks: answer.peak ? [{ x: answer.peak.at, y: answer.peak.value * scale.perMetre, text: `${length(answer.peak.value)} at ${hertz(answer.peak.at)}` }] : [],
    describe: (x, y) => `${hertz(x)}: ${number(y, 5)} ${scale.name}`,
  };
}

const COLOURS = 6;
export const seriesColour = (i) => 1 + (i % COLOURS);
export const known = (rows) => rows.flat().filter((value) => value !== null);

// An amplitude in the length that suits it, a stress in MPa, anything else as it is.
export function scaled(rows, unit) {
  if (unit === "Pa") return { name: "MPa", factor: 1e-6 };
  if (unit !== "m") return { name: unit, factor: 1 };
  const scale = shownUnit(largest(known(rows)));
  return { name: scale.name, factor: scale.perMetre, unit: scale };
}
