// Identification: measured responses and loops, the parameters looked for, the fit, how sure it is, what comes next.

import { on, state, tell } from "../base/state.js";
import { bad, button, byId, el, facts, note, show, titled } from "../base/dom.js";
import { csvText, saveText } from "../base/exports.js";
import { number, percent, seconds, valuesSaid } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { schemaForm } from "../forms/form.js";
import { run } from "../network/jobs.js";
import { askedFor, proposed } from "../scene/kinds.js";
import { putAll } from "../views/live.js";
import { figurePart, formPart, statusPart, view } from "../views/view.js";
import { clearData, dataPart, fillData, list, runsRead, sourceNames, startData, tables } from "./data.js";
import { candidatesTable, correlationTable, estimatesTable, loopsChart, phasesChart, responsesChart } from "./fit.js";

const EMPTY = "Choose files of measured responses or loops, or paste one, to see them here.";
let form = null;
let plots = null;
let last = null;

export const identify = view({
  kind: "identify", id: "identify", title: "Identification", tabs: "identify", wide: true, priority: 4,
  bar: { form: "identify-form", words: "Identify", free: true },
  about: "Parameters of the scene from what a rig measured, with how sure they are.",
  work: "identification", goes: ({ took, points }) => `Identifying:${took}; ${points} evaluations.`,
  parts: () => [
    statusPart("identify"),
    el("div", { class: "halves" }, dataPart(), formPart("identify")),
    el("div", { class: "halves" }, titled("Data and fit", figurePart("identify-response")),
      el("div", { id: "identify-second-part", hidden: true }, el("h3", {}, "Phases, or loops"), figurePart("identify-second"))),
    el("div", { id: "identify-result", hidden: true }, el("div", { class: "row", id: "identify-use" }), el("h3", {}, "Estimates"), el("div", { id: "identify-estimates" }),
      el("div", { class: "halves" }, el("div", { id: "identify-correlation" }), el("div", { id: "identify-next" }))),
  ],
  start() {
    form = schemaForm(byId("identify-form"), "identify", { keys: (key) => key !== "data", top: ["unknowns"], groups: [{ legend: "Noise, outliers, starts", id: "more" }], submit, words: identify.bar.words, primary: true });
    plots = {
      response: chart(byId("identify-response"), { label: "Fit over the data", file: "fit", height: 320 }),
      second: chart(byId("identify-second"), { label: "Phases or loops", file: "fit-phases", height: 320 }),
    };
    startData(() => {
      list();
      draw(null);
      tell("measured");
    });
    on("resubmit", (kind) => kind === "identify" && byId("identify-form").requestSubmit());
  },
  clear: () => identify.say(identify.about),
  scene() {
    clearData();
    form.fill(proposed("identify"));
    draw(null);
  },
  submitted(job) {
    form.fill(job.request);
    fillData(job.request.data ?? []);
  },
  result(result) {
    identify.say(`${result.status} ${result.evaluations} evaluations in ${seconds(result.seconds)}.`);
    draw(result);
  },
  failed(words, errors = []) {
    identify.say(named(words), true);
    complain(errors);
  },
});

async function submit(body) {
  const data = tables();
  if (!data.length) return complain([{ pointer: "/data", detail: "Choose files of measured data first, or paste one." }]);
  // Values that the scene has been given by hand stay; those looked for are found.
  await run("identify", { ...askedFor("identify"), data, ...body }, identify, identify.priority);
  return undefined;
}

const complain = (errors) => form.complain(errors.map((one) => ({ ...one, detail: named(one.detail) })));

// A table of a job by the name of its file.
const named = (text) => text.replaceAll(/data\[(\d+)\]/g, (whole, i) => sourceNames()[Number(i)] ?? whole);

// The data, with what was found in it, if anything.
function draw(found) {
  last = found;
  const runs = last?.runs ?? runsRead();
  const [response, phases, loops] = [responsesChart(runs), phasesChart(runs), loopsChart(runs)];
  const second = response ? (phases ?? loops) : null;
  const first = response ?? loops;
  if (first) plots.response.draw(first);
  else plots.response.clear(EMPTY);
  byId("identify-second-part").hidden = !second;
  if (second) plots.second.draw(second);
  byId("identify-result").hidden = !last;
  if (last) results(last);
}

function results(result) {
  const doubts = [
    ...(result.misfit ? [["misfit", bad(result.misfit)]] : []),
    ...result.not_reached.map(({ run: source, at }) => ["no response found", bad(`${named(source)} at ${at.map((f) => number(f, 5)).join(", ")} Hz`)]),
    ...result.untold.map(({ words }) => ["not told", bad(words)]),
    ...result.correlated.map(({ names, correlation }) => ["hard to tell apart", `${names.join(" and ")}: correlation ${number(correlation, 3)}`]),
    ...result.other_optima.map(({ misfit, ...values }) => ["another optimum", `${valuesSaid(values)}${misfit === undefined ? "" : `: misfit × ${number(misfit, 3)}`}`]),
  ];
  show(byId("identify-estimates"), estimatesTable(result), facts([
    ["noise", result.noise === null ? "–" : `${number(100 * result.noise, 3)} % of the amplitude`],
    ["left over", result.reduced_chi2 === null ? "–" : `χ² ${number(result.reduced_chi2, 3)} for each degree of freedom`],
    ["starts", `${result.agreeing} of the best searches agree; ${result.starts} places tried`], ...doubts,
  ]));
  const heat = correlationTable(result);
  show(byId("identify-correlation"), heat ? [el("h3", {}, "Correlations"), heat] : null);
  const next = candidatesTable(result);
  show(byId("identify-next"), next ? [el("h3", {}, "What to measure next"), next, note("With as many points as the run they go on from. More is told by how much the determinant of the information is raised.")] : note("No further measurement around these would tell more."));
  const good = Object.values(result.values).length > 0;
  show(byId("identify-use"),
    button("Use the identified values", use, { disabled: !good, id: "identify-take" }),
    button("Robust design with what stays uncertain", robust, { class: "main-button", disabled: !good, id: "identify-robust-design" }),
    button("Data and fit as CSV", () => saveText(csvText(fitColumns(result)), `fit-${state.scene}.csv`, "text/csv")),
    button("Result as JSON", () => saveText(JSON.stringify(result, null, 1), `identified-${state.scene}.json`, "application/json")));
}

const use = () => putAll({ ...state.set, ...last.values });

// The values are set, what is not known of them goes to the design problem: there its variables are chosen.
function robust() {
  use();
  const { uncertain, estimates } = last;
  const confidence = uncertain.confidence === undefined ? "" : `, ${percent(uncertain.confidence)}`;
  tell("uncertain-given", { uncertain, words: `identified: ${estimates.map(({ name }) => name).join(", ")}${confidence}` });
  tell("tab", "design");
  byId("study").focus();
}

const fitColumns = ({ runs }) => runs.flatMap((one, i) => ["x", "data", "fit", "fit_sd", "phase_deg", "fit_phase_deg"].filter((key) => one[key]).map((key) => [`run ${i + 1} ${Object.entries(one.conditions).map(([path, v]) => `${path} = ${v}`).join(" ")}: ${key}`, one[key]]));
