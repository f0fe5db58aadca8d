// A scene from nothing: the cases that the service knows, with the few questions of each.

import { el, say, show } from "../base/dom.js";
import { Problem, post, request } from "../network/api.js";
import { read } from "./cells.js";

const EMPTY = "ground-damper";
const GROUPS = [
  ["Blade", ["name", "frequency_hz", "modal_mass", "damping_ratio", "blades"]],
  ["Excitation", ["force", "engine_order"]],
  ["Contact", ["shape", "kt", "kn", "mu", "normal_load", "angle"]],
  ["Damper", ["damper_mass", "width", "radius", "speed"]],
];
let templates = null;

export async function openChooser(panel, { made, close }) {
  show(panel, el("p", { class: "note", role: "status" }, "The cases are being fetched …"));
  templates ??= (await request("/v1/templates")).items;
  const fill = async (template, answers) => made((await post("/v1/templates", { template, answers })).scene);
  const cards = templates.map(({ name, title, questions }) => card(title, questions.description, () => ask(panel, { name, title, questions, fill, close, back: () => openChooser(panel, { made, close }) })));
  const empty = card("An empty scene", "One mass on a spring, one contact, one force: rows to begin with in the tables.", () => fill(EMPTY, { name: "new-scene" }));
  show(panel, el("div", { class: "editor-bar" }, el("h3", {}, "New scene"), el("button", { type: "button", onclick: close }, "Close")), el("div", { class: "cards" }, empty, cards));
  panel.querySelector(".cards button").focus();
  panel.scrollIntoView({ block: "nearest" });
}

const card = (title, words, onclick) => el("button", { type: "button", class: "choice-card", onclick }, el("strong", {}, title), el("span", {}, words));

const unitOf = (words) => /\[([^\]]+)\]\.?$/.exec(words)?.[1] ?? "";

const LABELS = {
  name: "Name of the scene", frequency_hz: "Frequency", modal_mass: "Modal mass", damping_ratio: "Damping ratio", blades: "Number of blades", force: "Force", engine_order: "Engine order",
  shape: "Shape", kt: "Tangential stiffness", kn: "Normal stiffness", mu: "Friction coefficient μ", normal_load: "Normal load", angle: "Angle of the faces", damper_mass: "Mass of the damper",
  width: "Width", radius: "Radius", speed: "Speed of rotation",
};

function ask(panel, { name, title, questions, fill, close, back }) {
  const groups = GROUPS.map(([legend, keys]) => [legend, keys.filter((key) => questions.properties[key])]).filter(([, keys]) => keys.length);
  const left = Object.keys(questions.properties).filter((key) => !GROUPS.flatMap(([, keys]) => keys).includes(key));
  if (left.length) groups.push(["Further", left]);
  const form = el("form", { novalidate: true, id: "wizard-form" },
    el("div", { class: "editor-bar" }, el("h3", {}, title), el("button", { type: "button", onclick: close }, "Close")),
    el("p", { class: "note" }, questions.description),
    el("div", { class: "wizard-groups" }, groups.map(([legend, keys]) => el("fieldset", { class: "section" }, el("legend", {}, legend), keys.map((key) => question(key, questions.properties[key]))))),
    el("div", { class: "row" }, el("button", { type: "submit", class: "main-button" }, "Make the scene"), el("button", { type: "button", onclick: back }, "Back"), el("p", { id: "wizard-status", role: "status" })));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      await fill(name, answersOf(form, questions));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      refuse(form, error);
    }
  });
  show(panel, form);
  form.querySelector("input").select();
  form.querySelector("input").focus();
}

function question(key, { description, default: usual, enum: choices }) {
  const unit = unitOf(description);
  const id = `wizard-${key}`;
  const input = choices
    ? el("select", { id, name: key }, choices.map((word) => el("option", { value: word, selected: word === usual }, word)))
    : el("input", { id, name: key, type: "text", inputmode: key === "name" ? "text" : "decimal", spellcheck: false, autocomplete: "off", placeholder: usual === undefined ? "follows from the others" : "" });
  if (!choices && usual !== undefined) input.value = String(usual);
  const label = LABELS[key] ?? key.replaceAll("_", " ");
  const words = description.replace(/ \[[^\]]+\]\.?$/, "").replace(/\.$/, "");
  const more = label.startsWith(words) || words.toLowerCase() === label.toLowerCase() ? null : el("span", { class: "note", id: `${id}-words` }, `${words}.`);
  if (more) input.setAttribute("aria-describedby", `${id}-words`);
  return el("div", { class: "field question" }, el("label", { for: id }, label, unit ? ` [${unit}]` : ""), input, more);
}

function answersOf(form, questions) {
  const answers = {};
  for (const input of form.querySelectorAll("[name]")) {
    const value = read(input.value, questions.properties[input.name].type === "string" ? "text" : "number");
    if (value !== undefined) answers[input.name] = value;
  }
  return answers;
}

function refuse(form, error) {
  for (const node of form.querySelectorAll("[aria-invalid]")) node.removeAttribute("aria-invalid");
  for (const node of form.querySelectorAll(".message")) node.remove();
  const left = error.errors.filter(({ pointer, detail }) => {
    const input = form.querySelector(`[name="${CSS.escape(pointer.replace("/answers/", ""))}"]`);
    input?.setAttribute("aria-invalid", "true");
    input?.closest(".field").append(el("span", { class: "message" }, detail));
    return !input;
  });
  say("wizard-status", left.map(({ detail }) => detail).join(" ") || (error.errors.length ? "" : error.message), true);
  form.querySelector("[aria-invalid]")?.focus();
}
