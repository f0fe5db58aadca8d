// Axes: from values to pixels, and where the ticks go.

import { number } from "../base/format.js";

const STEPS = [1, 2, 2.5, 5, 10];

export function linear(low, high, from, to) {
  const span = high - low || 1;
  return {
    low,
    high,
    log: false,
    at: (value) => from + ((value - low) / span) * (to - from),
    back: (pixel) => low + ((pixel - from) / (to - from)) * span,
    ticks: (count) => linearTicks(low, high, count),
  };
}

export function logarithmic(low, high, from, to) {
  const [first, last] = [Math.log10(low), Math.log10(high)];
  const span = last - first || 1;
  return {
    low,
    high,
    log: true,
    at: (value) => from + ((Math.log10(Math.max(value, 1e-300)) - first) / span) * (to - from),
    back: (pixel) => 10 ** (first + ((pixel - from) / (to - from)) * span),
    ticks: (count) => logTicks(low, high, count),
  };
}

export const scale = (log, ...ends) => (log ? logarithmic(...ends) : linear(...ends));

export function linearTicks(low, high, count) {
  const rough = (high - low) / Math.max(count, 1);
  if (!(rough > 0)) return [tick(low)];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * STEPS.find((each) => each * power >= rough * 0.85);
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i += 1) found.push(tick(i * step));
  return found;
}

function logTicks(low, high, count) {
  const decades = Math.log10(high / low);
  const every = Math.max(1, Math.ceil(decades / Math.max(count, 1)));
  const inside = decades < 1.2 ? [1, 2, 3, 5, 7] : decades < 3.2 ? [1, 2, 5] : [1];
  const found = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power += 1) {
    if (decades >= 3.2 && power % every !== 0) continue;
    for (const digit of inside) {
      const value = digit * 10 ** power;
      if (value >= low * 0.9999 && value <= high * 1.0001) found.push(tick(value));
    }
  }
  return found.length > 1 ? found : linearTicks(low, high, count);
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
