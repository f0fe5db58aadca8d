// A list of like things as rows of fields under one line of heads: added, removed, read, filled, blamed.

import { button, el, options as optionsOf, show } from "../base/dom.js";

// `columns`: {name, label, type: "number" | "text" | "select" | "now", options, hint, off}; `told(row)` gives what stands
// in columns of the type "now". `read` gives a table for each row, without empty fields.
export function rowsOf(host, { id, one, columns, least = 0, told = null }) {
  const body = el("div", { class: "rows" });
  const add = button(`Add ${one}`, () => { const field = fresh(); refresh(field.closest(".problem-row"), "path"); field.focus(); }, { id: `${id}-add`, class: "add-row" });
  show(host, body, add);
  body.addEventListener("change", (event) => refresh(event.target.closest(".problem-row"), event.target.name));

  function refresh(row, changed) {
    if (!row || !told) return;
    const values = told(row.querySelector("[name]").value, changed) ?? {};
    for (const [name, value] of Object.entries(values)) {
      const node = row.querySelector(`[data-now="${name}"], [name="${name}"]`);
      if (node?.dataset.now) node.textContent = value;
      else if (node) node.value = value;
    }
  }

  function fresh(values = {}) {
    const about = `${one} ${body.children.length + 1}`;
    const fields = columns.filter((column) => !column.off?.()).map((column) => fieldIn(column, values[column.name], about));
    const remove = button("×", () => {
      row.remove();
      number();
      (body.lastElementChild?.querySelector("input, select") ?? add).focus();
    }, { class: "remove icon" });
    const row = el("div", { class: "problem-row", role: "group", "aria-label": about }, fields, remove, el("p", { class: "message", role: "alert" }));
    body.append(row);
    number();
    refresh(row, "");
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
    // Says what is wrong in the row of a number, or of the name in its first field; whether there is such a row.
    blame(which, name, words) {
      const row = /^\d+$/.test(which) ? body.children[Number(which)] : [...body.children].find((each) => each.querySelector("[name]").value === which);
      if (!row) return false;
      (row.querySelector(`[name="${name}"]`) ?? row.querySelector("input")).setAttribute("aria-invalid", "true");
      row.querySelector(".message").textContent += words;
      return true;
    },
    count: () => body.children.length,
  };
}

function fieldIn({ name, label, type = "number", options, hint }, value, about) {
  if (type === "now") return el("span", { class: "problem-field" }, el("span", {}, label), el("span", { class: "now", "data-now": name }, ""));
  const common = { name, "aria-label": `${about}: ${label}` };
  const input = type === "select"
    ? el("select", common, optionsOf(offered(options(), value), value))
    : el("input", { ...common, type: "text", inputmode: type === "number" ? "decimal" : "text", class: type === "number" ? "number" : undefined, placeholder: hint ?? "", spellcheck: false });
  if (type !== "select" && value !== undefined && value !== null) input.value = String(value);
  return el("label", { class: "problem-field" }, el("span", {}, label), input);
}

// What a problem from elsewhere names stays, also where the page would not offer it.
const offered = (known, value) => (value === undefined || known.includes(value) ? known : [...known, value]);
