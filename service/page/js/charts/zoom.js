// Zoom along the abscissa, of a map along both axes, logarithmic axes, and what charts of a tab share that have the same
// abscissa: stretch and crosshair.

import { button, show, svg } from "../base/dom.js";
import { placeIn } from "./plane.js";

const LEAST_DRAG = 8;
const CLOSER = 0.5;
const PAN = 0.2;
const charts = new Set();

// The ends of the abscissa and the ordinate's axis as they are looked at.
export function zoomed(self, x) {
  self.whole = [x.low, x.high];
  const [low, high] = self.window ?? self.whole;
  const { y } = self.shown;
  const log = self.log ?? y.log ?? false;
  // What has values below nothing, such as a loop, has no logarithms.
  const signed = self.shown.series.some((line) => line.y.some((value) => value !== null && value < 0));
  self.sayLog?.(log, signed);
  // A frame that was made for the whole of the other kind of axis is not one for this.
  const free = self.window || log !== (y.log ?? false);
  return [{ ...x, low, high }, free ? { ...y, log, low: log ? undefined : y.low, high: undefined, zero: !log && y.zero } : { ...y, log }];
}

function look(self, window) {
  const wanted = window && self.whole && (window[0] > self.whole[0] || window[1] < self.whole[1])
    ? [Math.max(window[0], self.whole[0]), Math.min(window[1], self.whole[1])] : null;
  if (wanted && !(wanted[1] > wanted[0])) return;
  for (const each of linked(self)) {
    each.window = wanted;
    each.repaint();
  }
}

const seen = ({ drawing }) => drawing.getClientRects().length > 0;
const linked = (self) => [...charts].filter((each) => each === self || (each.shown && each.shown.x.name === self.shown?.x.name && seen(each)));

function around(self, factor, at) {
  if (!self.whole) return;
  const [low, high] = self.window ?? self.whole;
  // Of a logarithmic abscissa stretches are shares of decades.
  const [to, back] = toFrom(self.shown.x.log);
  const [first, last] = [to(low), to(high)];
  const centre = at !== null && at >= low && at <= high ? to(at) : (first + last) / 2;
  look(self, [centre - (centre - first) * factor, centre + (last - centre) * factor].map(back));
}

const toFrom = (log) => (log ? [Math.log, Math.exp] : [(v) => v, (v) => v]);
const isPressed = (node) => node.getAttribute("aria-pressed") === "true";
const zoomButton = (label) => (sign, words, act) => button(sign, act, { "aria-label": `${label}: ${words}`, title: words });

export function zoomButtons(self, label) {
  const log = button("log", () => {
    self.log = !isPressed(log);
    self.repaint();
  }, { "aria-pressed": "false", "aria-label": `${label}: logarithmic` });
  self.sayLog = (is, signed) => {
    log.setAttribute("aria-pressed", String(is));
    log.hidden = signed && !is;
  };
  const of = zoomButton(label);
  return [
    log,
    of("+", "zoom in", () => around(self, CLOSER, self.at === null ? null : self.shown?.series[0]?.x[self.at] ?? null)),
    of("−", "zoom out", () => around(self, 1 / CLOSER, null)),
    of("1:1", "the whole", () => look(self, null)),
  ];
}

// Plus and minus zoom around the cursor, 0 shows the whole again, what else `more` may know. Whether the key was one of them.
function zoomKeyed(event, zoom, whole, more) {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  if (event.key === "+" || event.key === "=") zoom(CLOSER);
  else if (event.key === "-") zoom(1 / CLOSER);
  else if (event.key === "0") whole();
  else if (!more?.()) return false;
  event.preventDefault();
  return true;
}

export const zoomKey = (self, event, at) => zoomKeyed(event, (factor) => around(self, factor, at()), () => look(self, null));

// A stretch that is drawn over with the mouse is zoomed. Returns whether the last press was such a drag, not a click.
export function dragged(self) {
  const { drawing } = self;
  let from = null;
  let wide = false;
  const pixel = (event) => placeIn(drawing, event)[0];
  drawing.addEventListener("pointerdown", (event) => {
    wide = false;
    from = self.shown && self.box && event.button === 0 && event.pointerType === "mouse" ? pixel(event) : null;
  });
  drawing.addEventListener("pointermove", (event) => {
    if (from === null || !self.box) return;
    const [a, b] = [from, pixel(event)].sort((one, other) => one - other);
    wide = b - a >= LEAST_DRAG;
    if (wide) self.mark?.append(svg("rect", { class: "band", x: a, width: b - a, y: self.box.top, height: self.box.bottom - self.box.top }));
  });
  drawing.addEventListener("pointerup", (event) => {
    if (from !== null && wide) look(self, [from, pixel(event)].map((at) => self.xs.back(at)).sort((a, b) => a - b));
    from = null;
  });
  drawing.addEventListener("dblclick", () => look(self, null));
  return () => wide;
}

// The crosshair of one chart stands in the others too, null takes it away; `follow` puts it into a chart.
export function joined(self, follow = (x) => rule(self, x)) {
  charts.add(self);
  self.follow = follow;
  self.share = (x) => linked(self).forEach((each) => each !== self && each.mark && each.follow(x));
}

