// Sliders of the contact and the force, the response that follows them, and earlier ones pinned under it.

import { on, state, tell, write } from "../base/state.js";
import { chart } from "../charts/chart.js";
import { button, byId, el, options, show } from "../base/dom.js";
import { hertz, length, number, quantity } from "../base/format.js";
import { previewer } from "../network/previews.js";
import { responseOf, throughPeak } from "../charts/curves.js";
import { sameValues } from "../scene/inputs.js";
import { secondsOf, takes } from "../scene/kinds.js";
import { asked, current, fieldUnit, inField, ofField, ownValue, sliders as ranges, value, variedParts } from "../scene/scenes.js";

const STEPS = 400;
const COMES = "The response is on its way.";
const SLOW_MS = 300;
const ROOM = 1.3; // above the response, where its limits rise
let plot = null;
let ask = null;
let slow = 0;
// The last response with all harmonics [s]; from LONG on a coarser one comes first.
let took = 0;
const LONG = 0.3;
const COARSE = 5;
let latest = null;
// What the first response is of, which is asked for before the scene is known, and its answer.
let early = null;
// The response of the study, with what it was computed for and its linear limits.
let study = null;

export function startLive() {
  plot = chart(byId("live-figure"), { label: "Frequency response", file: "response", height: 260, onPick: ({ x }) => tell("point", x) });
  plot.clear(COMES);
  ask = previewer("sweep", drawn, refused);
  show(byId("pins"), button("Pin this curve", pin, { id: "pin" }), button("Unpin all", unpin, { id: "unpin", hidden: true }));
  on("study-curve", (found) => {
    study = found;
    redraw();
  });
  // Curve and words of another scene are not shown under the name of this one, whether its own come or not.
  on("scene-left", () => {
    for (const timer of [slow, writing]) clearTimeout(timer);
    [latest, study, took, byId("live-status").textContent] = [null, null, 0, ""];
    plot.clear(COMES);
  });
  on("scene", () => {
    latest = null;
    pinned([]);
    buildSliders();
    if (early?.values !== valuesNow()) refresh();
    else if (early.answer) drawn(...early.answer);
    else sayLate();
    early = null;
  });
  on("scene-contact", buildSliders);
  on("values", () => {
    fillSliders();
    refresh();
  });
}

// The first response comes while the page is being filled.
export function wishFirst() {
  early = { values: valuesNow() };
  wish(asked().harmonics);
}

function sayLate() {
  clearTimeout(slow);
  slow = setTimeout(() => {
    const long = byId("starting").hidden ? takes("sweep") : "slowly until all is ready";
    byId("live-status").textContent = `The response is being computed${long && `, ${long}`} …`;
  }, SLOW_MS);
}

function refresh() {
  if (!current.body) return;
  sayLate();
  wish(Math.max(took, secondsOf("sweep")) > LONG && asked().harmonics > COARSE ? COARSE : asked().harmonics);
}

const valuesNow = () => JSON.stringify([state.scene, asked()]);
const wish = (harmonics) => ask({ kind: "sweep", ...asked(), harmonics }, { scene: state.scene, values: valuesNow(), harmonics });

// What is too large to be followed live is computed by a job, whose response takes the place of this one.
function refused(error, token) {
  clearTimeout(slow);
  early = null;
  if (token.scene !== state.scene) return;
  if (!shown()) plot.clear();
  if (error.retryAfter || error.status === 409) {
    byId("live-status").textContent = error.message;
    return;
  }
  const words = `Not followed live: ${error.message.replace(/:? submit (it as )?a job$/, "")}. `;
  const large = error.status === 503 || /preview/.test(error.message);
  show(byId("live-status"), words, large ? button("Compute it as a job", () => tell("sweep-wanted")) : null);
}

// The response of a job as the live one, where that is not followed.
export function showResponse(result) {
  clearTimeout(slow);
  latest = result;
  redraw();
  byId("live-status").textContent = `Of a job, with ${asked().harmonics} harmonics: ${words(result)}`;
}

const words = ({ peak, band_hz: band, status, peak_certificate: certificate }) =>
  (peak ? `peak ${length(peak.value)} at ${hertz(peak.at)}` : status)
  + (band === null ? "" : `, band ${hertz(band)}`)
  + (peak && certificate && !certificate.known ? `; ${certificate.reason}` : "");

// What the sliders are set to: the response that follows them, or that of the study where it is of the same values.
const ofStudy = () => study?.answer && sameValues(study.request, { set: state.set, harmonics: state.harmonics });
const shown = () => (ofStudy() ? study.answer : latest);

const lineOf = (answer, look) => {
  const { parameter: x, amplitude: y } = throughPeak(answer);
  return { x, y, ...look };
};

const MOST_PINS = 4;
// Earlier responses, each named by the values it had: what a change did is seen beside what was before.
let pins = [];

function pinned(these) {
  pins = these;
  byId("unpin").hidden = pins.length === 0;
  redraw();
}

const pin = () => shown() && pinned([...pins, { answer: shown(), name: nameOf(shown()) }].slice(-MOST_PINS));

function unpin() {
  pinned([]);
  byId("pin").focus();
}

const nameOf = ({ peak }) => {
  const values = Object.entries(state.set).map(([path, value]) => `${path} ${quantity(path, value)}`);
  return [values.length ? values.slice(-2).join(", ") : "values of the scene", peak ? length(peak.value) : ""].filter(Boolean).join(": ");
};

