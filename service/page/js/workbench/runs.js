// The rail's runs: what is under way, then the last ones with their figure and response; the table has all of them.

import { orNotice, request } from "../network/api.js";
import { on, state, tell } from "../base/state.js";
import { button, byId, el, redrawn, say, svg } from "../base/dom.js";
import { length, quantity, timing, when } from "../base/format.js";
import { isUnderWay, PINNED, pressOf, runs, summaryOf, titleOf } from "./run_list.js";

const MOST = 8;
const MOST_VALUES = 3;
const LEADING = ["design", "identify", "pareto", "modes", "sweep"];
export const WORDS = { accepted: "waits", running: "runs", failed: "failed", dismissed: "stopped" };
// A run that ended short of its goal has a result: it did not fail.
export const wordOf = (run) => (run.status === "failed" && peakOf(run) ? "fell short" : WORDS[run.status]);

export function startRuns() {
  on("runs", draw);
  for (const event of ["job-begun", "computed", "scene"]) on(event, draw);
  byId("runs-all").addEventListener("click", () => tell("tab", "runs"));
  setInterval(() => runs().some(isUnderWay) && draw(), 1000);
  on("run-ended", ended);
}

// Runs of one press under the one that matters most; pinned ones first. {head, rest}
export function presses(list) {
  const groups = new Map();
  for (const run of list) {
    const key = pressOf(run) || run.id;
    groups.set(key, [...(groups.get(key) ?? []), run]);
  }
  const rank = ({ kind }) => (LEADING.includes(kind) ? LEADING.indexOf(kind) : LEADING.length);
  return [...groups.values()].map((all) => {
    const [head, ...rest] = [...all].sort((a, b) => rank(a) - rank(b));
    return { head, rest };
  });
}

export const isPinned = ({ tags }) => tags.includes(PINNED);

// Which values a run has: two of the same kind are told apart.
export const valuesOf = (run, most = MOST_VALUES) => valuesIn(summaryOf(run) ?? {}, most);

export function valuesIn({ request: body, values = {} }, most) {
  const over = body?.variables ? Object.keys(body.variables) : typeof body?.parameter === "string" && body.from !== undefined ? [body.parameter] : [];
  const told = [...over.filter((path) => !(path in values)).map((path) => `over ${path}`), ...Object.entries(values).map(([path, value]) => `${path} ${quantity(path, value)}`),
    ...(body?.frequency_hz > 0 ? [`at ${quantity("frequency", body.frequency_hz)}`] : [])];
  return told.length > most ? [...told.slice(0, most), "…"] : told;
}

export const peakOf = (run) => {
  const { peak, worst } = summaryOf(run) ?? {};
  return peak ? `${length(peak.value)}${worst ? " worst" : ""}` : "";
};

const seen = new WeakMap();

function draw() {
  const list = runs();
  const busy = list.filter(isUnderWay).length;
  say("runs-status", busy ? `${busy} under way` : list.length ? "" : `No run${state.project ? " in this project" : ""} yet: Find the best damper makes the first ones.`);
  drawRuns(byId("runs-list"), MOST);
}

// The last runs in a list, those under way first, then pinned ones; whether there are any. The same list is not drawn anew
// under the focus or a press: only how far things are goes on.
export function drawRuns(host, most) {
  const list = runs();
  const busy = list.filter(isUnderWay);
  const rest = presses(list.filter((run) => !isUnderWay(run))).map(({ head }) => head);
  const shown = [...busy, ...rest.filter(isPinned), ...rest.filter((run) => !isPinned(run))].slice(0, Math.max(most, busy.length));
  const now = JSON.stringify([shown.map((run) => [run.id, run.status, run.name, run.tags, summaryOf(run)?.status]), state.jobs]);
  if (now === seen.get(host)) busy.forEach((run) => progressed(host, run));
  else redrawn(host, shown.map(line));
  seen.set(host, now);
  return shown.length > 0;
}

function progressed(host, run) {
  const node = host.querySelector(`[data-run="${run.id}"]`);
  if (!node) return;
  node.querySelector("progress").value = run.progress;
  node.querySelector(".run-time").textContent = `${WORDS[run.status]}${timing(run)}`;
}

function line(run) {
  const title = titleOf(run);
  const open = state.jobs[run.kind] === run.id;
  const words = [peakOf(run), ...valuesOf(run, 1), wordOf(run) ?? ""].filter(Boolean).join(" · ");
  return el("li", { class: open ? "run is-shown" : "run", "data-run": run.id },
    button([el("span", {}, el("b", {}, title), isUnderWay(run) ? "" : el("span", { class: "run-what" }, words)), sparkline(summaryOf(run)?.curve)], () => openRun(run),
      { class: "run-name", "data-focus": `open-${run.id}`, "aria-current": open ? "true" : undefined, title: when(run.created) }),
    isUnderWay(run) ? underWay(run, title) : null);
}

export const underWay = (run, title) =>
  el("div", { class: "row tight" },
    el("progress", { class: "bar", max: 1, value: run.progress, "aria-label": `Progress of run ${title}` }),
    el("span", { class: "run-what run-time" }, `${WORDS[run.status]}${timing(run)}`),
    button("Stop", () => orNotice(() => request(`/v1/jobs/${run.id}`, { method: "DELETE" })), { "data-focus": `stop-${run.id}`, "aria-label": `Stop run ${title}` }));

// What was asked is needed to show it; a run from the command may bring a scene of its own.
export const openRun = (run) => orNotice(async () => {
  const asked = summaryOf(run)?.request ?? (await request(`/v1/runs/${run.id}`)).request;
  tell("open-run", { ...run, request: asked });
});

// A job that ends while nobody looks is told by the browser, if it may.
function ended(run) {
  if (!document.hidden || window.Notification?.permission !== "granted") return;
  const note = new Notification(`${titleOf(run)}: ${run.status === "successful" ? "done" : WORDS[run.status]}`);
  note.onclick = () => { window.focus(); openRun(run); };
}

const [WIDE, HIGH] = [84, 22];

// A response as a line of a few pixels.
export function sparkline(curve) {
  if (!curve?.amplitude.length) return "";
  const { frequency_hz: x, amplitude: y } = curve;
  const [first, last, top] = [x[0], x[x.length - 1], Math.max(...y)];
  const at = x.map((hertz, i) => `${((WIDE * (hertz - first)) / (last - first || 1)).toFixed(1)} ${(HIGH - 2 - ((HIGH - 4) * y[i]) / (top || 1)).toFixed(1)}`);
  return svg("svg", { class: "spark", viewBox: `0 0 ${WIDE} ${HIGH}`, width: WIDE, height: HIGH, "aria-hidden": "true" }, svg("path", { class: "series c1", d: `M${at.join("L")}` }));
}
