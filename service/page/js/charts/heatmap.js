// The map of amplitude over two parameters: a canvas below, axes and lines in SVG above.

import { empty } from "./chart.js";
import { chartTools } from "./heatmap_tools.js";
import { SHADES } from "../base/colours.js";
import { el, show, svg } from "../base/dom.js";
import { lengthUnit, number } from "../base/format.js";
import { pathOf, plane, shape } from "./plane.js";

const LEGEND = 14;

// Draws {x, y: {name, values, log}, rows: [[metre]], lines: [{name, x, y, colour, dash}], marks: [{x, y, text}]}.
export function heatmap(host, { label, file, height = 340, onPick }) {
  const read = el("p", { class: "chart-read", "aria-live": "polite" });
  const canvas = el("canvas", { "aria-hidden": "true" });
  const drawing = svg("svg", { class: "chart", role: "group", tabindex: 0, "aria-label": label });
  drawing.setAttribute("aria-roledescription", "map, arrows move in it, Enter picks");
  const stage = el("div", { class: "canvas-host" }, canvas, drawing);
  const self = { drawing, canvas, shown: null, row: 0, column: 0 };
  const tools = chartTools(self, file, label);
  show(host, stage, el("div", { class: "chart-foot" }, read, tools));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  self.draw = (what) => {
    const begun = performance.now();
    self.shown = what;
    tools.hidden = false;
    paint(self, host, height);
    self.milliseconds = performance.now() - begun;
  };
  // Nothing to show: a frame of the same size, so that nothing moves when there is.
  self.clear = () => {
    self.shown = null;
    tools.hidden = true;
    canvas.width = 0;
    read.textContent = "";
    const width = Math.max(host.clientWidth, 240);
    sized(drawing, width, height);
    show(drawing, empty(width, height, "Nothing computed yet."));
  };
  self.clear();
  self.redraw = () => self.shown && paint(self, host, height);
  const place = (event) => {
    if (!self.shown) return false;
    const frame = drawing.getBoundingClientRect();
    const zoom = frame.width / drawing.viewBox.baseVal.width || 1;
    const x = self.xs.back((event.clientX - frame.left) / zoom);
    const y = self.ys.back((event.clientY - frame.top) / zoom);
    cursor(self, nearest(self.shown.x.values, x), nearest(self.shown.y.values, y), read);
    return true;
  };
  drawing.addEventListener("pointermove", place);
  drawing.addEventListener("pointerleave", () => self.mark?.replaceChildren());
  drawing.addEventListener("click", (event) => place(event) && onPick(pointOf(self)));
  drawing.addEventListener("keydown", (event) => keyed(self, event, read, onPick));
  new ResizeObserver(() => {
    if (self.shown && Math.abs(host.clientWidth - self.width) > 1) paint(self, host, height);
  }).observe(host);
  return self;
}

const pointOf = ({ shown, row, column }) => ({
  x: shown.x.values[column],
  y: shown.y.values[row],
  value: shown.rows[row][column],
});

function nearest(values, wanted) {
  let best = 0;
  values.forEach((value, i) => {
    if (Math.abs(value - wanted) < Math.abs(values[best] - wanted)) best = i;
  });
  return best;
}

function sized(drawing, width, height) {
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  drawing.setAttribute("width", width);
  drawing.setAttribute("height", height);
}

const axisOf = ({ name, values, log }) => ({ name, log, low: Math.min(...values), high: Math.max(...values) });

