// Axes: from values to pixels, and where the ticks go. The scales are D3's.

import { number } from "../base/format.js";
import { scaleLinear, scaleLog } from "../vendor/d3.js";

const LEAST = 1e-300; // what a logarithmic axis draws nothing and less at

export function scale(log, low, high, from, to) {
  const of = (log ? scaleLog() : scaleLinear()).domain([low, high > low ? high : low + 1]).range([from, to]);
  return {
    low,
    high,
    log: Boolean(log),
    at: log ? (value) => of(Math.max(value, LEAST)) : of,
    back: of.invert,
    ticks: (count) => (log ? logTicks(of, count) : of.ticks(count).map(tick)),
  };
}

// Lines at the digits of each decade, with numbers at those there is room for; less than a decade has round numbers.
function logTicks(of, count) {
  const [low, high] = of.domain();
  if (high / low < 5) return scaleLinear().domain([low, high]).ticks(count).map(tick);
  const named = of.tickFormat(count, (value) => tick(value).text);
  return of.ticks().map((value) => ({ value, text: named(value) }));
}

const tick = (value) => {
  const size = Math.abs(value);
  if (size < 1e-14) return { value, text: "0" };
  return { value, text: size < 1e-3 ? value.toExponential().replace(/(\.\d{1,3})\d*e/, "$1e") : number(value, 6) };
};

// The ends of an axis for values; a log axis leaves out what is not positive.
export function extent(lists, { log = false, zero = false, pad = 0.04 } = {}) {
  let [low, high] = [Infinity, -Infinity];
  for (const list of lists) {
    for (const value of list) {
      if (value === null || !Number.isFinite(value) || (log && value <= 0)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return log ? [0.1, 1] : [0, 1];
  if (log) {
    const factor = Math.max((high / low) ** pad, 1.02);
    return [low / factor, high * factor];
  }
  const margin = (high - low || Math.abs(high) || 1) * pad;
  return [zero && low >= 0 ? 0 : low - margin, high + margin];
}
