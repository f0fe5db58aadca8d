// A chart of lines and points in SVG: read by mouse and keyboard, picked by click and Enter, saved as files.

import { button, el, show, svg } from "../base/dom.js";
import { csvText, pngBlob, saveBlob, saveText, svgText } from "../base/exports.js";
import { number } from "../base/format.js";
import { extent, pathOf, placeIn, plane, shape, sized } from "./plane.js";
import { dragged, joined, rule, zoomButtons, zoomKey, zoomed } from "./zoom.js";

const MARGIN_LEFT = 62;
const LEAST_HEIGHT = 120;
const NOTHING = "Nothing computed yet.";
const DASHES = { dashed: "7 4", dotted: "2 4" };

// What a chart shows: {x, y: {name, unit, log, zero, low, high}, series: [{name, x, y, colour, dash, width, shape, bare}],
// bands: [[low, high]], limits: [{y, name}], marks: [{x, y, text, shape, colour}]}.
// `unit` is the {name, perMetre} of an axis of lengths: files have them in metres, as those of the service do.
// Charts of a tab with the same abscissa share the crosshair and the stretch that is zoomed.
export function chart(host, { label, file, height = 300, onPick, legend = true }) {
  const read = el("p", { class: "chart-read", "aria-live": "polite" });
  const drawing = svg("svg", { class: "chart", role: "group", tabindex: 0, "aria-label": label, "aria-roledescription": `chart, arrows move along it${onPick ? ", Enter picks" : ""}` });
  const tools = el("div", { class: "chart-tools" });
  const foot = el("div", { class: "chart-foot" }, read, tools);
  show(host, drawing, foot);
  // Where the layout gives a figure its height (`--fill: 1`), the drawing takes what its foot leaves.
  const tall = () => (getComputedStyle(host).getPropertyValue("--fill") === "1" ? Math.max(host.clientHeight - foot.offsetHeight, LEAST_HEIGHT) : height);
  const self = { drawing, shown: null, at: null, log: null, window: null };
  tools.append(...zoomButtons(self, label), ...saving(self, file, label));

  self.repaint = () => self.shown && paint(self, host, tall(), legend, label);
  self.draw = (what) => {
    const before = self.shown && self.at !== null ? pointOf(self).x : null;
    self.shown = what;
    tools.hidden = false;
    drawing.toggleAttribute("hidden", false);
    host.toggleAttribute("data-empty", false);
    if (before === null) read.textContent = "";
    self.repaint();
    // What the cursor reads is of the curve that is seen, not of the one before.
    if (before !== null) self.cursor(nearest(lineOf(self), before));
  };
  // Nothing to show is one line.
  self.clear = (words = NOTHING) => {
    Object.assign(self, { shown: null, at: null, window: null, width: host.clientWidth });
    tools.hidden = true;
    drawing.toggleAttribute("hidden", true);
    host.toggleAttribute("data-empty", words === NOTHING);
    read.textContent = words;
  };
  self.clear();
  self.cursor = (index) => moveCursor(self, index, read);
  drawing.addEventListener("pointermove", (event) => hover(self, event));
  drawing.addEventListener("pointerleave", () => {
    self.mark?.replaceChildren();
    self.share(null);
  });
  joined(self, (x) => follow(self, x, read));
  const justDragged = dragged(self);
  drawing.addEventListener("keydown", (event) => keyed(self, event, onPick));
  if (onPick) {
    drawing.addEventListener("click", (event) => {
      if (justDragged()) return;
      hover(self, event);
      if (self.at !== null) onPick(pointOf(self), self.at);
    });
  }
  new ResizeObserver(() => {
    if (Math.abs(host.clientWidth - (self.width ?? 0)) <= 1 && Math.abs(tall() - Number(drawing.getAttribute("height"))) <= 1) return;
    self.repaint();
  }).observe(host);
  return self;
}

// The line that is read and picked from is the first.
const lineOf = ({ shown }) => shown?.series[0];
const pointOf = (self, at = self.at) => ({ x: lineOf(self).x[at], y: lineOf(self).y[at] });
const wordsOf = ({ shown }, { x, y }, at) => shown.describe?.(x, y, at) ?? `${shown.x.name}: ${number(x, 6)} · ${shown.y.name}: ${number(y, 5)}`;

function ends(axis, lists) {
  const [low, high] = extent(lists, axis);
  return { ...axis, low: axis.low ?? low, high: axis.high ?? high };
}

