// Nonlinear modes: frequency and damping of a free motion over its amplitude, and what follows from them.

import { state } from "../base/address.js";
import { byId, el, facts, say, show } from "../base/dom.js";
import { on } from "../base/events.js";
import { csvText, saveText } from "../base/exports.js";
import { length, number, seconds } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { asked, current, value } from "../scene/scenes.js";
import { putAll } from "../views/live.js";
import { shapeCard } from "../shape/card.js";
import { amplitudeOf, columnsOf, dampingChart, frequencyChart, loopChart, nearestMotion, performanceChart, shapeChart, stabilityOf, statesAt } from "./charts.js";

const MOST_PINS = 4;
const EMPTY = "Choose a mode and its amplitudes, then press “Follow the mode”.";
let plots = null;
let space = null;
let last = null;
let point = 0;
let contact = 0;
let over = "modal";
let by = "load";
let pins = [];

export function startModes() {
  const pick = (_point, at) => choose(at);
  plots = {
    frequency: chart(byId("modes-frequency"), { label: "Frequency over amplitude", file: "mode-frequency", height: 280, onPick: pick }),
    damping: chart(byId("modes-damping"), { label: "Damping ratio over amplitude", file: "mode-damping", height: 280, onPick: pick }),
    performance: chart(byId("modes-peaks"), { label: "Peak of the mode", file: "mode-peaks", height: 280 }),
    loop: chart(byId("modes-loop"), { label: "Loop at the amplitude", file: "mode-loop", height: 280 }),
    shape: chart(byId("modes-shape"), { label: "Shape at the amplitude", file: "mode-shape", height: 280 }),
  };
  space = shapeCard(byId("modes-shape-view"), { id: "mode-space", file: "mode-shape-in-space" });
  on("scene-left", space.leave);
  on("scene", () => {
    [last, point, contact, pins] = [null, 0, 0, []];
    clear();
  });
}

function clear() {
  plots.frequency.clear(EMPTY);
  plots.damping.clear("Damping ratio, and the limit cycles of flutter.");
  plots.performance.clear("Resonance peaks that follow from the mode.");
  plots.loop.clear("Hysteresis loops of a chosen amplitude.");
  plots.shape.clear("Shape at a chosen amplitude.");
  space.offer({ ...asked(), mode: 1 }, "mode 1, contacts as at rest");
  say("modes-status", "The free motion of a mode changes with its amplitude: stuck contacts are springs, sliding ones dampers.");
  for (const id of ["modes-tools", "modes-facts", "modes-loop-more", "modes-peaks-more"]) show(byId(id));
}

export const modesView = {
  waiting: () => say("modes-status", "The mode waits for a worker."),
  progress: ({ took, points }) => say("modes-status", `Following the mode:${took}; ${points} points.`),
  result(result, _sweeps, job) {
    if (!result.amplitude.length) return say("modes-status", result.status, true);
    last = { result, request: job.request };
    // Where most is damped there is most to see.
    point = result.damping_ratio.indexOf(Math.max(...result.damping_ratio));
    contact = Math.min(contact, Math.max((result.motions?.loops.length ?? 1) - 1, 0));
    say("modes-status", `${result.amplitude.length} points in ${seconds(result.seconds)}. ${result.status}`);
    draw();
    return undefined;
  },
  failed: (words) => say("modes-status", words, true),
};

function draw() {
  drawCurves();
  drawPerformance();
  tools();
  choose(point);
  describe();
}

function drawCurves() {
  plots.frequency.draw(frequencyChart(last.result, over, pins));
  plots.damping.draw(dampingChart(last.result, over, pins));
}

function drawPerformance() {
  const { performance } = last.result;
  if (!performance) return plots.performance.clear("It was not asked for peaks.");
  plots.performance.draw(performanceChart(last.result, by));
  const choices = performance.scales ? [["load", "over the loads"], ["excitation", "over the excitation"]] : [];
  const loads = loadsAt(performance.least?.load);
  show(byId("modes-peaks-more"), el("div", { class: "row" },
    choices.map(([key, words]) => el("button", { type: "button", "aria-pressed": String(key === by), onclick: () => { by = key; drawPerformance(); } }, words)),
    Object.keys(loads).length ? el("button", { type: "button", onclick: () => putAll({ ...state.set, ...loads }) }, `Use the loads × ${number(performance.least.load, 3)}`) : null),
    performance.scales ? null : el("p", { class: "note" }, "Forces, loads and motions do not grow together here: peaks over the loads are not known."));
  return undefined;
}

// Every force of the joints times a factor, as values to set.
function loadsAt(factor) {
  if (!factor) return {};
  const loads = [...current.parameters.values()].filter(({ part, unit, otherwise }) => unit === "N" && !otherwise && current.joints.some(({ name }) => name === part));
  return Object.fromEntries(loads.map(({ path }) => [path, value(path)]).filter(([, load]) => load !== 0).map(([path, load]) => [path, Number((load * factor).toPrecision(6))]));
}

