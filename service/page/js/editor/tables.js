// The sections of a scene as tables: a row for each mass, spring, contact …, a column for each value; one value as a field:
// how it is shown, and how what was typed is read.

import { button, el, note, show, svg } from "../base/dom.js";
import { addRow, completed, dofsOf, doubleRow, endsOf, escaped, isKept, removeRow, rename, rowsOf, setCell } from "./scene_data.js";
import { keyOf, keysOf, oneOf, requiredKeys, sectionsOf, titleOf, wordsOf } from "./schema.js";

const ALWAYS = ["", "structure", "structure/masses", "structure/springs", "contacts", "excitation", "observe"];
const LEAST = { names: 10, any: 6, numbers: 8, number: 6, text: 7, pair: 5 };
const MOST = 26;
// What a row is: these have a column even where they are left out.
const TELLING = ["law", "shape", "kind"];
let opened = new Map();
export const forgetOpened = () => { opened = new Map(); };
const openedIn = (path) => opened.get(path) ?? opened.set(path, new Set()).get(path);

// A value that is said to be missing gets a column.
export function openMissing(scene, issues) {
  for (const { pointer } of issues) {
    const section = sectionsOf(scene).filter(({ path }) => path === "" || pointer.startsWith(`/${path}/`)).pop();
    if (!section) continue;
    for (const { row, pointer: at } of rowsOf(scene, section)) {
      const key = pointer.startsWith(`${at}/`) ? pointer.slice(at.length + 1) : "";
      if (key && !key.includes("/") && row !== null && typeof row === "object" && keyOf(scene, section.path, row, key)) openedIn(section.path).add(key);
    }
  }
}

const asTable = (row) => (row !== null && typeof row === "object" && !Array.isArray(row) ? row : {});

// The keys that have a column: those in use, those a row may not be without, and those that were asked for.
function columnsOf(scene, path, rows) {
  const shown = [];
  for (const { row } of rows) {
    const table = asTable(row);
    const wanted = [...TELLING, ...Object.keys(table), ...requiredKeys(scene, path, table), ...openedIn(path)];
    const known = keysOf(scene, path, table);
    for (const key of known) if (wanted.includes(key) && !shown.includes(key)) shown.push(key);
    for (const key of Object.keys(table)) if (!known.includes(key) && !shown.includes(key)) shown.push(key);
  }
  const order = rows.length ? keysOf(scene, path, asTable(rows[0].row)) : [];
  const place = (key) => (order.includes(key) ? order.indexOf(key) : 500);
  return path === "" || path === "observe" || path === "structure" ? shown : shown.sort((a, b) => place(a) - place(b));
}

// As wide as the longest value of its column, within limits.
function widthOf(rows, known) {
  const texts = rows.flatMap(({ row }) => {
    const value = row !== null && typeof row === "object" ? row[known.key] : row;
    return known.type === "pair" && Array.isArray(value) ? value.map((end) => textOf(end, "text")) : [textOf(value, known.type)];
  });
  return Math.min(Math.max(LEAST[known.type] ?? 6, ...texts.map((text) => text.length)), MOST);
}

const COPY = "M3 5.5h7.5V13H3zM5.5 5.5V3H13v7.5h-2.5";
const CROSS = "M4 4l8 8M12 4l-8 8";
const icon = (path) => svg("svg", { viewBox: "0 0 16 16", width: 15, height: 15, "aria-hidden": "true", fill: "none", stroke: "currentColor", "stroke-width": 1.4 }, svg("path", { d: path }));
const nameOf = (path, { row, name, index }) => name ?? asTable(row).name ?? `${oneOf(path)} ${index + 1}`;

// A value that no field can show: a table of tables, a matrix.
const isSection = (scene, path, key) => sectionsOf(scene).some((section) => section.path === (path === "" ? key : `${path}/${key}`));

