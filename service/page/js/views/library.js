// The stored sweeps: filters, files, and several of them side by side.

import { state, write } from "../base/address.js";
import { request } from "../network/api.js";
import { chart } from "../charts/chart.js";
import { throughPeak } from "../charts/curves.js";
import { load } from "./design.js";
import { byId, el, say, show, table } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { saveFrom } from "../base/exports.js";
import { length, lengthUnit, number, quantity, when, withUnit } from "../base/format.js";
import { current } from "../scene/scenes.js";

const FILTERS = [
  ["scene", "Scene", "text"], ["parameter", "Parameter", "text"], ["contact", "Contact", "text"], ["N0_min", "N0 from [N]", "number"], ["N0_max", "N0 to [N]", "number"],
  ["peak_max", "Peak up to", "number"], ["band_hz_max", "Band up to [Hz]", "number"],
];
const SORTS = [["-created", "newest first"], ["peak", "lowest peak first"], ["band_hz", "narrowest band first"], ["-points", "most points first"]];
// Lengths are asked for in the units in which tables and charts tell them.
const METRES = { "m": 1, "mm": 1e-3, "µm": 1e-6 };
const SIZE = 25;
const FAR_APART = 4;
const DASHES = [undefined, "dashed", "dotted"];
let plot = null;
let items = [];
let next = null;
const details = new Map();
// What was asked last; an older answer that comes later is not shown.
let listed = 0;
let compared = 0;

export function startLibrary() {
  plot = chart(byId("compare-figure"), { label: "Sweeps side by side", file: "compare", height: 320 });
  const form = byId("library-form");
  const inputs = FILTERS.map(([name, words, type]) =>
    el("span", { class: "pair" }, el("label", { for: `filter-${name}` }, words), el("input", { id: `filter-${name}`, name, type, step: "any" }),
      name === "peak_max" ? el("select", { id: "filter-peak-unit", "aria-label": "Unit of the peak" }, Object.keys(METRES).map((unit) => el("option", { value: unit }, unit))) : null));
  const sort = el("select", { id: "filter-sort", name: "sort" }, SORTS.map(([value, words]) => el("option", { value }, words)));
  show(form, inputs, el("span", { class: "pair" }, el("label", { for: "filter-sort" }, "Order"), sort), 
    el("span", { class: "pair" }, el("input", { id: "filter-intermediate", type: "checkbox", name: "all" }), el("label", { for: "filter-intermediate" }, "also those on the way to a design, a map or a front")),
    el("button", { type: "submit" }, "Show"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    list();
  });
  byId("library-more").addEventListener("click", () => list(next));
  on("job-ended", () => list());
  on("online", () => list());
}

export async function openLibrary() {
  await list();
  await compare();
}

// A peak in metres, whatever its unit on the form.
const asAsked = (name, text) => (name === "peak_max" ? String(Number((Number(text) * METRES[byId("filter-peak-unit").value]).toPrecision(12))) : text);

function query() {
  const words = new URLSearchParams({ limit: SIZE });
  if (!byId("filter-intermediate").checked) words.set("intermediate", "false");
  for (const [name, value] of new FormData(byId("library-form"))) if (name !== "all" && String(value).trim()) words.set(name, asAsked(name, String(value).trim()));
  return `/v1/sweeps?${words}`;
}

const nothing = () =>
  ([...byId("library-form").querySelectorAll("input:not([type=checkbox])")].some(({ value }) => value.trim())
    ? "No stored sweep meets this."
    : "No sweep is stored yet: Find the best damper computes the first ones.");

async function list(address = null) {
  const mine = (listed += 1);
  try {
    const page = await request(address ?? query());
    if (mine !== listed) return;
    items = address ? [...items, ...page.items] : page.items;
    next = page.next;
    byId("library-more").hidden = next === null;
    say("library-status", items.length ? `${items.length} sweeps${next ? ", there are more" : ""}.` : nothing());
    rows();
  } catch (error) {
    say("library-status", error.message, true);
  }
}