// A line at a place of the abscissa, if it is seen, with what stands on it.
export function rule(self, x, ...on) {
  const at = x === null ? NaN : self.xs.at(x);
  const within = at >= self.box.left && at <= self.box.right;
  show(self.mark, within ? [svg("path", { class: "cursor", d: `M${at} ${self.box.top}V${self.box.bottom}` }), ...on] : null);
  return within;
}

// A stretch moved and scaled within the whole; null for all of it.
function stretch([low, high], whole, log, { factor = 1, at = null, by = 0 }) {
  const [to, back] = toFrom(log);
  const [first, last, least, most] = [low, high, ...whole].map(to);
  const centre = at !== null && at >= low && at <= high ? to(at) : (first + last) / 2;
  let [a, b] = [centre - (centre - first) * factor, centre + (last - centre) * factor];
  const shift = Math.min(Math.max(by * (b - a), least - a), most - b);
  if (b - a >= most - least) return null;
  [a, b] = [a + shift, b + shift];
  if (a < least) [a, b] = [least, least + b - a];
  if (b > most) [a, b] = [most - (b - a), most];
  return [back(a), back(b)];
}

// Looks at other stretches of both axes; null is the whole of one.
function lookAt(self, x, y) {
  self.windowY = y;
  look(self, x);
  self.repaint();
}

const stretches = (self) => [self.window ?? self.whole, self.windowY ?? self.wholeY];

function zoomMap(self, factor, at = null) {
  if (!self.shown) return;
  const [x, y] = stretches(self);
  lookAt(self, stretch(x, self.whole, self.xs.log, { factor, at: at?.x ?? null }), stretch(y, self.wholeY, self.ys.log, { factor, at: at?.y ?? null }));
}

function panMap(self, right, up) {
  if (!self.shown) return;
  const [x, y] = stretches(self);
  lookAt(self, self.window && stretch(x, self.whole, self.xs.log, { by: right }), self.windowY && stretch(y, self.wholeY, self.ys.log, { by: up }));
}

const wholeMap = (self) => self.shown && lookAt(self, null, null);

// Buttons of the zoom, and of the axes.
export function mapButtons(self, label, at) {
  const of = zoomButton(label);
  const [x, y] = ["x", "y"].map((axis) => {
    const node = of(`log ${axis}`, `logarithmic ${axis}`, () => {
      self.log[axis] = !isPressed(node);
      self.repaint();
    });
    node.setAttribute("aria-pressed", "false");
    return node;
  });
  self.sayLog = (ofX, ofY, mayX, mayY) => [[x, ofX, mayX], [y, ofY, mayY]].forEach(([node, is, may]) => {
    node.setAttribute("aria-pressed", String(is));
    node.hidden = !may;
  });
  return [x, y, of("+", "zoom in", () => zoomMap(self, CLOSER, at())), of("−", "zoom out", () => zoomMap(self, 1 / CLOSER)), of("1:1", "the whole", () => wholeMap(self))];
}

const MOVES = { ArrowRight: [PAN, 0], ArrowLeft: [-PAN, 0], ArrowUp: [0, PAN], ArrowDown: [0, -PAN] };

// Shift with an arrow moves the map.
export const mapKey = (self, event, at) => zoomKeyed(event, (factor) => zoomMap(self, factor, at()), () => wholeMap(self), () => {
  const move = event.shiftKey && MOVES[event.key];
  if (move) panMap(self, ...move);
  return move;
});

// A rectangle that is drawn over with the mouse is zoomed, with Shift the map is moved. Whether the last press was such a drag.
export function mapDragged(self) {
  const { drawing } = self;
  let [from, far, moving] = [null, false, false];
  const inside = ([x, y]) => [Math.min(Math.max(x, self.box.left), self.box.right), Math.min(Math.max(y, self.box.top), self.box.bottom)];
  drawing.addEventListener("pointerdown", (event) => {
    far = false;
    from = self.shown && self.box && event.button === 0 && event.pointerType === "mouse" ? placeIn(drawing, event) : null;
    moving = event.shiftKey;
    if (from) event.preventDefault();
  });
  drawing.addEventListener("pointermove", (event) => {
    if (!from) return;
    const to = placeIn(drawing, event);
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    far ||= Math.hypot(dx, dy) >= LEAST_DRAG;
    if (!far) return;
    if (moving) {
      panMap(self, -dx / (self.box.right - self.box.left), dy / (self.box.bottom - self.box.top));
      from = to;
      return;
    }
    const [a, b] = [inside(from), inside(to)];
    show(self.mark, svg("rect", { class: "map-box", x: Math.min(a[0], b[0]), y: Math.min(a[1], b[1]), width: Math.abs(a[0] - b[0]), height: Math.abs(a[1] - b[1]) }));
  });
  drawing.addEventListener("pointerup", (event) => {
    const start = from;
    from = null;
    if (!start || !far || moving) return;
    const [a, b] = [inside(start), inside(placeIn(drawing, event))];
    // A stretch that is thin in one direction is of the other alone.
    const along = (one, other, back, now) => (Math.abs(one - other) < LEAST_DRAG ? now : [one, other].map(back).sort((p, q) => p - q));
    lookAt(self, along(a[0], b[0], self.xs.back, self.window), along(a[1], b[1], self.ys.back, self.windowY));
  });
  drawing.addEventListener("dblclick", () => wholeMap(self));
  return () => far;
}