// Draws the tables of `scene`; `edit(change, redraw)` has a change made, with the tables drawn again if they have other rows.
export function drawTables(host, scene, edit) {
  const sections = sectionsOf(scene);
  const used = sections.filter((section) => ALWAYS.includes(section.path) || rowsOf(scene, section).some(({ row }) => Object.keys(asTable(row)).length));
  const unused = sections.filter((section) => !used.includes(section) && section.form !== "fields");
  const lists = [["editor-ends", endsOf(scene)], ["editor-dofs", dofsOf(scene)]].map(([id, names]) => el("datalist", { id }, names.map((name) => el("option", { value: name }))));
  const add = unused.length
    ? el("fieldset", { class: "add-section" }, el("legend", {}, "Add"), el("div", { class: "row" }, unused.map((section) =>
      button(titleOf(section.path), () => edit((draft) => { addRow(draft, section); }, idOf(`/${section.path}`)), { title: wordsOf(scene, section.path), id: `add-${idOf(`/${section.path}`)}` }))))
    : null;
  show(host, lists, used.map((section) => (section.form === "fields" ? fields(scene, section, edit) : rowTable(scene, section, edit))), add);
}

function keyWords({ key, unit, words, range, required }) {
  const parts = [`${key}${unit ? ` [${unit}]` : ""}`, words, range ? `Range: ${range}.` : "", required ? "" : "May be left out."];
  return parts.filter(Boolean).join(" — ").replace(" — Range", " Range").replace(" — May", " May");
}

function fields(scene, section, edit) {
  const { path } = section;
  const [{ row, pointer }] = rowsOf(scene, section);
  const shown = columnsOf(scene, path, [{ row }]).filter((key) => !isSection(scene, path, key) && !(path === "" && ["structure", "observe"].includes(key)));
  const groups = shown.map((key) => {
    const at = `${pointer}/${escaped(key)}`;
    if (isKept(scene && path, key, row[key])) return el("div", { class: "field kept" }, el("span", {}, key), el("span", { class: "note" }, sizeOf(row[key])));
    const known = keyOf(scene, path, row, key) ?? { key, type: "any", words: "The service does not know this key.", unit: "" };
    const input = valueCell(known, row, at, `${key} of ${titleOf(path).toLowerCase()}`, edit, path, 0, scene);
    return el("div", { class: "field", "data-words": keyWords(known) }, el("label", { for: known.type === "pair" ? idOf(`${at}/0`) : idOf(at) }, key, known.unit ? ` [${known.unit}]` : ""), input);
  });
  const more = moreKeys(scene, path, row, shown, edit, 0);
  return el("fieldset", { class: "section", id: idOf(`/${path}`) }, el("legend", {}, titleOf(path)), el("div", { class: "fields narrow" }, groups, more ? el("div", { class: "field" }, more) : null));
}

const sizeOf = (value) => (Array.isArray(value) ? `${value.length} × ${value[0]?.length ?? 1}, kept as it is` : "kept as it is");

function rowTable(scene, section, edit) {
  const { path, form } = section;
  const rows = rowsOf(scene, section);
  const columns = columnsOf(scene, path, rows);
  const heads = columns.map((key) => {
    const known = rows.map(({ row }) => keyOf(scene, path, asTable(row), key)).find(Boolean) ?? { key, unit: "", words: "" };
    return el("th", { scope: "col", title: keyWords(known), class: known.type === "number" ? "number" : undefined }, key, known.unit ? el("span", { class: "unit" }, ` [${known.unit}]`) : null);
  });
  const first = form === "names" ? el("th", { scope: "col" }, path === "structure/masses" ? "DOF" : "name") : null;
  const body = rows.map((each) => rowOf(scene, section, each, columns, edit));
  const table = rows.length
    ? el("div", { class: "scroll" }, el("table", { class: "grid" }, el("caption", { class: "unseen" }, titleOf(path)),
      el("thead", {}, el("tr", {}, first, heads, el("th", { scope: "col" }, el("span", { class: "unseen" }, "Change the row")))), el("tbody", {}, body)))
    : note(`None. ${wordsOf(scene, path)}`);
  return el("fieldset", { class: "section", id: idOf(`/${path}`) }, el("legend", {}, titleOf(path), rows.length ? el("span", { class: "count" }, ` ${rows.length}`) : null), table,
    button(`Add ${oneOf(path)}`, () => edit((draft) => { addRow(draft, section); }, `row:${path}:${rows.length}`), { class: "add", id: `add-${idOf(`/${path}`)}` }));
}

