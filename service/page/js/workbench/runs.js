// The rail's runs: what is under way and what was computed, opened, named, deleted, two of them compared.

import { request } from "../network/api.js";
import { state } from "../base/address.js";
import { byId, el, say, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { number, quantity, when } from "../base/format.js";
import { timing } from "../base/timing.js";
import { VIEWS } from "../views.js";
import { compareRuns } from "./comparison.js";
import { runForm } from "./run_form.js";

const SIZE = 30;
const BUSY_MS = 2000;
const QUIET_MS = 15_000;
const UNDER_WAY = ["accepted", "running"];
const WORDS = { accepted: "waits", running: "runs", failed: "failed", dismissed: "stopped" };
const MOST_VALUES = 3;
const AT_ONCE = 6;
let items = [];
let next = null;
let asked = 0;
let timer = 0;
let chosen = [];
const open = new Set();
// The forms that are open: what was typed and not saved outlives a list that is drawn anew.
const forms = new Map();
// What was asked of each run: lists leave it out, and it never changes.
const requests = new Map();

export function startRuns() {
  byId("runs-form").addEventListener("submit", (event) => {
    event.preventDefault();
    items = [];
    listRuns();
  });
  byId("runs-more").addEventListener("click", () => listRuns(next));
  for (const way of ["project", "job-ended", "online", "runs-changed", "scene-left"]) on(way, () => listRuns());
  on("job-begun", () => later(BUSY_MS / 4));
  on("comparison-closed", () => {
    chosen = [];
    draw();
  });
  byId("runs-list").addEventListener("pointerdown", () => { pressed = true; });
  for (const end of ["pointerup", "pointercancel"]) document.addEventListener(end, () => { pressed = false; });
  document.addEventListener("visibilitychange", () => later(0));
}

function query() {
  const words = new URLSearchParams({ limit: Math.max(SIZE, items.length) });
  const text = byId("runs-text").value.trim();
  const tag = byId("runs-tag").value.trim();
  const since = byId("runs-since").value;
  if (state.project) words.set("project", state.project);
  if (text) words.set("text", text);
  if (tag) words.set("tag", tag);
  if (since) words.set("created_after", new Date(`${since}T00:00`).toISOString());
  return `/v1/runs?${words}`;
}

// Looked at again soon while something is under way, seldom otherwise, never in a tab that is not seen.
function later(wait) {
  clearTimeout(timer);
  if (!document.hidden) timer = setTimeout(() => listRuns(), wait);
}

export async function listRuns(address = null) {
  const mine = (asked += 1);
  try {
    const page = await request(address ?? query());
    const busy = (await request("/v1/runs?status=accepted&status=running")).items;
    if (mine !== asked) return;
    const ids = new Set(busy.map(({ id }) => id));
    const listed = page.items.filter(({ id }) => !ids.has(id));
    items = address ? [...items, ...listed] : [...busy, ...listed];
    next = page.next;
    byId("runs-more").hidden = next === null;
    say("runs-status", status(busy.length));
    draw();
    await learn();
    draw();
  } catch (error) {
    if (mine === asked) say("runs-status", error.message, true);
  }
  later(items.some(({ status: now }) => UNDER_WAY.includes(now)) ? BUSY_MS : QUIET_MS);
}

async function learn() {
  const missing = items.filter(({ id }) => !requests.has(id));
  for (let at = 0; at < missing.length; at += AT_ONCE) {
    await Promise.all(missing.slice(at, at + AT_ONCE).map(async ({ id }) => {
      try {
        requests.set(id, (await request(`/v1/runs/${id}`)).request ?? {});
      } catch (error) {
        // Deleted between the list and this look at it: the next list is without it.
        if (error.status !== 404) throw error;
      }
    }));
  }
}

const filtered = () => ["runs-text", "runs-tag", "runs-since"].some((id) => byId(id).value.trim());

function status(busy) {
  if (!items.length) return filtered() ? "No run meets this." : `No run${state.project ? " in this project" : ""} yet: Find the best damper makes the first ones.`;
  return busy ? `${busy} under way` : "";
}

// Which values a run had: two of the same kind are told apart.
function values({ id }) {
  const body = requests.get(id) ?? {};
  const told = [
    ...Object.keys(body.variables ?? {}).map((path) => `over ${path}`),
    ...(typeof body.parameter === "string" && body.from !== undefined ? [`over ${body.parameter}`] : []),
    ...Object.entries(body.set ?? {}).map(([path, value]) => `${path} ${quantity(path, value)}`),
    ...(body.frequency_hz > 0 ? [`at ${number(body.frequency_hz, 5)} Hz`] : []),
  ];
  return told.length > MOST_VALUES ? [...told.slice(0, MOST_VALUES), "…"] : told;
}

export const titleOf = (run) => run.name || `${run.kind} of ${run.scene ?? "a scene"}`;

let seen = "";
// A button that is being pressed is not drawn anew under the pointer: the press would be no click.
let pressed = false;

function draw() {
  if (pressed) return;
  const host = byId("runs-list");
  const now = JSON.stringify([items, chosen, [...open], requests.size, state.jobs]);
  // What is being typed in stays; the same list is not drawn anew under the focus.
  if (now === seen || host.querySelector("form")?.contains(document.activeElement)) return;
  seen = now;
  const focused = document.activeElement?.closest("#runs-list") ? document.activeElement.dataset.focus : null;
  show(host, items.map(line));
  if (focused) host.querySelector(`[data-focus="${focused}"]`)?.focus();
}

function line(run) {
  const title = titleOf(run);
  const what = [run.name ? `${run.kind} of ${run.scene ?? "a scene"}` : "", ...values(run)].filter(Boolean).join(", ");
  const shown = state.jobs[run.kind] === run.id;
  return el("li", { class: shown ? "run is-shown" : "run" },
    el("div", { class: "run-head" },
      box(run, title),
      el("button", { type: "button", class: "run-name", "data-focus": `open-${run.id}`, "aria-current": shown ? "true" : undefined, onclick: () => openRun(run) }, title)),
    what ? el("p", { class: "run-what" }, what) : null,
    UNDER_WAY.includes(run.status) ? underWay(run, title) : el("p", { class: "run-what" }, [WORDS[run.status], when(run.created)].filter(Boolean).join(" · ")),
    run.notes ? el("p", { class: "run-notes" }, run.notes) : null,
    run.tags.length ? el("ul", { class: "tags", "aria-label": "Tags" }, run.tags.map((tag) => el("li", {}, tag))) : null,
    more(run, title));
}

function box(run, title) {
  const input = el("input", { type: "checkbox", checked: chosen.includes(run.id), "data-focus": `compare-${run.id}`, "aria-label": `Compare run ${title}, ${when(run.created)}` });
  input.addEventListener("change", () => {
    chosen = input.checked ? [...chosen, run.id].slice(-2) : chosen.filter((id) => id !== run.id);
    draw();
    if (chosen.length === 2) compareRuns(...chosen);
  });
  return input;
}

const underWay = (run, title) =>
  el("div", { class: "row tight" },
    el("progress", { class: "bar", max: 1, value: run.progress, "aria-label": `Progress of run ${title}` }),
    el("span", { class: "run-what" }, `${WORDS[run.status]}${timing(run)}`),
    el("button", { type: "button", "data-focus": `stop-${run.id}`, "aria-label": `Stop run ${title}`, onclick: () => stop(run.id) }, "Stop"));

async function stop(id) {
  try {
    await request(`/v1/jobs/${id}`, { method: "DELETE" });
  } catch (error) {
    tell("notice", error.message);
  }
  listRuns();
}

function more(run, title) {
  const inside = el("div", {});
  const node = el("details", {}, el("summary", { "data-focus": `more-${run.id}`, "aria-label": `More of run ${title}` }, run.sweeps ? `More, ${run.sweeps} sweep${run.sweeps > 1 ? "s" : ""}` : "More"), inside);
  const fill = () => {
    if (forms.get(run.id)?.revision !== run.revision) forms.set(run.id, { revision: run.revision, nodes: runForm(run, title) });
    show(inside, forms.get(run.id).nodes);
  };
  node.addEventListener("toggle", () => {
    if (node.open === open.has(run.id)) return;
    if (node.open) open.add(run.id);
    else {
      open.delete(run.id);
      forms.delete(run.id);
    }
    if (node.open) fill();
  });
  if (open.has(run.id)) {
    node.open = true;
    fill();
  }
  return node;
}

// A run whose kind has a view is shown with the values it was computed for; any other is taken as a file.
function openRun(run) {
  const asked = requests.get(run.id);
  if (run.kind in VIEWS && typeof asked?.scene === "string") tell("open-run", { ...run, request: asked });
  else tell("notice", `A ${run.kind} has no view of its own: More has its results as a file.`);
}
