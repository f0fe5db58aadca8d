// Nonlinear modes: frequency and damping of a free motion over its amplitude, and what follows from them.

import { on, state } from "../base/state.js";
import { button, byId, el, facts, note, show, titled } from "../base/dom.js";
import { csvText, saveText } from "../base/exports.js";
import { hertz, length, measured, nearestIn, number, seconds } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { asked, current, value } from "../scene/scenes.js";
import { shapeCard } from "../shape/card.js";
import { putAll } from "../views/live.js";
import { figurePart, formPart, statusPart, view } from "../views/view.js";
import { amplitudeOf, columnsOf, dampingChart, frequencyChart, loopChart, performanceChart, shapeChart, stabilityOf, statesAt } from "./charts.js";

const MOST_PINS = 4;
let plots = null;
let space = null;
let last = null;
let point = 0;
let contact = 0;
let over = "modal";
let by = "load";
let pins = [];

export const modes = view({
  kind: "modes", id: "modes", title: "Nonlinear mode", tabs: "modes", wide: true, priority: 4,
  form: {
    words: "Follow the mode", primary: true, top: ["mode", "from", "to", "nodal_diameter", "aero_damping", "exact_peaks"],
    groups: [{ legend: "Loops, peaks, disturbances, phase resonance", id: "more" }],
  },
  bar: { form: "modes-form", words: "Follow the mode", free: true },
  about: "The free motion of a mode changes with its amplitude: stuck contacts are springs, sliding ones dampers.",
  work: "mode", goes: ({ took, points }) => `Following the mode:${took}; ${points} points.`,
  parts: () => [
    formPart("modes"), statusPart("modes"), el("div", { class: "row", id: "modes-tools" }),
    el("div", { class: "halves" }, titled("Frequency", figurePart("modes-frequency")), titled("Damping", figurePart("modes-damping"))),
    el("div", { class: "thirds" },
      titled("Peak over load and excitation", figurePart("modes-peaks"), el("div", { id: "modes-peaks-more" })),
      titled("Hysteresis loop", figurePart("modes-loop"), el("div", { id: "modes-loop-more" })),
      titled("Shape", figurePart("modes-shape"), el("div", { id: "modes-shape-view" }))),
    el("div", { id: "modes-facts" }),
  ],
  start() {
    const plot = (name, label, onPick) => chart(byId(`modes-${name}`), { label, file: `mode-${name}`, height: 280, onPick });
    const pick = (_point, at) => choose(at);
    plots = {
      frequency: plot("frequency", "Frequency over amplitude", pick), damping: plot("damping", "Damping ratio over amplitude", pick),
      performance: plot("peaks", "Peak of the mode"), loop: plot("loop", "Loop at the amplitude"), shape: plot("shape", "Shape at the amplitude"),
    };
    space = shapeCard(byId("modes-shape-view"), { id: "mode-space", file: "mode-shape-in-space" });
    on("scene-left", space.leave);
  },
  scene() {
    [last, point, contact, pins] = [null, 0, 0, []];
    plots.frequency.clear("Choose a mode and its amplitudes, then press “Follow the mode”.");
    plots.damping.clear("Damping ratio, and the limit cycles of flutter.");
    plots.performance.clear("Resonance peaks that follow from the mode.");
    plots.loop.clear("Hysteresis loops of a chosen amplitude.");
    plots.shape.clear("Shape at a chosen amplitude.");
    space.offer({ ...asked(), mode: 1 }, "mode 1, contacts as at rest");
    for (const id of ["modes-tools", "modes-loop-more", "modes-peaks-more"]) show(byId(id));
  },
  result(result, _sweeps, job) {
    if (!result.amplitude.length) return modes.say(result.status, true);
    last = { result, request: job.request };
    // Where most is damped there is most to see.
    point = result.damping_ratio.indexOf(Math.max(...result.damping_ratio));
    contact = Math.min(contact, Math.max((result.motions?.loops.length ?? 1) - 1, 0));
    modes.say(`${result.amplitude.length} points in ${seconds(result.seconds)}. ${result.status}`);
    return draw();
  },
});

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
    choices.map(([key, words]) => button(words, () => { by = key; drawPerformance(); }, { "aria-pressed": String(key === by) })),
    Object.keys(loads).length ? button(`Use the loads × ${number(performance.least.load, 3)}`, () => putAll({ ...state.set, ...loads })) : null),
    performance.scales ? null : note("Forces, loads and motions do not grow together here: peaks over the loads are not known."));
  return undefined;
}