function rowOf(scene, section, each, columns, edit) {
  const { path, form } = section;
  const { row, pointer, index, name } = each;
  const who = nameOf(path, each);
  const scalar = form === "names" && (row === null || typeof row !== "object");
  const naming = form === "names"
    ? el("th", { scope: "row" }, nameCell({ pointer, about: `Name of ${oneOf(path)} ${index + 1}`, value: name }, (is) => {
      if (dofsOf(scene).includes(is)) return false;
      edit((draft) => rename(draft, path, name, is), `renamed:${idOf(pointer)}:${idOf(`/${path}/${escaped(is)}`)}`);
      return true;
    }))
    : null;
  const cells = columns.map((key) => el("td", {}, oneCell(scene, section, each, key, scalar, who, edit)));
  if (form === "names" && !columns.length) cells.push(el("td", {}, oneCell(scene, section, each, "row", true, who, edit)));
  const act = (words, sign, change, focus) => button(icon(sign), () => edit(change, focus), { class: "icon", "aria-label": `${words} ${who}`, title: words });
  const more = path === "structure/dofs" ? null : moreKeys(scene, path, asTable(row), columns, edit, index);
  return el("tr", { "data-row": `${path}:${index}`, "data-pointer": pointer }, naming, cells, el("td", { class: "acts" }, more,
    act("Duplicate", COPY, (draft) => { doubleRow(draft, section, index); }, `row:${path}:${index + 1}`),
    act("Remove", CROSS, (draft) => { removeRow(draft, section, index); }, `row:${path}:${Math.max(index - 1, 0)}`)));
}

function oneCell(scene, { path, form }, { row, pointer, name, index }, key, scalar, who, edit) {
  const whole = form === "names" && scalar && (key === "m" || key === "row");
  const known = keyOf(scene, path, asTable(row), key);
  if (whole) {
    const [top, table] = path.split("/");
    return cell({ ...known, pointer, name: key, about: `${key} of ${who}`, type: "number", value: row, width: widthOf(rowsOf(scene, { path, form }), { key, type: "number" }) }, (value) => edit((draft) => { draft[top][table][name] = value ?? ""; }));
  }
  if (!known && asTable(row)[key] === undefined) return el("span", { class: "none", "aria-label": "not a value of this row" }, "·");
  const at = `${pointer}/${escaped(key)}`;
  return valueCell(known ?? { key, type: "any", words: "", unit: "" }, asTable(row), at, `${key} of ${who}`, edit, path, index, scene, name);
}

const formOf = (path) => (path === "structure/masses" ? "names" : ["", "structure", "observe"].includes(path) ? "fields" : "rows");

function valueCell(known, row, pointer, about, edit, path, index, scene, name) {
  const list = known.type === "pair" ? "editor-ends" : known.key === "dof" ? "editor-dofs" : known.key === "on" ? "editor-ends" : "";
  // Another law or shape has other columns.
  const redraw = known.type === "choice" && TELLING.includes(known.key) ? idOf(pointer) : undefined;
  return cell({ ...known, pointer, name: known.key, about, value: row[known.key], list, width: formOf(path) === "fields" ? undefined : widthOf(rowsOf(scene, { path, form: formOf(path) }), known) }, (value) =>
    edit((draft) => {
      const form = formOf(path);
      const each = rowsOf(draft, { path, form }).find((one) => (form === "names" ? one.name === name : one.index === index));
      let owner = each?.row;
      if (form === "names" && (owner === null || typeof owner !== "object")) owner = draft.structure.masses[name] = { m: owner };
      if (form === "fields" && path !== "" && !draft[path]) owner = draft[path] = {};
      setCell(owner, known.key, value);
      if (redraw) completed(draft, path, owner);
      if (form === "names" && Object.keys(owner).length === 1 && "m" in owner) draft.structure.masses[name] = owner.m;
    }, redraw));
}