const ghosts = () => pins.map(({ answer, name }, i) => ({ name, x: answer.parameter, y: answer.amplitude, colour: [7, 5, 4, 3][i], dash: "dotted", width: 1.6 }));

function redraw() {
  const answer = shown() ?? study?.answer;
  if (!answer || !current.body) return study?.line && plot.draw({ ...responseOf({ parameter: study.line.x, amplitude: study.line.y, peak: { value: Math.max(...study.line.y), at: study.line.x[0] } }), marks: [] });
  const { limits, line } = study ?? {};
  const others = [...ghosts(), ...(line ? [line] : []), ...(study?.answer && answer !== study.answer ? [lineOf(study.answer, { name: "of the study", colour: 7, dash: "dashed" })] : [])];
  // The linear limits rise far above, and narrow resonances lie between their points: the frame stays with friction.
  const linear = limits ? [lineOf(limits.free, { name: "removed (linear)", colour: 7, dash: "dotted", bare: true }), lineOf(limits.stuck, { name: "stuck (linear)", colour: 3, dash: "dashed", bare: true })] : [];
  const drawing = responseOf(answer, [...others, ...linear]);
  if (linear.length) drawing.y.high = drawing.series.filter(({ bare }) => !bare).flatMap(({ y }) => y).reduce((a, b) => Math.max(a, b), 0) * ROOM;
  return plot.draw(drawing);
}

function drawn(answer, { milliseconds, token }) {
  clearTimeout(slow);
  if (token.scene !== state.scene) return;
  if (!current.body) {
    if (early) early.answer = [answer, { milliseconds, token }];
    return;
  }
  latest = answer;
  redraw();
  tell("states", { states: answer.states, at: answer.peak?.at });
  if (answer.peak) tell("size", answer.peak.value);
  byId("live-status").textContent = `${words(answer)} · ${answer.points} points in ${number(answer.seconds * 1e3, 2)} ms, answered after ${number(milliseconds, 2)} ms${fewer(answer, token)}`;
  performance.mark("live-drawn");
  document.documentElement.dataset.live = String(Number(document.documentElement.dataset.live ?? 0) + 1);
}

// What is left out of a curve for it to come soon: by the page, where that of all harmonics follows, or by the service.
function fewer({ n_harmonics: kept, seconds: taken }, { values, harmonics }) {
  const { harmonics: all } = asked();
  if (kept === all) took = taken;
  if (kept === all || values !== valuesNow()) return "";
  if (kept < harmonics) return ` · preview with ${kept} of ${all} harmonics, to answer at once: the frequency response below keeps all`;
  wish(all);
  return ` · preview with ${kept} harmonics, that with ${all} is being computed`;
}

const toStep = ({ log, low, high }, number) =>
  Math.round(STEPS * (log ? Math.log(Math.max(number, low) / low) / Math.log(high / low) : (number - low) / (high - low)));

const fromStep = ({ log, low, high }, step) =>
  Number((log ? low * (high / low) ** (step / STEPS) : low + ((high - low) * step) / STEPS).toPrecision(4));

let sliders = [];

function buildSliders() {
  sliders = ranges().map((range) => {
    const id = `slide-${range.path.replace(".", "-")}`;
    const slide = el("input", { type: "range", id, min: 0, max: STEPS, step: 1, "aria-describedby": "live-status" });
    const box = el("input", { type: "number", step: "any", "aria-label": `${range.text}, number` });
    slide.addEventListener("input", () => put(range, fromStep(range, Number(slide.value)), true));
    box.addEventListener("change", () => box.value !== "" && Number.isFinite(box.valueAsNumber) && put(range, ofField(range.path, box.valueAsNumber)));
    const node = el("div", { class: "slider" }, el("label", { for: id, title: range.words }, range.text), el("span", { class: "pair" }, box, el("span", {}, fieldUnit(range.path).name)), slide);
    return { range, slide, box, node };
  });
  show(byId("sliders"), contactChooser(), sliders.map((each) => each.node), el("div", {}, button("Values of the scene", () => putAll({}))));
  fillSliders();
}

function contactChooser() {
  const names = variedParts();
  if (names.length < 2) return null;
  const choose = el("select", { id: "contact" }, options(names, state.contact));
  choose.addEventListener("change", () => {
    Object.assign(state, { contact: choose.value, variable: "", range: null });
    write();
    tell("contact");
    buildSliders();
    refresh();
  });
  return el("div", { class: "row" }, el("label", { for: "contact" }, "Contact"), choose);
}

function fillSliders() {
  for (const { range, slide, box, node } of sliders) {
    const now = value(range.path);
    slide.value = String(toStep(range, now));
    slide.setAttribute("aria-valuetext", quantity(range.path, now));
    node.classList.toggle("changed", range.path in state.set && now !== ownValue(range.path));
    if (document.activeElement !== box) box.value = String(inField(range.path, now, 6));
  }
}

let writing = 0;

function put({ path }, number) {
  delete state.set[path];
  state.set[path] = number;
  fillSliders();
  refresh();
  // Browsers refuse to have the address rewritten at every position of a slider.
  clearTimeout(writing);
  writing = setTimeout(() => {
    write();
    tell("settled");
  }, 250);
}

export function putAll(values) {
  state.set = { ...values };
  write();
  tell("values");
  tell("settled");
}
