// What a scene may hold, by the schema of the service: its tables with their keys, units, words and choices.

import { endsOf } from "../forms/fields.js";
import { request } from "../network/api.js";
import { parameterOf } from "../scene/kinds.js";

const FIRST = ["name", "kind", "sectors", "dof", "on", "shape", "law", "between", "between_second", "normal_between"];
const LAST = ["at", "normal", "tangents", "motions", "direction", "out", "axial", "group", "factor"];
const TITLES = {
  "": "Scene", "structure": "Structure", "structure/masses": "Masses", "structure/springs": "Springs", "structure/dampers": "Dashpots", "structure/dofs": "DOFs of the matrices",
  contacts: "Contacts", excitation: "Forces", observe: "What is observed", bodies: "Bodies", nodes: "Nodes", loads: "Constant loads",
  dampers: "Dampers by shape", with_speed: "What follows the speed", couplings: "Couplings", aerodynamics: "Aerodynamics", recovery: "Recovered quantities", materials: "Materials",
};
const ONE = {
  "structure/masses": "mass", "structure/springs": "spring", "structure/dampers": "dashpot", "structure/dofs": "DOF", contacts: "contact", excitation: "force", bodies: "body",
  nodes: "node", loads: "load", dampers: "damper", couplings: "coupling", materials: "material",
};
let schema = null;

export async function loadSchema() {
  schema ??= await request("/v1/scenes-schema");
}

const resolved = (node) => (node?.$ref ? { ...schema.$defs[node.$ref.split("/").pop()], ...(node.description ? { description: node.description } : {}) } : node);
const at = (node, key) => resolved(resolved(node)?.properties?.[key]);

// The table or list of tables at a path of keys: `structure/springs`.
function nodeOf(scene, path) {
  if (path === "") return schema;
  const [top, below] = path.split("/");
  const node = at(schema, top);
  if (top !== "structure") return node;
  const kind = variantOf(node, scene.structure ?? {});
  return below ? at(kind, below) : kind;
}

const variants = (node) => (node.oneOf ?? []).map(resolved);

// The key by which the variants of a table are told: the one with a word of its own in each.
function tagOf(node) {
  const all = variants(node);
  const [first] = all;
  if (!first) return "";
  return Object.keys(first.properties).find((key) => {
    const words = all.map((each) => each.properties[key]?.const);
    return words.every((word) => word !== undefined) && new Set(words).size === all.length;
  }) ?? "";
}

function variantOf(node, row) {
  const all = variants(node);
  if (!all.length) return resolved(node);
  const tag = tagOf(node);
  return all.find((each) => each.properties[tag].const === row[tag]) ?? all.find((each) => !(each.required ?? []).includes(tag)) ?? all[0];
}

// The schema of one row of a section.
function rowSchema(scene, path, row) {
  if (path === "structure/masses") return resolved({ $ref: "#/$defs/MassEntry" });
  const node = nodeOf(scene, path);
  const many = node?.type === "array" ? node : (node?.anyOf ?? []).find((each) => each.type === "array");
  return many ? variantOf(resolved(many.items), row) : resolved(node);
}

function choicesOf(scene, path, key) {
  const node = path === "structure" ? at(schema, "structure") : resolved(nodeOf(scene, path)?.items);
  return node && tagOf(node) === key ? variants(node).map((each) => each.properties[key].const) : null;
}

// The variant of a row that does not tell.
function usualOf(scene, path, choices) {
  const node = path === "structure" ? null : resolved(nodeOf(scene, path).items);
  const tag = node ? tagOf(node) : "";
  const usual = node && variants(node).find((each) => !(each.required ?? []).includes(tag));
  return usual ? choices.find((word) => word === usual.properties[tag].const) : undefined;
}

const lastUnit = (words) => [...(words ?? "").matchAll(/\[([^\]]+)\]/g)].pop()?.[1] ?? "";

function typeOf(node) {
  if (node.enum || node.const !== undefined || node.type === "boolean") return "choice";
  if (node.type === "number" || node.type === "integer") return "number";
  if (node.type === "string") return "text";
  if (node.prefixItems?.length === 2 && node.prefixItems.every((each) => each.type === "string")) return "pair";
  if (node.prefixItems?.every((each) => each.type === "number")) return "numbers";
  if (node.type === "object") return "names";
  return "any";
}

// One key as a column knows it; what the law says of its parameters counts first.
export function keyOf(scene, path, row, key) {
  const of = rowSchema(scene, path, row);
  const node = resolved(of?.properties?.[key]);
  if (!node) return null;
  const choices = choicesOf(scene, path, key);
  const type = choices ? "choice" : typeOf(node);
  const law = path === "contacts" ? parameterOf(row, key) : undefined;
  const numeric = type === "number" || type === "numbers" || (type === "any" && node.anyOf?.some((each) => each.type === "number"));
  return {
    key, type, words: node.description ?? "", unit: law?.unit ?? (numeric ? lastUnit(node.description) : ""), required: (of.required ?? []).includes(key),
    choices: choices ?? node.enum ?? (node.const !== undefined ? [node.const] : node.type === "boolean" ? [true, false] : null),
    otherwise: choices ? usualOf(scene, path, choices) : node.default, example: node.examples?.[0], range: endsOf(node),
  };
}

const rank = (key, index) => (FIRST.includes(key) ? FIRST.indexOf(key) - 100 : LAST.includes(key) ? 1000 + LAST.indexOf(key) : index);

// All keys that a row may have, in the order of columns.
export function keysOf(scene, path, row) {
  const keys = Object.keys(rowSchema(scene, path, row)?.properties ?? {});
  return keys.sort((a, b) => rank(a, keys.indexOf(a)) - rank(b, keys.indexOf(b)));
}

export const requiredKeys = (scene, path, row) => rowSchema(scene, path, row)?.required ?? [];
export const titleOf = (path) => TITLES[path] ?? path.split("/").pop().replaceAll("_", " ");
export const oneOf = (path) => ONE[path] ?? `row of ${titleOf(path).toLowerCase()}`;
export const wordsOf = (scene, path) => (path === "" ? "" : nodeOf(scene, path)?.description ?? "");

// The sections that a scene of its kind can have: fields, rows of a list, or rows of a table of names.
export function sectionsOf(scene) {
  const structure = nodeOf(scene, "structure");
  const listed = (node) => node?.type === "array" && (resolved(node.items)?.type === "object" || resolved(node.items)?.oneOf);
  const found = [{ path: "", form: "fields" }, { path: "structure", form: "fields" }];
  for (const key of ["masses", "dofs"]) if (structure.properties[key]) found.push({ path: `structure/${key}`, form: "names" });
  for (const [key, node] of Object.entries(structure.properties)) if (listed(resolved(node))) found.push({ path: `structure/${key}`, form: "rows" });
  const order = ["nodes", "bodies", "contacts", "dampers", "loads", "excitation"];
  const lists = Object.keys(schema.properties).filter((key) => key === "excitation" || listed(at(schema, key)));
  lists.sort((a, b) => (order.indexOf(a) + 1 || 99) - (order.indexOf(b) + 1 || 99));
  return [...found, ...lists.map((path) => ({ path, form: "rows" })), { path: "observe", form: "fields" }];
}
