// The form of a study, made of the schema of its body: a field for each key, rows for its tables, what is wrong beside it.

import { byId, el, show } from "../base/dom.js";
import { on } from "../base/events.js";
import { lengthUnit, METRES } from "../base/format.js";
import { current } from "../scene/scenes.js";
import { kindOf } from "../scene/kinds.js";
import { hintOf, numberOf, readField, Unreadable, written } from "./fields.js";
import { rowsOf } from "./rows.js";
import { boundsTold, namesOfTable } from "./tables.js";

const PAIR = /\[([^\],]+), ([^\],]+)\]/;

// The columns of a pair, named as the words of its key name its ends.
const ends = (field, before = "") => {
  const [, low, high] = PAIR.exec(field.words) ?? ["", "from", "to"];
  return [["low", low], ["high", high]].map(([name, label]) => ({ name: before + name, label: before ? `${field.label}: ${label}` : label }));
};

const choiceColumn = ({ choices, otherwise, required }, more) => ({ ...more, type: "select", options: () => (required || otherwise !== undefined ? choices : ["", ...choices]) });

// Tables by the same names are columns of one: {main, beside}.
function tablesIn(fields) {
  const main = fields.filter(({ kind, by, of }) => kind === "table" && by && of.kind === "pair");
  const found = [];
  for (const field of main) if (!found.some(({ beside }) => beside.includes(field))) found.push({ main: field, beside: fields.filter((each) => each !== field && each.kind === "table" && each.by === field.by) });
  return found;
}

// A table by paths as rows: the path, its value now, the pair, its unit, then what stands beside.
function tableRows(host, id, table) {
  const { main, beside } = table;
  const columns = [
    { name: "path", label: "quantity", type: "select", options: () => namesOfTable(main.key) }, { name: "now", label: "now", type: "now" },
    ...ends(main), { name: "unit", label: "unit", type: "now" },
    ...beside.flatMap((field) => (field.of.kind === "pair" ? ends(field, `${field.key}_`) : field.of.kind === "choice" ? [choiceColumn({ ...field.of, otherwise: "" }, { name: field.key, label: field.label })] : [{ name: field.key, label: field.label, off: () => !table.used?.includes(field.key) }])),
  ];
  return rowsOf(host, { id, one: main.label.replace(/s$/, ""), columns, least: 1, told: (path, changed) => boundsTold(main.key, path, changed) });
}

function tableBody(rows, { main, beside }) {
  const body = { [main.key]: {} };
  for (const row of rows) {
    const pointer = (key) => `/${key}/${row.path}`;
    if (row.path in body[main.key]) throw new Unreadable(pointer(main.key), `${row.path} stands there twice.`);
    const pair = (field, before, all) => ends(field, before).map(({ name, label }) => numberOf(row[name], pointer(all), `${row.path}, ${label},`));
    body[main.key][row.path] = pair(main, "", main.key);
    for (const field of beside) {
      const given = field.of.kind === "pair" ? ends(field, `${field.key}_`).some(({ name }) => row[name] !== undefined) && pair(field, `${field.key}_`, field.key)
        : row[field.key] !== undefined && (field.of.kind === "number" ? numberOf(row[field.key], pointer(field.key), `${row.path}, ${field.label},`) : row[field.key] !== "auto" && row[field.key]);
      if (given || given === 0) (body[field.key] ??= {})[row.path] = given;
    }
  }
  return Object.keys(body[main.key]).length ? body : {};
}

const rowsOfTable = ({ main, beside }, request) => Object.entries(request[main.key] ?? {}).map(([path, [low, high]]) => Object.assign({ path, low, high }, ...beside.map((field) => {
  const value = request[field.key]?.[path];
  return field.of.kind === "pair" && value ? { [`${field.key}_low`]: value[0], [`${field.key}_high`]: value[1] } : { [field.key]: value };
})));

// A list of tables as rows; of values by path those in `paths` have a column each.
function listColumns({ columns }, paths) {
  return columns.flatMap((field) => (field.kind === "pair" ? ends({ ...field, words: "" }, `${field.key}_`)
    : field.kind === "choice" ? [choiceColumn(field, { name: field.key, label: field.label })]
      : field.kind === "table" ? [...paths.map((path) => ({ name: path, label: path })), { name: field.key, label: "further values", type: "text", hint: "damper.mu = 0.3" }]
        : [{ name: field.key, label: field.unit ? `${field.label} [${field.unit}]` : field.label, type: field.kind === "number" ? "number" : "text", hint: hintOf({ ...field, ends: "" }), off: () => field.key === "engine_order" && !current.body?.structure.sectors }]));
}

