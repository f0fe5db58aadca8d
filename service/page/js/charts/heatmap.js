// The map of amplitude over two parameters: a canvas below, axes and lines in SVG above.

import { el, show, svg } from "../base/dom.js";
import { length, number, shownUnit } from "../base/format.js";
import { bisector } from "../vendor/d3.js";
import { saving } from "./chart.js";
import { pathOf, placeIn, plane, shape, sized } from "./plane.js";
import { joined, mapButtons, mapDragged, mapKey } from "./zoom.js";

const LEGEND = 14;
// Viridis, which everybody can read, in 16 stops between which colours are mixed.
const STOPS = [
  [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142], [35, 136, 142],
  [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54], [210, 226, 27], [253, 231, 37],
];

const SHADES = (() => {
  const table = new Uint8ClampedArray(256 * 4);
  for (let i = 0; i < 256; i += 1) {
    const place = (i / 255) * (STOPS.length - 1);
    const at = Math.min(Math.floor(place), STOPS.length - 2);
    for (let c = 0; c < 3; c += 1) table[4 * i + c] = STOPS[at][c] + (place - at) * (STOPS[at + 1][c] - STOPS[at][c]);
    table[4 * i + 3] = 255;
  }
  return table;
})();

// Draws {x, y: {name, values, log}, rows: [[metre]], lines: [{name, x, y, colour, dash}], marks: [{x, y, text}]}.
export function heatmap(host, { label, file, height = 340, onPick }) {
  const read = el("p", { class: "chart-read", "aria-live": "polite" });
  const canvas = el("canvas", { "aria-hidden": "true" });
  const drawing = svg("svg", { class: "chart", role: "group", tabindex: 0, "aria-label": label, "aria-roledescription": "map, arrows move in it, with Shift they move the map, Enter picks" });
  const stage = el("div", { class: "canvas-host" }, canvas, drawing);
  const self = { drawing, canvas, shown: null, row: null, column: null, window: null, windowY: null, log: {} };
  const at = () => (self.column === null ? null : pointOf(self));
  const tools = el("div", { class: "chart-tools" }, mapButtons(self, label, at), saving(self, file, label, () => canvas));
  self.columns = () => columns(self.shown);
  show(host, stage, el("div", { class: "chart-foot" }, read, tools));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  self.repaint = () => {
    if (!self.shown) return;
    const begun = performance.now();
    paint(self, host, height);
    self.milliseconds = performance.now() - begun;
  };
  self.draw = (what) => {
    self.shown = what;
    self.range = rangeOf(what.rows);
    tools.hidden = false;
    drawing.toggleAttribute("hidden", false);
    read.textContent = "";
    self.repaint();
  };
  // Nothing to show is one line.
  self.clear = () => {
    Object.assign(self, { shown: null, row: null, column: null, window: null, windowY: null, log: {} });
    tools.hidden = true;
    canvas.width = 0;
    drawing.toggleAttribute("hidden", true);
    read.textContent = "Nothing computed yet.";
  };
  self.clear();
  joined(self);
  const place = (event) => {
    if (!self.shown) return false;
    const [x, y] = placeIn(drawing, event);
    cursor(self, nearest(self.shown.x.values, self.xs.back(x)), nearest(self.shown.y.values, self.ys.back(y)), read);
    return true;
  };
  drawing.addEventListener("pointermove", (event) => event.buttons || place(event));
  drawing.addEventListener("pointerleave", () => {
    self.mark?.replaceChildren();
    self.share(null);
  });
  const justDragged = mapDragged(self);
  drawing.addEventListener("click", (event) => !justDragged() && place(event) && onPick(pointOf(self)));
  drawing.addEventListener("keydown", (event) => self.shown && (mapKey(self, event, at) || keyed(self, event, read, onPick)));
  new ResizeObserver(() => {
    if (self.shown && Math.abs(host.clientWidth - self.width) > 1) self.repaint();
  }).observe(host);
  return self;
}

const pointOf = ({ shown, row, column }) => ({ x: shown.x.values[column], y: shown.y.values[row], value: shown.rows[row][column] });
const rising = bisector((value) => value);
const falling = bisector((value) => -value);

// The place of the value next to the wanted one, of values that rise or fall.
function nearest(values, wanted) {
  const up = values[values.length - 1] >= values[0];
  return up ? rising.center(values, wanted) : falling.center(values, -wanted);
}

// An axis as it is looked at: its whole, the stretch that is zoomed, logarithmic where it is asked for and may be.
function axisOf({ name, values, log }, window, wanted) {
  const whole = [Math.min(...values), Math.max(...values)];
  const may = whole[0] > 0;
  const [low, high] = window ?? whole;
  return { name, log: may && (wanted ?? log ?? false), may, whole, low, high };
}