function paint(self, host, height, legend, label) {
  const { series, bands = [], limits = [], marks = [] } = self.shown;
  const width = Math.max(host.clientWidth, 240);
  self.width = host.clientWidth;
  const framed = series.filter((line) => !line.bare);
  const whole = ends({ pad: 0, ...self.shown.x }, [...framed.map((line) => line.x), marks.map((m) => m.x)]);
  const [x, inY] = zoomed(self, whole);
  const y = ends(inY, self.window ? [...framed.map((line) => inside(line, x))] : [
    ...framed.map((line) => line.y),
    marks.map((m) => m.y),
    limits.map((limit) => limit.y).filter((v) => v !== undefined),
  ]);
  const names = legend ? keyPlaces(series, width) : { entries: [], rows: 0 };
  const base = plane(width, height, x, y, { above: ROW * names.rows });
  Object.assign(self, base);
  const clip = `clip-${label.replace(/\W+/g, "-")}`;
  const { box, xs } = base;
  const within = svg(
    "g",
    { "clip-path": `url(#${clip})` },
    bands.map(([low, high]) =>
      svg("rect", { class: "band", x: xs.at(low), width: Math.max(xs.at(high) - xs.at(low), 1), y: box.top, height: box.bottom - box.top }),
    ),
    limits.map((limit) => limitLine(limit, base)),
    series.map((line) => curve(line, base)),
  );
  self.mark = svg("g", {});
  sized(self.drawing, width, height);
  show(
    self.drawing,
    svg("defs", {}, svg("clipPath", { id: clip }, svg("rect", { x: box.left, y: box.top - 6, width: box.right - box.left, height: box.bottom - box.top + 12 }))),
    base.frame,
    within,
    marks.map((mark) => marked(mark, base)),
    key(names),
    self.mark,
  );
}

// The values of a line over a stretch, with its neighbours: what the frame of a zoomed chart holds.
const inside = (line, { low, high }) =>
  line.y.filter((_, i) => [i - 1, i, i + 1].some((at) => line.x[at] >= low && line.x[at] <= high));

function nearest(line, x) {
  let best = 0;
  line.x.forEach((value, i) => {
    if (value !== null && line.y[i] !== null && Math.abs(value - x) < Math.abs((line.x[best] ?? Infinity) - x)) best = i;
  });
  return best;
}

function bars(line, { box, xs, ys }) {
  const half = Math.max(0.3 * Math.abs(xs.at(1) - xs.at(0)), 1.5);
  // From 0 up or down, or from the bottom where 0 is not in sight.
  const foot = ys.log ? box.bottom : Math.min(ys.at(0), box.bottom);
  return line.x.map((value, i) => {
    if (line.y[i] === null) return null;
    const end = ys.at(line.y[i]);
    return svg("rect", { class: `f${line.colour ?? 1}`, x: xs.at(value) - half, width: 2 * half, y: Math.min(end, foot), height: Math.abs(foot - end) });
  });
}

function curve(line, base) {
  const { xs, ys } = base;
  if (line.bars) return bars(line, base);
  const nodes = [];
  if (line.width !== 0) {
    nodes.push(svg("path", { class: `series ${line.paint ?? `c${line.colour ?? 1}`}`, d: pathOf(xs, ys, line.x, line.y), "stroke-dasharray": DASHES[line.dash], "stroke-width": line.width ?? 2 }));
  }
  if (line.shape) {
    line.x.forEach((value, i) => {
      if (value === null || line.y[i] === null || (ys.log && line.y[i] <= 0)) return;
      nodes.push(shape(line.shape, xs.at(value), ys.at(line.y[i]), line.size ?? 3.2, line.colour ?? 1));
    });
  }
  return nodes;
}

function limitLine({ x, y, name }, { box, xs, ys }) {
  if (x !== undefined) {
    const at = xs.at(x);
    return [svg("line", { class: "limit", x1: at, x2: at, y1: box.top, y2: box.bottom }), svg("text", { class: "halo", x: at + 4, y: box.top + 12 }, name)];
  }
  const at = ys.at(y);
  return [svg("line", { class: "limit", x1: box.left, x2: box.right, y1: at, y2: at }), svg("text", { class: "halo", x: box.right - 4, y: at - 5, "text-anchor": "end" }, name)];
}

function marked({ x, y, text, shape: kind = "circle", colour = 2 }, { box, xs, ys }) {
  const [px, py] = [xs.at(x), Math.max(ys.at(y), box.top)];
  const share = (px - box.left) / (box.right - box.left);
  const anchor = share < 0.25 ? "start" : share > 0.75 ? "end" : "middle";
  const above = py - 10 > box.top + 4;
  return [shape(kind, px, py, 4.5, colour, text), text ? svg("text", { class: "halo", x: px, y: above ? py - 10 : py + 20, "text-anchor": anchor }, text) : null];
}

const LETTER = 6.4;
const ROW = 17;