// What a row may have besides.
function moreKeys(scene, path, row, shown, edit, index) {
  const left = keysOf(scene, path, row).filter((key) => !shown.includes(key) && !isSection(scene, path, key) && !(path === "" && ["structure", "observe"].includes(key)));
  if (!left.length) return null;
  const about = path === "" || path === "structure" || path === "observe" ? titleOf(path).toLowerCase() : row.name ?? `${oneOf(path)} ${index + 1}`;
  const select = el("select", { class: "more", "aria-label": `Add a value to ${about}`, title: "Add a value", id: `more-${idOf(`/${path}/${index}`)}` },
    el("option", { value: "" }, formOf(path) === "fields" ? "+ value" : "+"), left.map((key) => el("option", { value: key, title: keyOf(scene, path, row, key)?.words }, key)));
  select.addEventListener("change", () => {
    openedIn(path).add(select.value);
    edit(null, `cell:${path}:${index}:${select.value}`);
  });
  return select;
}

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
export const idOf = (pointer) => `field${pointer.replaceAll(/[^A-Za-z0-9]/g, "-")}`;
const plainList = (value) => Array.isArray(value) && value.every((one) => one === null || typeof one !== "object");
const plainTable = (value) => value !== null && typeof value === "object" && !Array.isArray(value) && Object.values(value).every((one) => one === null || typeof one !== "object");

// A value in the words of its field.
function textOf(value, type) {
  if (value === undefined || value === null) return "";
  if (type === "numbers" && plainList(value)) return value.join(", ");
  if (type === "names" && plainTable(value)) return Object.entries(value).map(([key, one]) => `${key} = ${one}`).join(", ");
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}

const one = (text) => (NUMBER.test(text) ? Number(text) : text);

// What was typed; undefined if nothing was.
function readCell(text, type) {
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

function typed(attributes, value, width) {
  const input = el("input", { type: "text", spellcheck: false, autocomplete: "off", ...attributes });
  if (width) input.style.width = `calc(${width}ch + 1.1rem)`;
  input.value = value;
  return input;
}

// The field or fields of a value. `told` is called with the value whenever it is another one.
function cell({ pointer, name, about, type, choices, otherwise, value, list, width }, told) {
  const common = { "aria-label": about, "data-pointer": pointer, id: idOf(pointer), "data-key": name };
  if (type === "choice") return choice(common, choices, value, otherwise, told);
  if (type === "pair") return pair(common, Array.isArray(value) ? value : [], list, width, told);
  const placeholder = otherwise === undefined || otherwise === null ? "" : textOf(otherwise, type);
  const input = typed({ ...common, value: "", list: list || undefined, class: type === "number" ? "number" : undefined, placeholder }, textOf(value, type), width);
  input.addEventListener("input", () => told(readCell(input.value, type)));
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
    return typed({ ...common, list, id: idOf(pointer), "data-pointer": pointer, "aria-label": `${common["aria-label"]}, end ${i + 1}` }, textOf(value[i], "text"), width);
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
function nameCell({ pointer, about, value }, told) {
  const input = typed({ id: `${idOf(pointer)}-name`, "data-late": "yes", "aria-label": about, "data-pointer": `${pointer}#`, "data-key": "name" }, value, Math.max(value.length, 6));
  input.addEventListener("change", () => {
    const name = input.value.trim();
    if (!name || name === value || !told(name)) input.value = value;
  });
  return input;
}
