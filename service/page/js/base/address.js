// What is seen, in the address: a reload goes on, and a link shows another the same.

// Every other word is the name of a kind of job, with the id of its job.
const WORDS = ["scene", "contact", "variable", "set", "harmonics", "at", "range", "compare", "tab", "project"];
export const FIRST_TAB = "response";
const KIND = /^[a-z][a-z0-9-]{0,31}$/;
const ID = /^[0-9a-f-]{36}$/;

export const state = {
  scene: "",
  set: {},
  contact: "",
  variable: "",
  range: null,
  harmonics: 11,
  at: null,
  jobs: {},
  compare: [],
  tab: "",
  project: "",
};

export function read() {
  written = location.search;
  const words = new URLSearchParams(location.search);
  state.scene = words.get("scene") ?? "";
  state.contact = words.get("contact") ?? "";
  state.variable = words.get("variable") ?? "";
  state.set = pairs(words.get("set") ?? "");
  state.harmonics = whole(words.get("harmonics"), 11);
  state.at = positive(words.get("at"));
  const range = (words.get("range") ?? "").split(":").map(Number);
  state.range = range.length === 2 && range.every((end) => end > 0) ? range : null;
  state.compare = (words.get("compare") ?? "").split(",").filter((id) => ID.test(id)).slice(0, 2);
  // The tab of the runs was called after the data once.
  state.tab = (words.get("tab") ?? "").replace(/^data$/, "runs");
  state.project = ID.test(words.get("project") ?? "") ? words.get("project") : "";
  state.jobs = {};
  for (const [kind, id] of words) {
    if (!WORDS.includes(kind) && KIND.test(kind) && ID.test(id)) state.jobs[kind] = id;
  }
}

let held = 0;
let written = "";

// What stood in the address before the browser went back or forward.
export const lastWritten = () => written;

// A further entry of the browser's history, which what follows writes to: Back leads to what was seen before.
export function step() {
  if (!held && state.scene) history.pushState(null, "", location.href);
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
  if (state.scene) words.set("scene", state.scene);
  const set = Object.entries(state.set).map(([path, value]) => `${path}:${value}`);
  if (set.length) words.set("set", set.join(","));
  if (state.contact) words.set("contact", state.contact);
  if (state.variable) words.set("variable", state.variable);
  if (state.range) words.set("range", state.range.join(":"));
  if (state.harmonics !== 11) words.set("harmonics", state.harmonics);
  if (state.at !== null) words.set("at", Number(state.at.toPrecision(9)));
  for (const [kind, id] of Object.entries(state.jobs)) words.set(kind, id);
  if (state.compare.length) words.set("compare", state.compare.join(","));
  if (state.tab && state.tab !== FIRST_TAB) words.set("tab", state.tab);
  if (state.project) words.set("project", state.project);
  const text = words.toString().replaceAll("%3A", ":").replaceAll("%2C", ",");
  const address = `${location.pathname}${text ? `?${text}` : ""}`;
  if (address !== location.pathname + location.search) history.replaceState(null, "", address + location.hash);
  written = location.search;
}

function pairs(text) {
  const found = {};
  for (const pair of text.split(",").filter(Boolean)) {
    const [path, value] = pair.split(":");
    if (/^[\w@-]+(\.[\w@-]+)?$/.test(path) && value !== "" && Number.isFinite(Number(value))) {
      found[path] = Number(value);
    }
  }
  return found;
}

const whole = (text, otherwise) => (/^[1-9]\d{0,2}$/.test(text ?? "") ? Number(text) : otherwise);

const positive = (text) => (text !== null && Number(text) > 0 ? Number(text) : null);
