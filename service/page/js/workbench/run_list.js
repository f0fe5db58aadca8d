// The runs that are known here: listed once, then told by the service as they begin, go on and end.

import { eventsOf, fetched, lost, pause, Problem, request } from "../network/api.js";
import { on, state, tell } from "../base/state.js";
import { byId, say } from "../base/dom.js";

const SIZE = 100;
const AT_ONCE = 4;
export const PRESS = "press-";
export const PINNED = "pinned";
const known = new Map();
const summaries = new Map();
let next = null;
let asked = 0;
let wanted = [];
let asking = 0;
export const isUnderWay = ({ status }) => status === "accepted" || status === "running";

// All that are known, newest first; ids grow with time.
export const runs = () => [...known.values()].sort((a, b) => (a.id < b.id ? 1 : -1));

// The state of a run as it was told last.
export const lastTold = (id) => known.get(id) ?? null;

// What was asked of a run and what came out; null until the service has said it.
export const summaryOf = ({ id }) => summaries.get(id) ?? null;
export const hasMore = () => next !== null;
export const titleOf = (run) => run.name || `${run.kind} of ${run.scene ?? "a scene"}`;
export const pressOf = ({ tags }) => tags.find((tag) => tag.startsWith(PRESS)) ?? "";

export function startRunList() {
  for (const way of ["project", "online", "runs-changed", "runs-since"]) on(way, () => listRuns());
  on("key", () => listRuns());
  follow();
}

function query() {
  const words = new URLSearchParams({ limit: SIZE });
  const since = byId("runs-since").value;
  if (state.project) words.set("project", state.project);
  if (since) words.set("created_after", new Date(`${since}T00:00`).toISOString());
  return `/v1/runs?${words}`;
}

const isListed = (run) => (!state.project || run.project === state.project) && (!byId("runs-since").value || new Date(run.created) >= new Date(`${byId("runs-since").value}T00:00`));

export async function listRuns(more = false) {
  const mine = (asked += 1);
  try {
    const page = await request(more && next ? next : query());
    // Those under way are there whoever began them and in whatever project.
    const busy = more ? [] : (await request("/v1/runs?status=accepted&status=running")).items;
    if (mine !== asked) return;
    if (!more) known.clear();
    for (const run of [...page.items, ...busy]) known.set(run.id, run);
    next = page.next;
    changed();
  } catch (error) {
    if (mine === asked) say("runs-status", error.message, true);
  }
}

function changed() {
  wanted = runs().filter((run) => !isUnderWay(run) ? summaries.get(run.id)?.status !== run.status : !summaries.has(run.id));
  tell("runs");
  learn();
}

// What lists leave out, a few at a time; of a run that has ended it never changes.
async function learn() {
  while (asking < AT_ONCE && wanted.length) {
    const { id, status } = wanted.shift();
    asking += 1;
    request(`/v1/runs/${id}/summary`).then((found) => {
      summaries.set(id, { ...found, status });
    }).catch((error) => {
      // Deleted between the list and this look at it: the next list is without it.
      if (!(error instanceof Problem)) throw error;
      summaries.set(id, { id, status, request: null, values: {}, peak: null, found: [], curve: null });
    }).finally(() => {
      asking -= 1;
      tell("runs");
      learn();
    });
  }
}

const keyGiven = () => new Promise((resolve) => {
  const off = on("key", () => {
    off();
    resolve();
  });
});

// One stream for all runs, taken up again when it breaks.
async function follow() {
  for (;;) {
    try {
      const answer = await fetched("/v1/runs/events", { headers: { Accept: "text/event-stream" } });
      tell("runs-followed");
      for await (const { event, data } of eventsOf(answer.body)) if (event === "run") told(data);
      await pause(0.5);
    } catch (error) {
      if (!(error instanceof Problem)) await lost();
      else if (error.status === 401) await keyGiven();
      else await pause(5);
    }
  }
}

function told(run) {
  const before = known.get(run.id);
  tell("run", run);
  if (isUnderWay(run) || isListed(run)) known.set(run.id, { ...run, request: undefined });
  else if (!known.delete(run.id)) return; // what has ended stands with its own project alone
  changed();
  if (before && isUnderWay(before) && !isUnderWay(run)) tell("run-ended", run);
}
