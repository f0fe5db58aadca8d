// Identification: measured responses and loops, the parameters looked for, the fit, how sure it is, what comes next.

import { state } from "../base/address.js";
import { byId, el, facts, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { csvText, saveText } from "../base/exports.js";
import { number, percent, quantity, seconds } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { schemaForm } from "../forms/form.js";
import { run } from "../network/jobs.js";
import { askedFor, proposed } from "../scene/kinds.js";
import { putAll } from "../views/live.js";
import { clearData, fillData, list, runsRead, sourceNames, startData, tables } from "./data.js";
import { candidatesTable, correlationTable, estimatesTable, loopsChart, phasesChart, responsesChart } from "./fit.js";

const PRIORITY = 4;
const EMPTY = "Choose files of measured responses or loops, or paste one, to see them here.";
let form = null;
let plots = null;
let last = null;

export function startIdentify() {
  form = schemaForm(byId("identify-form"), "identify", { keys: (key) => key !== "data", top: ["unknowns"], groups: [{ legend: "Noise, outliers, starts", id: "more" }], submit, words: "Identify", primary: true });
  plots = {
    response: chart(byId("identify-response"), { label: "Fit over the data", file: "fit", height: 320 }),
    second: chart(byId("identify-second"), { label: "Phases or loops", file: "fit-phases", height: 320 }),
  };
  startData(() => {
    last = null;
    list();
    draw();
    results();
  });
  on("scene", () => {
    last = null;
    clearData();
    form.fill(proposed("identify"));
    draw();
    results();
    say("identify-status", "Parameters of the scene from what a rig measured, with how sure they are.");
  });
  on("resubmit", (kind) => kind === "identify" && byId("identify-form").requestSubmit());
}

async function submit(body) {
  const data = tables();
  if (!data.length) return complain([{ pointer: "/data", detail: "Choose files of measured data first, or paste one." }]);
  // Values that the scene has been given by hand stay; those looked for are found.
  await run("identify", { ...askedFor("identify"), data, ...body }, identifyView, PRIORITY);
  return undefined;
}

const complain = (errors) => form.complain(errors.map((one) => ({ ...one, detail: named(one.detail) })));

// A table of a job by the name of its file.
const named = (text) => text.replaceAll(/data\[(\d+)\]/g, (whole, i) => sourceNames()[Number(i)] ?? whole);

export const identifyView = {
  waiting: () => say("identify-status", "The identification waits for a worker."),
  progress: ({ took, points }) => say("identify-status", `Identifying:${took}; ${points} evaluations.`),
  submitted(job) {
    form.fill(job.request);
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
  byId("study").focus();
}

const fitColumns = ({ runs }) => runs.flatMap((one, i) => ["x", "data", "fit", "fit_sd", "phase_deg", "fit_phase_deg"].filter((key) => one[key]).map((key) => [`run ${i + 1} ${Object.entries(one.conditions).map(([path, v]) => `${path} = ${v}`).join(" ")}: ${key}`, one[key]]));
