// Cards whose inputs changed since they were computed say so, with one click to compute them again.

import { byId, el, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { differences } from "../scene/inputs.js";

const CARDS = { sweep: "response", design: "design", map: "map", pareto: "front", accuracy: "accuracy", campbell: "campbell", interference: "interference", modes: "modes", identify: "identify" };
const WAYS = ["settled", "values", "settings", "contact", "scene-contact"];
const computed = new Map();
const underway = new Set();

// The request that what is seen of a kind was computed for.
export const computedFor = (kind) => computed.get(kind) ?? null;

// What changed since, in words; empty if what is seen is of the present values, or if nothing is seen.
export const changedSince = (kind) => (computed.has(kind) ? differences(kind, computed.get(kind)) : []);

export const isUnderway = (kind) => underway.has(kind);

export function startRenewal() {
  for (const card of Object.values(CARDS)) {
    byId(card).querySelector("h2").after(el("div", { class: "stale", id: `${card}-stale`, role: "status", hidden: true }));
  }
  on("scene-left", () => {
    computed.clear();
    underway.clear();
    update();
  });
  on("job-begun", (kind) => {
    underway.add(kind);
    update();
  });
  on("job-over", (kind) => {
    underway.delete(kind);
    update();
  });
  on("computed", ({ kind, request }) => {
    computed.set(kind, request);
    update();
  });
  for (const way of WAYS) on(way, update);
}

// A button that computes a kind again with what is set now.
export const renewButton = (kind, words = "Compute again") =>
  el("button", { type: "button", class: "renew", disabled: isUnderway(kind), onclick: () => tell("renew", kind) }, isUnderway(kind) ? "Being computed …" : words);

function update() {
  for (const [kind, card] of Object.entries(CARDS)) {
    const changed = changedSince(kind);
    const bar = byId(`${card}-stale`);
    const words = changed.join("; ");
    const now = `${words} ${isUnderway(kind)}`;
    byId(card).classList.toggle("is-stale", changed.length > 0);
    bar.hidden = changed.length === 0;
    // A bar that says the same keeps its button, and with it the focus.
    if (bar.dataset.says === now) continue;
    bar.dataset.says = now;
    show(bar, changed.length ? [el("strong", {}, "Stale"), el("span", {}, ` computed for ${words}. `), renewButton(kind)] : []);
  }
  tell("staleness");
}
