// Identification: measured responses and loops, the parameters looked for, the fit, how sure it is, what comes next.

import { state } from "../base/address.js";
import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { csvText, saveText } from "../base/exports.js";
import { number, percent, quantity, seconds } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { rowsOf } from "../design/rows.js";
import { run } from "../network/jobs.js";
import { asked, ranges, value, variables, variedParts } from "../scene/scenes.js";
import { putAll } from "../views/live.js";
import { clearData, fillData, list, runsRead, sourceNames, startData, tables } from "./data.js";
import { candidatesTable, correlationTable, estimatesTable, loopsChart, phasesChart, responsesChart } from "./fit.js";

const PRIORITY = 4;
const AROUND = 3;
const EMPTY = "Choose files of measured responses or loops, or paste one, to see them here.";
let rows = null;
let plots = null;
let last = null;

export function startIdentify() {
  const paths = () => [...new Set([...variables(), ...variedParts().flatMap(ranges).map(({ path }) => path), "excitation.amplitude"])];
  rows = rowsOf(byId("identify-unknowns"), { id: "identify-unknowns", one: "parameter", least: 1, columns: [
    { key: "path", label: "Parameter", type: "select", options: paths }, { key: "low", label: "from" }, { key: "high", label: "to" },
    { key: "mean", label: "Known before: mean", hint: "none" }, { key: "sd", label: "± standard deviation", hint: "none" },
    { key: "how", label: "Steps", type: "select", options: () => ["auto", "linear", "logarithmic"] }] });
  // A parameter that is chosen brings bounds around its value.
  byId("identify-unknowns").addEventListener("change", (event) => event.target.name === "path" && bounds(event.target.closest(".problem-row")));
  byId("identify-unknowns-add").addEventListener("click", () => bounds(byId("identify-unknowns").querySelector(".problem-row:last-child")));
  plots = {
    response: chart(byId("identify-response"), { label: "Fit over the data", file: "fit", height: 320, link: "measured" }),
    second: chart(byId("identify-second"), { label: "Phases or loops", file: "fit-phases", height: 320, link: "measured" }),
  };
  startData(() => {
    last = null;
    list();
    draw();
    results();
  });
  byId("identify-form").addEventListener("submit", (event) => {
    event.preventDefault();
    submit();
  });
  on("scene", () => {
    last = null;
    clearData();
    fillUnknowns({});
    draw();
    results();
    say("identify-status", "Parameters of the scene from what a rig measured, with how sure they are.");
  });
  on("resubmit", (kind) => kind === "identify" && submit());
}

function bounds(row) {
  const path = row?.querySelector("[name=path]").value;
  const now = path ? value(path) : null;
  if (!now) return;
  const ends = [now / AROUND, now * AROUND].map((end) => Number(end.toPrecision(3))).sort((a, b) => a - b);
  ["low", "high"].forEach((key, i) => { row.querySelector(`[name=${key}]`).value = String(ends[i]); });
}

function fillUnknowns({ unknowns, priors, scaling, noise, robust, starts }) {
  const own = variedParts()[0];
  const first = own ? ranges(own).map(({ path }) => path).filter((path) => /\.(kt|mu)$/.test(path)) : [];
  const given = Object.entries(unknowns ?? {});
  rows.fill(given.length
    ? given.map(([path, [low, high]]) => ({ path, low, high, mean: priors?.[path]?.[0], sd: priors?.[path]?.[1], how: scaling?.[path] ?? "auto" }))
    : (first.length ? first : variables().slice(0, 1)).map((path) => ({ path, how: "auto" })));
  if (!given.length) for (const row of byId("identify-unknowns").querySelectorAll(".problem-row")) bounds(row);
  byId("identify-noise").value = noise ?? "";
  byId("identify-robust").checked = robust ?? false;
  byId("identify-starts").value = String(starts ?? 16);
}

// What the fields say, in the words of the service. What is no number is said here, at its field.
function body() {
  const found = { data: tables(), unknowns: {}, robust: byId("identify-robust").checked };
  const [priors, scaling, wrong] = [{}, {}, []];
  const numberIn = (row, key, words, needed) => {
    if (row[key] === undefined && !needed) return undefined;
    const given = Number(row[key]);
    if (row[key] === undefined || !Number.isFinite(given)) wrong.push({ pointer: `/unknowns/${row.path}`, detail: `${row.path}, ${words}, must be a number, got ${row[key] ?? "nothing"}.` });
    return given;
  };
  for (const row of rows.read()) {
    if (row.path in found.unknowns) wrong.push({ pointer: `/unknowns/${row.path}`, detail: `${row.path} stands there twice.` });
    found.unknowns[row.path] = [numberIn(row, "low", "from", true), numberIn(row, "high", "to", true)];
    if (row.mean !== undefined || row.sd !== undefined) priors[row.path] = [numberIn(row, "mean", "mean", true), numberIn(row, "sd", "standard deviation", true)];
    if (row.how && row.how !== "auto") scaling[row.path] = row.how;
  }
  if (Object.keys(priors).length) found.priors = priors;
  if (Object.keys(scaling).length) found.scaling = scaling;
  for (const [key, input] of [["noise", byId("identify-noise")], ["starts", byId("identify-starts")]]) if (input.value !== "") found[key] = input.valueAsNumber;
  if (!found.data.length) wrong.push({ pointer: "/data", detail: "Choose files of measured data first, or paste one." });
  return { found, wrong };
}

