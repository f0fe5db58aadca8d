// The strip under the bar: what the service still starts and how far each part is; gone when all are ready.

import { byId, el, note, show } from "../base/dom.js";
import { on } from "../base/state.js";
import { pause, partsOfService } from "../network/api.js";

const SIGNS = { ready: "✓", compiles: "◔", waits: "○" };
const EVERY = 1; // s
let watching = false;

export function startStrip() {
  on("online", watch);
  on("offline", () => { byId("starting").hidden = true; });
  watch();
}

// Until all parts are ready; what is not answered says nothing anew.
async function watch() {
  if (watching) return;
  watching = true;
  for (let busy = true; busy; ) {
    const parts = await partsOfService();
    if (parts) draw(parts);
    busy = !parts || parts.some(({ state }) => state !== "ready");
    if (busy) await pause(EVERY);
  }
  watching = false;
}

const shareOf = ({ state, done, of }) => (state === "ready" ? 1 : of ? done / of : 0);
const bar = (value, label) => el("progress", { max: 1, value, "aria-label": label });

// Rounded, so that what is read aloud changes seldom.
function leftOf(parts) {
  const left = Math.max(...parts.map(({ seconds_left: seconds }) => seconds ?? 0));
  return left ? `: about ${left < 15 ? Math.ceil(left / 5) * 5 : Math.round(left / 10) * 10} s more` : "";
}

function draw(parts) {
  const strip = byId("starting");
  strip.hidden = parts.every(({ state }) => state === "ready");
  if (strip.hidden) return show(strip);
  const words = `Getting ready${leftOf(parts)}`;
  if (!strip.firstChild) strip.append(el("div", {}, el("p", { class: "starting-head", role: "status" }), bar(0, "Start of the service"), note("Open and edit now; what you start waits.")));
  const [head, all] = strip.firstChild.children;
  if (head.textContent !== words) head.textContent = words;
  const compiles = parts.find(({ state }) => state === "compiles");
  all.value = compiles ? shareOf(compiles) : parts.reduce((sum, part) => sum + shareOf(part), 0) / parts.length;
  return strip.replaceChildren(strip.firstChild, ...parts.map((part) => cell(part, compiles)));
}

function cell({ name, state, done, of }, compiles) {
  const after = compiles && state === "waits" ? (name.startsWith("Live") ? "slow until then" : `after ${compiles.name.toLowerCase()}`) : "";
  return el("div", { class: `is-${state}` },
    el("p", {}, el("span", { class: "sign", "aria-hidden": "true" }, SIGNS[state]), el("b", {}, ` ${name} `), el("span", { class: "note" }, state)),
    of ? bar(done / of, `Kernels of ${name}`) : null,
    note(of ? `${done} of about ${of} kernels` : after));
}
