// The card of a shape: opened by a button, then it follows what is looked at; played, turned, enlarged, saved.

import { button as buttonOf, byId, el, note, options, say, show } from "../base/dom.js";
import { on } from "../base/state.js";
import { paperColour, saveBlob } from "../base/exports.js";
import { hertz, measured, number } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { STATES } from "../scene/marks.js";

const PERIOD_MS = 2400;
const STEPS = 96;
const FRAMES = 8;
const STRIDE = 6; // steps at a press where motion is to be reduced
const KEYS = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1], "+": [0, 0, 0.85], "-": [0, 0, 1.18] };
const STATE_WORDS = [["is-stick", "sticks"], ["is-slip", "slips"], ["is-apart", "open"]];
const NO_WEBGL = "This browser has no WebGL, with which shapes are drawn. The service tells them as numbers: its preview “shape”.";
const still = matchMedia("(prefers-reduced-motion: reduce)");
const angle = (step) => (2 * Math.PI * step) / STEPS;

export function shapeCard(host, { id, file }) {
  const self = { id, file, host, opened: false, wish: null, shape: null, stage: null, playing: 0, parts: null };
  build(self);
  self.ask = previewer(id, (answer, { token }) => token === self.wish?.token && arrived(self, answer), (error, token) => token === self.wish?.token && empty(self, error.message, true));
  const repaint = () => self.stage?.colourBy(self.parts.by.value);
  on("theme", repaint);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  return {
    // What is looked at now: the body of the question, and in words.
    offer(body, words) {
      const token = JSON.stringify(body);
      if (self.wish?.token === token) return;
      self.wish = { body, words, token };
      if (self.opened) ask(self);
      else empty(self, "");
    },
    leave() {
      self.wish = null;
      empty(self, "");
    },
  };
}

function build(self) {
  const { id } = self;
  const button = (text, label, act) => buttonOf(text, act, { "aria-label": label, title: label });
  const parts = {
    status: el("p", { class: "note", role: "status", id: `${id}-status` }),
    open: buttonOf("", () => { self.opened = true; ask(self); }, { id: `${id}-open` }),
    canvas: null,
    art: el("div", { class: "shape-art" }),
    by: el("select", { id: `${id}-by`, "aria-label": "Coloured by", onchange: () => { self.stage.colourBy(parts.by.value); drawKey(self); } }, options(["amplitude", ["state", "contact state"]])),
    at: el("input", { type: "range", id: `${id}-at`, min: 0, max: STEPS, step: 1, "aria-label": "Angle in the period", oninput: () => { pause(self); move(self); } }),
    play: button("▶", "Play", () => (self.playing ? pause(self) : play(self))),
    whole: button("⤢", "Whole view", () => enlarge(self)),
    png: button("PNG", "Save this frame as PNG", () => save(self, 1)),
    frames: button("Frames", `Save ${FRAMES} frames of a period as PNG`, () => save(self, FRAMES)),
    key: el("div", { class: "key" }),
    notes: note(),
    dialog: el("dialog", { class: "shape-whole", "aria-label": "Shape, whole view" }),
  };
  parts.at.value = "0";
  parts.figure = el("figure", { class: "shape", hidden: true }, el("div", { class: "row tight" }, parts.play, parts.by, parts.whole, parts.png, parts.frames), parts.art, parts.at, parts.key, parts.notes);
  parts.dialog.addEventListener("close", () => {
    parts.dialog.before(parts.figure);
    parts.whole.focus();
  });
  show(self.host, parts.status, parts.open, parts.figure, parts.dialog);
  self.parts = parts;
  new ResizeObserver(() => self.stage?.look()).observe(parts.art);
  empty(self, "");
}

// Nothing to show is one line, with the button that fills it.
function empty(self, words, bad = false) {
  close(self);
  const { parts, wish } = self;
  parts.figure.hidden = true;
  parts.open.hidden = !wish || (self.opened && !bad);
  parts.open.textContent = wish ? `Show ${wish.words}` : "";
  say(parts.status.id, words || (wish ? "" : "Once there is a response, its shape can be shown."), bad);
}

function ask(self) {
  say(self.parts.status.id, `Computing ${self.wish.words} …`);
  self.parts.open.hidden = true;
  self.ask({ kind: "shape", ...self.wish.body }, self.wish.token);
}

async function arrived(self, { reached, status, shape }) {
  if (!reached) return empty(self, status, true);
  const { token } = self.wish;
  const [three, { stage }] = await Promise.all([import("../vendor/three.js"), import("./stage.js")]);
  if (self.wish?.token !== token) return undefined;
  const { parts } = self;
  close(self);
  const canvas = el("canvas", { role: "group", tabindex: 0, "aria-roledescription": "shape in space, arrows turn it, plus and minus bring it nearer" });
  parts.figure.hidden = false;
  show(parts.art, canvas);
  const drawn = stage(three, canvas, shape);
  if (!drawn) return empty(self, NO_WEBGL, true);
  Object.assign(self, { shape, stage: drawn });
  parts.canvas = canvas;
  turns(self, canvas);
  say(parts.status.id, "");
  describe(self);
  drawn.colourBy(parts.by.value);
  move(self);
  canvas.dataset.drawn = token;
  return undefined;
}

