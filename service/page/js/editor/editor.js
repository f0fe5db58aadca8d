// The editor of a scene: tables of its parts and its text side by side, what is wrong at the field and at the line; a scene
// from nothing: the cases that the service knows, with the few questions of each.

import { button, byId, el, note, onSubmit, refocus, say, show } from "../base/dom.js";
import { saveText } from "../base/exports.js";
import { tell } from "../base/state.js";
import { fieldsOf } from "../forms/fields.js";
import { schemaForm } from "../forms/form.js";
import { post, Problem, request } from "../network/api.js";
import { current } from "../scene/scenes.js";
import { drawTables, forgetOpened, idOf, openMissing } from "./tables.js";
import { sceneDocument } from "./document.js";
import { tidied } from "./scene_data.js";
import { loadSchema } from "./schema.js";
import { tomlPane } from "./toml_pane.js";

let doc = null;
let pane = null;
let back = "edit-scene";

export async function openText(text, form, from) {
  if (form === "toml") return begin({ text }, from);
  try {
    return await begin({ scene: (await post("/v1/scenes/read", { text, form })).scene });
  } catch (error) {
    const panel = byId("editor");
    panel.hidden = false;
    show(panel, el("p", { class: "issues", role: "alert", tabindex: -1 }, `The file cannot be read: ${error.message}`), button("Close", close));
    panel.firstChild.focus();
  }
  return undefined;
}

export const edit = (scene) => begin({ scene });

// The scene that is shown, under another name.
export async function editCurrent() {
  if (!current.body) return;
  await loadSchema();
  await begin({ scene: tidied({ ...current.body, name: `${current.body.name}-2` }) });
}

export async function newScene() {
  byId("editor").hidden = false;
  back = "new-scene";
  await openChooser(byId("editor"), { made: (scene) => begin({ scene }, "new-scene"), close });
}

async function begin(given, from = "edit-scene") {
  back = from;
  await loadSchema();
  forgetOpened();
  await build();
  say("editor-status", "The scene is being read …");
  // Before it was read nothing in it can be used.
  await doc.open(given).finally(() => { byId("editor-form").inert = false; });
  const first = byId("editor").querySelector("[aria-invalid]") ?? (doc.unreadable ? pane : byId("editor").querySelector("input"));
  first?.focus();
  byId("editor").scrollIntoView({ block: "start" });
}

function close() {
  byId("editor").hidden = true;
  refocus(back);
}

async function build() {
  const panel = byId("editor");
  panel.hidden = false;
  const tables = el("div", { id: "editor-tables" });
  const text = el("div", { class: "toml-pane" });
  const form = el("form", { novalidate: true, id: "editor-form", inert: true },
    el("div", { class: "editor-bar" },
      el("button", { type: "submit", class: "main-button" }, "Use this scene"),
      button("Undo", () => step("undo"), { id: "editor-undo", title: "Undo (Ctrl+Z)" }),
      button("Redo", () => step("redo"), { id: "editor-redo", title: "Redo (Ctrl+Shift+Z)" }),
      button("Save as TOML", () => saveText(doc.text, `${doc.scene.name || "scene"}.toml`, "application/toml")),
      button("Close", close),
      el("p", { id: "editor-status", role: "status", class: "note" })),
    el("div", { id: "editor-issues" }),
    el("div", { class: "editor-sides" },
      el("div", { class: "editor-left" }, tables, el("p", { id: "editor-help", class: "help note" }, "What a value means is said here while its field is in use.")),
      text));
  show(panel, form);
  doc = sceneDocument(shown);
  pane = await tomlPane(text, (words) => {
    busy(true);
    doc.type(words);
  }, () => doc.scene);
  onSubmit(form, store);
  form.addEventListener("keydown", keys);
  tables.addEventListener("focusin", help);
}

// Until the service has looked at the last change.
const busy = (is) => byId("editor-form").setAttribute("aria-busy", String(is));

// Undoes or redoes a step of the text, which the tables follow; what was typed last into them is in it before.
async function step(which) {
  await doc.settle();
  pane[which]();
}

function keys(event) {
  if (event.defaultPrevented || !(event.ctrlKey || event.metaKey) || event.altKey) return;
  const pressed = event.key.toLowerCase();
  if (pressed !== "z" && pressed !== "y") return;
  event.preventDefault();
  step(pressed === "y" || event.shiftKey ? "redo" : "undo");
}

// What the column of a field says of it, and the line it stands at.
function help({ target }) {
  const words = target.closest("[data-words]")?.dataset.words ?? headOf(target)?.title ?? target.selectedOptions?.[0]?.title ?? target.title;
  if (words) say("editor-help", words);
}

