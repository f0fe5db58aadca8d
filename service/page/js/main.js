// The page of stickslip: a first screen; with a scene in the address projects, scenes and runs at the left, the scene with its
// answer and views beside them.

import { asOneStep, lastWritten, on, read, state, tell, write } from "./base/state.js";
import { button, byId, dropsOn, el, onFiles, options, show } from "./base/dom.js";
import { saveToml } from "./base/exports.js";
import { restoreTab, startFrame, startNotices, startTabs, startTheme, tabOf } from "./workbench/frame.js";
import { Problem, patiently, post } from "./network/api.js";
import { forget, resume, run } from "./network/jobs.js";
import { loadKinds, loadLaws } from "./scene/kinds.js";
import { asked, current, listScenes, loadScene, variedParts } from "./scene/scenes.js";
import { fillSettings, startSettings } from "./scene/settings.js";
import { startStructure } from "./scene/structure.js";
import { startShape } from "./shape/card.js";
import { hasOwnView, STUDIES, viewOf, VIEWS } from "./views.js";
import { startAnswer } from "./views/answer.js";
import { showResponse, startLive, wishFirst } from "./views/live.js";
import { showOther, startQuestions } from "./views/questions.js";
import { startRenewal, startStudy } from "./views/study.js";
import { response } from "./views/response.js";
import { placeCards, startViews } from "./views/view.js";
import { startComparison } from "./workbench/comparison.js";
import { askScene, showFirst, startFirst } from "./workbench/first.js";
import { listProjects, startProjects } from "./workbench/projects.js";
import { listRuns, startRunList } from "./workbench/run_list.js";
import { startRuns } from "./workbench/runs.js";
import { startRunsTable } from "./workbench/runs_table.js";
import { startStrip } from "./workbench/starting.js";

const FIRST = "bladed-disk";
const MOST_NAMES = 20;
let sceneNames = [];
let learned = null;

async function scenes() {
  const known = await listScenes();
  sceneNames = known;
  show(byId("scene"), options(known.map((each) => [each.name, titleOf(each)])));
  if (isFirst()) return;
  if (!known.some(({ name }) => name === state.scene)) {
    const wanted = state.scene;
    state.scene = known.some(({ name }) => name === FIRST) ? FIRST : known[0].name;
    if (wanted) missing(wanted);
  }
  sceneList();
}

// Which of the two screens is seen; theme and API are said in the rail of the one, in the bar of the other.
const isFirst = () => document.documentElement.dataset.screen === "first";

function screen(name) {
  document.documentElement.dataset.screen = name;
  byId(name === "first" ? "bar" : "rail").append(byId("foot"));
}

const first = () => scenes().then(() => showFirst(sceneNames));

