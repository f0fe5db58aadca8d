// The fit over the data, and the tables that say how sure it is.

import { el, numeric, scrolled, scrolledTable } from "../base/dom.js";
import { hertz, largest, number, quantity, shownUnit, times, valuesSaid } from "../base/format.js";

const COLOURS = 6;
const SHAPES = ["circle", "square", "triangle", "diamond"];

// What tells the runs apart: the conditions that are not the same in all.
function namesOf(runs) {
  const paths = [...new Set(runs.flatMap(({ conditions }) => Object.keys(conditions)))];
  const varied = paths.filter((path) => new Set(runs.map(({ conditions }) => conditions[path])).size > 1);
  return runs.map(({ conditions }, i) => varied.filter((path) => path in conditions).map((path) => `${path.split(".").pop()} ${quantity(path, conditions[path])}`).join(", ") || `run ${i + 1}`);
}

const style = (i) => ({ colour: 1 + (i % COLOURS), shape: SHAPES[i % SHAPES.length] });

// Data as points, the fit as a line through them, run after run.
function over(runs, x, y, of, factor) {
  const names = namesOf(runs);
  const up = (values) => (values ?? []).map(times(factor));
  const data = runs.map((run, i) => ({ name: names[i], x: of(run.x), y: up(run[y]), ...style(i), width: 0, size: 3.2 }));
  const fits = runs.flatMap((run, i) => (run[x] ? [{ name: "", x: of(run.x), y: up(run[x]), colour: style(i).colour, width: 1.8 }] : []));
  return [...data, ...fits];
}

export function responsesChart(all) {
  const runs = all.filter(({ kind }) => kind === "response");
  if (!runs.length) return null;
  const unit = shownUnit(Math.max(...runs.map(({ data }) => largest(data))));
  return {
    x: { name: "frequency [Hz]", pad: 0.02 },
    y: { name: `amplitude [${unit.name}]`, unit, zero: true, pad: 0.08 },
    series: over(runs, "fit", "data", (x) => x, unit.perMetre),
    describe: (x, y) => `${hertz(x)}: ${number(y, 4)} ${unit.name} measured`,
  };
}

export function phasesChart(all) {
  const runs = all.filter(({ phase_deg: phase }) => phase);
  if (!runs.length) return null;
  return { x: { name: "frequency [Hz]", pad: 0.02 }, y: { name: "phase [deg]", pad: 0.06 }, series: over(runs, "fit_phase_deg", "phase_deg", (x) => x, 1) };
}

export function loopsChart(all) {
  const runs = all.filter(({ kind }) => kind === "loop");
  if (!runs.length) return null;
  const unit = shownUnit(Math.max(...runs.map(({ x }) => largest(x))));
  return { x: { name: `motion [${unit.name}]`, unit, pad: 0.06 }, y: { name: "force [N]", pad: 0.06 }, series: over(runs, "fit", "data", (x) => x.map(times(unit.perMetre)), 1) };
}

export function estimatesTable({ estimates }) {
  const range = ([low, high], path) => `${number(low, 5)} to ${quantity(path, high)}`;
  return scrolledTable("Estimates", ["parameter", numeric("estimate"), numeric("± standard error"), "95 % interval", "bounds", "told by the data"],
    estimates.map((one) => [one.name, numeric(el("strong", {}, quantity(one.name, one.value))), numeric(one.standard_error === null ? "–" : number(one.standard_error, 3)),
      range(one.interval, one.name), one.bounds ? range(one.bounds, one.name) : "–",
      el("span", { class: one.told ? "chip good" : "chip bad" }, one.told ? (one.at_bound ? "yes, at a bound" : "yes") : "no")]));
}

// Correlations as a table of heat: blue below 0, orange above, the number always.
export function correlationTable({ estimates, correlation }) {
  if (estimates.length < 2 || !correlation.length) return null;
  const cell = (value, row, column) => {
    const node = el("td", { class: `number heat ${value < 0 ? "cold" : "warm"}` }, row === column ? "1" : value === null ? "–" : number(value, 2));
    node.style.setProperty("--share", row === column || value === null ? "0" : String(Math.min(Math.abs(value), 1)));
    return node;
  };
  return scrolled("Correlations", el("table", { class: "heat-table" }, el("caption", { class: "unseen" }, "Correlations of the estimates"),
    el("thead", {}, el("tr", {}, el("th", { scope: "col" }, ""), estimates.map(({ name }) => el("th", { scope: "col" }, name)))),
    el("tbody", {}, correlation.map((row, i) => el("tr", {}, el("th", { scope: "row" }, estimates[i].name), row.map((value, j) => cell(value, i, j)))))));
}

export function candidatesTable({ candidates }) {
  if (!candidates.length) return null;
  return scrolledTable("Measurements to make next", ["measure next", numeric("tells more"), "narrows the error of"],
    candidates.slice(0, 6).map((one, i) => [i ? valuesSaid(one.conditions) : el("strong", {}, valuesSaid(one.conditions)), numeric(number(one.gain, 3)),
      one.tells ? `${one.tells} × ${number(one.factor, 2)}` : "–"]));
}
