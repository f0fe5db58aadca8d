// The frame of a chart: axes from values to pixels, on the scales of D3, paper, grid, names, and the box inside.

import { svg } from "../base/dom.js";
import { number } from "../base/format.js";
import { line, scaleLinear, scaleLog } from "../vendor/d3.js";

const MARGIN = { left: 62, right: 14, top: 12, bottom: 44 };
const PIXELS_A_TICK = { x: 72, y: 42 };

export function plane(width, height, x, y, { paper = true, above = 0 } = {}) {
  const box = { left: MARGIN.left, right: Math.max(width - MARGIN.right, MARGIN.left + 20), top: MARGIN.top + above, bottom: height - MARGIN.bottom };
  const xs = { ...scale(x.log, x.low, x.high, box.left, box.right), whole: x.whole, names: x.names };
  const ys = scale(y.log, y.low, y.high, box.bottom, box.top);
  const frame = svg(
    "g",
    {},
    paper ? svg("rect", { class: "paper", x: 0, y: 0, width, height }) : null,
    gridLines(box, xs, ys, paper),
    svg("path", { class: "axis", d: `M${box.left} ${box.top}V${box.bottom}H${box.right}` }),
    svg("text", { x: (box.left + box.right) / 2, y: height - 8, "text-anchor": "middle" }, x.name),
    svg("text", { transform: `translate(14 ${(box.top + box.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, y.name),
  );
  return { box, xs, ys, frame };
}

const LETTER = 6.8;
const APART = 8;

function gridLines(box, xs, ys, lines) {
  const nodes = [];
  let free = -Infinity;
  for (const { value, text: plain } of xs.ticks((box.right - box.left) / PIXELS_A_TICK.x)) {
    if (xs.whole && !Number.isInteger(value)) continue;
    const text = xs.names ? (xs.names[value] ?? "") : plain;
    const at = xs.at(value);
    nodes.push(svg("line", { class: lines ? "grid" : "axis", x1: at, x2: at, y1: lines ? box.top : box.bottom + 4, y2: box.bottom }));
    if (!text) continue;
    // A number that would stand on its neighbour is left out; its line stays.
    const half = (LETTER * text.length) / 2;
    if (at - half < free) continue;
    free = at + half + APART;
    nodes.push(svg("text", { class: "soft", x: at, y: box.bottom + 16, "text-anchor": "middle" }, text));
  }
  for (const { value, text } of ys.ticks((box.bottom - box.top) / PIXELS_A_TICK.y)) {
    const at = ys.at(value);
    nodes.push(svg("line", { class: lines ? "grid" : "axis", x1: lines ? box.left : box.left - 4, x2: lines ? box.right : box.left, y1: at, y2: at }));
    if (text) nodes.push(svg("text", { class: "soft", x: box.left - 6, y: at + 4, "text-anchor": "end" }, text));
  }
  return nodes;
}

// A path through points; gaps where a number is missing.
export function pathOf(xs, ys, x, y) {
  const drawn = (axis, value) => value !== null && Number.isFinite(value) && !(axis.log && value <= 0);
  const path = line()
    .defined((i) => drawn(xs, x[i]) && drawn(ys, y[i]))
    .x((i) => xs.at(x[i]))
    .y((i) => ys.at(y[i]))
    .digits(1);
  return path(x.map((_, i) => i)) ?? "";
}

const SHAPES = {
  circle: (x, y, r) => svg("circle", { cx: x, cy: y, r }),
  square: (x, y, r) => svg("rect", { x: x - r, y: y - r, width: 2 * r, height: 2 * r }),
  diamond: (x, y, r) => svg("path", { d: `M${x} ${y - 1.4 * r}L${x + 1.4 * r} ${y}L${x} ${y + 1.4 * r}L${x - 1.4 * r} ${y}Z` }),
  triangle: (x, y, r) => svg("path", { d: `M${x} ${y - 1.3 * r}L${x + 1.2 * r} ${y + r}L${x - 1.2 * r} ${y + r}Z` }),
};

export function shape(kind, x, y, r, colour, title) {
  const node = SHAPES[kind](x, y, r);
  node.setAttribute("class", `f${colour}`);
  if (title) node.append(svg("title", {}, title));
  return node;
}

// A drawing has a size; a press or a move of the pointer is at a place in it.
export function sized(drawing, width, height) {
  for (const [name, value] of Object.entries({ viewBox: `0 0 ${width} ${height}`, width, height })) drawing.setAttribute(name, value);
}

export function placeIn(drawing, { clientX, clientY }) {
  const { left, top, width } = drawing.getBoundingClientRect();
  const zoom = width / drawing.viewBox.baseVal.width || 1;
  return [(clientX - left) / zoom, (clientY - top) / zoom];
}

const LEAST = 1e-300; // what a logarithmic axis draws nothing and less at

function scale(log, low, high, from, to) {
  const of = (log ? scaleLog() : scaleLinear()).domain([low, high > low ? high : low + 1]).range([from, to]);
  return { low, high, log: Boolean(log), at: log ? (value) => of(Math.max(value, LEAST)) : of, back: of.invert, ticks: (count) => (log ? logTicks(of, count) : of.ticks(count).map(tick)) };
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
