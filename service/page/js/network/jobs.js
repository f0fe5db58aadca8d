// Jobs of this page: submitted, watched, taken up again after a reload or a restart of the service.

import { patiently, post, Problem, request, watch } from "./api.js";
import { on, state, tell, write } from "../base/state.js";
import { timing } from "../base/format.js";
import { lastTold } from "../workbench/run_list.js";

const ENDED = ["successful", "failed", "dismissed"];
const TICK_MS = 1000;
const watching = new Map();

// What is computed while a project is open belongs to it.
const inProject = () => (state.project ? { project: state.project } : {});

// A key that no other request has; also where a page that did not come over TLS has no `randomUUID`.
const freshKey = () =>
  [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");

// Submits a job of a kind and follows it: `view` hears {progress, points, result, failed, waiting}. Whether it succeeded.
export function run(kind, body, view, priority = 0) {
  forget(kind);
  return heard(kind, view, async ({ signal }) => {
    const headers = { "Idempotency-Key": freshKey() };
    const job = await patiently(() => post("/v1/jobs", { kind, priority, ...body, ...inProject() }, { headers, signal }));
    state.jobs[kind] = job.id;
    write();
    return follow(kind, job.id, view, signal);
  });
}

// Follows a job that was submitted before, by this page or the one that shared its link.
export const resume = (kind, view) => state.jobs[kind] && heard(kind, view, ({ signal }) => follow(kind, state.jobs[kind], view, signal).catch((error) => {
  if (!(error instanceof Problem && error.status === 404)) throw error;
  delete state.jobs[kind];
  write();
}));

export function forget(kind) {
  watching.get(kind)?.abort();
  watching.delete(kind);
  delete state.jobs[kind];
}

// Begins to follow a job of a kind, in place of the one before; what is refused is said by the view.
async function heard(kind, view, work) {
  watching.get(kind)?.abort();
  const mine = new AbortController();
  const isMine = () => watching.get(kind) === mine;
  watching.set(kind, mine);
  tell("job-begun", kind);
  view.waiting?.();
  try {
    return await work(mine);
  } catch (error) {
    if (error.name !== "AbortError" && isMine()) view.failed(error.message, error.errors ?? []);
    return false;
  } finally {
    if (isMine()) tell("job-over", kind);
  }
}

async function follow(kind, id, view, signal) {
  const first = await patiently(() => request(`/v1/jobs/${id}`, { signal }));
  if (typeof first.request.scene === "string" && first.request.scene !== state.scene) return ofAnotherScene(kind, first, view);
  // A scene that a job brought along is stored under a name before its run is shown.
  first.request.scene = state.scene;
  view.submitted?.(first);
  const job = ENDED.includes(first.status) ? first : await watched(first, view, signal);
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
    await view.result(results.result, results.sweeps, { ...job, request: first.request });
    if (signal.aborted) return false;
    tell("computed", { kind, request: first.request, result: results.result });
  }
  if (job.status === "failed") view.failed(job.error?.detail ?? "The job failed.", job.error?.issues ?? [], results ? null : job);
  return job.status === "successful";
}

// Follows a job to its end; the time it takes is told every second, also while nothing else is new.
async function watched(first, view, signal) {
  let now = first;
  const report = () => {
    if (now.status === "running") view.progress?.({ ...now, took: timing(now) });
  };
  const clock = setInterval(() => now.status === "running" && report(), TICK_MS);
  const onProgress = (news) => {
    now = { ...now, ...news, started: now.started ?? (news.status === "running" ? new Date().toISOString() : null) };
    report();
  };
  try {
    return view.points ? await watch(first.id, { signal, onProgress, onPoints: (news) => view.points(news) }) : await ended(first.id, signal, onProgress);
  } finally {
    clearInterval(clock);
  }
}

// The end of a job, by the stream of all runs; it is asked for where that stream broke in between.
function ended(id, signal, onProgress) {
  return new Promise((resolve, reject) => {
    const done = (settle, value) => {
      for (const off of offs) off();
      settle(value);
    };
    const told = (run) => {
      if (run.id !== id) return;
      if (ENDED.includes(run.status)) request(`/v1/jobs/${id}`, { signal }).then((job) => done(resolve, job), (error) => done(reject, error));
      else onProgress({ status: run.status, progress: run.progress, points: run.points, best: run.best });
    };
    const look = () => patiently(() => request(`/v1/jobs/${id}`, { signal })).then(told, (error) => done(reject, error));
    const offs = [on("run", told), on("runs-followed", look)];
    signal.addEventListener("abort", () => done(reject, signal.reason));
    const before = lastTold(id);
    if (before) told(before);
  });
}

// A job that a link names beside another scene: its values are not for this one.
function ofAnotherScene(kind, job, view) {
  delete state.jobs[kind];
  write();
  view.failed(`The ${kind} of the link is of the scene ${job.scene}, not of ${state.scene}: it is left out.`, []);
  return false;
}
