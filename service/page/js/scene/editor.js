// A scene as fields: every value of its tables, what is wrong beside the field it is about.

import { Problem, post } from "../network/api.js";
import { byId, el, say, show } from "../base/dom.js";
import { tell } from "../base/events.js";
import { current } from "./scenes.js";
import { parameterOf } from "./laws.js";

const escaped = (key) => String(key).replaceAll("~", "~0").replaceAll("/", "~1");
const MISSING = "";
let draft = null;
let rest = [];

// Matrices and what came of them are kept as they are: nobody edits them number by number.
const KEPT = /^\/structure\/(M|K|C|modes|reduction)$/;

// Every value that is no table, with its pointer and where it sits.
export function leaves(item, pointer = "", into = []) {
  for (const [key, value] of Object.entries(item)) {
    const here = `${pointer}/${escaped(key)}`;
    if (KEPT.test(here) && typeof value === "object") continue;
    if (value !== null && typeof value === "object" && Object.keys(value).length) leaves(value, here, into);
    else into.push({ pointer: here, owner: item, key, value });
  }
  return into;
}

export async function openText(text, form) {
  try {
    const { scene, issues } = await post("/v1/scenes/read", { text, form });
    edit(scene, issues);
  } catch (error) {
    const panel = byId("editor");
    panel.hidden = false;
    show(panel, el("p", { class: "issues", role: "alert", tabindex: -1 }, `The file cannot be read: ${error.message}`), closing());
    panel.firstChild.focus();
  }
}

export function edit(scene, issues = []) {
  draft = structuredClone(scene);
  draw(issues);
}

export const editCurrent = () => current.body && edit({ ...current.body, name: `${current.body.name}-2` });

const closing = () => el("button", { type: "button", onclick: close }, "Close");

function close() {
  byId("editor").hidden = true;
  byId("edit-scene").focus();
}

// A value that is missing gets an empty field where it belongs: what is said of it stands there, and it can be filled in.
function provideMissing(issues) {
  for (const { pointer } of issues) {
    const [last, ...above] = pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~")).reverse();
    const owner = above.reverse().reduce((item, key) => item?.[key], draft);
    if (last === undefined || owner === null || typeof owner !== "object" || Array.isArray(owner) || Object.hasOwn(owner, last)) continue;
    if (owner !== draft || last === "name") owner[last] = MISSING;
  }
}

// The scene as it is handed in: fields that are still empty are left out.
const sent = () => JSON.stringify(draft, (_, value) => (value === MISSING ? undefined : value));

function draw(issues) {
  provideMissing(issues);
  const panel = byId("editor");
  panel.hidden = false;
  rest = [...issues];
  const groups = groupsOf(draft).map(([title, fields]) =>
    el("fieldset", {}, el("legend", {}, title), el("div", { class: "fields" }, fields.map(field))));
  const left = rest.length
    ? el("ul", { class: "issues" }, rest.map((issue) => el("li", {}, `${issue.pointer || "scene"}: ${issue.detail}`)))
    : null;
  const words = issues.length
    ? `${issues.length === 1 ? "One thing is" : `${issues.length} things are`} wrong with this scene; each is said beside its field.`
    : "Nothing is wrong with this scene. It is stored under its name, which then keeps its meaning.";
  const form = el("form", { novalidate: true }, el("p", { id: "editor-status", role: "status", class: issues.length ? "issues" : "note" }, words), left, groups,
    el("div", { class: "row" }, el("button", { type: "submit", class: "main-button" }, "Use this scene"), closing()));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    store();
  });
  show(panel, form);
  const first = panel.querySelector("[aria-invalid]") ?? panel.querySelector("input");
  first?.focus();

  function field(leaf) {
    const mine = rest.filter((issue) => issue.pointer === leaf.pointer || below(leaf, issue));
    rest = rest.filter((issue) => !mine.includes(issue));
    const id = `field${leaf.pointer.replaceAll(/[^A-Za-z0-9]/g, "-")}`;
    const message = mine.map((issue) => issue.detail).join(" ");
    const input = el("input", {
      id, type: "text", value: String(leaf.value ?? ""), spellcheck: false,
      "aria-invalid": mine.length ? "true" : undefined, "aria-describedby": mine.length ? `${id}-message` : undefined,
    });
    input.setAttribute("value", textOf(leaf.value));
    input.addEventListener("change", () => (leaf.owner[leaf.key] = read(input.value, leaf.value)));
    return el("div", { class: mine.length ? "field wrong" : "field" }, el("label", { for: id }, nameOf(leaf.pointer), unitOf(leaf) ? ` [${unitOf(leaf)}]` : ""), input,
      mine.length ? el("span", { class: "message", id: `${id}-message` }, message) : null);
  }
}

