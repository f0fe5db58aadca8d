// Studies of kinds that have no view of their own: a form made of the schema of their body, any result as a table.

import { request } from "../network/api.js";
import { state } from "../base/address.js";
import { byId, el, facts, say, show, table } from "../base/dom.js";
import { on } from "../base/events.js";
import { saveText } from "../base/exports.js";
import { number } from "../base/format.js";
import { resume, run } from "../network/jobs.js";
import { asked } from "../scene/scenes.js";
import { VIEWS } from "../views.js";

const OF_THE_PAGE = ["kind", "scene", "set", "harmonics", "fresh", "priority", "max_seconds",
  "project", "name", "notes", "tags"];
const ROWS = 200;
let kinds = [];

export function startOthers() {
  byId("others-kind").addEventListener("change", draw);
  byId("others-form").addEventListener("submit", (event) => {
    event.preventDefault();
    submit();
  });
  on("scene", () => {
    say("others-status", "");
    show(byId("others-result"));
    takeUp();
  });
}

// Asks the service which kinds it has, and offers those without a view.
export async function offerOthers() {
  kinds = (await request("/v1/kinds")).items.filter(({ name }) => !(name in VIEWS));
  byId("others").hidden = !kinds.length;
  show(byId("others-kind"), kinds.map(({ name }) => el("option", { value: name }, name)));
  if (kinds.length) draw();
  takeUp();
}

// Goes on with the job that the address names.
function takeUp() {
  const kind = kinds.find(({ name }) => state.jobs[name]);
  if (!kind) return;
  byId("others-kind").value = kind.name;
  draw();
  resume(kind.name, view(kind.name));
}

const chosen = () => kinds.find(({ name }) => name === byId("others-kind").value);

// What a key takes beside null.
const shape = (schema) => (schema.anyOf ? (schema.anyOf.find(({ type }) => type === "array") ?? schema.anyOf.find(({ type }) => type !== "null")) : schema) ?? {};

const keysOf = ({ body }) => Object.entries(body.properties).filter(([key]) => !OF_THE_PAGE.includes(key));

function draw() {
  const kind = chosen();
  byId("others-summary").textContent = kind.summary;
  show(byId("others-fields"), keysOf(kind).map(([key, schema]) => field(kind, key, schema)));
}

function field(kind, key, schema) {
  const { type, enum: words } = shape(schema);
  const id = `others-field-${key}`;
  const [needed, example] = [kind.body.required.includes(key), kind.body.examples?.[0]?.[key] ?? schema.default];
  const common = { id, name: key, required: needed, "aria-describedby": `${id}-more` };
  const hint = example === undefined || example === null ? "" : text(example);
  let input = el("input", { ...common, type: "text", placeholder: hint, spellcheck: false });
  if (type === "boolean") input = el("input", { ...common, required: false, type: "checkbox", checked: schema.default === true });
  else if (words) input = el("select", common, needed ? null : el("option", { value: "" }, ""), words.map((word) => el("option", { value: word }, word)));
  else if (type === "number" || type === "integer") input = el("input", { ...common, type: "number", step: type === "integer" ? 1 : "any", placeholder: hint });
  return el("div", { class: "field" }, el("label", { for: id }, needed ? `${key} (needed)` : key), input,
    el("span", { id: `${id}-more`, class: "note" }, schema.description ?? ""), el("span", { class: "message", role: "alert" }));
}

const plain = (value) => (Array.isArray(value) ? !value.some((one) => typeof one === "object") : typeof value !== "object");

const text = (value) => (Array.isArray(value) && plain(value) ? value.join(", ") : plain(value) ? String(value) : JSON.stringify(value));

// A field as its key in the body: lists are written with commas, tables as JSON.
function read(input, schema) {
  const { type, items } = shape(schema);
  if (input.type === "checkbox") return input.checked;
  const written = input.value.trim();
  if (written === "") return undefined;
  if (type === "number" || type === "integer") return Number(written);
  if (type === "string") return written;
  if (type === "array" && !written.startsWith("[")) {
    const parts = written.split(",").map((part) => part.trim()).filter(Boolean);
    return items?.type === "number" || items?.type === "integer" ? parts.map(Number) : parts;
  }
  try {
    return JSON.parse(written);
  } catch {
    throw new Error(`${input.name} takes JSON: ${written}`);
  }
}

async function submit() {
  const kind = chosen();
  const body = Object.fromEntries(Object.entries(asked()).filter(([key]) => key in kind.body.properties));
  complain([]);
  try {
    for (const [key, schema] of keysOf(kind)) {
      const value = read(byId(`others-field-${key}`), schema);
      if (value !== undefined) body[key] = value;
    }
  } catch (error) {
    say("others-status", error.message, true);
    return;
  }
  await run(kind.name, body, view(kind.name), 3);
}

// Says what is wrong beside the field it is about; what is about no field comes back.
function complain(errors) {
  for (const node of byId("others-fields").querySelectorAll(".field")) {
    const mine = errors.filter(({ pointer }) => pointer.split("/")[1] === node.querySelector("[name]").name);
    node.classList.toggle("wrong", mine.length > 0);
    node.querySelector(".message").textContent = mine.map(({ detail }) => detail).join(" ");
  }
}

const view = (name) => ({
  waiting() {
    say("others-status", `${name} waits for a worker.`);
    show(byId("others-result"));
  },
  progress: ({ took }) => say("others-status", `${name}:${took}.`),
  result(result, sweeps) {
    say("others-status", sweeps.length ? `${name} is done; its sweeps are among those stored.` : `${name} is done.`);
    show(byId("others-result"), facts(scalars(result)), columns(result),
      el("button", { type: "button", onclick: () => saveText(JSON.stringify(result, null, 1), `${name}.json`, "application/json") }, "Save as JSON"));
  },
  failed(words, errors) {
    say("others-status", words, true);
    complain(errors);
  },
});

const worded = (value) => (typeof value === "number" ? number(value, 6) : value === null ? "–" : typeof value === "boolean" ? (value ? "yes" : "no") : String(value));

function scalars(item, before = "") {
  return Object.entries(item).flatMap(([key, value]) => {
    if (Array.isArray(value)) return plain(value) && value.length <= 6 ? [[before + key, value.map(worded).join(", ")]] : [[before + key, `${value.length} values`]];
    return value !== null && typeof value === "object" ? scalars(value, `${before}${key}.`) : [[before + key, worded(value)]];
  });
}

// Lists of numbers of the same length, side by side.
function columns(result) {
  const lists = Object.entries(result).filter(([, value]) => Array.isArray(value) && value.length > 6 && value.every((one) => one === null || typeof one === "number"));
  const longest = Math.max(0, ...lists.map(([, value]) => value.length));
  const same = lists.filter(([, value]) => value.length === longest);
  if (!same.length) return null;
  const rows = Array.from({ length: Math.min(longest, ROWS) }, (_, i) => same.map(([, value]) => ({ text: worded(value[i]), number: true })));
  return el("details", {}, el("summary", {}, `Numbers${longest > ROWS ? `, the first ${ROWS}` : ""}`),
    el("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Numbers of the result" }, table(same.map(([name]) => ({ text: name, number: true })), rows, "Numbers")));
}
