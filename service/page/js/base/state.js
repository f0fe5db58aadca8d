// What is seen, in the address: a reload goes on, and a link shows another the same. What happens: parts of the page tell
// each other.

export const FIRST_TAB = "response";
const KIND = /^[a-z][a-z0-9-]{0,31}$/;
const ID = /^[0-9a-f-]{36}$/;
const USUAL_HARMONICS = 11;
const plain = { read: (word) => word ?? "", write: (value) => value };

// How each word of the address is read, and what is written where it says something. Every other word is the name of a
// kind of job, with the id of its job.
const WORDS = {
  scene: plain,
  set: { read: pairs, write: (set) => Object.entries(set).map(([path, value]) => `${path}:${value}`).join(",") },
  contact: plain,
  variable: plain,
  range: { read: rangeOf, write: (range) => range?.join(":") },
  harmonics: { read: (word) => (/^[1-9]\d{0,2}$/.test(word ?? "") ? Number(word) : USUAL_HARMONICS), write: (count) => (count === USUAL_HARMONICS ? "" : count) },
  at: { read: (word) => (word !== null && Number(word) > 0 ? Number(word) : null), write: (at) => (at === null ? "" : Number(at.toPrecision(9))) },
  jobs: { read: () => ({}), write: () => "" },
  compare: { read: (word) => (word ?? "").split(",").filter((id) => ID.test(id)).slice(0, 2), write: (ids) => ids.join(",") },
  // The tab of the runs was called after the data once.
  tab: { read: (word) => (word ?? "").replace(/^data$/, "runs"), write: (tab) => (tab === FIRST_TAB ? "" : tab) },
  project: { read: (word) => (ID.test(word ?? "") ? word : ""), write: (id) => id },
};

export const state = Object.fromEntries(Object.entries(WORDS).map(([name, word]) => [name, word.read(null)]));

export function read() {
  written = location.search;
  const words = new URLSearchParams(location.search);
  for (const [name, word] of Object.entries(WORDS)) state[name] = word.read(words.get(name));
  for (const [kind, id] of words) if (!(kind in WORDS) && KIND.test(kind) && ID.test(id)) state.jobs[kind] = id;
}

let held = 0;
let written = "";

// What stood in the address before the browser went back or forward.
export const lastWritten = () => written;

// A further entry of the browser's history, which what follows writes to: Back leads to what was seen before.
export function step() {
  if (!held && (state.scene || !location.search)) history.pushState(null, "", location.href);
}

// What is done within is one step, or none where it goes back itself.
export async function asOneStep(work, { back = false } = {}) {
  if (!back) step();
  held += 1;
  try {
    return await work();
  } finally {
    held -= 1;
  }
}

export function write() {
  const words = new URLSearchParams();
  for (const [name, word] of Object.entries(WORDS)) {
    const said = word.write(state[name]);
    if (said) words.set(name, said);
    if (name === "jobs") for (const [kind, id] of Object.entries(state.jobs)) words.set(kind, id);
  }
  const text = words.toString().replaceAll("%3A", ":").replaceAll("%2C", ",");
  const address = `${location.pathname}${text ? `?${text}` : ""}`;
  if (address !== location.pathname + location.search) history.replaceState(null, "", address + location.hash);
  written = location.search;
}

function pairs(word) {
  const found = {};
  for (const pair of (word ?? "").split(",").filter(Boolean)) {
    const [path, value] = pair.split(":");
    if (/^[\w@-]+(\.[\w@-]+)?$/.test(path) && value !== "" && Number.isFinite(Number(value))) found[path] = Number(value);
  }
  return found;
}

function rangeOf(word) {
  const range = (word ?? "").split(":").map(Number);
  return range.length === 2 && range.every((end) => end > 0) ? range : null;
}

const listeners = new Map();

export function on(name, listener) {
  if (!listeners.has(name)) listeners.set(name, new Set());
  listeners.get(name).add(listener);
  return () => listeners.get(name).delete(listener);
}

export function tell(name, detail) {
  for (const listener of listeners.get(name) ?? []) listener(detail);
}
