// The table of runs: sorted by any column, filtered by words and figures, those of one press folded under it.

import { orNotice, patched } from "../network/api.js";
import { on, state, tell, write } from "../base/state.js";
import { bad, button, byId, el, note, options, redrawn, say, show } from "../base/dom.js";
import { csvText, saveText } from "../base/exports.js";
import { METRES, number, when } from "../base/format.js";
import { compareRuns } from "./comparison.js";
import { isHidden, runForm } from "./run_form.js";
import { hasMore, isUnderWay, listRuns, PINNED, runs, summaryOf, titleOf } from "./run_list.js";
import { isPinned, openRun, peakOf, presses, sparkline, underWay, valuesOf, wordOf, WORDS } from "./runs.js";

// What a row is sorted by; empty figures come last whichever way.
const COLUMNS = [
  ["kind", "Kind", ({ kind, name }) => name || kind], ["scene", "Scene", ({ scene }) => scene ?? ""], ["values", "Values", (run) => valuesOf(run).join(", ")],
  ["peak", "Peak", (run) => summaryOf(run)?.peak?.value], ["band", "Band [Hz]", (run) => summaryOf(run)?.band_hz], ["harmonics", "Harmonics", (run) => summaryOf(run)?.harmonics],
  ["response", "Response", null], ["created", "When", ({ created }) => created],
];
const NUMBERS = ["peak", "band", "harmonics"];
const LIMIT = /^(peak|band)?\s*([<>])\s*([\d.,]+(?:e-?\d+)?)\s*(m|mm|µm|um|hz)?$/i;
let sort = { key: "created", down: true };
const unfolded = new Set();
const opened = new Set();
// The forms that are open: what was typed and not saved outlives a table that is drawn anew.
const forms = new Map();
let seen = "";

export function startRunsTable() {
  byId("runs-form").addEventListener("submit", (event) => event.preventDefault());
  for (const id of ["runs-text", "runs-kind", "runs-fold"]) byId(id).addEventListener("input", draw);
  byId("runs-since").addEventListener("change", () => tell("runs-since"));
  byId("runs-more").addEventListener("click", () => listRuns(true));
  byId("runs-csv").addEventListener("click", saveTable);
  byId("runs-notify").addEventListener("click", async () => {
    await Notification.requestPermission();
    notifiable();
  });
  notifiable();
  for (const event of ["runs", "computed", "scene"]) on(event, draw);
  on("comparison-closed", () => choose([]));
  on("kinds", () => state.compare.length === 2 && compareRuns(...state.compare));
}

function choose(ids) {
  state.compare = ids;
  write();
  draw();
}

const notifiable = () => { byId("runs-notify").hidden = window.Notification?.permission !== "default"; };

// Words that all must be there, and limits such as “> 0.1 mm” or “band < 100 Hz”, with commas between them.
function meets(run) {
  const kind = byId("runs-kind").value;
  if (kind && run.kind !== kind) return false;
  const words = [run.kind, run.scene, run.name, run.notes, ...run.tags, ...valuesOf(run, Infinity), WORDS[run.status]].join(" ").toLowerCase();
  return byId("runs-text").value.split(",").map((part) => part.trim().toLowerCase()).filter(Boolean).every((part) => {
    const [, of, sign, given, unit = ""] = LIMIT.exec(part) ?? [];
    if (!sign) return part.split(/\s+/).every((word) => words.includes(word));
    const isBand = of === "band" || unit === "hz";
    const value = isBand ? summaryOf(run)?.band_hz : summaryOf(run)?.peak?.value;
    const limit = Number(given.replace(",", ".")) * (isBand ? 1 : METRES[unit.replace("um", "µm")] ?? 1);
    return typeof value === "number" && (sign === "<" ? value < limit : value > limit);
  });
}

function ordered(list) {
  const [, , of] = COLUMNS.find(([key]) => key === sort.key);
  const none = (value) => value === undefined || value === null || value === "";
  return [...list].sort((a, b) => {
    const [x, y] = [of(a), of(b)];
    if (none(x) || none(y)) return none(x) - none(y);
    return (x < y ? -1 : x > y ? 1 : 0) * (sort.down ? -1 : 1);
  });
}

// The rows that are seen: {run, more, inside}.
function rows() {
  const list = ordered(runs().filter(meets));
  if (!byId("runs-fold").checked) return list.filter(isPinned).concat(list.filter((run) => !isPinned(run))).map((run) => ({ run, more: 0 }));
  const groups = presses(list);
  const order = ordered(groups.map(({ head }) => head)).map((head) => groups.find((group) => group.head === head));
  return [...order.filter(({ head }) => isPinned(head)), ...order.filter(({ head }) => !isPinned(head))]
    .flatMap(({ head, rest }) => [{ run: head, more: rest.length }, ...(unfolded.has(head.id) ? rest.map((run) => ({ run, more: 0, inside: true })) : [])]);
}

