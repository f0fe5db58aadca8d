// A form made of the schema of a body: a field for each key, rows for its tables, what is wrong beside it.

import { byId, el, onSubmit, show } from "../base/dom.js";
import { on } from "../base/state.js";
import { kindOf } from "../scene/kinds.js";
import { tablesIn } from "./rows.js";
import { Unreadable } from "./fields.js";
import { boxesPart, fieldPart, listPart, namesPart, tablePart } from "./parts.js";

// The parts of the keys, in order; tables that stand beside another are in its rows.
function partsOf(id, fields, paths, own) {
  const tables = tablesIn(fields);
  const inRows = tables.flatMap(({ beside }) => beside);
  return new Map(fields.filter((field) => !inRows.includes(field)).map((field) => {
    const table = tables.find(({ main }) => main === field);
    const part = own[field.key] ? { ...own[field.key], node: own[field.key].node(field) }
      : table ? tablePart(id, table) : field.kind === "rows" ? listPart(id, field, paths)
        : field.kind === "table" && field.of.kind === "choice" ? boxesPart(id, field) : field.kind === "table" && field.names ? namesPart(id, field) : fieldPart(id, field);
    return [field.key, part];
  }));
}

// Single fields side by side, rows of their own across.
function gathered(nodes) {
  const single = nodes.filter((node) => node.classList.contains("field"));
  return [...nodes.filter((node) => !single.includes(node)), single.length ? el("div", { class: "fields" }, single) : null];
}

// Whether a field says something else than what holds without it.
const isFilled = ({ type, checked, value, dataset }) => (type === "checkbox" ? checked !== (dataset.usual === "true") : value !== "" && value !== (dataset.usual ?? ""));
const merged = (before, value) => (before && typeof value === "object" && !Array.isArray(value) ? { ...before, ...value } : value);

// Whether an error could be said at a part.
function blamed(parts, { pointer, detail }) {
  const [top, which, key] = pointer.split("/").slice(1);
  const all = [...parts.values()].flatMap((part) => part.inside ?? [part]);
  const table = all.find((part) => part.table && [part.table.main, ...part.table.beside].some((each) => each.key === top));
  if (table) return table.rows.blame(which ?? "", top === table.table.main.key ? "low" : top, detail);
  const part = parts.get(top);
  if (part?.blame) return part.blame(which, detail);
  if (part?.rows) return part.rows.blame(which ?? "", key, detail);
  const input = part?.input ?? all.find((each) => each.key === `${top}-${which}`)?.input;
  if (!input) return false;
  input.setAttribute("aria-invalid", "true");
  input.closest(".field").classList.add("wrong");
  input.closest(".field").querySelector(".message").textContent += detail;
  return true;
}

// A form in `host`, of a kind of study or of `{fields}`. `keys` says which of the body it has; those of `top` come first,
// those of `groups` [{legend, id, keys}] are folded, all others where a group has no keys; `paths` have columns in rows of
// values; `own` are parts that are no field. With `submit` it has a button. It is there once the kinds are known.
export function schemaForm(host, kind, { id = kind, keys = () => true, top = [], groups = [], paths = [], own = {}, submit = null, words = "Compute", primary = false, fold = "" } = {}) {
  let parts = new Map();
  const single = () => [...parts.values()].flatMap((part) => part.inside ?? [part]);

  function build() {
    parts = partsOf(id, (kind.fields ?? kindOf(kind).fields).filter(({ key }) => keys(key)), paths, own);
    const rest = [...parts.keys()].filter((key) => !top.includes(key) && !groups.some((group) => group.keys?.includes(key)));
    const gather = (chosen) => gathered(chosen.map((key) => parts.get(key)?.node).filter(Boolean));
    const folded = groups.map(({ legend, id: name, keys: chosen = rest }) => el("details", { id: `${id}-${name}-fold` }, el("summary", {}, legend), gather(chosen)));
    const open = gather(groups.some((group) => !group.keys) ? top : [...top, ...rest]);
    const button = submit ? el("div", { class: "row" }, el("button", { type: "submit", id: `${id}-submit`, class: primary ? "main-button" : undefined }, words), el("span", { class: "note", id: `${id}-takes` })) : null;
    const wrong = el("p", { id: `${id}-wrong`, class: "bad", role: "alert" });
    if (fold) show(host, button, el("details", { id: `${id}-settings` }, el("summary", {}, fold), open, folded), wrong);
    else show(host, open, folded, wrong, button);
  }

  // The keys of the body, and what can not be read.
  function read() {
    const [body, wrong] = [{}, []];
    for (const part of single()) {
      try {
        for (const [name, value] of Object.entries(part.read())) body[name] = merged(body[name], value);
      } catch (error) {
        if (!(error instanceof Unreadable)) throw error;
        wrong.push(...error.errors);
      }
    }
    return { body, wrong };
  }

  function fill(request) {
    for (const part of single()) part.fill(request);
    for (const node of host.querySelectorAll("details[id$=-fold]")) if ([...node.querySelectorAll("input, select:not(.unit)")].some(isFilled)) node.open = true;
    complain([]);
  }

  // Says what is wrong beside the field or the row it is about; what is about none stands below.
  function complain(errors) {
    for (const node of host.querySelectorAll("[aria-invalid]")) node.removeAttribute("aria-invalid");
    for (const node of host.querySelectorAll(".message")) node.textContent = "";
    for (const node of host.querySelectorAll(".field.wrong")) node.classList.remove("wrong");
    const left = errors.filter((error) => !blamed(parts, error));
    if (byId(`${id}-wrong`)) byId(`${id}-wrong`).textContent = left.map(({ detail }) => detail).join(" ");
    const first = host.querySelector("[aria-invalid]");
    first?.closest("details")?.setAttribute("open", "");
    first?.focus();
  }

  if (!kind.fields) on("kinds", build);
  if (kind.fields || kindOf(kind)) build();
  // Lengths are asked for in the unit of what is seen.
  on("size", (metres) => single().forEach((part) => part.sized?.(metres)));
  if (submit) onSubmit(host, () => {
    const { body, wrong } = read();
    complain(wrong);
    if (!wrong.length) submit(body);
  });
  return { read, fill, complain, rows: (key) => parts.get(key)?.rows };
}
