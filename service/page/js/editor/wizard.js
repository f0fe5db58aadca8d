// A scene from nothing: the cases that the service knows, with the few questions of each.

import { button, el, note, show } from "../base/dom.js";
import { fieldsOf } from "../forms/fields.js";
import { schemaForm } from "../forms/form.js";
import { Problem, post, request } from "../network/api.js";

const EMPTY = "ground-damper";
let templates = null;

export async function openChooser(panel, { made, close }) {
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