function listBody(field, row, index, paths) {
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

function listRow(field, given, paths) {
  return Object.assign({}, ...field.columns.map((each) => {
    const value = given[each.key];
    if (each.kind === "pair") return { [`${each.key}_low`]: value?.[0], [`${each.key}_high`]: value?.[1] };
    if (each.kind !== "table") return { [each.key]: value === undefined ? undefined : written(each, value) };
    const rest = Object.entries(value ?? {}).filter(([path]) => !paths.includes(path));
    return { ...Object.fromEntries(paths.map((path) => [path, value?.[path]])), [each.key]: written(each, Object.fromEntries(rest)) || undefined };
  }));
}

// A form in `host`, of the kind of a study or of `{fields}`. `keys` of the body that it has (all if left out), `groups` [{legend, id, keys}] that fold, the
// rest in those before; `paths` that rows of values have columns for; `own` keys with a part of their own
// {key: {node, read, fill, blame}}. It is there once the kinds are known.
export function schemaForm(host, kind, { id = kind, keys = () => true, top = [], groups = [], paths = [], own = {}, submit = null, words = "Compute", primary = false, fold = "" } = {}) {
  let fields = [];
  const parts = new Map();
  const units = new Map();

  function build() {
    fields = (kind.fields ?? kindOf(kind).fields).filter(({ key }) => keys(key));
    parts.clear();
    units.clear();
    const tables = tablesIn(fields);
    const inTables = tables.flatMap(({ beside }) => beside.map(({ key }) => key));
    const nodes = new Map(fields.filter(({ key }) => !inTables.includes(key)).map((field) => [field.key, part(field, tables)]));
    const rest = [...nodes.keys()].filter((key) => !top.includes(key) && !groups.some((group) => group.keys?.includes(key)));
    const gather = (chosen) => gathered(chosen.map((key) => nodes.get(key)).filter(Boolean));
    const grouped = groups.map(({ legend, id: name, keys: chosen = rest }) => el("details", { id: `${id}-${name}-fold` }, el("summary", {}, legend), gather(chosen)));
    const open = gather(groups.some((group) => !group.keys) ? top : [...top, ...rest]);
    const button = submit ? el("div", { class: "row" }, el("button", { type: "submit", id: `${id}-submit`, class: primary ? "main-button" : undefined }, words), el("span", { class: "note", id: `${id}-takes` })) : null;
    const wrong = el("p", { id: `${id}-wrong`, class: "bad", role: "alert" });
    if (fold) show(host, button, el("details", { id: `${id}-settings` }, el("summary", {}, fold), open, grouped), wrong);
    else show(host, open, grouped, wrong, button);
  }

  // Single fields side by side, rows of their own across.
  const gathered = (nodes) => {
    const single = nodes.filter((node) => node.classList.contains("field"));
    return [...nodes.filter((node) => !single.includes(node)), single.length ? el("div", { class: "fields" }, single) : null];
  };

  function part(field, tables) {
    const { key } = field;
    const table = tables.find(({ main }) => main === field);
    if (own[key]) return own[key].node(field);
    if (table || field.kind === "rows") {
      const inner = el("div", { id: `${id}-${key}` });
      const rows = table ? tableRows(inner, inner.id, table) : rowsOf(inner, { id: inner.id, one: field.label.replace(/s$/, ""), columns: listColumns(field, paths) });
      parts.set(key, table
        ? { read: () => tableBody(rows.read(), table), fill(request) {
          table.used = table.beside.filter((one) => one.key in request).map((one) => one.key);
          rows.fill(rowsOfTable(table, request));
        }, rows, table }
        : { read: () => { const found = rows.read().map((row, i) => listBody(field, row, i, paths)); return found.length ? { [key]: found } : {}; }, fill: (request) => rows.fill((request[key] ?? []).map((one) => listRow(field, one, paths))), rows });
      return el("fieldset", {}, el("legend", { title: field.words }, field.label), el("p", { class: "note" }, field.words), inner);
    }
    if (field.kind === "table" && field.of.kind === "choice") return boxes(field);
    if (field.kind === "table" && field.names) return el("fieldset", {}, el("legend", {}, field.label), el("p", { class: "note" }, field.words), el("div", { class: "fields" }, field.names.map((name) => single({ ...field.of, key: `${key}-${name}`, label: name, at: [key, name] }))));
    return single({ ...field, at: [key] });
  }

  // Names that something holds for, or not.
  function boxes(field) {
    const [word] = field.of.choices;
    const node = el("div", { class: "row", id: `${id}-${field.key}`, role: "group", "aria-label": field.words });
    parts.set(field.key, {
      read() {
        const chosen = [...node.querySelectorAll("input:checked")].map(({ name }) => [name, word]);
        return chosen.length ? { [field.key]: Object.fromEntries(chosen) } : {};
      },
      fill: (request) => show(node, namesOfTable(field.key).map((name) => el("label", { class: "pair" }, el("input", { type: "checkbox", name, checked: name in (request[field.key] ?? {}) }), `${name}: ${word.replaceAll("-", " ")}`))),
    });
    return node;
  }

  function single(field) {
    const name = `${id}-${field.key}`;
    const common = { id: name, name: field.key, title: field.words, "aria-describedby": `${name}-more`, "aria-required": field.required ? "true" : undefined, "data-usual": field.otherwise };
    const input = field.kind === "truth" ? el("input", { ...common, type: "checkbox" })
      : field.kind === "choice" ? el("select", common, (field.otherwise === undefined ? [""] : []).concat(field.choices).map((word) => el("option", { value: word, selected: word === field.otherwise }, word || "as usual")))
        : el("input", { ...common, type: "text", inputmode: field.kind === "number" ? "decimal" : "text", placeholder: hintOf(field), spellcheck: false, autocomplete: "off" });
    const unit = field.unit === "m" ? el("select", { id: `${name}-unit`, "aria-label": `Unit of ${field.label}`, class: "unit" }, Object.keys(METRES).map((each) => el("option", { value: each, selected: each === "mm" }, each))) : field.unit ? el("span", { class: "unit" }, field.unit) : null;
    if (field.unit === "m") units.set(input, unit);
    const per = () => (field.unit === "m" ? 1 / METRES[unit.value] : 1);
    const [key, inside] = field.at;
    parts.set(field.key, {
      read() {
        const value = field.kind === "truth" ? (input.checked === Boolean(field.otherwise) ? undefined : input.checked) : readField(field, input.value, `/${field.at.join("/")}`, per());
        if (value === undefined || (field.kind === "choice" && value === field.otherwise)) return {};
        return { [key]: inside ? { [inside]: value } : value };
      },
      fill(request) {
        const value = inside ? request[key]?.[inside] : request[key];
        if (field.kind === "truth") input.checked = value ?? field.otherwise ?? false;
        else if (field.kind === "choice") input.value = value ?? field.otherwise ?? "";
        else {
          if (field.unit === "m" && typeof value === "number" && lengthUnit(value).name in METRES) unit.value = lengthUnit(value).name;
          input.value = written(field, value, per());
        }
      },
      input,
    });
    return el("div", { class: field.kind === "truth" ? "field check" : "field" }, el("label", { for: name }, field.required ? `${field.label} (needed)` : field.label), el("span", { class: "pair" }, input, unit),
      el("span", { id: `${name}-more`, class: "note" }, [field.words, field.kind === "number" && field.ends && hintOf(field) !== field.ends ? `(${field.ends})` : ""].filter(Boolean).join(" ")), el("span", { class: "message", role: "alert" }));
  }

  // The keys of the body, and what can not be read.
  function read() {
    const [body, wrong] = [{}, []];
    for (const [key, each] of [...parts, ...Object.entries(own)]) {
      try {
        for (const [name, value] of Object.entries(each.read())) body[name] = name in body && typeof value === "object" && !Array.isArray(value) ? { ...body[name], ...value } : value;
      } catch (error) {
        if (!(error instanceof Unreadable)) throw error;
        wrong.push(...error.errors.map((one) => ({ key, ...one })));
      }
    }
    return { body, wrong };
  }

  function fill(request) {
    for (const each of [...parts.values(), ...Object.values(own)]) each.fill(request);
    for (const fold of host.querySelectorAll("details[id$=-fold]")) if ([...fold.querySelectorAll("input, select:not(.unit)")].some(isFilled)) fold.open = true;
    complain([]);
  }

  // Whether a field says something else than what holds without it.
  const isFilled = (input) => (input.type === "checkbox" ? input.checked !== (input.dataset.usual === "true") : input.value !== (input.dataset.usual ?? ""));

  // Says what is wrong beside the field or the row it is about; what is about none stands below.
  function complain(errors) {
    for (const node of host.querySelectorAll("[aria-invalid]")) node.removeAttribute("aria-invalid");
    for (const node of host.querySelectorAll(".message")) node.textContent = "";
    for (const node of host.querySelectorAll(".field.wrong")) node.classList.remove("wrong");
    const left = errors.filter(({ pointer, detail }) => {
      const [top, which, key] = pointer.split("/").slice(1);
      const table = [...parts.values()].find(({ table: one }) => one && [one.main, ...one.beside].some((each) => each.key === top));
      if (own[top]?.blame?.(which, detail)) return false;
      if (table?.rows.blame(which ?? "", top === table.table.main.key ? "low" : top, detail)) return false;
      if (parts.get(top)?.rows?.blame(which ?? "", key, detail)) return false;
      const input = parts.get(top)?.input ?? parts.get(`${top}-${which}`)?.input;
      if (!input) return true;
      input.setAttribute("aria-invalid", "true");
      input.closest(".field").classList.add("wrong");
      input.closest(".field").querySelector(".message").textContent += detail;
      return false;
    });
    if (byId(`${id}-wrong`)) byId(`${id}-wrong`).textContent = left.map(({ detail }) => detail).join(" ");
    const first = host.querySelector("[aria-invalid]");
    first?.closest("details")?.setAttribute("open", "");
    first?.focus();
  }

  if (!kind.fields) on("kinds", build);
  if (kind.fields || kindOf(kind)) build();
  // Lengths are asked for in the unit of what is seen.
  on("size", (size) => {
    const { name } = lengthUnit(size);
    for (const [input, unit] of units) if (input.value === "" && name in METRES) unit.value = name;
  });
  if (submit) {
    host.addEventListener("submit", (event) => {
      event.preventDefault();
      const { body, wrong } = read();
      complain(wrong);
      if (!wrong.length) submit(body);
    });
  }
  return { read, fill, complain, rows: (key) => parts.get(key)?.rows };
}
