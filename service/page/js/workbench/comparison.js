// Two runs: their responses over one another, then the quantities that differ, each in one unit, with the difference.

import { orNotice, request } from "../network/api.js";
import { chart } from "../charts/chart.js";
import { byId, details, note, numeric, scrolledTable, show } from "../base/dom.js";
import { tell } from "../base/state.js";
import { number, shownUnit, unitOf, when } from "../base/format.js";
import { kindOf } from "../scene/kinds.js";
import { titleOf } from "./run_list.js";
import { valuesIn } from "./runs.js";

const LONGEST = 48;
const POINTS = 600;
const FACTOR = 3; // from which on a ratio is said as such
// Said by the summaries, or of no use beside another run.
const SAID = /^(peak|peak_at|optimum|values|set|variables)(\.|$)|^(band_hz|error_estimate|harmonics|n_harmonics|scene|kind|status)$/;
const UNIT = /\[([^\]]+)\]/;
const TIMES = /(^|[._])seconds$/;
let plot = null;
let asked = 0;

export function startComparison() {
  plot = chart(byId("runs-compare-figure"), { label: "Responses of two runs", file: "compare", height: 260 });
  byId("runs-compare-close").addEventListener("click", () => {
    byId("runs-compare").hidden = true;
    show(byId("runs-compare-body"));
    tell("comparison-closed");
  });
}

export function compareRuns(a, b) {
  const mine = (asked += 1);
  return orNotice(async () => {
    const [found, ...summaries] = await Promise.all([
      request(`/v1/runs/compare?a=${encodeURIComponent(a)}&b=${encodeURIComponent(b)}`), ...[a, b].map((id) => request(`/v1/runs/${id}/summary?points=${POINTS}`)),
    ]);
    if (mine !== asked) return;
    byId("runs-compare").hidden = false;
    overlay([found.a, found.b], summaries);
    show(byId("runs-compare-body"), differences(found, summaries));
    byId("runs-compare").scrollIntoView({ block: "nearest" });
    byId("runs-compare-title").focus();
  });
}

// Two with the same name are told apart by their values, or by when they were handed in.
function headings(both, summaries) {
  const told = both.map((run, i) => [titleOf(run), ...valuesIn(summaries[i], 1)].join(", "));
  return told[0] === told[1] ? both.map((run) => `${titleOf(run)}, ${when(run.created)}`) : told;
}

function overlay(runs, summaries) {
  const drawn = summaries.map(({ curve, peak }, i) => ({ curve, peak, i })).filter(({ curve }) => curve);
  if (!drawn.length) return plot.clear("Neither run has stored a response over the frequency.");
  const names = headings(runs, summaries);
  const unit = shownUnit(Math.max(...drawn.flatMap(({ curve }) => curve.amplitude)));
  plot.draw({
    x: { name: "frequency [Hz]" }, y: { name: `amplitude [${unit.name}]`, unit, zero: true, pad: 0.1 },
    series: drawn.map(({ curve, i }) => ({ name: names[i], x: curve.frequency_hz, y: curve.amplitude.map((v) => v * unit.perMetre), colour: 1 + i, dash: i ? "dashed" : undefined })),
    marks: drawn.filter(({ peak }) => peak?.at).map(({ peak, i }) => ({ x: peak.at, y: peak.value * unit.perMetre, colour: 1 + i, text: `${number(peak.value * unit.perMetre)} ${unit.name}` })),
  });
  return undefined;
}

