// Zoom and pan of a map: over a stretch of both axes, the abscissa shared with the charts that have the same.

import { el, show, svg } from "../base/dom.js";
import { look } from "./zoom.js";

const LEAST_DRAG = 8;
const CLOSER = 0.5;
const PAN = 0.2;

const toFrom = (log) => (log ? [Math.log, Math.exp] : [(v) => v, (v) => v]);

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

const seen = (self) => [self.window ?? self.whole, self.windowY ?? self.wholeY];

function zoomMap(self, factor, at = null) {
  if (!self.shown) return;
  const [x, y] = seen(self);
  lookAt(self, stretch(x, self.whole, self.xs.log, { factor, at: at?.x ?? null }), stretch(y, self.wholeY, self.ys.log, { factor, at: at?.y ?? null }));
}

function panMap(self, right, up) {
  if (!self.shown) return;
  const [x, y] = seen(self);
  lookAt(self, self.window && stretch(x, self.whole, self.xs.log, { by: right }), self.windowY && stretch(y, self.wholeY, self.ys.log, { by: up }));
}

const wholeMap = (self) => self.shown && lookAt(self, null, null);

// Buttons of the zoom, and of the axes.
export function mapButtons(self, label, at) {
  const button = (sign, words, act) => el("button", { type: "button", "aria-label": `${label}: ${words}`, title: words, onclick: act }, sign);
  const log = (axis) => {
    const node = button(`log ${axis}`, `logarithmic ${axis}`, () => {
      self.log[axis] = node.getAttribute("aria-pressed") !== "true";
      self.repaint();
    });
    node.setAttribute("aria-pressed", "false");
    return node;
  };
  const [x, y] = [log("x"), log("y")];
  self.sayLog = (ofX, ofY, mayX, mayY) => [[x, ofX, mayX], [y, ofY, mayY]].forEach(([node, is, may]) => {
    node.setAttribute("aria-pressed", String(is));
    node.hidden = !may;
  });
  return [x, y, button("+", "zoom in", () => zoomMap(self, CLOSER, at())), button("−", "zoom out", () => zoomMap(self, 1 / CLOSER)), button("1:1", "the whole", () => wholeMap(self))];
}

// Plus and minus zoom around the cursor, 0 shows the whole, Shift with an arrow moves. Whether the key was one of them.
export function mapKey(self, event, at) {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const moves = { ArrowRight: [PAN, 0], ArrowLeft: [-PAN, 0], ArrowUp: [0, PAN], ArrowDown: [0, -PAN] };
  if (event.key === "+" || event.key === "=") zoomMap(self, CLOSER, at());
  else if (event.key === "-") zoomMap(self, 1 / CLOSER, at());
  else if (event.key === "0") wholeMap(self);
  else if (event.shiftKey && moves[event.key]) panMap(self, ...moves[event.key]);
  else return false;
  event.preventDefault();
  return true;
}

// A rectangle that is drawn over with the mouse is zoomed, with Shift the map is moved. Whether the last press was such a drag.
export function mapDragged(self) {
  const { drawing } = self;
  let [from, far, moving] = [null, false, false];
  const place = (event) => {
    const frame = drawing.getBoundingClientRect();
    const zoom = frame.width / drawing.viewBox.baseVal.width || 1;
    return [(event.clientX - frame.left) / zoom, (event.clientY - frame.top) / zoom];
  };
  const inside = ([x, y]) => [Math.min(Math.max(x, self.box.left), self.box.right), Math.min(Math.max(y, self.box.top), self.box.bottom)];
  drawing.addEventListener("pointerdown", (event) => {
    far = false;
    from = self.shown && self.box && event.button === 0 && event.pointerType === "mouse" ? place(event) : null;
    moving = event.shiftKey;
    if (from) event.preventDefault();
  });
  drawing.addEventListener("pointermove", (event) => {
    if (!from) return;
    const to = place(event);
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
    const [a, b] = [inside(start), inside(place(event))];
    // A stretch that is thin in one direction is of the other alone.
    const along = (one, other, back, now) => (Math.abs(one - other) < LEAST_DRAG ? now : [one, other].map(back).sort((p, q) => p - q));
    lookAt(self, along(a[0], b[0], self.xs.back, self.window), along(a[1], b[1], self.ys.back, self.windowY));
  });
  drawing.addEventListener("dblclick", () => wholeMap(self));
  return () => far;
}