// Where the names of the lines go: in rows above the chart, as wide as it is.
function keyPlaces(series, width) {
  const named = series.filter((line) => line.name);
  if (named.length < 2) return { entries: [], rows: 0 };
  let [x, row] = [MARGIN_LEFT, 0];
  const entries = named.map((line) => {
    const wide = 28 + LETTER * line.name.length + 16;
    if (x + wide > width && x > MARGIN_LEFT) [x, row] = [MARGIN_LEFT, row + 1];
    const place = { line, x, row };
    x += wide;
    return place;
  });
  return { entries, rows: row + 1 };
}

function key({ entries }) {
  return entries.map(({ line, x, row }) => {
    const y = 14 + ROW * row;
    return [
      line.width === 0
        ? shape(line.shape ?? (line.bars ? "square" : "circle"), x + 11, y - 4, 3.5, line.colour ?? 1)
        : svg("path", { class: `series ${line.paint ?? `c${line.colour ?? 1}`}`, d: `M${x} ${y - 4}h22`, "stroke-dasharray": DASHES[line.dash] }),
      svg("text", { x: x + 28, y }, line.name),
    ];
  });
}

function hover(self, event) {
  const line = lineOf(self);
  if (!line?.x.length) return;
  const [px, py] = placeIn(self.drawing, event);
  let [best, least] = [0, Infinity];
  line.x.forEach((value, i) => {
    if (value === null || line.y[i] === null) return;
    const far = Math.hypot(self.xs.at(value) - px, 0.35 * (self.ys.at(line.y[i]) - py));
    if (far < least) [best, least] = [i, far];
  });
  self.cursor(best);
}

function moveCursor(self, index, read) {
  const line = lineOf(self);
  if (!line?.x.length) return;
  const way = index < (self.at ?? 0) ? -1 : 1;
  let next = Math.min(Math.max(index, 0), line.x.length - 1);
  while (line.y[next] === null && line.y[next + way] !== undefined) next += way;
  if (line.y[next] === null || line.x[next] === null) return;
  self.at = next;
  const { x, y } = pointOf(self);
  const [px, py] = [self.xs.at(x), self.ys.at(y)];
  show(self.mark, svg("path", { class: "cursor", d: `M${px} ${self.box.top}V${self.box.bottom}M${self.box.left} ${py}H${self.box.right}` }), shape("circle", px, py, 4, 7));
  self.share(x);
  read.setAttribute("aria-live", "polite");
  read.textContent = wordsOf(self, { x, y }, self.at);
}

// The cursor of another chart: where it stands in this one, and the value there, which is not spoken.
function follow(self, x, read) {
  const line = lineOf(self);
  const at = x === null || !line?.x.length ? null : nearest(line, x);
  const point = at === null ? { y: null } : pointOf(self, at);
  const onIt = point.y === null ? [] : [shape("circle", self.xs.at(point.x), self.ys.at(point.y), 4, 7)];
  if (!rule(self, x, ...onIt) || point.y === null) return;
  read.setAttribute("aria-live", "off");
  read.textContent = wordsOf(self, point, at);
}

function keyed(self, event, onPick) {
  const count = lineOf(self)?.x.length ?? 0;
  if (!count) return;
  if (zoomKey(self, event, () => (self.at === null ? null : pointOf(self).x))) return;
  const at = self.at ?? 0;
  const moves = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
  if (event.key in moves) self.cursor(at + moves[event.key]);
  else if (event.key === "Home") self.cursor(0);
  else if (event.key === "End") self.cursor(count - 1);
  else if ((event.key === "Enter" || event.key === " ") && onPick) onPick(pointOf(self), at);
  else return;
  event.preventDefault();
}

// The buttons that take a chart away.
export function saving(self, file, label, canvas) {
  const as = (text, act) => button(text, () => self.shown && act(), { "aria-label": `${label}: save as ${text}` });
  return [
    as("SVG", () => saveText(svgText(self.drawing, canvas?.()), `${file}.svg`, "image/svg+xml")),
    as("PNG", async () => saveBlob(await pngBlob(self.drawing, canvas?.()), `${file}.png`)),
    as("CSV", () => saveText(csvText(self.columns?.() ?? columnsOf(self.shown)), `${file}.csv`, "text/csv")),
  ];
}

const columnsOf = (shown) =>
  shown.series.flatMap((line, i) => {
    const name = line.name || `series ${i + 1}`;
    return [[shown.x, line.x], [shown.y, line.y]].map(([axis, values]) => [`${name}: ${inMetres(axis)}`, metres(axis, values)]);
  });

const inMetres = ({ name, unit }) => (unit ? name.replace(`[${unit.name}]`, "[m]") : name);
const metres = ({ unit }, values) => (unit ? values.map((v) => (v === null ? null : Number((v / unit.perMetre).toPrecision(15)))) : values);