// Another point of the curve: its loop, its shape, what the contacts do there.
function choose(at) {
  point = at;
  const { result } = last;
  if (!result.motions?.points.length) {
    plots.loop.clear("It was not asked for loops.");
    plots.shape.clear("It was not asked for shapes.");
    return;
  }
  const there = nearestMotion(result, point);
  offerShape(result.motions.points[there]);
  const shown = result.motions.points[there];
  if (result.motions.loops.length) plots.loop.draw(loopChart(result, there, contact));
  else plots.loop.clear("The scene has no contacts.");
  plots.shape.draw(shapeChart(result, there));
  const names = result.motions.loops.map((loop) => loop.contact);
  show(byId("modes-loop-more"),
    el("p", { class: "note", role: "status" }, `At a = ${number(result.amplitude[shown], 4)} √kg m, max |${result.dof}| ${length(result.max_abs[shown])}: ${statesAt(result, shown)}. A click on a curve above shows another amplitude.`),
    el("div", { class: "row" }, names.length > 1 ? names.map((name, i) => el("button", { type: "button", "aria-pressed": String(i === contact), onclick: () => { contact = i; choose(point); } }, name)) : null));
}

// The shape in space at a point of the curve.
function offerShape(at) {
  const { result, request } = last;
  const { scene, set = {}, harmonics = result.n_harmonics } = request;
  const there = result.motions.points.indexOf(at);
  const { dofs, shapes: { real, imag } } = result.motions;
  const states = Object.fromEntries(result.contacts.map((name, i) => [name, result.states[at][i]]));
  const body = { scene, set, harmonics, motion: { dofs, real: real[there], imag: imag[there], frequency_hz: result.frequency[at], states } };
  if (result.nodal_diameter !== null) body.nodal_diameter = result.nodal_diameter;
  space.offer(body, `mode ${result.mode} at a = ${number(result.amplitude[at], 3)} √kg m`);
}

function tools() {
  const { result, request } = last;
  const button = (words, act, more = {}) => el("button", { type: "button", ...more, onclick: act }, words);
  const own = Object.entries(request.set ?? {}).map(([path, v]) => `${path} ${number(v)}`).slice(-2).join(", ");
  show(byId("modes-tools"),
    button("over modal amplitude", () => { over = "modal"; redraw(); }, { "aria-pressed": String(over === "modal") }),
    button(`over max |${result.dof}|`, () => { over = "observed"; redraw(); }, { "aria-pressed": String(over === "observed") }),
    button("Pin this curve", () => {
      pins = [...pins, { result, name: `mode ${result.mode}${own ? `, ${own}` : ""}` }].slice(-MOST_PINS);
      redraw();
    }),
    pins.length ? button("Unpin all", () => { pins = []; redraw(); }) : null,
    button("Curve as CSV", () => saveText(csvText(columnsOf(result)), `mode-${state.scene}.csv`, "text/csv")));
}

// The stretch that is zoomed is of the amplitude that was looked at.
function redraw() {
  for (const plot of [plots.frequency, plots.damping]) plot.window = null;
  drawCurves();
  tools();
}

function describe() {
  const { result } = last;
  const best = result.damping_ratio.indexOf(Math.max(...result.damping_ratio));
  const worst = (key) => result[key].reduce((most, v) => (v !== null && v > most ? v : most), 0);
  const { performance, limit_cycles: flutter } = result;
  const exact = (performance?.exact ?? []).filter(({ peak }) => peak === null).length;
  show(byId("modes-facts"), facts([
    ["mode", `${result.mode}${result.nodal_diameter === null ? "" : `, nodal diameter ${result.nodal_diameter}`}, ${result.n_harmonics} harmonics`],
    ["at small amplitudes", `${number(result.frequency[0], 6)} Hz, ζ ${number(100 * result.damping_ratio[0], 4)} %`],
    ["most damping", `ζ ${number(100 * result.damping_ratio[best], 4)} % at ${number(result.frequency[best], 6)} Hz, max |${result.dof}| ${length(result.max_abs[best])}`],
    ["estimated error", `${number(worst("frequency_error"), 2)} Hz, ζ ${number(100 * worst("damping_error"), 2)} %`],
    ...(performance?.least ? [["least peak", `${length(performance.least.peak)} with the loads × ${number(performance.least.load, 4)}: of this mode alone, a whole response confirms it`]] : []),
    ...(exact ? [["not compared", `${exact} of ${performance.exact.length} whole responses did not reach the end of the band`]] : []),
    ...(flutter ? flutterFacts(flutter, result) : []),
  ]));
}

const known = (error, told) => (error == null ? "not known" : told(error));

function flutterFacts({ cycles, unsolved = [], most_damping: most, most_at: at, most_error: error }, result) {
  const rows = cycles.map((cycle) => [cycle.stable === null ? "cycle" : `${stabilityOf(cycle)} cycle`,
    `${length(cycle.max_abs)} ± ${known(cycle.max_abs_error, length)} at ${number(cycle.frequency, 6)} Hz, a ${number(amplitudeOf(result, "modal").of(cycle), 4)} √kg m${cycle.stable === null ? `, the mode alone ${cycle.attracts ? "attracts" : "repels"}, stability not known` : ""}`]);
  rows.push(...unsolved.map(([low, high]) => ["not solved", `a ${number(low, 4)} to ${number(high, 4)} √kg m: a cycle may be there`]));
  if (!rows.length) rows.push(["limit cycles", "none between these amplitudes"]);
  return [...(most === null ? [] : [["most that is held", `ζ_aero −${number(100 * most, 4)} % ± ${known(error, (value) => `${number(100 * value, 2)} %`)} at a ${number(at, 4)} √kg m`]]), ...rows];
}
