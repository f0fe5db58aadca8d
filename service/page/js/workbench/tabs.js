// Tabs: which cards are seen together. A card may stand under several; "All" is the whole page under one another.

import { FIRST_TAB, state, step, write } from "../base/address.js";
import { byId, el, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";

const TABS = [["response", "Response"], ["map", "Map"], ["design", "Design"], ["disk", "Disk"], ["modes", "Modes"], ["identify", "Identification"], ["accuracy", "Accuracy"], ["runs", "Runs"], ["all", "All"]];
const OF_KIND = { sweep: "response", march: "response", map: "map", pareto: "map", design: "design", accuracy: "accuracy", campbell: "disk", interference: "disk", modes: "modes", identify: "identify" };
const MOVES = { ArrowRight: 1, ArrowLeft: -1 };

// The tab that shows what a kind of job found.
export const tabOf = (kind) => OF_KIND[kind] ?? "runs";

const known = (name) => TABS.some(([each]) => each === name);

export function startTabs() {
  const list = byId("tabs");
  show(list, TABS.map(([name, words]) =>
    el("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": "panel", onclick: () => openTab(name) }, words)));
  list.addEventListener("keydown", (event) => {
    const at = TABS.findIndex(([name]) => name === state.tab);
    const next = event.key === "Home" ? 0 : event.key === "End" ? TABS.length - 1 : event.key in MOVES ? (at + MOVES[event.key] + TABS.length) % TABS.length : -1;
    if (next < 0) return;
    event.preventDefault();
    openTab(TABS[next][0]);
    byId(`tab-${TABS[next][0]}`).focus();
  });
  on("tab", openTab);
  restoreTab();
}

// The tab of the address as it is now.
export const restoreTab = () => openTab(known(state.tab) ? state.tab : FIRST_TAB);

function openTab(name) {
  if (name !== state.tab) {
    step();
    byId("panel").scrollTop = 0;
  }
  state.tab = name;
  for (const [each] of TABS) {
    const tab = byId(`tab-${each}`);
    tab.setAttribute("aria-selected", String(each === name));
    tab.tabIndex = each === name ? 0 : -1;
  }
  byId("panel").setAttribute("aria-labelledby", `tab-${name}`);
  byId("panel").dataset.view = name;
  for (const card of byId("panel").querySelectorAll("[data-tabs]")) card.classList.toggle("off", name !== "all" && !card.dataset.tabs.split(" ").includes(name));
  tell("tab-shown", name);
  if (state.scene) write();
}
