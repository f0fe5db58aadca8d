// One point: loops, a period against the time march, harmonics.

import { on, state, tell, write } from "../base/state.js";
import { button, byId, el, facts, say, show, titled } from "../base/dom.js";
import { hertz, largest, length, notes, number, percent, shownUnit, times } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { resume, run } from "../network/jobs.js";
import { previewer } from "../network/previews.js";
import { asked, current } from "../scene/scenes.js";
import { figurePart, statusPart, view } from "./view.js";

const MARCH_EVERY = 16;
const MOTIONS = [["stick", "sticks", undefined], ["slip", "slips", "dashed"], ["apart", "open", "dotted"]];
let plots = null;
let found = null;
let march = null;
let chosen = 0;
let ask = null;

export const point = view({
  id: "point", title: "One point", tabs: "response map disk", wide: true,
  about: "Click on a response or on the map, or enter a frequency.",
  parts: () => [
    statusPart("point"),
    el("div", { class: "row" }, el("label", { for: "point-at" }, "Frequency"), el("input", { type: "number", id: "point-at", step: "any", min: "0" }), el("span", {}, "Hz"),
      button("Show", typed, { id: "point-show" })),
    el("div", { class: "thirds" }, titled("Hysteresis loops", figurePart("loops-figure"), el("div", { id: "loops-more" })),
      titled("One period, with the time march", figurePart("history-figure"), statusPart("march")), titled("Harmonics", figurePart("harmonics-figure"))),
    el("div", { id: "point-facts" }),
  ],
  start() {
    plots = {
      loops: chart(byId("loops-figure"), { label: "Hysteresis loop", file: "loop", height: 190 }),
      history: chart(byId("history-figure"), { label: "One period", file: "period", height: 190 }),
      harmonics: chart(byId("harmonics-figure"), { label: "Amplitude of each harmonic", file: "harmonics", height: 190, legend: false }),
    };
    ask = previewer("point", (answer, { token }) => token === wish() && arrived(answer), (error) => point.say(error.message, true));
    byId("point-at").addEventListener("keydown", (event) => event.key === "Enter" && typed());
    on("point", go);
    on("peak", (at) => state.at === null && go(at));
    on("settled", () => state.at !== null && go(state.at));
  },
  scene() {
    found = march = null;
    say("march-status", "");
    show(byId("loops-more"));
    for (const plot of Object.values(plots)) plot.clear();
    if (state.at !== null) go(state.at, true);
  },
});

const typed = () => go(byId("point-at").valueAsNumber);
const wish = () => JSON.stringify([state.scene, state.set, state.harmonics, state.at]);

function go(frequency, again = false) {
  if (!(frequency > 0)) return point.say("The frequency must be a number above 0.", true);
  if (state.at !== frequency) again = false;
  state.at = frequency;
  write();
  byId("point-at").value = String(Number(frequency.toPrecision(7)));
  march = null;
  say("march-status", "");
  ask({ kind: "point", ...asked(), frequency_hz: frequency }, wish());
  if (again && state.jobs.march) resume("march", timeMarch);
  return undefined;
}

function arrived(answer) {
  found = answer;
  if (!answer.converged) return point.say(answer.status, true);
  point.say(`${hertz(answer.frequency_hz)}: ${length(answer.max_abs)}, error about ${length(answer.error_estimate)}.`);
  const states = answer.period.contacts.map((c) => [c.name, c.shares ? `${c.state}: ${shares(c.shares)}` : c.state]);
  point.facts(
    facts([["max |x|", length(answer.max_abs)], ["half peak to peak", length(answer.half_peak_to_peak)], ["mean", length(answer.mean)], ...states, ...notes(answer)]),
    button("Compare with the time march", () => referee()),
  );
  tell("states", { states: Object.fromEntries(answer.period.contacts.map((c) => [c.name, c.state])), at: answer.frequency_hz, period: answer.period });
  draw();
  judged();
  if (!byId("march-status").textContent && !state.jobs.march) say("march-status", "The time march, which shares nothing with the balance, has not been asked.");
  return undefined;
}

const shares = ({ stick, slip, separation }) =>
  [["sticks", stick], ["slips", slip], ["open", separation]].filter(([, s]) => s > 0).map(([w, s]) => `${w} ${percent(s)}`).join(", ");

