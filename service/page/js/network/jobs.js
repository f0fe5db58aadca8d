// Jobs of this page: submitted, watched, taken up again after a reload or a restart of the service.

import { Problem, patiently, post, request } from "./api.js";
import { state, write } from "../base/address.js";
import { byId, el, show } from "../base/dom.js";
import { tell } from "../base/events.js";
import { timing } from "../base/timing.js";
import { watch } from "./stream.js";

const WORDS = { accepted: "waits", running: "runs", successful: "done", failed: "failed", dismissed: "stopped" };
const ENDED = ["successful", "failed", "dismissed"];
const TICK_MS = 1000;
const shown = new Map();
const watching = new Map();

// What is computed while a project is open belongs to it.
const inProject = () => (state.project ? { project: state.project } : {});

// A key that no other request has; also where a page that did not come over TLS has no `randomUUID`.
const freshKey = () =>
  [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");

// Submits a job of a kind and follows it: `view` hears {progress, points, result, failed, waiting}. Whether it succeeded.
export async function run(kind, body, view, priority = 0) {
  forget(kind);
  const mine = begin(kind);
  tell("job-begun", kind);
  view.waiting?.();
  const key = freshKey();
  try {
    const headers = { "Idempotency-Key": key };
    const job = await patiently(() => post("/v1/jobs", { kind, priority, ...body, ...inProject() }, { headers, signal: mine.signal }));
    state.jobs[kind] = job.id;
    write();
    return await follow(kind, job.id, view, mine);
  } catch (error) {
    refused(kind, error, view, mine);
    return false;
  } finally {
    if (watching.get(kind) === mine) tell("job-over", kind);
  }
}

// Follows a job that was submitted before, by this page or the one that shared its link.
export async function resume(kind, view) {
  const id = state.jobs[kind];
  if (!id) return;
  const mine = begin(kind);
  tell("job-begun", kind);
  view.waiting?.();
  try {
    await follow(kind, id, view, mine);
  } catch (error) {
    if (error instanceof Problem && error.status === 404) {
      delete state.jobs[kind];
      write();
      shown.delete(kind);
      list();
      view.gone?.();
    } else refused(kind, error, view, mine);
  } finally {
    if (watching.get(kind) === mine) tell("job-over", kind);
  }
}

export function forget(kind) {
  watching.get(kind)?.abort();
  watching.delete(kind);
  shown.delete(kind);
  delete state.jobs[kind];
  list();
}

function begin(kind) {
  watching.get(kind)?.abort();
  const mine = new AbortController();
  watching.set(kind, mine);
  return mine;
}

function refused(kind, error, view, mine) {
  if (error.name === "AbortError" || watching.get(kind) !== mine) return;
  view.failed(error.message, error.errors ?? []);
}

async function follow(kind, id, view, { signal }) {
  const first = await patiently(() => request(`/v1/jobs/${id}`, { signal }));
  if (typeof first.request.scene === "string" && first.request.scene !== state.scene) return ofAnotherScene(kind, first, view);
  enter(kind, first);
  view.submitted?.(first);
  const job = ENDED.includes(first.status) ? first : await watched(kind, first, view, signal);
  enter(kind, job);
  if (job.status === "dismissed") {
    view.failed("The job was stopped.", [], job);
    return false;
  }
  const results = await patiently(() => request(`/v1/jobs/${id}/results`, { signal })).catch((error) => {
    if (error instanceof Problem) return null;
    throw error;
  });
  if (signal.aborted) return false;
  if (results) {
    view.result(results.result, results.sweeps, job);
    tell("computed", { kind, request: first.request, result: results.result });
  }
  if (job.status === "failed") view.failed(job.error?.detail ?? "The job failed.", job.error?.issues ?? [], results ? null : job);
  tell("job-ended", job);
  return job.status === "successful";
}

// Follows a job to its end; the time it takes is told every second, also while nothing else is new.
async function watched(kind, first, view, signal) {
  let now = first;
  const report = () => {
    enter(kind, now);
    if (now.status === "running") view.progress?.({ ...now, took: timing(now) });
  };
  const clock = setInterval(() => now.status === "running" && report(), TICK_MS);
  try {
    return await watch(first.id, {
      signal,
      onProgress: (news) => {
        const started = now.started ?? (news.status === "running" ? new Date().toISOString() : null);
        now = { ...now, ...news, started };
        report();
      },
      onPoints: (news) => view.points?.(news),
    });
  } finally {
    clearInterval(clock);
  }
}

// A job that a link names beside another scene: its values are not for this one.
function ofAnotherScene(kind, job, view) {
  delete state.jobs[kind];
  write();
  view.failed(`The ${kind} of the link is of the scene ${job.scene}, not of ${state.scene}: it is left out.`, []);
  return false;
}

function enter(kind, job) {
  shown.set(kind, job);
  list();
}

// A row stays the node it is while its job goes on: its button keeps the focus, and a press on it is a click.
const lines = new Map();

function list() {
  for (const [kind, { id }] of lines) if (shown.get(kind)?.id !== id) lines.delete(kind);
  const rows = [...shown].map(([kind, job]) => {
    if (!lines.has(kind)) lines.set(kind, line(kind, job));
    const { node, bar, words, stop } = lines.get(kind);
    const active = !ENDED.includes(job.status);
    bar.value = active ? job.progress : 1;
    words.textContent = `${WORDS[job.status]}${timing(job)}${job.result_of ? ", was stored" : ""}`;
    stop.hidden = !active;
    return node;
  });
  const host = byId("jobs-list");
  const seen = [...(host.querySelector("ul")?.children ?? [])];
  if (rows.length && rows.length === seen.length && rows.every((row, i) => row === seen[i])) return;
  show(host, rows.length ? el("ul", { class: "plain" }, rows) : el("p", { class: "note" }, "None begun in this tab. What others began is told with the runs."));
}

function line(kind, job) {
  const name = `${kind} of ${job.scene ?? "a scene"}`;
  const bar = el("progress", { class: "bar", max: 1, value: 0, "aria-label": `Progress of ${name}` });
  const words = el("span", { class: "note" });
  const stop = el("button", { type: "button", "aria-label": `Stop ${name}`, onclick: () => dismiss(job.id) }, "Stop");
  return { id: job.id, bar, words, stop, node: el("li", { class: "row" }, el("span", { class: "job-name" }, name), bar, words, stop) };
}

async function dismiss(id) {
  try {
    await request(`/v1/jobs/${id}`, { method: "DELETE" });
  } catch (error) {
    tell("notice", error.message);
  }
}

export const startJobs = list;