// An issue about a table is said at its first value.
const below = (leaf, issue) => issue.pointer !== "" && leaf.pointer.startsWith(`${issue.pointer}/`);

const textOf = (value) => (value !== null && typeof value === "object" ? JSON.stringify(value) : String(value ?? ""));

// What was typed, as a number where it is one; a name stays a name.
function read(text, before) {
  const trimmed = text.trim();
  if (before !== null && typeof before === "object") {
    try {
      return JSON.parse(trimmed);
    } catch {
      return trimmed;
    }
  }
  if (typeof before === "boolean" || trimmed === "true" || trimmed === "false") return trimmed === "true";
  return trimmed !== "" && Number.isFinite(Number(trimmed)) ? Number(trimmed) : trimmed;
}

// What a number of a scene is counted in, by the end of its pointer.
const UNITS = [
  [/\/k$/, "N/m"], [/\/c$/, "N s/m"], [/\/masses\/(?!.*\/(name|dof|between))/, "kg"], [/\/amplitude$/, "N"],
  [/\/band\/\d$/, "Hz"], [/phase$/, "rad"], [/stiffness_proportional_damping$/, "s"], [/mass_proportional_damping$/, "1/s"],
];

function unitOf({ pointer, owner, key, value }) {
  if (typeof value !== "number" && value !== MISSING) return "";
  const known = pointer.startsWith("/contacts/") ? parameterOf(owner, key)?.unit : UNITS.find(([end]) => end.test(pointer))?.[1];
  return known ?? "";
}

// "/structure/springs/0/k" is "springs 1 › k" in its group, "/contacts/0/mu" is "mu".
function nameOf(pointer) {
  const [top, ...parts] = pointer.split("/").slice(1);
  const inside = /^\d+$/.test(parts[0] ?? "") && parts.length > 1 ? parts.slice(1) : parts;
  const words = [];
  for (const part of inside) {
    if (/^\d+$/.test(part) && words.length) words[words.length - 1] += ` ${Number(part) + 1}`;
    else words.push(part.replaceAll("~1", "/").replaceAll("~0", "~"));
  }
  return words.join(" › ") || top;
}

function groupsOf(scene) {
  const groups = new Map();
  for (const leaf of leaves(scene)) {
    const [, top, index] = leaf.pointer.split("/");
    const listed = Array.isArray(scene[top]) && typeof scene[top][0] === "object";
    const title = listed ? `${top} ${Number(index) + 1}` : typeof scene[top] === "object" ? top : "scene";
    groups.set(title, [...(groups.get(title) ?? []), leaf]);
  }
  return [...groups];
}

async function store() {
  try {
    const { issues } = await post("/v1/scenes/read", { text: sent(), form: "json" });
    if (issues.length) return draw(issues);
    const stored = await post("/v1/scenes", JSON.parse(sent()));
    byId("editor").hidden = true;
    tell("scene-stored", stored.name);
  } catch (error) {
    if (error instanceof Problem && error.status === 409) return draw([{ pointer: "/name", detail: error.message }]);
    if (error instanceof Problem && error.errors.length) return draw(error.errors);
    say("editor-status", error.message, true);
  }
  return undefined;
}