export function referee(priority = 0, tags = []) {
  if (state.at === null) return null;
  const { scene, set } = asked();
  return run("march", { scene, set, frequency_hz: state.at, history: true, tags }, timeMarch, priority);
}

function judged() {
  if (!march) return;
  const apart = found?.max_abs ? `, ${number(100 * Math.abs(march.max_abs / found.max_abs - 1), 2)} % apart` : "";
  say("march-status", `Time march: ${length(march.max_abs)} after ${march.periods} periods${apart}.`);
}

// Follows the point that is looked at, which begins it.
export const timeMarch = view({
  kind: "march", id: "march", tabs: "response", work: "time march", goes: () => "The time march runs.",
  result(result, _sweeps, job) {
    if (Math.abs(job.request.frequency_hz - state.at) > 1e-9 * state.at) return;
    march = result;
    judged();
    if (found?.period) draw();
  },
});

const some = (values) => values.filter((_, i) => i % MARCH_EVERY === 0);

function draw() {
  drawHistory();
  drawLoop();
  drawHarmonics();
}

function drawHistory() {
  const { time, displacement } = found.period;
  const unit = shownUnit(largest(displacement));
  const [per, word] = time[time.length - 1] < 0.1 ? [1e3, "ms"] : [1, "s"];
  const line = (x, y) => ({ x: x.map((t) => t * per), y: y.map((v) => v * unit.perMetre) });
  const series = [{ name: "balance", ...line(time, displacement), colour: 1 }];
  const other = march?.history;
  if (other) series.push({ name: "time march", ...line(some(other.time), some(other.displacement)), colour: 2, width: 0, shape: "circle", size: 3 });
  plots.history.draw({ x: { name: `time [${word}]` }, y: { name: `${current.body.observe.dof} [${unit.name}]`, unit, pad: 0.06 }, series });
}

function drawLoop() {
  const contacts = found.period.contacts;
  if (!contacts.length) return;
  chosen = Math.min(chosen, contacts.length - 1);
  const contact = contacts[chosen];
  const unit = shownUnit(largest(contact.slip));
  const up = times(unit.perMetre);
  const x = contact.slip.map(up);
  const pieces = contact.motion
    ? MOTIONS.map(([paint, name, dash], code) => piece(contact, x, code, { paint, name, dash })).filter(Boolean)
    : [{ name: "", x, y: contact.force, colour: 1 }];
  const other = march?.history?.contacts.find((c) => c.name === contact.name);
  if (other) pieces.push({ name: "time march", x: some(other.slip).map(up), y: some(other.force), colour: 7, width: 0, shape: "circle", size: 2.6 });
  plots.loops.draw({ x: { name: `slip motion of ${contact.name} [${unit.name}]`, unit, pad: 0.06 }, y: { name: "friction force [N]", pad: 0.06 }, series: pieces });
  const choose = contacts.length > 1
    ? contacts.map((c, i) => button(c.name, () => { chosen = i; drawLoop(); }, { "aria-pressed": String(i === chosen) }))
    : [];
  show(byId("loops-more"), el("div", { class: "row" }, choose));
}

// The stretches of a loop in which the contact does one thing; gaps elsewhere.
function piece({ motion, force }, x, code, line) {
  if (!motion.includes(code)) return null;
  const inside = (i) => motion[i % motion.length] === code || motion[(i - 1 + motion.length) % motion.length] === code;
  const cut = (values) => values.map((v, i) => (inside(i) ? v : null));
  return { ...line, x: cut(x), y: cut(force), width: 2.4 };
}

function drawHarmonics() {
  const heights = found.harmonics.map((v) => (v > 0 ? v : null));
  const unit = shownUnit(largest(found.harmonics));
  const least = 1e-6 * largest(found.harmonics);
  const shown = heights.map((v) => (v !== null && v > least ? v * unit.perMetre : null));
  plots.harmonics.draw({
    x: { name: "harmonic (0 is the mean)", whole: true, low: -0.5, high: found.harmonics.length - 0.5 },
    y: { name: `amplitude [${unit.name}]`, unit, log: true, pad: 0.08 },
    series: [{ name: "amplitude", x: found.harmonics.map((_, i) => i), y: shown, colour: 1, bars: true, width: 0 }],
  });
}
