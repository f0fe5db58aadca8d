// Requests to the service: problem documents as errors, keys, the state of the connection; server-sent events through
// fetch, so that a key can go along, taken up again where they break.

import { tell } from "../base/state.js";

const KEY = "stickslip-key";
const BACKOFF = [0.25, 0.5, 1, 1.5];
let offline = false;
let back = null;

export class Problem extends Error {
  constructor(status, document, retryAfter = null) {
    super(document.detail || document.title || `HTTP status ${status}`);
    this.status = status;
    this.retryAfter = retryAfter;
    this.errors = document.errors ?? [];
  }
}

export class Offline extends Error {
  constructor() {
    super("the service does not answer");
  }
}

const key = () => sessionStorage.getItem(KEY) ?? "";

export function setKey(value) {
  if (value) sessionStorage.setItem(KEY, value);
  else sessionStorage.removeItem(KEY);
}

export const pause = (seconds) => new Promise((resolve) => setTimeout(resolve, seconds * 1000));
const authorised = (headers) => (key() ? { ...headers, Authorization: `Bearer ${key()}` } : headers);

// What is changed must be as it was known.
export const patched = (path, { revision }, body) => request(path, { method: "PATCH", body, headers: { "If-Match": `"${revision}"` } });

// A raw answer of the service; Offline if there is none, Problem if it refuses.
export async function fetched(path, { method = "GET", body, raw, headers = {}, signal } = {}) {
  const sent = body === undefined ? {} : { "Content-Type": "application/json" };
  let answer;
  try {
    answer = await fetch(path, { method, headers: authorised({ ...sent, ...headers }), body: raw ?? (body === undefined ? undefined : JSON.stringify(body)), signal });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    lost();
    throw new Offline();
  }
  if (answer.ok) return answer;
  const later = Number(answer.headers.get("Retry-After")) || null;
  const problem = new Problem(answer.status, await answer.json().catch(() => ({})), later);
  if (answer.status === 401) tell("key-wanted", problem);
  throw problem;
}

export async function request(path, options) {
  const answer = await fetched(path, options);
  return answer.status === 204 ? null : answer.json();
}

// Does something of which a failure is said, not thrown.
export async function orNotice(act, said = (error) => error.message) {
  try {
    return await act();
  } catch (error) {
    return tell("notice", said(error));
  }
}

// Every item of a list that comes in pages.
export async function everyItem(path) {
  const { items, next } = await request(path);
  return next ? [...items, ...(await everyItem(next))] : items;
}

// Sends a file and tells the share of it that is on its way: `fetch` does not say that.
export function sent(path, file, onProgress) {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("POST", path);
    if (key()) sending.setRequestHeader("Authorization", `Bearer ${key()}`);
    sending.responseType = "json";
    sending.upload.addEventListener("progress", ({ loaded, total }) => onProgress(loaded / total));
    sending.addEventListener("load", () => (sending.status < 300 ? resolve(sending.response) : reject(new Problem(sending.status, sending.response ?? {}))));
    sending.addEventListener("error", () => { lost(); reject(new Offline()); });
    sending.send(file);
  });
}

export const post = (path, body, options = {}) => request(path, { ...options, method: "POST", body });

// The service went away: ask until it is back, ever less often.
export function lost() {
  if (offline) return back;
  offline = true;
  tell("offline");
  back = (async () => {
    for (let turn = 0; offline; turn += 1) {
      await pause(BACKOFF[Math.min(turn, BACKOFF.length - 1)]);
      offline = (await partsOfService()) === null;
    }
    tell("online");
  })();
  return back;
}

// How far each part of the service is started; null where no service answers.
export const partsOfService = () => fetch("/health/ready", { cache: "no-store" }).then((answer) => answer.json()).then(({ parts }) => parts, () => null);

// Waits until the service answers again, then tries once more; for reads and for what has an idempotency key.
export async function patiently(attempt) {
  for (;;) {
    try {
      return await attempt();
    } catch (error) {
      if (!(error instanceof Offline)) throw error;
      await lost();
    }
  }
}

// Yields {event, data, id} of a body as it arrives.
export async function* eventsOf(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  try {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      text += value;
      const blocks = text.split(/\r?\n\r?\n/);
      text = blocks.pop();
      for (const block of blocks) {
        const event = parsed(block);
        if (event) yield event;
      }
    }
  } finally {
    reader.cancel().catch(() => undefined);
  }
}

function parsed(block) {
  const event = { event: "message", data: "", id: undefined };
  for (const line of block.split(/\r?\n/)) {
    const [, field, value] = /^([a-z]*):? ?(.*)$/.exec(line) ?? [];
    if (field === "event") event.event = value;
    else if (field === "data") event.data += value;
    else if (field === "id") event.id = value;
  }
  return event.data ? { ...event, data: JSON.parse(event.data) } : null;
}

// Follows a job to its end through broken connections and restarts; resolves to the job.
export async function watch(jobId, { onProgress, onPoints, signal } = {}) {
  let last;
  for (;;) {
    try {
      const headers = { Accept: "text/event-stream", ...(last ? { "Last-Event-ID": last } : {}) };
      const answer = await fetched(`/v1/jobs/${jobId}/events`, { headers, signal });
      if (answer.status !== 204) {
        for await (const { event, data, id } of eventsOf(answer.body)) {
          last = id ?? last;
          if (event === "end") return data;
          if (event === "progress") onProgress?.(data);
          if (event === "partial") onPoints?.(data);
        }
      }
      const job = await request(`/v1/jobs/${jobId}`, { signal });
      if (["successful", "failed", "dismissed"].includes(job.status)) return job;
      await pause(0.3);
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Problem) throw error;
      await lost();
    }
  }
}