function close(self) {
  pause(self);
  self.stage?.close();
  self.stage = null;
}

const sizeOf = ({ unit, amplitude }) => measured(Math.max(...amplitude.flat()), unit);

const statesOf = ({ contacts }) => contacts.filter(({ states }) => states[0]).map(({ name, states }) => {
  const every = [...new Set(states)];
  return `${name} ${every.map((state) => `${STATES[state]?.[1] ?? state}${every.length > 1 ? ` in ${states.filter((other) => other === state).length}` : ""}`).join(", ")}`;
});

function describe(self) {
  const { shape, parts, wish } = self;
  const wave = shape.nodal_diameter === null ? "" : `, nodal diameter ${shape.nodal_diameter}`;
  const words = [`${hertz(shape.frequency_hz)}${wave}`, `largest ${sizeOf(shape)}`, ...statesOf(shape)];
  parts.canvas.setAttribute("aria-label", `${wish.words}: ${words.join("; ")}`);
  const { shown } = self.stage;
  const whole = shape.contacts.filter(({ states, motions }) => states[0] && !motions[0]).map(({ name }) => name);
  const coloured = whole.length ? [`${whole.join(", ")}: coloured by what they do over the whole period.`] : [];
  parts.notes.textContent = [`${words.join(" · ")}.`, ...coloured, ...shape.notes, ...(shown < shape.sectors ? [`${shown} of ${shape.sectors} sectors are drawn.`] : [])].join(" ");
  drawKey(self);
}

function drawKey({ shape, stage: drawn, parts }) {
  const marks = shape.contacts.some(({ states }) => states[0]) ? STATE_WORDS.map(([name, words]) => [el("b", { class: name }), words]) : [];
  const ramp = parts.by.value === "amplitude" ? ["0", el("i"), sizeOf(shape)] : [];
  show(parts.key, ramp, shape.to_scale ? ` drawn × ${number(drawn.factor, 2)} ` : null, marks);
}

function move({ parts, stage: drawn }) {
  const step = Number(parts.at.value);
  parts.at.setAttribute("aria-valuetext", `${Math.round((360 * step) / STEPS)} degrees`);
  drawn?.draw(angle(step));
}

function play(self) {
  const { at, canvas } = self.parts;
  const [from, begun] = [Number(at.value), performance.now()];
  if (still.matches) {
    at.value = String((from + STRIDE) % STEPS);
    return move(self);
  }
  const next = (now) => {
    if (!canvas.clientWidth) return pause(self);
    at.value = String(Math.floor((from + (STEPS * Math.max(now - begun, 0)) / PERIOD_MS) % STEPS));
    move(self);
    self.playing = requestAnimationFrame(next);
    return undefined;
  };
  self.playing = requestAnimationFrame(next);
  return label(self, "❚❚", "Pause");
}

function pause(self) {
  cancelAnimationFrame(self.playing);
  self.playing = 0;
  label(self, "▶", still.matches ? "Step on" : "Play");
}

function label({ parts }, text, words) {
  parts.play.textContent = text;
  for (const name of ["aria-label", "title"]) parts.play.setAttribute(name, words);
}

function turns(self, canvas) {
  let held = null;
  canvas.addEventListener("pointerdown", (event) => {
    held = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", ({ clientX, clientY }) => {
    if (!held) return;
    self.stage?.orbit((held[0] - clientX) / 120, (clientY - held[1]) / 120);
    held = [clientX, clientY];
  });
  canvas.addEventListener("lostpointercapture", () => { held = null; });
  canvas.addEventListener("keydown", (event) => {
    if (!KEYS[event.key]) return;
    event.preventDefault();
    self.stage?.orbit(...KEYS[event.key]);
  });
}

function enlarge({ parts }) {
  if (parts.dialog.open) return parts.dialog.close();
  parts.dialog.append(parts.figure);
  return parts.dialog.showModal();
}

// Frames side by side on paper, the first as it stands.
async function save(self, count) {
  pause(self);
  const { canvas, at } = self.parts;
  const page = el("canvas");
  [page.width, page.height] = [count * canvas.width, canvas.height];
  const brush = page.getContext("2d");
  brush.fillStyle = paperColour();
  brush.fillRect(0, 0, page.width, page.height);
  for (let i = 0; i < count; i += 1) {
    self.stage.draw(angle(Number(at.value) + (i * STEPS) / count));
    brush.drawImage(canvas, i * canvas.width, 0);
  }
  move(self);
  saveBlob(await new Promise((done) => { page.toBlob(done, "image/png"); }), `${self.file}.png`);
}

// The shape of the response that is looked at, at the frequency at which it is.
export function startShape(bodyAt) {
  const card = shapeCard(byId("shape-view"), { id: "shape", file: "shape" });
  on("scene-left", card.leave);
  on("states", ({ at }) => {
    if (at > 0) card.offer(bodyAt(at), `the shape at ${hertz(at)}`);
  });
}
