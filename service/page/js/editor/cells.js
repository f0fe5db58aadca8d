// One value of a scene as a field: how it is shown, and how what was typed is read.

import { el } from "../base/dom.js";

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

export const idOf = (pointer) => `field${pointer.replaceAll(/[^A-Za-z0-9]/g, "-")}`;

const plainList = (value) => Array.isArray(value) && value.every((one) => one === null || typeof one !== "object");

const plainTable = (value) => value !== null && typeof value === "object" && !Array.isArray(value) && Object.values(value).every((one) => one === null || typeof one !== "object");

// A value in the words of its field.
export function textOf(value, type) {
  if (value === undefined || value === null) return "";
  if (type === "numbers" && plainList(value)) return value.join(", ");
  if (type === "names" && plainTable(value)) return Object.entries(value).map(([key, one]) => `${key} = ${one}`).join(", ");
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}

const widthOf = (letters) => `calc(${letters}ch + 1.1rem)`;

const one = (text) => (NUMBER.test(text) ? Number(text) : text);

// What was typed; undefined if nothing was.
export function read(text, type) {
  const typed = text.trim();
  if (typed === "") return undefined;
  if (type === "number") return one(typed);
  if (type === "text") return typed;
  if (type === "numbers" && !typed.startsWith("[")) return typed.split(/[,;\s]+/).filter(Boolean).map(one);
  if (type === "names" && !typed.startsWith("{")) {
    const pairs = typed.split(",").map((part) => part.split("=").map((word) => word.trim()));
    return pairs.every((pair) => pair.length === 2 && pair[0]) ? Object.fromEntries(pairs.map(([key, value]) => [key, one(value)])) : typed;
  }
  if (/^[[{]/.test(typed) || typed === "true" || typed === "false") {
    try {
      return JSON.parse(typed);
    } catch {
      return typed;
    }
  }
  return one(typed);
}

// The field or fields of a value. `told` is called with the value whenever it is another one.
export function cell({ pointer, name, about, type, choices, otherwise, value, list, width }, told) {
  const common = { "aria-label": about, "data-pointer": pointer, id: idOf(pointer), "data-key": name };
  if (type === "choice") return choice(common, choices, value, otherwise, told);
  if (type === "pair") return pair(common, Array.isArray(value) ? value : [], list, width, told);
  const input = el("input", {
    ...common, type: "text", value: "", spellcheck: false, autocomplete: "off", list: list || undefined, class: type === "number" ? "number" : undefined,
    placeholder: otherwise === undefined || otherwise === null ? "" : textOf(otherwise, type),
  });
  if (width) input.style.width = widthOf(width);
  if (list) input.setAttribute("list", list);
  input.value = textOf(value, type);
  input.addEventListener("input", () => told(read(input.value, type)));
  return input;
}

function choice(common, choices, value, otherwise, told) {
  const known = value === undefined || choices.includes(value) ? choices : [...choices, value];
  const empty = value === undefined ? [el("option", { value: "" }, otherwise === undefined ? "" : String(otherwise))] : [];
  const select = el("select", common, empty, known.map((word) => el("option", { value: String(word), selected: word === value }, String(word))));
  select.addEventListener("change", () => told(known.find((word) => String(word) === select.value)));
  return select;
}

function pair(common, value, list, width, told) {
  const ends = [0, 1].map((i) => {
    const pointer = `${common["data-pointer"]}/${i}`;
    const input = el("input", { ...common, id: idOf(pointer), "data-pointer": pointer, "aria-label": `${common["aria-label"]}, end ${i + 1}`, type: "text", spellcheck: false, autocomplete: "off" });
    if (width) input.style.width = widthOf(width);
    input.setAttribute("list", list);
    input.value = textOf(value[i], "text");
    return input;
  });
  for (const input of ends) {
    input.addEventListener("input", () => {
      const words = ends.map((end) => end.value.trim());
      told(words.some(Boolean) ? words : undefined);
    });
  }
  return el("span", { class: "ends" }, ends[0], el("span", { "aria-hidden": "true" }, "–"), ends[1]);
}

// A name that other parts refer to: it is changed when the field is left, not with every letter.
export function nameCell({ pointer, about, value }, told) {
  const input = el("input", { id: `${idOf(pointer)}-name`, "data-late": "yes", "aria-label": about, "data-pointer": `${pointer}#`, "data-key": "name", type: "text", spellcheck: false, autocomplete: "off" });
  input.style.width = widthOf(Math.max(value.length, 6));
  input.value = value;
  input.addEventListener("change", () => {
    const name = input.value.trim();
    if (!name || name === value || !told(name)) input.value = value;
  });
  return input;
}