function headOf(target) {
  const box = target.closest("td, th");
  return box ? box.closest("table").tHead?.rows[0].cells[box.cellIndex] : null;
}

// A change of the tables; `focus` says where to go on if they are drawn anew.
function changed(how, focus) {
  if (how) {
    busy(true);
    doc.change(how);
  }
  if (focus === undefined) return;
  if (focus.startsWith("renamed:")) return later(focus);
  draw();
  go(focus);
}

const later = (focus) => { setTimeout(renamed, 0, ...focus.split(":").slice(1)); };

// The focus has gone on already, maybe to a field that is called after the name.
function renamed(was, is) {
  const { id } = document.activeElement;
  draw();
  if (!byId(id)) byId(id.replace(was, is))?.focus();
}

function go(focus) {
  const [kind, path, index, key] = focus.split(":");
  const tables = byId("editor-tables");
  const row = tables.querySelector(`[data-row="${CSS.escape(`${path}:${index}`)}"]`);
  const found = kind === "row" ? row?.querySelector("input, select") ?? byId(`add-${idOf(`/${path}`)}`)
    : kind === "cell" ? (row ?? byId(idOf(`/${path}`))).querySelector(`[data-key="${CSS.escape(key)}"]`) : byId(focus);
  (found?.matches("fieldset") ? found.querySelector("input") : found)?.focus();
}

function draw() {
  const tables = byId("editor-tables");
  const active = tables.contains(document.activeElement) ? document.activeElement : null;
  const kept = active && { id: active.id, ends: [active.selectionStart, active.selectionEnd] };
  openMissing(doc.scene, doc.issues);
  drawTables(tables, doc.scene, changed);
  tables.inert = doc.unreadable;
  if (!kept?.id || !byId(kept.id)) return;
  byId(kept.id).focus({ preventScroll: true });
  if (kept.ends[0] !== null && kept.ends[0] !== undefined) byId(kept.id).setSelectionRange(...kept.ends);
}

function shown({ from, failed = "", errors = [] }) {
  if (failed) {
    const words = errors.map(({ detail }) => detail).join(" ");
    say("editor-status", words || failed, true);
    busy(false);
    return;
  }
  const missing = doc.issues.some(({ pointer }) => pointer && !byId("editor-tables").querySelector(`[data-pointer="${CSS.escape(pointer)}"]`));
  // What is being typed into a field that counts when it is left stays as it is.
  const typing = document.activeElement?.dataset?.late && byId("editor-tables").contains(document.activeElement);
  if (from !== "tables" || (missing && !typing)) draw();
  byId("editor-tables").inert = doc.unreadable;
  if (from === "tables") pane.set(doc.text);
  else if (from !== "text") pane.begin(doc.text);
  byId("editor-undo").disabled = !pane.canUndo;
  byId("editor-redo").disabled = !pane.canRedo;
  busy(!doc.settled);
  const { issues, unreadable } = doc;
  pane.mark(issues.filter(({ line }) => line), unreadable);
  if (!unreadable) markFields(byId("editor-tables"), issues);
  show(byId("editor-issues"), unreadable ? null : issueList(issues, (issue) => find(issue)));
  const count = issues.length === 1 ? "One thing is" : `${issues.length} things are`;
  say("editor-status", unreadable ? "The tables show what the text last held." : issues.length ? `${count} wrong; each is said at its field and marked at its line.` : "Nothing is wrong with this scene.", issues.length > 0);
}

// Goes to the field of an issue, and shows its line.
function find({ pointer, line, column }) {
  const field = [...byId("editor-tables").querySelectorAll("[aria-invalid]")].find((node) => (node.dataset.issues ?? "").split(" ").includes(pointer));
  field?.focus();
  if (line) pane.go(line, column, !field);
}

async function store() {
  await doc.settle();
  if (doc.issues.length) {
    const [first] = doc.issues;
    return doc.unreadable ? pane.go(first.line, first.column) : find(first);
  }
  try {
    const stored = await post("/v1/scenes", doc.scene);
    byId("editor").hidden = true;
    tell("scene-stored", stored.name);
  } catch (error) {
    if (error instanceof Problem && error.status === 409) doc.blame([{ pointer: "/name", detail: error.message, line: 1, column: 1 }]);
    else if (error instanceof Problem && error.errors.length) doc.blame(error.errors);
    else return say("editor-status", error.message, true);
    byId("editor").querySelector("[aria-invalid]")?.focus();
  }
  return undefined;
}

// "/structure/springs/0/k" is "structure › springs 1 › k".
function placeOf(pointer) {
  const words = [];
  for (const part of pointer.split("/").slice(1)) {
    if (/^\d+$/.test(part) && words.length) words[words.length - 1] += ` ${Number(part) + 1}`;
    else words.push(part.replaceAll("~1", "/").replaceAll("~0", "~"));
  }
  return words.join(" › ") || "scene";
}