function paint(self, host, height) {
  const { x, y, lines = [], marks = [] } = self.shown;
  const width = Math.max(host.clientWidth, 240);
  self.width = host.clientWidth;
  const [ofX, ofY] = [axisOf(x, self.window, self.log.x), axisOf(y, self.windowY, self.log.y)];
  Object.assign(self, { whole: ofX.whole, wholeY: ofY.whole });
  self.sayLog(ofX.log, ofY.log, ofX.may, ofY.may);
  const base = plane(width, height, ofX, ofY, { paper: false });
  Object.assign(self, base);
  const { box, xs, ys } = base;
  shades(self, box);
  self.mark = svg("g", {});
  sized(self.drawing, width, height);
  const inside = (m) => m.x >= xs.low && m.x <= xs.high && m.y >= ys.low && m.y <= ys.high;
  show(
    self.drawing,
    svg("defs", {}, svg("clipPath", { id: "clip-of-the-map" }, svg("rect", { x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top }))),
    base.frame,
    svg("g", { "clip-path": "url(#clip-of-the-map)" }, lines.map((line) => [
      svg("path", { class: "series map-under", d: pathOf(xs, ys, line.x, line.y), "stroke-width": 4.5 }),
      svg("path", { class: "series map-line", d: pathOf(xs, ys, line.x, line.y), "stroke-dasharray": line.dash ? "6 4" : undefined }),
    ])),
    marks.filter(inside).map((m) => {
      const right = xs.at(m.x) > (box.left + box.right) / 2;
      return [
        shape("diamond", xs.at(m.x), ys.at(m.y), 5.5, 2, m.text),
        svg("text", { class: "halo", x: xs.at(m.x) + (right ? -11 : 11), y: ys.at(m.y) + 4, "text-anchor": right ? "end" : "start" }, m.text),
      ];
    }),
    self.mark,
  );
}

// The least and the largest amplitude of all cells: colours mean the same however the map is zoomed.
function rangeOf(rows) {
  let [low, high] = [Infinity, 0];
  for (const row of rows) for (const v of row) if (v !== null && v > 0) [low, high] = [Math.min(low, v), Math.max(high, v)];
  return [low, high];
}

const PAINT = new Uint32Array(SHADES.buffer);

// Colours of every cell, logarithmic in the amplitude, at the canvas's own pixels: a row of cells is painted once.
function shades(self, box) {
  const { rows, x, y } = self.shown;
  const [low, high] = self.range;
  const [first, span] = [Math.log(low), Math.log(high) - Math.log(low) || 1];
  const [wide, tall] = [Math.round(box.right - box.left), Math.round(box.bottom - box.top)];
  const { canvas } = self;
  canvas.width = wide;
  canvas.height = tall;
  Object.assign(canvas.style, { left: `${box.left}px`, top: `${box.top}px`, width: `${wide}px`, height: `${tall}px` });
  const brush = canvas.getContext("2d");
  const image = brush.createImageData(wide, tall);
  const pixels = new Uint32Array(image.data.buffer);
  const columns = Array.from({ length: wide }, (_, i) => nearest(x.values, self.xs.back(box.left + i + 0.5)));
  const painted = new Map();
  for (let j = 0; j < tall; j += 1) {
    const at = nearest(y.values, self.ys.back(box.top + j + 0.5));
    if (!painted.has(at)) {
      const colours = rows[at].map((v) => (v === null ? 0 : PAINT[Math.round((255 * (Math.log(Math.max(v, low)) - first)) / span)]));
      painted.set(at, Uint32Array.from(columns, (column) => colours[column]));
    }
    pixels.set(painted.get(at), j * wide);
  }
  brush.putImageData(image, 0, 0);
}

function cursor(self, column, row, read) {
  const { shown, xs, ys, box } = self;
  self.column = Math.min(Math.max(column, 0), shown.x.values.length - 1);
  self.row = Math.min(Math.max(row, 0), shown.y.values.length - 1);
  const point = pointOf(self);
  const [px, py] = [xs.at(point.x), ys.at(point.y)];
  show(self.mark, svg("path", { class: "map-cursor", d: `M${px} ${box.top}V${box.bottom}M${box.left} ${py}H${box.right}` }));
  const height = point.value === null ? "no solution" : length(point.value);
  self.share(point.x);
  read.textContent = `${shown.x.name} ${number(point.x, 6)} · ${shown.y.name} ${number(point.y, 5)} · ${height}`;
}

function keyed(self, event, read, onPick) {
  const moves = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1], PageUp: [20, 0], PageDown: [-20, 0] };
  const step = moves[event.key];
  if (step) cursor(self, (self.column ?? 0) + step[0], (self.row ?? 0) + step[1], read);
  else if ((event.key === "Enter" || event.key === " ") && self.column !== null) onPick(pointOf(self));
  else return;
  event.preventDefault();
}

// The scale of colours as a strip with its ends.
export function shadeStrip([low, high]) {
  const unit = shownUnit(high);
  const strip = el("canvas", { width: 256, height: 1, "aria-hidden": "true", class: "strip" });
  const brush = strip.getContext("2d");
  const image = brush.createImageData(256, 1);
  image.data.set(SHADES);
  brush.putImageData(image, 0, 0);
  strip.style.height = `${LEGEND}px`;
  const text = (value) => `${number(value * unit.perMetre, 3)} ${unit.name}`;
  return el("div", { class: "strip-row" }, el("span", {}, text(low)), strip, el("span", {}, `${text(high)} (logarithmic)`));
}

// Its CSV is a table of every cell.
function columns({ x, y, rows }) {
  const cells = y.values.flatMap((b, j) => x.values.map((a, i) => [a, b, rows[j][i]]));
  return [x.name, y.name, "amplitude [m]"].map((name, k) => [name, cells.map((cell) => cell[k])]);
}