// A link of the page is followed within it, in another tab or window as any.
function follow(event, act) {
  if (event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  act();
}

function goTo(address) {
  if (address === location.pathname + location.search) return;
  history.pushState(null, "", address);
  asOneStep(restore, { back: true }).catch(failed);
}

const titleOf = ({ name, shipped }) => (shipped ? name : `${name} (stored)`);

// What a link wanted of a scene that is not there is not for the one shown instead.
function missing(wanted) {
  tell("notice", `There is no scene ${wanted} at this service: ${state.scene} is shown instead.`);
  Object.assign(state, { set: {}, contact: "", variable: "", range: null, at: null });
}

function sceneList() {
  byId("scene").value = state.scene;
  show(byId("scene-list"), sceneNames.map((each) => el("li", {}, button(titleOf(each), () => choose(each.name), { "aria-current": each.name === state.scene ? "true" : undefined }))));
}

async function choose(name) {
  if (name === state.scene) return;
  await change(name);
  byId("scene-list").querySelector("[aria-current]")?.focus();
}

async function open() {
  screen("scene");
  await learned;
  if (!(await loadScene(state.scene))) return;
  const names = variedParts();
  if (!names.includes(state.contact)) Object.assign(state, { contact: names[0] ?? "", variable: "" });
  fillSettings();
  write();
  tell("scene");
  for (const view of STUDIES) resume(view.kind, view);
}

const forgetAll = () => {
  for (const kind of new Set([...VIEWS.flatMap(({ kind }) => kind ?? []), ...Object.keys(state.jobs)])) forget(kind);
};

const change = (name) => asOneStep(async () => {
  forgetAll();
  Object.assign(state, { scene: name, set: {}, contact: "", variable: "", range: null, at: null, jobs: {} });
  write();
  tell("scene-left");
  sceneList();
  await open().catch(failed);
});

// Back and forward: what the address says is shown; a tab alone needs nothing new of the service.
const WITHOUT_TAB = /(?<=[?&])tab=[^&]*&?/;

async function restore() {
  const [before, now] = [lastWritten(), location.search].map((words) => words.replace(WITHOUT_TAB, "").replace(/[?&]$/, ""));
  if (before !== now) forgetAll();
  read();
  restoreTab();
  if (before === now && !isFirst()) return;
  tell("scene-left");
  if (!state.scene && !location.search) {
    screen("first");
    return first();
  }
  state.scene ||= FIRST;
  sceneList();
  await open();
}

// A scene that a run brought along, stored under its name or, where that is another's, under one beside it.
async function storedAs(scene) {
  for (let i = 1; ; i += 1) {
    const name = i === 1 ? scene.name : `${scene.name}-${i}`;
    try {
      await post("/v1/scenes", { ...scene, name });
      await scenes();
      return name;
    } catch (error) {
      if (!(error instanceof Problem && error.status === 409 && i < MOST_NAMES)) throw error;
    }
  }
}

// A run as it was computed: its scene, its values, its result in its view.
const openRun = (run) => asOneStep(() => openedRun(run));

async function openedRun({ id, kind, request }) {
  const scene = typeof request.scene === "string" ? request.scene : await storedAs(request.scene);
  if (scene !== state.scene) await change(scene);
  if (scene !== state.scene) return;
  Object.assign(state, { set: { ...request.set }, harmonics: request.harmonics ?? state.harmonics });
  const [[path, range] = [], ...more] = Object.entries(request.variables ?? {});
  const varied = path ?? (request.from === undefined ? "" : request.parameter);
  if (varied && !varied.includes(",") && !more.length) {
    [state.contact, state.variable = ""] = varied.split(".");
    state.range = range ?? [request.from, request.to];
  }
  if (kind === "march") state.at = request.frequency_hz;
  forget(kind);
  state.jobs[kind] = id;
  fillSettings();
  write();
  tell("scene-contact");
  tell("values");
  tell("settled");
  tell("tab", tabOf(kind));
  if (!hasOwnView(kind)) await showOther(kind);
  else if (viewOf(kind).title) await resume(kind, viewOf(kind));
}

// The frequency response alone, where it is too large to be followed live.
async function sweepAlone() {
  byId("response").scrollIntoView({ block: "nearest" });
  await run("sweep", asked(), { ...response, result: (result, ...more) => { response.result(result, ...more); showResponse(result); } }, response.priority);
}

// Fetched when they are first asked for.
const editor = () => import("./editor/editor.js");
const matrices = () => import("./scene/matrices.js");
const sceneFiles = () => import("./scene/files.js");

function controls() {
  const clicks = {
    "open-file": () => byId("file").click(), "open-matrices": () => matrices().then(({ openMatrices }) => openMatrices()).catch(failed),
    "new-scene": () => editor().then(({ newScene }) => newScene()).catch(failed), "edit-scene": () => editor().then(({ editCurrent }) => editCurrent()).catch(failed), "save-toml": () => saveToml(`${state.scene}.toml`), share,
  };
  for (const [id, act] of Object.entries(clicks)) byId(id).addEventListener("click", act);
  byId("home").addEventListener("click", (event) => follow(event, () => goTo(location.pathname)));
  startFirst({
    follow, scene: change, newScene: clicks["new-scene"], matrices: clicks["open-matrices"], runs: () => goTo("?tab=runs"),
    text: (...words) => editor().then(({ openText }) => openText(words[0], "toml", words[1])).catch(failed),
    rig: (name, files) => change(name).then(() => openRig(files)),
  });
  byId("scene").addEventListener("change", () => change(byId("scene").value));
  onFiles(byId("file"), (given) => take(given).catch(failed));
  dropsOn(document.body, (given) => given.then(take).catch(failed));
  addEventListener("popstate", () => asOneStep(restore, { back: true }).catch(failed));
}

function openRig(files) {
  tell("tab", tabOf("identify"));
  tell("rig-files", files);
}

// Files that were chosen or dropped: a scene is opened, tables are what a rig measured, anything else is taken for matrices.
async function take(files) {
  if (files.length && files.every(({ name }) => /\.(csv|tsv|txt)$/i.test(name))) return isFirst() ? askScene(files) : openRig(files);
  const { openScene, sceneIn } = await sceneFiles();
  const scene = sceneIn(files);
  if (scene) return openScene(scene, files);
  return files.length ? (await matrices()).openMatrices(files) : undefined;
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
  const withScene = state.scene || location.search;
  screen(withScene ? "scene" : "first");
  if (withScene) {
    state.scene ||= FIRST;
    wishFirst();
  }
  try {
    learned = Promise.all([loadLaws, loadKinds].map(patiently));
    await Promise.all([learned, patiently(withScene ? scenes : first)]);
    if (withScene) await patiently(open);
    await Promise.all([listProjects(), listRuns()]);
  } catch (error) {
    failed(error);
  }
  document.documentElement.dataset.ready = "yes";
  performance.mark("page-ready");
}

async function start() {
  // What is of the scene before hears nobody until the next one is there, whose values it would set.
  for (const [event, inert] of [["scene-left", true], ["scene", false]]) on(event, () => ["search", "study", "answer", "panel"].forEach((id) => { byId(id).inert = inert; }));
  startTheme();
  startNotices();
  startStrip();
  for (const view of VIEWS) await view.begin();
  read();
  placeCards(VIEWS);
  for (const begins of [startTabs, startProjects, startRunList, startRuns, startRunsTable, startComparison, startStructure, startLive]) begins();
  startViews(VIEWS);
  startShape((at) => ({ ...asked(), frequency_hz: at }));
  for (const begins of [startQuestions, startSettings, startRenewal, startAnswer, startStudy, startFrame]) begins();
  controls();
  on("sweep-wanted", sweepAlone);
  on("open-run", (found) => openRun(found).catch(failed));
  on("contact", fillSettings);
  on("scene-stored", async (name) => {
    await scenes().catch(failed);
    await change(name);
    byId("study").focus();
  });
  on("key", begin);
  return begin();
}

start();