async function submit() {
  complain([]);
  const { found, wrong } = body();
  if (wrong.length) return complain(wrong);
  // Values that the scene has been given by hand stay; those looked for are found.
  await run("identify", { ...asked(), ...found }, identifyView, PRIORITY);
  return undefined;
}

function complain(errors) {
  for (const node of byId("identify-form").querySelectorAll("[aria-invalid]")) node.removeAttribute("aria-invalid");
  say("identify-wrong", errors.map(({ detail }) => named(detail)).join(" "), true);
  for (const { pointer } of errors) {
    const [top, which] = pointer.split("/").slice(1);
    const row = [...byId("identify-unknowns").querySelectorAll(".problem-row")].find((each) => each.querySelector("[name=path]").value === which);
    const field = row?.querySelector(top === "priors" ? "[name=mean]" : "[name=low]") ?? (["noise", "starts"].includes(top) ? byId(`identify-${top}`) : null);
    field?.setAttribute("aria-invalid", "true");
  }
  byId("identify-form").querySelector("[aria-invalid]")?.focus();
}

// A table of a job by the name of its file.
const named = (text) => text.replaceAll(/data\[(\d+)\]/g, (whole, i) => sourceNames()[Number(i)] ?? whole);

export const identifyView = {
  waiting: () => say("identify-status", "The identification waits for a worker."),
  progress: ({ took, points }) => say("identify-status", `Identifying:${took}; ${points} evaluations.`),
  submitted(job) {
    fillUnknowns(job.request);
    fillData(job.request.data ?? []);
  },
  result(result, _sweeps, job) {
    last = { result, request: job.request };
    say("identify-status", `${result.status} ${result.evaluations} evaluations in ${seconds(result.seconds)}.`);
    draw();
    results();
  },
  failed(words, errors = []) {
    say("identify-status", named(words), true);
    complain(errors);
  },
};

function draw() {
  const runs = last?.result.runs ?? runsRead();
  const [response, phases, loops] = [responsesChart(runs), phasesChart(runs), loopsChart(runs)];
  const second = response ? (phases ?? loops) : null;
  const first = response ?? loops;
  if (first) plots.response.draw(first);
  else plots.response.clear(EMPTY);
  byId("identify-second-part").hidden = !second;
  if (second) plots.second.draw(second);
}

function results() {
  byId("identify-result").hidden = !last;
  if (!last) return;
  const { result } = last;
  const doubts = [
    ...(result.misfit ? [["misfit", bad(result.misfit)]] : []),
    ...result.not_reached.map(({ run: source, at }) => ["no response found", bad(`${named(source)} at ${at.map((f) => number(f, 5)).join(", ")} Hz`)]),
    ...result.untold.map(({ words }) => ["not told", bad(words)]),
    ...result.correlated.map(({ names, correlation }) => ["hard to tell apart", `${names.join(" and ")}: correlation ${number(correlation, 3)}`]),
    ...result.other_optima.map(({ misfit, ...values }) => ["another optimum", `${Object.entries(values).map(([path, v]) => `${path} ${quantity(path, v)}`).join(", ")}${misfit === undefined ? "" : `: misfit × ${number(misfit, 3)}`}`]),
  ];
  show(byId("identify-estimates"), estimatesTable(result), facts([
    ["noise", result.noise === null ? "–" : `${number(100 * result.noise, 3)} % of the amplitude`],
    ["left over", result.reduced_chi2 === null ? "–" : `χ² ${number(result.reduced_chi2, 3)} for each degree of freedom`],
    ["starts", `${result.agreeing} of the best searches agree; ${result.starts} places tried`], ...doubts,
  ]));
  const heat = correlationTable(result);
  show(byId("identify-correlation"), heat ? [el("h3", {}, "Correlations"), heat] : null);
  const next = candidatesTable(result);
  show(byId("identify-next"), next ? [el("h3", {}, "What to measure next"), next, el("p", { class: "note" }, "With as many points as the run they go on from. More is told by how much the determinant of the information is raised.")] : el("p", { class: "note" }, "No further measurement around these would tell more."));
  const good = Object.values(result.values).length > 0;
  show(byId("identify-use"),
    el("button", { type: "button", disabled: !good, id: "identify-take", onclick: use }, "Use the identified values"),
    el("button", { type: "button", class: "main-button", disabled: !good, id: "identify-robust-design", onclick: robust }, "Robust design with what stays uncertain"),
    el("button", { type: "button", onclick: () => saveText(csvText(fitColumns(result)), `fit-${state.scene}.csv`, "text/csv") }, "Data and fit as CSV"),
    el("button", { type: "button", onclick: () => saveText(JSON.stringify(result, null, 1), `identified-${state.scene}.json`, "application/json") }, "Result as JSON"));
}

const bad = (text) => el("span", { class: "bad" }, text);

const use = () => putAll({ ...state.set, ...last.result.values });

// The values are set, what is not known of them goes to the design problem: there its variables are chosen.
function robust() {
  use();
  const { uncertain, estimates } = last.result;
  const confidence = uncertain.confidence === undefined ? "" : `, ${percent(uncertain.confidence)}`;
  tell("uncertain-given", { uncertain, words: `identified: ${estimates.map(({ name }) => name).join(", ")}${confidence}` });
  tell("tab", "design");
  byId("problem-submit").focus();
}

const fitColumns = ({ runs }) => runs.flatMap((one, i) => ["x", "data", "fit", "fit_sd", "phase_deg", "fit_phase_deg"].filter((key) => one[key]).map((key) => [`run ${i + 1} ${Object.entries(one.conditions).map(([path, v]) => `${path} = ${v}`).join(" ")}: ${key}`, one[key]]));
