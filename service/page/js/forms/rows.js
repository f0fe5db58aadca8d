// A list of like things as rows of fields under one line of heads: added, removed, read, filled, blamed. Tables and lists of
// a body as such rows: what they offer, and what they say as keys of the body.

import { button, el, options as optionsOf, show } from "../base/dom.js";
import { number } from "../base/format.js";
import { contactsOf, current, fieldUnit, inField, ofField, value, variables } from "../scene/scenes.js";
import { hintOf, numberOf, readField, Unreadable, written } from "./fields.js";

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

// Names of contacts, or paths; what is designed comes before what is merely set.
export function namesOfTable(key) {
  if (key === "contact_states") return contactsOf();
  if (key === "variables") return variables();
  return [...new Set([...variables(), ...[...current.parameters.values()].filter(({ slider }) => slider).map(({ path }) => path)])];
}

// What a row says of its path, in the unit of its fields; a path that was chosen anew brings bounds.
export function boundsTold(key, path, changed) {
  const known = current.parameters.get(path);
  const now = { now: !known ? "" : number(value(path) === null ? null : inField(path, value(path)), 5), unit: fieldUnit(path).name };
  const bounds = known && changed === "path" ? (key === "variables" ? known.bounds : known.around ?? known.bounds) : null;
  return bounds ? { ...now, low: String(inField(path, bounds[0], 3)), high: String(inField(path, bounds[1], 3)) } : now;
}

const PAIR = /\[([^\],]+), ([^\],]+)\]/;

// The columns of a pair, named as the words of its key name its ends.
const ends = (field, before = "") => {
  const [, low, high] = PAIR.exec(field.words) ?? ["", "from", "to"];
  return [["low", low], ["high", high]].map(([name, label]) => ({ name: before + name, label: before ? `${field.label}: ${label}` : label }));
};

const choiceColumn = ({ choices, otherwise, required }, more) => ({ ...more, type: "select", options: () => (required || otherwise !== undefined ? choices : ["", ...choices]) });

// Tables by the same names are columns of one: {main, beside}.
export function tablesIn(fields) {
  const main = fields.filter(({ kind, by, of }) => kind === "table" && by && of.kind === "pair");
  const found = [];
  for (const field of main) if (!found.some(({ beside }) => beside.includes(field))) found.push({ main: field, beside: fields.filter((each) => each !== field && each.kind === "table" && each.by === field.by) });
  return found;
}

// The columns of a table by paths: the path, its value now, the pair, its unit, then what stands beside.
export function tableColumns(table) {
  const { main, beside } = table;
  return [
    { name: "path", label: "quantity", type: "select", options: () => namesOfTable(main.key) }, { name: "now", label: "now", type: "now" },
    ...ends(main), { name: "unit", label: "unit", type: "now" },
    ...beside.flatMap((field) => (field.of.kind === "pair" ? ends(field, `${field.key}_`) : field.of.kind === "choice" ? [choiceColumn({ ...field.of, otherwise: "" }, { name: field.key, label: field.label })] : [{ name: field.key, label: field.label, off: () => !table.used?.includes(field.key) }])),
  ];
}

export function tableBody(rows, { main, beside }) {
  const body = { [main.key]: {} };
  for (const row of rows) {
    const pointer = (key) => `/${key}/${row.path}`;
    if (row.path in body[main.key]) throw new Unreadable(pointer(main.key), `${row.path} stands there twice.`);
    const read = (field, name, label) => ofField(row.path, numberOf(row[name], pointer(field.key), `${row.path}, ${label},`));
    const pair = (field, before) => ends(field, before).map(({ name, label }) => read(field, name, label));
    body[main.key][row.path] = pair(main, "");
    for (const field of beside) {
      const given = field.of.kind === "pair" ? ends(field, `${field.key}_`).some(({ name }) => row[name] !== undefined) && pair(field, `${field.key}_`)
        : row[field.key] !== undefined && (field.of.kind === "number" ? read(field, field.key, field.label) : row[field.key] !== "auto" && row[field.key]);
      if (given || given === 0) (body[field.key] ??= {})[row.path] = given;
    }
  }
  return Object.keys(body[main.key]).length ? body : {};
}

export const rowsOfTable = ({ main, beside }, request) => Object.entries(request[main.key] ?? {}).map(([path, [low, high]]) => Object.assign({ path, low: inField(path, low), high: inField(path, high) }, ...beside.map((field) => {
  const [value, end] = [request[field.key]?.[path]].flat().map((one) => (typeof one === "number" ? inField(path, one) : one));
  return end === undefined ? { [field.key]: value } : { [`${field.key}_low`]: value, [`${field.key}_high`]: end };
})));

// The columns of a list of tables; of values by path those in `paths` have a column each.
export function listColumns({ columns }, paths) {
  return columns.flatMap((field) => (field.kind === "pair" ? ends({ ...field, words: "" }, `${field.key}_`)
    : field.kind === "choice" ? [choiceColumn(field, { name: field.key, label: field.label })]
      : field.kind === "table" ? [...paths.map((path) => ({ name: path, label: path })), { name: field.key, label: "further values", type: "text", hint: "damper.mu = 0.3" }]
        : [{ name: field.key, label: field.unit ? `${field.label} [${field.unit}]` : field.label, type: field.kind === "number" ? "number" : "text", hint: hintOf({ ...field, ends: "" }), off: () => field.key === "engine_order" && !current.body?.structure.sectors }]));
}

export function listBody(field, row, index, paths) {
  const found = {};
  for (const each of field.columns) {
    const pointer = `/${field.key}/${index}/${each.key}`;
    let value;
    if (each.kind === "pair") {
      const [low, high] = ends(each, `${each.key}_`).map(({ name }) => row[name]);
      if (low !== undefined || high !== undefined) value = [numberOf(low, pointer, `${each.label}, from,`), numberOf(high, pointer, `${each.label}, to,`)];
    } else if (each.kind === "table") {
      value = { ...readField(each, row[each.key], pointer) };
      for (const path of paths) if (row[path] !== undefined) value[path] = numberOf(row[path], pointer, path);
      if (!Object.keys(value).length) value = undefined;
    } else value = readField(each, row[each.key], pointer);
    if (value !== undefined) found[each.key] = value;
  }
  return found;
}

export function listRow(field, given, paths) {
  return Object.assign({}, ...field.columns.map((each) => {
    const value = given[each.key];
    if (each.kind === "pair") return { [`${each.key}_low`]: value?.[0], [`${each.key}_high`]: value?.[1] };
    if (each.kind !== "table") return { [each.key]: value === undefined ? undefined : written(each, value) };
    const rest = Object.entries(value ?? {}).filter(([path]) => !paths.includes(path));
    return { ...Object.fromEntries(paths.map((path) => [path, value?.[path]])), [each.key]: written(each, Object.fromEntries(rest)) || undefined };
  }));
}