function paint(self, host, height) {
  const { x, y, lines = [], marks = [] } = self.shown;
  const width = Math.max(host.clientWidth, 240);
  self.width = host.clientWidth;
  const base = plane(width, height, axisOf(x), axisOf(y), { paper: false });
  Object.assign(self, base);
  const { box, xs, ys } = base;
  const range = shades(self, box);
  self.mark = svg("g", {});
  sized(self.drawing, width, height);
  const inside = (m) => m.x >= xs.low && m.x <= xs.high && m.y >= ys.low && m.y <= ys.high;
  show(
    self.drawing,
    base.frame,
    lines.map((line) => [
      svg("path", { class: "series map-under", d: pathOf(xs, ys, line.x, line.y), "stroke-width": 4.5 }),
      svg("path", { class: "series map-line", d: pathOf(xs, ys, line.x, line.y), "stroke-dasharray": line.dash ? "6 4" : undefined }),
    ]),
    marks.filter(inside).map((m) => {
      const right = xs.at(m.x) > (box.left + box.right) / 2;
      return [
        shape("diamond", xs.at(m.x), ys.at(m.y), 5.5, 2, m.text),
        svg("text", { class: "halo", x: xs.at(m.x) + (right ? -11 : 11), y: ys.at(m.y) + 4, "text-anchor": right ? "end" : "start" }, m.text),
      ];
    }),
    self.mark,
  );
  self.range = range;
}

// Colours of every cell, logarithmic in the amplitude, drawn cell by cell at the canvas's own pixels.
function shades(self, box) {
  const { rows, x, y } = self.shown;
  let [low, high] = [Infinity, 0];
  for (const row of rows) for (const v of row) if (v !== null && v > 0) [low, high] = [Math.min(low, v), Math.max(high, v)];
  const [first, span] = [Math.log(low), Math.log(high) - Math.log(low) || 1];
  const [wide, tall] = [Math.round(box.right - box.left), Math.round(box.bottom - box.top)];
  const { canvas } = self;
  canvas.width = wide;
  canvas.height = tall;
  Object.assign(canvas.style, { left: `${box.left}px`, top: `${box.top}px`, width: `${wide}px`, height: `${tall}px` });
  const brush = canvas.getContext("2d");
  const image = brush.createImageData(wide, tall);
  const columns = Array.from({ length: wide }, (_, i) => nearest(x.values, self.xs.back(box.left + i + 0.5)));
  for (let j = 0; j < tall; j += 1) {
    const row = rows[nearest(y.values, self.ys.back(box.top + j + 0.5))];
    for (let i = 0; i < wide; i += 1) {
      const value = row[columns[i]];
      if (value === null) continue;
      const shade = 4 * Math.round((255 * (Math.log(Math.max(value, low)) - first)) / span);
      image.data.set(SHADES.subarray(shade, shade + 4), 4 * (j * wide + i));
    }
  }
  brush.putImageData(image, 0, 0);
  return [low, high];
}

function cursor(self, column, row, read) {
  const { shown, xs, ys, box } = self;
  self.column = Math.min(Math.max(column, 0), shown.x.values.length - 1);
  self.row = Math.min(Math.max(row, 0), shown.y.values.length - 1);
  const point = pointOf(self);
  const [px, py] = [xs.at(point.x), ys.at(point.y)];
  show(self.mark, svg("path", { class: "map-cursor", d: `M${px} ${box.top}V${box.bottom}M${box.left} ${py}H${box.right}` }));
  const unit = lengthUnit(point.value ?? 0);
  const height = point.value === null ? "no solution" : `${number(point.value * unit.perMetre)} ${unit.name}`;
  read.textContent = `${shown.x.name} ${number(point.x, 6)} · ${shown.y.name} ${number(point.y, 5)} · ${height}`;
}

function keyed(self, event, read, onPick) {
  if (!self.shown) return;
  const moves = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1], PageUp: [20, 0], PageDown: [-20, 0] };
  const step = moves[event.key];
  if (step) cursor(self, self.column + step[0], self.row + step[1], read);
  else if (event.key === "Enter" || event.key === " ") onPick(pointOf(self));
  else return;
  event.preventDefault();
}

// The scale of colours as a strip with its ends.
export function shadeStrip([low, high]) {
  const unit = lengthUnit(high);
  const strip = el("canvas", { width: 256, height: 1, "aria-hidden": "true", class: "strip" });
  const brush = strip.getContext("2d");
  const image = brush.createImageData(256, 1);
  image.data.set(SHADES);
  brush.putImageData(image, 0, 0);
  strip.style.height = `${LEGEND}px`;
  const text = (value) => `${number(value * unit.perMetre, 3)} ${unit.name}`;
  return el("div", { class: "strip-row" }, el("span", {}, text(low)), strip, el("span", {}, `${text(high)} (logarithmic)`));
}