const loads = (sweep) =>
  Object.entries(sweep.contacts).map(([name, c]) => (c.N0 === null ? null : `${name} ${number(c.N0)} N`)).filter(Boolean).join(", ");

// Loads, and whatever else tells a sweep from others that have the same loads: stiffness, friction, force, harmonics.
function told(sweep, among) {
  const own = loads(sweep);
  const [mine, ...others] = [sweep, ...among.filter((one) => one.scene === sweep.scene && loads(one) === own)].map(
    (one) => ({ ...valuesOf(one), harmonics: one.harmonics }));
  const apart = Object.keys(mine).filter((path) => others.some((other) => other[path] !== mine[path]));
  return [own, ...apart.map((path) => (path === "harmonics" ? `${mine[path]} harmonics` : `${path} ${quantity(path, mine[path])}`))].filter(Boolean).join(", ");
}

const titleOf = (sweep, among) => `${sweep.scene}, ${told(sweep, among) || sweep.parameter}`;

function rows() {
  const line = (sweep) => {
    const name = titleOf(sweep, items);
    const box = el("input", { type: "checkbox", checked: state.compare.includes(sweep.id), "aria-label": `Compare ${name}` });
    box.addEventListener("change", () => choose(sweep.id, box.checked));
    return [
      box,
      sweep.scene,
      `${sweep.parameter} ${number(sweep.from)} … ${number(sweep.to)}`,
      told(sweep, items),
      { text: sweep.peak ? length(sweep.peak.value) : "–", number: true },
      { text: sweep.peak ? quantity(sweep.parameter, sweep.peak.at) : "–", number: true },
      { text: sweep.band_hz === null ? "–" : number(sweep.band_hz), number: true },
      { text: String(sweep.points), number: true },
      when(sweep.created),
      actions(sweep, name),
    ];
  };
  const heads = ["compare", "scene", "over", "values", { text: "peak", number: true }, { text: "at", number: true }, { text: "band [Hz]", number: true }, { text: "points", number: true }, "stored", "take"];
  show(byId("library-table"), items.length ? table(heads, items.map(line), "Stored sweeps") : null);
}

function actions(sweep, name) {
  const button = (words, act) => el("button", { type: "button", "aria-label": `${words} of ${name}`, onclick: act }, words);
  const file = (words, type, below = "") =>
    button(words, () => saveFrom(`/v1/sweeps/${sweep.id}${below}`, type, `sweep-${sweep.id}.${words.toLowerCase()}`));
  const same = current.body?.name === sweep.scene;
  const take = same ? el("button", { type: "button", "aria-label": `Load ${name}`, onclick: () => use(sweep) }, "Load") : null;
  const forms = [file("CSV", "text/csv"), file("npz", "application/x-npz"), file("Parquet", "application/vnd.apache.parquet"),
    file("SVG", "image/svg+xml", "/plot.svg"), file("PNG", "image/png", "/plot.png"), button("TOML", () => tomlOf(sweep))];
  const more = el("details", {}, el("summary", { "aria-label": `Files of ${name}` }, "Files"), el("span", { class: "row tight" }, forms));
  return el("span", { class: "row tight" }, take, more);
}

// The values of a sweep with all that its job had set.
async function use(sweep) {
  try {
    const { request: asked } = await request(`/v1/jobs/${sweep.job}`);
    load(Object.fromEntries(Object.entries(valuesOf(sweep)).filter(([path]) => path !== sweep.parameter)), { scene: sweep.scene, set: asked.set });
  } catch (error) {
    tell("notice", error.message);
  }
}

