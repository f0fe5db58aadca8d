// Zoom along the abscissa, a logarithmic ordinate, and what charts of a tab share that have the same abscissa: stretch
// and crosshair.

import { el, show, svg } from "../base/dom.js";

const LEAST_DRAG = 8;
const CLOSER = 0.5;
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

export function look(self, window) {
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
  const [to, back] = self.shown.x.log ? [Math.log, Math.exp] : [(v) => v, (v) => v];
  const [first, last] = [to(low), to(high)];
  const centre = at !== null && at >= low && at <= high ? to(at) : (first + last) / 2;
  look(self, [centre - (centre - first) * factor, centre + (last - centre) * factor].map(back));
}

export function zoomButtons(self, label) {
  const log = el("button", { type: "button", "aria-pressed": "false", "aria-label": `${label}: logarithmic`, onclick: () => {
    self.log = log.getAttribute("aria-pressed") !== "true";
    self.repaint();
  } }, "log");
  self.sayLog = (is, signed) => {
    log.setAttribute("aria-pressed", String(is));
    log.hidden = signed && !is;
  };
  const button = (sign, words, act) => el("button", { type: "button", "aria-label": `${label}: ${words}`, title: words, onclick: act }, sign);
  return [
    log,
    button("+", "zoom in", () => around(self, CLOSER, self.at === null ? null : self.shown?.series[0]?.x[self.at] ?? null)),
    button("−", "zoom out", () => around(self, 1 / CLOSER, null)),
    button("1:1", "the whole", () => look(self, null)),
  ];
}

// Plus and minus zoom around the cursor, 0 shows the whole again. Whether the key was one of them.
export function zoomKey(self, event, at) {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  if (event.key === "+" || event.key === "=") around(self, CLOSER, at());
  else if (event.key === "-") around(self, 1 / CLOSER, at());
  else if (event.key === "0") look(self, null);
  else return false;
  event.preventDefault();
  return true;
}

// A stretch that is drawn over with the mouse is zoomed. Returns whether the last press was such a drag, not a click.
export function dragged(self) {
  const { drawing } = self;
  let from = null;
  let wide = false;
  const pixel = (event) => {
    const frame = drawing.getBoundingClientRect();
    return (event.clientX - frame.left) / (frame.width / drawing.viewBox.baseVal.width || 1);
  };
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
