// The page of stickslip: one scene, one button, everything that is known of it.

import { read, state, write } from "./base/address.js";
import { Problem, patiently } from "./network/api.js";
import { byId, el, show } from "./base/dom.js";
import { startAnswer } from "./views/answer.js";
import { startDesign } from "./views/design.js";
import { edit, editCurrent, openText } from "./scene/editor.js";
import { on, tell } from "./base/events.js";
import { startFront } from "./views/front.js";
import { loadLaws } from "./scene/laws.js";
import { forget, resume, run, startJobs } from "./network/jobs.js";
import { openLibrary, startLibrary } from "./views/library.js";
import { showResponse, startLive } from "./views/live.js";
import { startMap } from "./views/map.js";
import { openMatrices } from "./scene/matrices.js";
import { SCENES } from "./scene/matrix_files.js";
import { startNotices } from "./base/notices.js";
import { offerOthers, startOthers } from "./views/others.js";
import { startPoint } from "./views/point.js";
import { startRenewal } from "./views/renewal.js";
import { startResponse, sweepView } from "./views/response.js";
import { asked, current, listScenes, loadScene, shownScene, variedContacts } from "./scene/scenes.js";
import { fillSettings, startSettings } from "./scene/settings.js";
import { contactTable, drawStructure } from "./scene/structure.js";
import { startStudies } from "./views/studies.js";
import { startStudy } from "./views/study.js";
import { startTheme } from "./base/theme.js";
import { saveToml } from "./base/toml.js";
import { VIEWS } from "./views.js";

const FIRST = "bladed-disk";
let states = { states: null, at: null };

function sections() {
  const links = [...document.querySelectorAll("main > section")].slice(2).map((section) =>
    el("li", {}, el("a", { href: `#${section.id}` }, section.querySelector("h2").dataset.short ?? section.querySelector("h2").textContent)));
  show(byId("sections"), links);
}

async function scenes() {
  const known = await listScenes();
  show(byId("scene"), known.map(({ name, shipped }) => el("option", { value: name }, shipped ? name : `${name} (stored)`)));
  if (!known.some(({ name }) => name === state.scene)) {
    state.scene = known.some(({ name }) => name === FIRST) ? FIRST : known[0].name;
  }
  byId("scene").value = state.scene;
}

async function open() {
  await loadScene(state.scene);
  const names = variedContacts().map((c) => c.name);
  if (!names.includes(state.contact)) Object.assign(state, { contact: names[0] ?? "", variable: "" });
  fillSettings();
  write();
  states = { states: null, at: null };
  drawScene();
  tell("scene");
  for (const [kind, view] of Object.entries(VIEWS)) if (view) resume(kind, view);
}

let drawn = "";

// The drawing changes with the scene and the states alone; under a slider that is seldom.
function drawScene() {
  const scene = shownScene();
  const now = JSON.stringify([scene.name, states.states]);
  if (now !== drawn) drawStructure(byId("structure-figure"), scene, states.states);
  drawn = now;
  show(byId("structure-states"), contactTable(scene, states.states, states.at));
}

async function change(name) {
  for (const kind of new Set([...Object.keys(VIEWS), ...Object.keys(state.jobs)])) forget(kind);
  Object.assign(state, { scene: name, set: {}, contact: "", variable: "", range: null, at: null, jobs: {} });
  tell("scene-left");
  await open().catch(failed);
}

// The frequency response alone, where it is too large to be followed live.
async function sweepAlone() {
  byId("response").scrollIntoView({ block: "nearest" });
  await run("sweep", asked(), { ...sweepView, result: (result, ...more) => { sweepView.result(result, ...more); showResponse(result); } }, 6);
}

function controls() {
  byId("scene").addEventListener("change", () => change(byId("scene").value));
  byId("open-file").addEventListener("click", () => byId("file").click());
  byId("file").addEventListener("change", async () => {
    await take([...byId("file").files]);
    byId("file").value = "";
  });
  byId("open-matrices").addEventListener("click", () => openMatrices());
  startDrops();
  byId("edit-scene").addEventListener("click", editCurrent);
  byId("save-toml").addEventListener("click", () => saveToml(`${state.scene}.toml`));
  byId("share").addEventListener("click", share);
}

// Files that were chosen or dropped: a scene is opened, anything else is taken for matrices.
async function take(files) {
  const scene = files.find(({ name }) => SCENES.test(name));
  if (scene) await openText(await scene.text(), scene.name.toLowerCase().endsWith(".json") ? "json" : "toml");
  else if (files.length) openMatrices(files);
}

function startDrops() {
  const card = byId("start");
  const over = (event, on) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    card.classList.toggle("dropping", on);
  };
  card.addEventListener("dragover", (event) => over(event, true));
  card.addEventListener("dragleave", (event) => over(event, false));
  card.addEventListener("drop", (event) => {
    over(event, false);
    take([...event.dataTransfer.files]).catch(failed);
  });
}

async function share() {
  write();
  try {
    await navigator.clipboard.writeText(location.href);
    byId("share").textContent = "Link copied";
  } catch {
    byId("share").textContent = "Copy it from the address";
  }
  setTimeout(() => { byId("share").textContent = "Copy link"; }, 4000);
}

function failed(error) {
  if (error instanceof Problem && error.status === 401) return;
  tell("notice", error.message);
}

async function begin() {
  try {
    await patiently(loadLaws);
    await patiently(scenes);
    await patiently(open);
    await patiently(offerOthers);
    await openLibrary();
  } catch (error) {
    failed(error);
  }
  document.documentElement.dataset.ready = "yes";
  performance.mark("page-ready");
}

function start() {
  startTheme();
  startNotices();
  read();
  sections();
  startJobs();
  startDesign();
  startLive();
  startResponse();
  startMap();
  startPoint();
  startFront();
  startStudies();
  startOthers();
  startLibrary();
  startSettings();
  startRenewal();
  startAnswer();
  startStudy();
  controls();
  on("states", (found) => {
    states = found;
    drawScene();
  });
  on("sweep-wanted", sweepAlone);
  on("contact", fillSettings);
  on("scene-stored", async (name) => {
    await scenes().catch(failed);
    byId("scene").value = name;
    await change(name);
    byId("study").focus();
  });
  on("key", begin);
  return begin();
}

export { current, edit };
await start();