// Every force of the joints times a factor, as values to set.
function loadsAt(factor) {
  if (!factor) return {};
  const loads = [...current.parameters.values()].filter(({ part, unit, otherwise }) => unit === "N" && !otherwise && current.joints.some(({ name }) => name === part));
  return Object.fromEntries(loads.map(({ path }) => [path, value(path)]).filter(([, load]) => load !== 0).map(([path, load]) => [path, Number((load * factor).toPrecision(6))]));
}

// Another point of the curve, or the one nearest to it that has them: its loop, its shape, what the contacts do there.
function choose(at) {
  point = at;
  const { result } = last;
  if (!result.motions?.points.length) {
    plots.loop.clear("It was not asked for loops.");
    plots.shape.clear("It was not asked for shapes.");
    return;
  }
  const there = nearestIn(result.motions.points, point);
  const shown = result.motions.points[there];
  offerShape(shown, there);
  if (result.motions.loops.length) plots.loop.draw(loopChart(result, there, contact));
  else plots.loop.clear("The scene has no contacts.");
  plots.shape.draw(shapeChart(result, there));
  const names = result.motions.loops.map((loop) => loop.contact);
  show(byId("modes-loop-more"),
    el("p", { class: "note", role: "status" }, `At a = ${measured(result.amplitude[shown], "√kg m")}, max |${result.dof}| ${length(result.max_abs[shown])}: ${statesAt(result, shown)}. A click on a curve above shows another amplitude.`),
    el("div", { class: "row" }, names.length > 1 ? names.map((name, i) => button(name, () => { contact = i; choose(point); }, { "aria-pressed": String(i === contact) })) : null));
}

// The shape in space at a point of the curve.
function offerShape(at, there) {
  const { result, request } = last;
  const { scene, set = {}, harmonics = result.n_harmonics } = request;
  const { dofs, shapes: { real, imag } } = result.motions;
  const states = Object.fromEntries(result.contacts.map((name, i) => [name, result.states[at][i]]));
  const body = { scene, set, harmonics, motion: { dofs, real: real[there], imag: imag[there], frequency_hz: result.frequency[at], states } };
  if (result.nodal_diameter !== null) body.nodal_diameter = result.nodal_diameter;
  space.offer(body, `mode ${result.mode} at a = ${measured(result.amplitude[at], "√kg m")}`);
}

function tools() {
  const { result, request } = last;
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
  modes.facts(facts([
    ["mode", `${result.mode}${result.nodal_diameter === null ? "" : `, nodal diameter ${result.nodal_diameter}`}, ${result.n_harmonics} harmonics`],
    ["at small amplitudes", `${hertz(result.frequency[0])}, ζ ${number(100 * result.damping_ratio[0], 4)} %`],
    ["most damping", `ζ ${number(100 * result.damping_ratio[best], 4)} % at ${hertz(result.frequency[best])}, max |${result.dof}| ${length(result.max_abs[best])}`],
    ["estimated error", `${hertz(worst("frequency_error"))}, ζ ${number(100 * worst("damping_error"), 2)} %`],
    ...(performance?.least ? [["least peak", `${length(performance.least.peak)} with the loads × ${number(performance.least.load, 4)}: of this mode alone, a whole response confirms it`]] : []),
    ...(exact ? [["not compared", `${exact} of ${performance.exact.length} whole responses did not reach the end of the band`]] : []),
    ...(flutter ? flutterFacts(flutter, result) : []),
  ]));
}

const known = (error, told) => (error == null ? "not known" : told(error));

function flutterFacts({ cycles, unsolved = [], most_damping: most, most_at: at, most_error: error }, result) {
  const rows = cycles.map((cycle) => [cycle.stable === null ? "cycle" : `${stabilityOf(cycle)} cycle`,
    `${length(cycle.max_abs)} ± ${known(cycle.max_abs_error, length)} at ${hertz(cycle.frequency)}, a ${measured(amplitudeOf(result, "modal").of(cycle), "√kg m")}${cycle.stable === null ? `, the mode alone ${cycle.attracts ? "attracts" : "repels"}, stability not known` : ""}`]);
  rows.push(...unsolved.map(([low, high]) => ["not solved", `a ${number(low, 4)} to ${measured(high, "√kg m")}: a cycle may be there`]));
  if (!rows.length) rows.push(["limit cycles", "none between these amplitudes"]);
  return [...(most === null ? [] : [["most that is held", `ζ_aero −${number(100 * most, 4)} % ± ${known(error, (value) => `${number(100 * value, 2)} %`)} at a ${measured(at, "√kg m")}`]]), ...rows];
}
