// Tabs: which cards are seen together. A card may stand under several; "All" is the whole page under one another.

import { FIRST_TAB, state, step, write } from "../base/address.js";
import { button, byId, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { TABS, viewOf } from "../views.js";

const MOVES = { ArrowRight: 1, ArrowLeft: -1 };

const isOn = (card, name) => name === "all" || card.dataset.tabs.split(" ").includes(name);
const cards = () => [...byId("panel").querySelectorAll("[data-tabs]")];
// Of a tab whose cards are of a folder that was taken out there is none.
const tabs = () => TABS.filter(([name]) => cards().some((card) => isOn(card, name)));

// The tab that shows what a kind of job found.
export const tabOf = (kind) => viewOf(kind)?.tabs?.split(" ")[0] ?? "runs";

export function startTabs() {
  const names = tabs().map(([name]) => name);
  show(byId("tabs"), tabs().map(([name, words]) => button(words, () => openTab(name), { role: "tab", id: `tab-${name}`, "aria-controls": "panel" })));
  byId("tabs").addEventListener("keydown", (event) => {
    const { length } = names;
    const next = event.key === "Home" ? 0 : event.key === "End" ? length - 1 : event.key in MOVES ? (names.indexOf(state.tab) + MOVES[event.key] + length) % length : -1;
    if (next < 0) return;
    event.preventDefault();
    openTab(names[next]);
    byId(`tab-${names[next]}`).focus();
  });
  on("tab", openTab);
  restoreTab();
}

// The tab of the address as it is now.
export const restoreTab = () => openTab(byId(`tab-${state.tab}`) ? state.tab : FIRST_TAB);

function openTab(name) {
  if (name !== state.tab) {
    step();
    byId("panel").scrollTop = 0;
  }
  state.tab = name;
  for (const tab of byId("tabs").children) {
    const chosen = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(chosen));
    tab.tabIndex = chosen ? 0 : -1;
  }
  byId("panel").setAttribute("aria-labelledby", `tab-${name}`);
  byId("panel").dataset.view = name;
  for (const card of cards()) card.classList.toggle("off", !isOn(card, name));
  tell("tab-shown", name);
  if (state.scene) write();
}
