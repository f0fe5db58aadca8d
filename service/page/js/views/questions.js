// Studies as questions: a card each in a designer's words, filled in from the scene, with what it takes, run at one
// press. One that has a view of its own opens that; of any other the result stands in its card, as drawings and a table.

import { on, state, tell } from "../base/state.js";
import { button, byId, el, facts, note, numeric, say, scrolledTable, show, svg, titled } from "../base/dom.js";
import { saveText } from "../base/exports.js";
import { quantity, unitOf, when } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { schemaForm } from "../forms/form.js";
import { tables } from "../identify/data.js";
import { patiently, request } from "../network/api.js";
import { resume, run } from "../network/jobs.js";
import { askedFor, barRange, kindNames, kindOf, ofTheBar, proposalOf, refusedFor, takes } from "../scene/kinds.js";
import { variable } from "../scene/scenes.js";
import { hasOwnView, viewOf } from "../views.js";
import { tabOf } from "../workbench/frame.js";
import { complaining, view } from "./view.js";

const [ROWS, MEASURED] = [200, ["identify", "posterior"]];
const GROUPS = [["", "All"], ["damper", "Damper"], ["life", "Life"], ["engine", "Engine"], ["rig", "Rig"], ["checks", "Checks"]];
// What comes out, as a stroke in a frame of 112 by 70: of a kind, else of its group.
const PICTURES = {
  damper: "M6 18C30 24 44 58 58 58S92 44 108 22", life: "M6 60C50 58 82 52 108 12M6 36H108", engine: "M6 66L108 10M6 66L108 36M6 30H108M6 48H108",
  rig: "M6 62C38 60 46 52 54 14C60 10 62 50 70 58S96 62 108 62", checks: "M14 64V40M32 64V30M50 64V46M68 64V14M86 64V36M104 64V50",
  margin: "M6 62C46 58 80 46 108 8M6 30H108", sweep: "M6 62C40 60 48 52 54 12C62 52 74 58 108 62", pareto: "M10 8C14 44 40 58 106 62", solve: "M22 60L46 12H92L68 60Z", march: "M6 35C14 6 22 6 30 35S46 64 54 35 70 6 78 35 94 64 102 35", transient: "M6 36C10 28 14 28 18 36S26 46 32 36 42 16 48 36 58 64 66 36 76 8 84 36 94 58 102 36", modes: "M64 66V44C64 32 54 20 38 8", accuracy: "M8 10L40 30L72 44L104 60",
};
const cards = new Map();
// The group shown; the highest peak that is seen [m].
let [group, peak] = ["", 0];
const hasData = (kind) => !MEASURED.includes(kind) || tables().length > 0;
// The question of a kind, for people; what it computes where nobody put it as one.
const asks = (kind) => ({ title: kindOf(kind).summary.replace(/\.$/, ""), group: "checks", body: {}, assumed: [], of_peak: {}, ...proposalOf(kind) });

export function startQuestions() {
  show(byId("questions-groups"), GROUPS.map(([name, words]) => button(words, () => {
    group = name;
    filter();
  }, { "data-group": name })));
  on("scene", build);
  on("size", (metres) => {
    peak = metres;
    for (const kind of cards.keys()) if (Object.keys(asks(kind).of_peak).length) fill(kind);
  });
  on("settings", () => [...cards.keys()].filter((kind) => Object.keys(ofTheBar(kind)).length).forEach((kind) => fill(kind)));
  on("cost", sayCosts);
  on("measured", sayCosts);
  on("computed", ({ kind, request }) => {
    if (!cards.has(kind)) return;
    fill(kind, request);
    sayOf(kind, `✓ ${when(new Date().toISOString())}`);
    byId(`ask-${kind}-open`).hidden = false;
  });
}

function build() {
  cards.clear();
  const fitting = kindNames().filter((kind) => !refusedFor(kind));
  say("questions-status", `${fitting.length} of ${kindNames().length} questions fit ${state.scene}.`);
  show(byId("questions-cards"), [...fitting, ...kindNames().filter((kind) => refusedFor(kind))].map(cardOf));
  for (const kind of fitting) prepare(kind);
  filter();
  sayCosts();
  // Goes on with the jobs that the address names.
  for (const kind of fitting) if (state.jobs[kind] && !hasOwnView(kind)) showOther(kind);
}

function cardOf(kind) {
  const [{ title, group: of }, refused] = [asks(kind), refusedFor(kind)];
  return el("article", { class: `card question${refused ? " refused" : ""}`, id: `ask-${kind}`, "data-of": of, "aria-labelledby": `ask-${kind}-title` },
    svg("svg", { viewBox: "0 0 112 70", "aria-hidden": "true" }, svg("path", { class: "frame", d: "M4 2V68H110" }), svg("path", { d: PICTURES[kind] ?? PICTURES[of] })),
    el("div", {}, el("h3", { id: `ask-${kind}-title` }, title), note(refused || kindOf(kind).summary)),
    refused ? null : [el("p", { class: "note", id: `ask-${kind}-bar` }), el("form", { id: `ask-${kind}-form`, novalidate: true }), el("div", { class: "row" }, el("span", { class: "status", id: `ask-${kind}-status`, role: "status" }), button("Open", () => open(kind), { id: `ask-${kind}-open`, hidden: true })), el("div", { id: `ask-${kind}-result` })]);
}

