// Cards whose inputs changed since they were computed say so, with one click to compute them again.

import { button, byId, el, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { differences } from "../scene/inputs.js";
import { STUDIES } from "../views.js";

const WAYS = ["settled", "values", "settings", "contact", "scene-contact"];
const computed = new Map();
const underway = new Set();

// The request that what is seen of a kind was computed for.
export const computedFor = (kind) => computed.get(kind) ?? null;

// What changed since, in words; empty if what is seen is of the present values, or if nothing is seen.
export const changedSince = (kind) => (computed.has(kind) ? differences(kind, computed.get(kind)) : []);

export const isUnderway = (kind) => underway.has(kind);

export function startRenewal() {
  const then = (change) => (told) => {
    change(told);
    update();
  };
  on("scene-left", then(() => [computed, underway].forEach((each) => each.clear())));
  on("job-begun", then((kind) => underway.add(kind)));
  on("job-over", then((kind) => underway.delete(kind)));
  on("computed", then(({ kind, request }) => computed.set(kind, request)));
  for (const way of WAYS) on(way, update);
}

// A button that computes a kind again with what is set now.
const renewButton = (kind, words = "Compute again") =>
  button(isUnderway(kind) ? "Being computed …" : words, () => tell("renew", kind), { class: "renew", disabled: isUnderway(kind) });

// What a card that is stale says.
export const staleWords = (kind, changed, words) => (changed.length ? [el("strong", {}, "Stale"), el("span", {}, ` computed for ${changed.join("; ")}. `), renewButton(kind, words)] : []);

function update() {
  for (const { kind, id } of STUDIES) {
    const changed = changedSince(kind);
    const bar = byId(`${id}-stale`);
    const now = `${changed.join("; ")} ${isUnderway(kind)}`;
    byId(id).classList.toggle("is-stale", changed.length > 0);
    bar.hidden = changed.length === 0;
    // A bar that says the same keeps its button, and with it the focus.
    if (bar.dataset.says === now) continue;
    bar.dataset.says = now;
    show(bar, staleWords(kind, changed));
  }
  tell("staleness");
}