function draw() {
  const host = byId("runs-table");
  const all = rows();
  const kinds = [...new Set(runs().map(({ kind }) => kind))].sort();
  if (byId("runs-kind").options.length !== kinds.length + 1) {
    show(byId("runs-kind"), options([["", "all kinds"], ...kinds], byId("runs-kind").value));
  }
  byId("runs-more").hidden = !hasMore();
  const count = runs().length;
  say("runs-count", count ? `${count} run${count > 1 ? "s" : ""} in ${presses(runs()).length} press${presses(runs()).length > 1 ? "es" : ""}${hasMore() ? ", there are more" : ""}.` : "");
  const now = JSON.stringify([all.map(({ run, more, inside }) => [run, more, inside, summaryOf(run)?.status]), sort, state.compare, [...opened], [...unfolded], state.jobs]);
  // What is being typed in stays; the same table is not drawn anew under the focus.
  if (now === seen || host.querySelector("form")?.contains(document.activeElement)) return;
  seen = now;
  redrawn(host, all.length ? el("table", {}, el("caption", { class: "unseen" }, "Runs"), el("thead", {}, heads()), el("tbody", {}, all.flatMap(row)))
    : note(count ? "No run meets this." : "No run yet: Find the best damper makes the first ones."));
}

function heads() {
  const column = (content, more = {}) => el("th", { scope: "col", ...more }, content);
  const unseen = (words) => column(el("span", { class: "unseen" }, words));
  const sorted = (key) => { sort = { key, down: sort.key === key ? !sort.down : key === "created" }; draw(); };
  const head = ([key, words, of]) => column(
    of ? button([words, sort.key === key ? (sort.down ? " ▼" : " ▲") : ""], () => sorted(key), { class: "sort", "data-focus": `sort-${key}` }) : words,
    { class: NUMBERS.includes(key) ? "number" : undefined, "aria-sort": sort.key === key ? (sort.down ? "descending" : "ascending") : of ? "none" : undefined },
  );
  return el("tr", {}, unseen("Compare"), unseen("Pin"), COLUMNS.map(head), unseen("More"));
}

function row({ run, more, inside }) {
  const title = titleOf(run);
  const shown = state.jobs[run.kind] === run.id;
  const summary = summaryOf(run);
  const unfold = (words, set, name, about, of) => button(words, () => turned(set, run.id), { class: of, "data-focus": `${name}-${run.id}`, "aria-expanded": String(set.has(run.id)), "aria-label": about });
  const named = [
    more ? unfold(unfolded.has(run.id) ? "▾" : "▸", unfolded, "fold", `${more} more runs of the press of ${title}`, "fold") : null,
    button(run.name || run.kind, () => openRun(run), { class: "run-name", "data-focus": `open-${run.id}`, "aria-current": shown ? "true" : undefined }), more ? el("span", { class: "note" }, ` and ${more} more`) : null,
    run.status === "failed" || run.status === "dismissed" ? el("span", { class: "chip bad", title: run.error?.detail }, wordOf(run)) : null,
    el("ul", { class: "tags", "aria-label": "Tags" }, run.tags.filter((tag) => !isHidden(tag)).map((tag) => el("li", {}, tag)))];
  const cells = [run.scene ?? "", run.error?.detail && run.status === "failed" ? bad(run.error.detail) : valuesOf(run).join(", "), peakOf(run), summary?.band_hz ? number(summary.band_hz) : "", summary?.harmonics ?? "",
    isUnderWay(run) ? underWay(run, title) : sparkline(summary?.curve), when(run.created)];
  const classes = { 2: "number", 3: "number", 4: "number" };
  const line = el("tr", { "data-run": run.id, class: [inside ? "inside" : "", shown ? "is-shown" : ""].join(" ").trim() || undefined },
    el("td", {}, box(run, title)), el("td", {}, pin(run, title)), el("th", { scope: "row" }, named),
    cells.map((cell, i) => el("td", { class: classes[i] }, cell)),
    el("td", {}, unfold("More", opened, "more", `More of run ${title}`, "quiet")));
  return opened.has(run.id) ? [line, el("tr", { "data-more": run.id }, el("td", { colspan: String(COLUMNS.length + 3) }, formOf(run, title)))] : [line];
}

function formOf(run, title) {
  if (forms.get(run.id)?.revision !== run.revision) forms.set(run.id, { revision: run.revision, nodes: runForm(run, title) });
  return forms.get(run.id).nodes;
}

function turned(set, id) {
  if (!set.delete(id)) set.add(id);
  forms.delete(id);
  draw();
}

function box(run, title) {
  const input = el("input", { type: "checkbox", checked: state.compare.includes(run.id), "data-focus": `compare-${run.id}`, "aria-label": `Compare run ${title}, ${when(run.created)}` });
  input.addEventListener("change", () => {
    choose(input.checked ? [...state.compare, run.id].slice(-2) : state.compare.filter((id) => id !== run.id));
    if (state.compare.length === 2) compareRuns(...state.compare);
  });
  return input;
}

const pin = (run, title) => button(isPinned(run) ? "★" : "☆", async () => {
  const tags = isPinned(run) ? run.tags.filter((tag) => tag !== PINNED) : [...run.tags, PINNED];
  await orNotice(() => patched(`/v1/runs/${run.id}`, run, { tags }));
  tell("runs-changed");
}, { class: "pin", "data-focus": `pin-${run.id}`, "aria-pressed": String(isPinned(run)), "aria-label": `Pin run ${title}` });

function saveTable() {
  const all = rows().map(({ run }) => run);
  saveText(csvText([...COLUMNS.filter(([, , of]) => of).map(([, words, of]) => [words === "Peak" ? "Peak [m]" : words, all.map((run) => { const value = of(run) ?? ""; return typeof value === "string" ? `"${value.replaceAll('"', '""')}"` : value; })]), ["Id", all.map(({ id }) => id)]]), "runs.csv", "text/csv");
}