// {name, unit, a, b} of everything that is known of both, what people look for first.
function quantities({ a, b, inputs, results }, [one, other]) {
  const pair = (name, unit, of) => ({ name, unit, a: of(one), b: of(other) });
  const paths = [...new Set([one, other].flatMap(({ values }) => Object.keys(values)))];
  // What the schemas of the results say, of those that have several forms of each.
  const told = Object.assign({}, ...[b, a].flatMap(({ kind }) => [...Object.values(kindOf(kind)?.result?.$defs ?? {}), kindOf(kind)?.result ?? {}]).map(({ properties }) => properties ?? {}));
  const settings = Object.fromEntries([a, b].flatMap(({ kind }) => kindOf(kind)?.fields ?? []).map((field) => [field.key, field]));
  const worst = [one, other].some((summary) => summary.worst);
  return [
    pair(worst ? "Highest peak, of a robust design the worst" : "Highest peak", "m", ({ peak }) => peak?.value ?? null), pair("at", "Hz", ({ peak }) => peak?.at || null),
    pair("Resonance band", "Hz", ({ band_hz: band }) => band), pair("Error estimate of the peak", "m", ({ error_estimate: error }) => error), pair("Harmonics", "", ({ harmonics }) => harmonics),
    ...paths.map((path) => pair(path, unitOf(path), ({ values }) => values[path] ?? null)),
    ...inputs.filter(({ path }) => !SAID.test(path) && !paths.includes(path)).map(({ path, a: x, b: y, part }) => {
      const field = settings[path.split(".")[0]];
      return { name: field ? path.replace(field.key, field.label) : path, unit: part === "scene" ? unitOf(path) : field?.unit ?? "", a: x, b: y, scene: part === "scene" };
    }),
    // A number without a unit is a count or a residual of the computation: the JSON of the runs has them.
    ...results.filter(({ name }) => !SAID.test(name)).map(({ name, a: x, b: y }) => {
      const words = told[name]?.description ?? "";
      return { name: nameIn(words) || name.replaceAll("_", " ").replaceAll(".", ", "), unit: UNIT.exec(words)?.[1] ?? (TIMES.test(name) ? "s" : name.endsWith("_hz") ? "Hz" : ""), a: x, b: y };
    }).filter(({ unit, a: x, b: y }) => unit || ![x, y].some(isNumber)),
  ];
}

// What words call a quantity, unless they only go on from the name of the key.
const nameIn = (words) => (/^(Of|With|At|In) /.test(words) ? "" : words.split(/[.,;:[]/)[0].trim());

function differences(found, summaries) {
  const { a, b, more_inputs: further } = found;
  const all = quantities(found, summaries);
  const same = a.scene === b.scene;
  const differing = all.filter((each) => !isEqual(each) && (same || !each.scene));
  const equal = all.filter((each) => isEqual(each) && each.a !== null);
  const ofScenes = same ? [] : all.filter((each) => each.scene && !isEqual(each));
  const heads = ["quantity", ...[...headings([a, b], summaries), "difference"].map(numeric)];
  const part = (label, list) => scrolledTable(label, heads, list.map(row));
  return [
    same ? null : note(`The scenes are different ones: ${a.scene ?? "none"} and ${b.scene ?? "none"}.`),
    differing.length ? part("Differences of two runs", differing) : note("Nothing differs: both computed the same."),
    further ? note(`${further} further inputs differ.`) : null,
    ofScenes.length ? details(`${ofScenes.length} values of the scenes`, part("Values of two scenes", ofScenes)) : null,
    equal.length ? details(`${equal.length} of ${all.length} quantities are equal`, part("Equal quantities of two runs", equal)) : null,
  ];
}

const isEqual = ({ a, b }) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
const isNumber = (value) => typeof value === "number";

function row({ name, unit, a, b }) {
  const { name: told, perMetre } = shownUnit(Math.max(...[a, b].filter(isNumber).map(Math.abs), 0), unit);
  const said = (value) => (isNumber(value) ? `${number(value * perMetre)} ${told}`.trim() : words(value));
  return [name, ...[a, b].map((value) => ({ text: said(value), title: typeof value === "string" ? value : undefined, number: true })), numeric(isNumber(a) && isNumber(b) ? change(a * perMetre, b * perMetre, told) : "")];
}

// The second against the first: as a ratio where it is another size, else in per cent.
function change(a, b, unit) {
  if (a === b) return "";
  if (!(a > 0 && b > 0)) return `${b > a ? "+" : "−"}${number(Math.abs(b - a), 3)} ${unit}`.trim();
  if (b / a >= FACTOR || a / b >= FACTOR) return b > a ? `× ${number(b / a, 3)}` : `÷ ${number(a / b, 3)}`;
  return `${b > a ? "+" : "−"}${number(100 * Math.abs(b / a - 1), 2)} %`;
}

function words(value) {
  if (value === null || value === undefined) return "–";
  const text = typeof value === "object" ? JSON.stringify(value) : String(value);
  return text.length > LONGEST ? `${text.slice(0, LONGEST)}…` : text;
}
