// A list of like things as rows of fields: added, removed, read, filled.

import { el, show } from "../base/dom.js";

// `columns`: {key, label, type: "number" | "text" | "select", options, hint}. `read` gives a table for each row, without empty fields.
export function rowsOf(host, { id, one, columns, least = 0 }) {
  const body = el("div", { class: "rows" });
  const add = el("button", { type: "button", id: `${id}-add`, onclick: () => fresh().focus() }, `Add ${one}`);
  show(host, body, add);

  function fresh(values = {}) {
    const index = body.children.length + 1;
    const fields = columns.filter((column) => !column.off?.()).map((column) => field(column, values[column.key], `${one} ${index}`));
    const remove = el("button", { type: "button", class: "remove", "aria-label": `Remove ${one} ${index}`, onclick: () => {
      row.remove();
      number();
      (body.lastElementChild?.querySelector("input, select") ?? add).focus();
    } }, "×");
    const row = el("div", { class: "problem-row", role: "group", "aria-label": `${one} ${index}` }, fields, remove);
    body.append(row);
    number();
    return row.querySelector("input, select");
  }

  function number() {
    [...body.children].forEach((row, i) => {
      row.setAttribute("aria-label", `${one} ${i + 1}`);
      row.querySelector(".remove").setAttribute("aria-label", `Remove ${one} ${i + 1}`);
      row.querySelector(".remove").hidden = body.children.length <= least;
    });
  }

  return {
    fill(list) {
      show(body);
      for (const values of list) fresh(values);
    },
    read: () => [...body.children].map((row) => Object.fromEntries([...row.querySelectorAll("[name]")].map((input) => [input.name, input.value.trim()]).filter(([, value]) => value !== ""))),
    row: (index) => body.children[index] ?? null,
    count: () => body.children.length,
  };
}

function field({ key, label, type = "number", options, hint }, value, about) {
  const common = { name: key, "aria-label": `${about}: ${label}` };
  const input = type === "select"
    ? el("select", common, optionsOf(options(), value).map((option) => el("option", { value: option, selected: option === value }, option)))
    : el("input", { ...common, type, step: "any", placeholder: hint ?? "", spellcheck: false });
  if (type !== "select" && value !== undefined && value !== null) input.value = String(value);
  return el("label", { class: "problem-field" }, el("span", {}, label), input);
}

// What a problem from elsewhere names stays, also where the page would not offer it.
const optionsOf = (known, value) => (value === undefined || known.includes(value) ? known : [...known, value]);