// The field an issue is about: its own, that around it, or the first one in it.
function fieldOf(fields, pointer) {
  if (!pointer) return null;
  const exact = fields.find((node) => node.dataset.pointer === pointer);
  if (exact?.matches("input, select")) return exact;
  const around = fields.filter((node) => node.matches("input, select") && pointer.startsWith(`${node.dataset.pointer}/`)).pop();
  if (around) return around;
  const inside = fields.find((node) => node.matches("input, select") && node.dataset.pointer.startsWith(`${pointer}/`));
  return inside ?? exact?.querySelector("input, select") ?? null;
}

function markFields(host, issues) {
  for (const node of host.querySelectorAll(".message")) node.remove();
  for (const node of host.querySelectorAll("[aria-invalid]")) {
    node.removeAttribute("aria-invalid");
    node.removeAttribute("aria-describedby");
    delete node.dataset.issues;
  }
  for (const node of host.querySelectorAll(".wrong")) node.classList.remove("wrong");
  const fields = [...host.querySelectorAll("[data-pointer]")];
  for (const { pointer, detail } of issues) {
    const field = fieldOf(fields, pointer);
    if (!field) continue;
    const id = `${field.id}-message`;
    const before = document.getElementById(id);
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-describedby", id);
    field.dataset.issues = `${field.dataset.issues ?? ""} ${pointer}`.trim();
    const row = field.closest("tr");
    (row ?? field.closest(".field"))?.classList.add("wrong");
    if (before) before.append(` ${detail}`);
    else if (row) below(row, el("span", { id }, detail));
    else field.closest(".field")?.append(el("span", { class: "message", id }, detail));
  }
}

// A row of words under a row of fields.
function below(row, words) {
  const next = row.nextElementSibling;
  if (next?.classList.contains("message")) next.firstElementChild.append(words);
  else row.after(el("tr", { class: "message" }, el("td", { colspan: String(row.cells.length) }, words)));
}

function issueList(issues, go) {
  if (!issues.length) return null;
  return el("ul", { class: "issues issue-list", "aria-label": "What is wrong" }, issues.map((issue) => el("li", {},
    el("button", { type: "button", class: "link", onclick: () => go(issue) }, `${placeOf(issue.pointer)}${issue.line ? `, line ${issue.line}` : ""}`), ` ${issue.detail}`)));
}

const EMPTY = "ground-damper";
let templates = null;

async function openChooser(panel, { made, close }) {
  show(panel, el("p", { class: "note", role: "status" }, "The cases are being fetched …"));
  templates ??= (await request("/v1/templates")).items;
  const fill = async (template, answers) => made((await post("/v1/templates", { template, answers })).scene);
  const cards = templates.map(({ name, title, questions }) => card(title, questions.description, () => ask(panel, { name, title, questions, fill, close, back: () => openChooser(panel, { made, close }) })));
  const empty = card("An empty scene", "One mass on a spring, one contact, one force: rows to begin with in the tables.", () => fill(EMPTY, { name: "new-scene" }));
  show(panel, el("div", { class: "editor-bar" }, el("h3", {}, "New scene"), button("Close", close)), el("div", { class: "cards" }, empty, cards));
  panel.querySelector(".cards button").focus();
  panel.scrollIntoView({ block: "nearest" });
}

const card = (title, words, onclick) => button([el("strong", {}, title), el("span", {}, words)], onclick, { class: "choice-card" });

function ask(panel, { name, title, questions, fill, close, back }) {
  // A question is called by its words: its key is known to nobody yet.
  const fields = fieldsOf(questions).map((field) => {
    const [label] = field.words.split(/[,;:.[]/);
    return { ...field, label: label.trim(), words: field.words.slice(label.length).replace(/^[,;:. ]+|\s*\[[^\]]+\]|\.$/g, "") };
  });
  const host = el("form", { novalidate: true, id: "wizard-form" });
  show(panel, el("div", { class: "editor-bar" }, el("h3", {}, title), button("Back", back), button("Close", close)),
    note(questions.description), host);
  const form = schemaForm(host, { fields }, { id: "wizard", words: "Make the scene", primary: true, submit: async (answers) => {
    try {
      await fill(name, answers);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      form.complain((error.errors.length ? error.errors : [{ pointer: "", detail: error.message }]).map((one) => ({ ...one, pointer: one.pointer.replace("/answers", "") })));
    }
  } });
  form.fill(Object.fromEntries(fields.map(({ key, otherwise }) => [key, otherwise])));
  host.querySelector("input").select();
  host.querySelector("input").focus();
}
