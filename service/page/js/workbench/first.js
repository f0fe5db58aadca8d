// The first screen: a scene of one's own from a file, from matrices or from a template, the scenes that come with the package,
// recent runs and own scenes. `acts` is what it leads to, given by the page.

import { button, byId, el, note, options, show, svg } from "../base/dom.js";
import { when } from "../base/format.js";
import { on } from "../base/state.js";
import { orNotice, patiently, post, request } from "../network/api.js";
import { drawScene } from "../scene/structure.js";
import { drawRuns } from "./runs.js";

const MOST_RUNS = 4;
const MOST_SCENES = 5;
const MATRIX = 66;
const EDGE = 4;
let acts = null;
let known = [];
let templates = null;
const scenes = new Map();
const isShown = () => document.documentElement.dataset.screen === "first";

export function startFirst(given) {
  acts = given;
  on("runs", () => byId("first-runs") && isShown() && drawRecent());
}

// Shows it, with the scenes that the service knows.
export async function showFirst(list) {
  known = list;
  const panel = byId("first");
  if (!panel.firstChild) build(panel);
  show(byId("first-shipped"), known.filter(({ shipped }) => shipped).map(sceneCard));
  drawOwn();
  drawRecent();
  show(byId("first-rig"));
  templates ??= (await patiently(() => request("/v1/templates"))).items;
  show(byId("first-templates"), templates.map(templateCard));
}

const titled = (id, words, more, ...content) => el("section", { "aria-labelledby": id }, el("h2", { id }, words, more ? el("span", { class: "note" }, ` ${more}`) : null), content);
const card = (words, ...content) => el("section", { class: "card" }, el("h3", {}, words), content);

function build(panel) {
  show(panel,
    el("div", { class: "first-main" },
      titled("first-own-title", "Your scene", "", el("div", { class: "ways" },
        card("Open a file", el("div", { class: "drop" }, el("span", {}, "Drop it here, or"), button("Choose a file…", () => byId("file").click(), { class: "main-button", id: "first-open" }),
          note("scene .toml .json · rig data .csv"), note("with the files it refers to, any encoding"), el("div", { id: "first-rig" }))),
        card("From matrices", el("div", { class: "matrix-picture" }, matrix("M"), matrix("K")), note("Of finite elements: .mtx .npz .mat .op4 .inp .cdb. Contact, force and what to watch are picked by node, and reduced for you."),
          button("Choose M and K…", () => acts.matrices(), { id: "first-matrices" })),
        card("From a template", el("div", { id: "first-templates", class: "templates" }), note("Or by ", button("a few questions", () => acts.newScene(), { class: "link", id: "first-questions" }), " in place of a text.")))),
      titled("first-shipped-title", "Shipped scenes", "open, drag, then copy what you like", el("div", { id: "first-shipped", class: "scene-cards" }))),
    el("div", { id: "first-recent", class: "first-recent" },
      listed("first-runs", "Recent runs", el("a", { href: "?tab=runs", class: "note", onclick: (event) => acts.follow(event, acts.runs) }, "All runs")),
      listed("first-scenes", "Your scenes", null)));
}

// A banded matrix, as a picture.
function matrix(name) {
  const cells = Array.from({ length: 9 }, (_, i) => [-1, 0, 1].map((by) => [i, i + by])).flat().filter(([, j]) => j >= 0 && j < 9);
  return svg("svg", { viewBox: `0 0 ${MATRIX} ${MATRIX}`, "aria-hidden": "true" },
    svg("path", { class: "earth", d: `M8 3H3V63H8M58 3H63V63H58` }),
    cells.map(([i, j]) => svg("rect", { class: i === j ? "cell is-diagonal" : "cell", x: 7 + 6 * i, y: 7 + 6 * j, width: 4.5, height: 4.5 })),
    svg("text", { x: MATRIX / 2, y: 39, "text-anchor": "middle", class: "halo" }, name));
}

// The tables of a scene without its matrices, asked for once: a name keeps its meaning.
function tables(name) {
  if (!scenes.has(name)) scenes.set(name, patiently(() => request(`/v1/scenes/${encodeURIComponent(name)}?files=false`)).then(({ scene }) => scene));
  return scenes.get(name);
}

// Place for the drawing of a scene, which fills it when it is known.
function picture(scene) {
  const host = el("span", { class: "picture", "aria-hidden": "true" });
  orNotice(async () => {
    drawScene(host, await scene, { small: true });
    const { x, y, width, height } = host.firstChild.getBBox();
    // What is drawn in place fills its frame, blades are cut there.
    if (width && !host.querySelector(".bodies")) host.firstChild.setAttribute("viewBox", `${x - EDGE} ${y - EDGE} ${width + 2 * EDGE} ${height + 2 * EDGE}`);
  });
  return host;
}

const sceneLink = (name, className, ...content) =>
  el("a", { class: className, href: `?scene=${encodeURIComponent(name)}`, onclick: (event) => acts.follow(event, () => acts.scene(name)) }, content);

const sceneCard = ({ name, title }) => sceneLink(name, "scene-card", picture(tables(name)), el("span", {}, el("b", {}, name), el("span", { class: "note" }, title)));

function templateCard({ name, title, questions }) {
  const own = freeName(questions.properties.name.default);
  const made = post("/v1/templates", { template: name, answers: { name: own } });
  return button([picture(made.then(({ scene }) => scene)), el("b", {}, title)],
    () => orNotice(async () => acts.text((await made).text, `template-${name}`)), { class: "template", id: `template-${name}` });
}

// A name that no scene has.
function freeName(wanted) {
  for (let i = 1; ; i += 1) {
    const name = i === 1 ? wanted : `${wanted}-${i}`;
    if (!known.some((each) => each.name === name)) return name;
  }
}

function drawRecent() {
  byId("first-runs").parentElement.hidden = !drawRuns(byId("first-runs"), MOST_RUNS);
  byId("first-recent").hidden = [...byId("first-recent").children].every(({ hidden }) => hidden);
}

function drawOwn() {
  const own = known.filter(({ shipped }) => !shipped).sort((a, b) => (a.created < b.created ? 1 : -1));
  show(byId("first-scenes"), own.slice(0, MOST_SCENES).map(ownScene));
  byId("first-scenes").parentElement.hidden = !own.length;
}

const listed = (id, words, more) => el("section", { class: "card", "aria-labelledby": `${id}-title` }, el("div", { class: "row" }, el("h2", { id: `${id}-title` }, words), more), el("ul", { id, class: "plain" }));
const ownScene = ({ name, created }) => el("li", {}, sceneLink(name, "own-scene", el("span", {}, el("b", {}, name), el("span", { class: "note" }, when(created))), picture(tables(name))));

// Of what a rig measured it is asked which scene that was.
export function askScene(files) {
  const names = [...known].sort((a, b) => a.shipped - b.shipped).map(({ name }) => name);
  const choose = el("select", { id: "first-rig-scene" }, options(names));
  show(byId("first-rig"), el("label", { for: "first-rig-scene" }, `${files.map(({ name }) => name).join(", ")} was measured on`), choose,
    button("Open", () => acts.rig(choose.value, files), { id: "first-rig-open", class: "main-button" }));
  choose.focus();
}