// The scene of a sweep with its values, and the command that computes the same.
async function tomlOf(sweep) {
  const file = `sweep-${sweep.id}.toml`;
  try {
    const job = await request(`/v1/jobs/${sweep.job}`);
    if (!["sweep", "design", "pareto"].includes(job.kind) || job.request.cases) {
      throw new Error(`this sweep is of a job of the kind ${job.kind}, which changes more of the scene than these values`);
    }
    const { scene } = await request(`/v1/jobs/${sweep.job}/scene`);
    const at = sweep.frequency_hz ? ` --frequency ${sweep.frequency_hz}` : "";
    const command = `stickslip sweep ${file} --parameter ${sweep.parameter} --from ${sweep.from} --to ${sweep.to}${at} --harmonics ${sweep.harmonics}`;
    const set = Object.fromEntries(Object.entries(valuesOf(sweep)).filter(([path]) => path !== sweep.parameter));
    await saveFrom("/v1/scenes/text", "application/toml", file, { method: "POST", body: { scene, set, comments: ["A stored sweep of stickslip. The same from the command:", command] } });
  } catch (error) {
    tell("notice", `${file}: ${error.message}`);
  }
}

// The values of a sweep that stayed fixed, as paths.
export function valuesOf(sweep) {
  const values = {};
  for (const [name, contact] of Object.entries(sweep.contacts)) {
    for (const key of ["N0", "N1", "kt", "mu"]) if (contact[key] !== null) values[`${name}.${key}`] = contact[key];
  }
  if (sweep.excitation_amplitude !== null) values["excitation.amplitude"] = sweep.excitation_amplitude;
  return values;
}

function choose(id, chosen) {
  state.compare = chosen ? [...state.compare, id] : state.compare.filter((other) => other !== id);
  write();
  compare();
}

async function compare() {
  const mine = (compared += 1);
  const found = [];
  for (const id of state.compare) {
    try {
      if (!details.has(id)) details.set(id, await request(`/v1/sweeps/${id}?format=json`));
      found.push(details.get(id));
    } catch (error) {
      say("library-status", error.message, true);
    }
  }
  if (mine !== compared) return;
  byId("compare-note").hidden = found.length > 0;
  byId("compare-figure").hidden = found.length === 0;
  if (!found.length) {
    plot.clear();
    show(byId("compare-facts"));
    return;
  }
  drawCompared(found);
}

function drawCompared(found) {
  const peaks = found.map((s) => s.peak?.value ?? 0);
  const highest = Math.max(...peaks);
  const unit = lengthUnit(highest);
  const far = highest > FAR_APART * Math.min(...peaks.filter((peak) => peak > 0));
  plot.draw({
    x: { name: withUnit(found[0].parameter) },
    y: { name: `amplitude [${unit.name}]`, unit, zero: !far, log: far },
    series: found.map((sweep, i) => {
      const { parameter, amplitude } = throughPeak({ ...sweep.arrays, peak: sweep.peak });
      return { name: titleOf(sweep, found), x: parameter, y: amplitude.map((v) => v * unit.perMetre), colour: 1 + (i % 7), dash: DASHES[i % 3] };
    }),
  });
  const row = (name, of) => [name, ...found.map((sweep) => ({ text: of(sweep), number: true }))];
  show(
    byId("compare-facts"),
    table(["", ...found.map((sweep) => ({ text: titleOf(sweep, found), number: true }))], [
      row("highest peak", (s) => (s.peak ? length(s.peak.value) : "–")),
      row("at", (s) => (s.peak ? quantity(s.parameter, s.peak.at) : "–")),
      row("error estimate", (s) => (typeof s.error_estimate === "number" ? length(s.error_estimate) : "–")),
      row("peaks between points", (s) => ({ true: "known", false: "not known" })[s.peaks_known] ?? "–"),
      row("band [Hz]", (s) => (s.band_hz === null ? "–" : number(s.band_hz))),
      row("force [N]", (s) => number(s.excitation_amplitude)),
      row("harmonics", (s) => String(s.harmonics)),
      row("points", (s) => String(s.points)),
    ], "Sweeps side by side"),
  );
}