// The form of a question: what is proposed, and of a kind that has no view of its own all else folded.
function prepare(kind) {
  const { body, of_peak: shares, assumed } = asks(kind);
  const proposed = [...Object.keys(body), ...Object.keys(shares)];
  const unit = body.parameter ? unitOf(body.parameter) : unitOf("excitation.amplitude");
  const barred = Object.keys(ofTheBar(kind));
  const fields = kindOf(kind).fields.filter(({ key, kind: what }) => key !== "data" && !barred.includes(key) && (!hasOwnView(kind) || proposed.includes(key)) && !(what === "truth" && hasOwnView(kind)))
    .map((field) => ({ ...field, required: field.required && !proposed.includes(field.key), unit: field.unit || (["from", "to"].includes(field.key) && field.kind === "number" ? unit : "") }));
  const open = hasOwnView(kind) ? [] : fields.filter(({ key, required }) => proposed.includes(key) || required).map(({ key }) => key);
  const folded = fields.length > open.length && !hasOwnView(kind) ? [{ legend: "Options", id: "options" }] : [];
  const form = schemaForm(byId(`ask-${kind}-form`), { fields }, { id: `ask-${kind}`, top: open, groups: folded, words: "Run", submit: (asked) => ask(kind, asked) });
  cards.set(kind, { form });
  for (const key of [...assumed, ...Object.keys(shares)]) byId(`ask-${kind}-${key}`)?.closest(".field")?.classList.add("assumed");
  fill(kind);
}

// What is being typed is not taken away.
function fill(kind, request = null) {
  if (byId(`ask-${kind}-form`).contains(document.activeElement)) return;
  const { body, of_peak: shares } = asks(kind);
  const ofPeak = peak ? Object.fromEntries(Object.entries(shares).map(([key, share]) => [key, Number((share * peak).toPrecision(3))])) : {};
  cards.get(kind).form.fill(request ?? { ...body, ...ofPeak });
  byId(`ask-${kind}-bar`).textContent = Object.keys(ofTheBar(kind)).length ? `${variable()} from ${barRange(kind).map((end) => quantity(variable(), end)).join(" to ")}` : "";
}

function filter() {
  for (const each of byId("questions-groups").children) each.setAttribute("aria-pressed", String(each.dataset.group === group));
  for (const card of byId("questions-cards").children) card.hidden = group !== "" && card.dataset.of !== group;
}

function sayCosts() {
  for (const kind of cards.keys()) {
    byId(`ask-${kind}-takes`).textContent = hasData(kind) ? takes(kind) : "needs measurements";
    byId(`ask-${kind}-submit`).textContent = hasData(kind) ? "Run" : "Choose measurements…";
  }
}

const sayOf = (kind, words, bad) => byId(`ask-${kind}-status`) && say(`ask-${kind}-status`, words, bad);

function ask(kind, body) {
  if (!hasData(kind)) return tell("tab", "identify");
  byId(`ask-${kind}-open`).hidden = true;
  return run(kind, { ...askedFor(kind), ...asks(kind).body, ...ofTheBar(kind), ...(MEASURED.includes(kind) && { data: tables() }), ...body }, complaining(beside(kind), cards.get(kind).form), 3);
}

// The view of a kind, which is told in its card as well.
function beside(kind) {
  const of = hasOwnView(kind) ? viewOf(kind) : otherView(kind);
  const also = (name, words) => (...told) => {
    of[name](...told);
    sayOf(kind, words(...told), name === "failed");
  };
  return { ...of, waiting: also("waiting", () => "Waits for a worker."), progress: also("progress", ({ took }) => `Runs:${took}`), failed: also("failed", (words) => words) };
}

function open(kind) {
  if (!hasOwnView(kind)) return byId(`ask-${kind}`).classList.toggle("is-open");
  tell("tab", tabOf(kind));
  byId(viewOf(kind).id)?.scrollIntoView({ block: "nearest" });
  return undefined;
}

// A job of a kind without a view of its own: its form as it was asked, its result beside it.
export function showOther(kind) {
  byId(`ask-${kind}`).scrollIntoView({ block: "nearest" });
  return resume(kind, { ...beside(kind), submitted: (job) => fill(kind, job.request) });
}

// Any study without a view of its own, by its name: its drawings, and what people read of it.
const otherView = (kind) => Object.assign(view({ id: `ask-${kind}`, goes: () => "" }), {
  say: () => undefined,
  waiting: () => show(byId(`ask-${kind}-result`)),
  failed: () => undefined,
  async result(result, _sweeps, { id }) {
    const { blocks } = await patiently(() => request(`/v1/jobs/${id}/told`));
    const drawings = viewOf(kind)?.drawings(result) ?? [];
    const figures = drawings.map(() => el("div", { class: "figure" }));
    byId(`ask-${kind}`).classList.add("is-open");
    show(byId(`ask-${kind}-result`), ...drawings.map(({ label }, i) => titled(label, figures[i])), blocks.map(told),
      button("Save as JSON", () => saveText(JSON.stringify(result, null, 1), `${kind}.json`, "application/json")));
    // Drawn where they stand: a chart is as wide as its place.
    drawings.forEach(({ label, file, draw }, i) => chart(figures[i], { label, file }).draw(draw));
  },
});

const isNumber = (text) => /^[≤≥±\s]*[-+−]?\d/.test(text);

// Names with their values, or a table whose columns of numbers stand to the right.
function told({ title, pairs, columns, rows }) {
  const heading = title ? el("h3", {}, title) : null;
  if (pairs) return [heading, facts(pairs)];
  const right = columns.map((_, i) => rows.some((row) => row[i]) && rows.every((row) => !row[i] || isNumber(row[i])));
  const cells = (row) => row.map((text, i) => (right[i] ? numeric(text) : text));
  return [heading, scrolledTable(title || "Numbers", cells(columns), rows.slice(0, ROWS).map(cells), { more: rows.length > ROWS ? `The first ${ROWS} of ${rows.length} rows.` : "" })];
}
