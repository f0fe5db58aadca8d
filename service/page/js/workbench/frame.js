// The frame of the page: the drawer that holds the rail where there is no room for it, the menus of the bar, the chips of
// values that differ from the scene, light or dark; the tabs: which cards are seen together; the banner: the service away,
// a refusal, a key wanted.

import { button, byId, el, onSubmit, say, show } from "../base/dom.js";
import { quantity } from "../base/format.js";
import { FIRST_TAB, on, state, step, tell, write } from "../base/state.js";
import { setKey } from "../network/api.js";
import { refusedFor } from "../scene/kinds.js";
import { ownValue, variable } from "../scene/scenes.js";
import { TABS, viewOf } from "../views.js";
import { putAll } from "../views/live.js";

const WIDE = matchMedia("(min-width: 1100px)");

export function startFrame() {
  startDrawer();
  menu("scene-menu", "scene-tools", (node, open) => { node.hidden = !open; });
  menu("search-menu", "search", (node, open) => node.classList.toggle("is-open", open));
  for (const event of ["scene", "values", "settled"]) on(event, drawChips);
  for (const event of ["scene", "settings", "scene-contact", "contact"]) on(event, sayWhat);
}

// The rail stands beside the view, or in a dialog over it: focus stays inside, Escape closes, focus returns.
function startDrawer() {
  const [drawer, rail] = [byId("drawer"), byId("rail")];
  const main = byId("main");
  byId("rail-open").addEventListener("click", () => {
    drawer.append(rail);
    drawer.showModal();
  });
  byId("rail-close").addEventListener("click", () => drawer.close());
  drawer.addEventListener("click", (event) => event.target === drawer && drawer.close());
  drawer.addEventListener("close", () => main.before(rail));
  WIDE.addEventListener("change", () => drawer.close());
  on("scene-left", () => drawer.close());
  on("open-run", () => drawer.close());
}

function menu(id, folded, unfold) {
  const [button, node] = [byId(id), byId(folded)];
  const put = (open) => {
    button.setAttribute("aria-expanded", String(open));
    unfold(node, open);
  };
  const isOpen = () => button.getAttribute("aria-expanded") === "true";
  button.addEventListener("click", () => put(!isOpen()));
  node.addEventListener("click", (event) => event.target.closest("button") && put(false));
  document.addEventListener("pointerdown", (event) => isOpen() && !button.parentElement.contains(event.target) && put(false));
  button.parentElement.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !isOpen()) return;
    put(false);
    button.focus();
  });
}

function drawChips() {
  const changed = Object.entries(state.set).filter(([path, value]) => value !== ownValue(path));
  show(byId("chips"), changed.map(([path, value]) => {
    const scene = ownValue(path);
    return el("li", { class: "set-chip" },
      el("b", {}, `${path} = ${quantity(path, value)}`),
      scene === null ? null : ` (scene: ${quantity(path, scene)})`,
      button("×", () => putBack(path), { "aria-label": `Put ${path} back to the value of the scene` }));
  }));
}

function putBack(path) {
  const { [path]: _, ...rest } = state.set;
  putAll(rest);
  (byId("chips").querySelector("button") ?? byId("study")).focus();
}

function sayWhat() {
  const path = variable();
  byId("search-words").textContent = path && state.range ? `${path} ${state.range.map((end) => quantity(path, end)).join(" – ")}` : "–";
}

const THEME = "stickslip-theme";

// Light, dark, or as the system has it; kept on this machine.
export function startTheme() {
  const choose = byId("theme");
  choose.value = localStorage.getItem(THEME) ?? "";
  apply(choose.value);
  choose.addEventListener("change", () => {
    if (choose.value) localStorage.setItem(THEME, choose.value);
    else localStorage.removeItem(THEME);
    apply(choose.value);
  });
}

function apply(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  else delete document.documentElement.dataset.theme;
  tell("theme", theme);
}

const MOVES = { ArrowRight: 1, ArrowLeft: -1 };
const isOn = (card, name) => name === "all" || card.dataset.tabs.split(" ").includes(name);
const cards = () => [...byId("panel").querySelectorAll("[data-tabs]")];
// Of a tab whose cards are of a folder that was taken out there is none.
const tabs = () => TABS.filter(([name]) => cards().some((card) => isOn(card, name)));

// The tab that shows what a kind of job found.
export const tabOf = (kind) => viewOf(kind)?.tabs?.split(" ")[0] ?? "runs";

// Tabs of studies stand there once those were asked, or where the scene has them; that of all cards by its address.
const QUIET = ["disk", "map", "accuracy", "all"];
const wanted = new Set();

function showTabs() {
  for (const tab of byId("tabs").children) {
    const name = tab.id.replace("tab-", "");
    tab.hidden = QUIET.includes(name) && name !== state.tab && !wanted.has(name);
  }
}

export function startTabs() {
  const want = (kind) => {
    wanted.add(tabOf(kind));
    showTabs();
  };
  on("job-begun", want);
  on("scene-left", () => wanted.clear());
  on("scene", () => (refusedFor("interference") ? showTabs() : want("interference")));
  show(byId("tabs"), tabs().map(([name, words]) => button(words, () => openTab(name), { role: "tab", id: `tab-${name}`, "aria-controls": "panel" })));
  byId("tabs").addEventListener("keydown", (event) => {
    const names = [...byId("tabs").children].filter((tab) => !tab.hidden).map(({ id }) => id.replace("tab-", ""));
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
  showTabs();
  byId("panel").setAttribute("aria-labelledby", `tab-${name}`);
  byId("panel").dataset.view = name;
  for (const card of cards()) card.classList.toggle("off", !isOn(card, name));
  tell("tab-shown", name);
  if (state.scene) write();
}

const NOTICE_SECONDS = 12;
let fading = 0;

// The banner says something, or nothing; what stays does so until something else is said.
function told(words, stays = false) {
  clearTimeout(fading);
  show(byId("banner"), words);
  byId("banner").hidden = !words;
  if (words && !stays) fading = setTimeout(silent, NOTICE_SECONDS * 1000);
}

function silent() {
  byId("banner").hidden = true;
}

export function startNotices() {
  on("offline", () => told("The service does not answer. Nothing is lost: this page goes on when it is back.", true));
  on("online", silent);
  on("notice", (text) => told([text, " ", button("Close", silent)]));
  on("key-wanted", (problem) => {
    byId("key-form").hidden = false;
    say("key-status", problem.message);
  });
  onSubmit(byId("key-form"), () => {
    setKey(byId("key").value.trim());
    byId("key").value = "";
    byId("key-form").hidden = true;
    tell("key");
  });
}
