// The parts of a form: a field, rows of a table or a list, names that something holds for. Each reads and fills its keys
// of a body: {node, read, fill, input or rows}.

import { el, note, options, show } from "../base/dom.js";
import { METRES, shownUnit } from "../base/format.js";
import { boundsTold, listBody, listColumns, listRow, namesOfTable, rowsOf, rowsOfTable, tableBody, tableColumns } from "./rows.js";
import { hintOf, readField, written } from "./fields.js";

const framed = ({ label, words }, ...content) => el("fieldset", {}, el("legend", { title: words }, label), note(words), content);
const one = ({ label }) => label.replace(/s$/, "");

// The rows of a table by paths, with those that stand beside it.
export function tablePart(id, table) {
  const { main } = table;
  const host = el("div", { id: `${id}-${main.key}` });
  const rows = rowsOf(host, { id: host.id, one: one(main), columns: tableColumns(table), least: 1, told: (path, changed) => boundsTold(main.key, path, changed) });
  return {
    node: framed(main, host), rows, table, read: () => tableBody(rows.read(), table),
    fill(request) {
      table.used = table.beside.filter(({ key }) => key in request).map(({ key }) => key);
      rows.fill(rowsOfTable(table, request));
    },
  };
}

// The rows of a list of tables.
export function listPart(id, field, paths) {
  const { key } = field;
  const host = el("div", { id: `${id}-${key}` });
  const rows = rowsOf(host, { id: host.id, one: one(field), columns: listColumns(field, paths) });
  return {
    node: framed(field, host), rows, fill: (request) => rows.fill((request[key] ?? []).map((each) => listRow(field, each, paths))),
    read() {
      const found = rows.read().map((row, i) => listBody(field, row, i, paths));
      return found.length ? { [key]: found } : {};
    },
  };
}

// Names that something holds for, or not.
export function boxesPart(id, { key, words, of }) {
  const [word] = of.choices;
  const node = el("div", { class: "row", id: `${id}-${key}`, role: "group", "aria-label": words });
  return {
    node,
    read() {
      const chosen = [...node.querySelectorAll("input:checked")].map(({ name }) => [name, word]);
      return chosen.length ? { [key]: Object.fromEntries(chosen) } : {};
    },
    fill: (request) => show(node, namesOfTable(key).map((name) => el("label", { class: "pair" }, el("input", { type: "checkbox", name, checked: name in (request[key] ?? {}) }), `${name}: ${word.replaceAll("-", " ")}`))),
  };
}

// A field for each of the names of a table.
export function namesPart(id, field) {
  const inside = field.names.map((name) => fieldPart(id, { ...field.of, key: `${field.key}-${name}`, label: name, at: [field.key, name] }));
  return { node: framed(field, el("div", { class: "fields" }, inside.map(({ node }) => node))), inside };
}

function control(field, common) {
  if (field.kind === "truth") return el("input", { ...common, type: "checkbox" });
  if (field.kind !== "choice") return el("input", { ...common, type: "text", inputmode: field.kind === "number" ? "decimal" : "text", placeholder: hintOf(field), spellcheck: false, autocomplete: "off" });
  const words = (field.otherwise === undefined ? [""] : []).concat(field.choices);
  return el("select", common, options(words.map((word) => [word, word || "as usual"]), field.otherwise));
}

// One key as a field; a length is asked for in a unit that may be chosen.
export function fieldPart(id, field) {
  const name = `${id}-${field.key}`;
  const input = control(field, { id: name, name: field.key, title: field.words, "aria-describedby": `${name}-more`, "aria-required": field.required ? "true" : undefined, "data-usual": field.otherwise });
  const isLength = field.unit === "m";
  const unit = isLength ? el("select", { id: `${name}-unit`, "aria-label": `Unit of ${field.label}`, class: "unit" }, options(Object.keys(METRES), "mm"))
    : field.unit ? el("span", { class: "unit" }, field.unit) : null;
  const per = () => (isLength ? 1 / METRES[unit.value] : 1);
  const sized = (metres) => { if (isLength && shownUnit(metres).name in METRES) unit.value = shownUnit(metres).name; };
  const [key, inside] = field.at ?? [field.key];
  const about = [field.words, field.kind === "number" && field.ends && field.ends !== "above 0" && hintOf(field) !== field.ends ? `(${field.ends})` : ""].filter(Boolean).join(" ");
  return {
    key: field.key, input, sized: (metres) => input.value === "" && sized(metres),
    node: el("div", { class: field.kind === "truth" ? "field check" : "field" }, el("label", { for: name }, field.required ? `${field.label} (needed)` : field.label), el("span", { class: "pair" }, input, unit),
      el("span", { id: `${name}-more`, class: "note" }, about), el("span", { class: "message", role: "alert" })),
    read() {
      const value = field.kind === "truth" ? (input.checked === Boolean(field.otherwise) ? undefined : input.checked) : readField(field, input.value, `/${[key, inside].filter(Boolean).join("/")}`, per());
      if (value === undefined || (field.kind === "choice" && value === field.otherwise)) return {};
      return { [key]: inside ? { [inside]: value } : value };
    },
    fill(request) {
      const value = inside ? request[key]?.[inside] : request[key];
      if (field.kind === "truth") input.checked = value ?? field.otherwise ?? false;
      else if (field.kind === "choice") input.value = value ?? field.otherwise ?? "";
      else {
        if (typeof value === "number") sized(value);
        input.value = written(field, value, per());
      }
    },
  };
}
