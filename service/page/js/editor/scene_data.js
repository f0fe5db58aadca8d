// Changes of a scene's tables: rows that are new, doubled or gone, names that are changed wherever they stand.

import { keyOf, keysOf, oneOf, requiredKeys, sectionsOf } from "./schema.js";

const ENDS = /^(between|between_second|normal_between)$/;
export const escaped = (key) => String(key).replaceAll("~", "~0").replaceAll("/", "~1");

// Matrices and what came of them are kept as they are: nobody edits them number by number.
export const isKept = (path, key, value) => path === "structure" && /^(M|K|C|G|K_omega2|modes|reduction|diameters)$/.test(key) && value !== null && typeof value === "object";

export function partOf(scene, path) {
  return path === "" ? scene : path.split("/").reduce((item, key) => item?.[key], scene);
}

// The rows of a section with where each stands: a force without a list is a list of one.
export function rowsOf(scene, { path, form }) {
  const part = partOf(scene, path);
  if (form === "fields") return [{ row: part ?? {}, pointer: path === "" ? "" : `/${path}`, index: 0 }];
  if (form === "names") return Object.entries(part ?? {}).map(([name, row], index) => ({ row, name, index, pointer: `/${path}/${escaped(name)}` }));
  if (part && !Array.isArray(part)) return [{ row: part, pointer: `/${path}`, index: 0 }];
  return (part ?? []).map((row, index) => ({ row, index, pointer: `/${path}/${index}` }));
}

function listAt(scene, path) {
  const keys = path.split("/");
  const last = keys.pop();
  const owner = keys.reduce((item, key) => (item[key] ??= {}), scene);
  if (owner[last] && !Array.isArray(owner[last])) owner[last] = [owner[last]];
  return [owner, last];
}

export const dofsOf = ({ structure = {}, bodies = [], dampers = [] }) => [
  ...Object.keys(structure.masses ?? structure.dofs ?? {}),
  ...[...bodies, ...(Array.isArray(dampers) ? dampers : []).filter(({ mass }) => mass !== undefined)]
    .flatMap(({ name, plane }) => (plane ? ["x", "y", "rz"] : ["x", "y", "z", "rx", "ry", "rz"]).map((end) => `${name}.${end}`)),
];

// What an end may be called.
export function endsOf(scene) {
  const places = [...(scene.nodes ?? []), ...(scene.bodies ?? [])].map(({ name }) => name).filter(Boolean);
  const here = [...dofsOf(scene), ...places];
  const next = scene.structure?.kind === "cyclic" || scene.structure?.sectors ? here.map((name) => `${name}@next`) : [];
  return ["ground", ...here, ...next];
}

const fresh = (wanted, taken) => {
  if (!taken.includes(wanted)) return wanted;
  const stem = wanted.replace(/\d+$/, "");
  for (let i = 2; ; i += 1) if (!taken.includes(`${stem}${i}`)) return `${stem}${i}`;
};

const namesOf = (scene) => ["contacts", "dampers", "bodies", "nodes", "loads"].flatMap((key) => (scene[key] ?? []).map(({ name }) => name))
  .concat((scene.structure?.springs ?? []).map(({ name }) => name));

// A row with what it needs: names that are free, ends that are there, and the examples of the schema. Those of
// another law or shape lose what they can not have.
export function completed(scene, path, row) {
  const known = keysOf(scene, path, row);
  for (const key of Object.keys(row)) if (!known.includes(key)) delete row[key];
  const dofs = dofsOf(scene);
  for (const key of known) {
    if (!requiredKeys(scene, path, row).includes(key) || key in row) continue;
    const { type, choices, example, otherwise } = keyOf(scene, path, row, key);
    if (key === "name") row.name = fresh(oneOf(path).replaceAll(/[^A-Za-z0-9]+/g, "-"), namesOf(scene));
    else if (ENDS.test(key)) row[key] = [dofs.at(-1) ?? "", "ground"];
    else if (key === "dof") row.dof = dofs[0] ?? "";
    else if (type === "choice") [row[key]] = choices;
    else if (otherwise ?? example ?? null) row[key] = structuredClone(otherwise ?? example);
  }
  return row;
}

export function addRow(scene, { path, form }) {
  if (form === "names") {
    const [top, key] = path.split("/");
    const table = ((scene[top] ??= {})[key] ??= {});
    const name = fresh(path === "structure/masses" ? "m1" : "dof1", dofsOf(scene));
    table[name] = path === "structure/masses" ? Object.values(table).at(-1) ?? keyOf(scene, path, {}, "m").example ?? 0.1 : 0;
    return Object.keys(table).length - 1;
  }
  const [owner, last] = listAt(scene, path);
  const row = completed(scene, path, {});
  (owner[last] ??= []).push(row);
  return owner[last].length - 1;
}

export function doubleRow(scene, { path, form }, index) {
  const [owner, last] = form === "names" ? [null, null] : listAt(scene, path);
  if (form === "names") return renewed(scene, path, (all) => all.toSpliced(index + 1, 0, [fresh(`${all[index][0]}2`, all.map(([name]) => name)), structuredClone(all[index][1])]));
  const copy = structuredClone(owner[last][index]);
  if (copy.name) copy.name = fresh(`${copy.name.replace(/-?\d+$/, "")}2`, namesOf(scene));
  owner[last].splice(index + 1, 0, copy);
  return undefined;
}

export function removeRow(scene, { path, form }, index) {
  if (form === "names") return renewed(scene, path, (all) => all.toSpliced(index, 1));
  const [owner, last] = listAt(scene, path);
  owner[last].splice(index, 1);
  if (!owner[last].length) delete owner[last];
  return undefined;
}

// A table of names with other entries, in their order.
function renewed(scene, path, change) {
  const [top, key] = path.split("/");
  scene[top][key] = Object.fromEntries(change(Object.entries(scene[top][key])));
}

// Gives a DOF, and whatever refers to it, another name.
export function rename(scene, path, was, is) {
  renewed(scene, path, (all) => all.map(([name, value]) => [name === was ? is : name, value]));
  const other = (word) => (typeof word === "string" && word.split("@")[0] === was ? is + word.slice(was.length) : word);
  const walk = (item) => {
    for (const [key, value] of Object.entries(item)) {
      if (ENDS.test(key) && Array.isArray(value)) item[key] = value.map(other);
      else if (key === "dof") item[key] = other(value);
      else if (key === "dofs" && item !== scene.structure) for (const name of Object.keys(value)) value[name] = other(value[name]);
      else if (value !== null && typeof value === "object") walk(value);
    }
  };
  walk(scene);
}

export function setCell(owner, key, value) {
  if (value === undefined) delete owner[key];
  else owner[key] = value;
}

const LEADING = ["name", "kind", "sectors", "speed"];

// A scene as a person would write it: without what is as usual anyway, each table in the order of its columns.
export function tidied(scene) {
  const found = structuredClone(scene);
  for (const section of sectionsOf(scene)) {
    for (const { row } of rowsOf(found, section)) {
      if (row === null || typeof row !== "object" || section.path === "structure/dofs") continue;
      for (const [key, value] of Object.entries(row)) {
        const usual = keyOf(scene, section.path, row, key)?.otherwise;
        const empty = Array.isArray(value) && !value.length;
        if (value === null || empty || (usual !== undefined && JSON.stringify(value) === JSON.stringify(usual))) delete row[key];
      }
      if (section.form === "rows") inOrder(row, keysOf(scene, section.path, row));
    }
  }
  inOrder(found, [...LEADING, "structure", "nodes", "bodies", "contacts", "dampers", "loads"]);
  inOrder(found.structure, [...LEADING, "axis", "stiffness_proportional_damping", "loss_factor", "damping_ratio", "masses", "springs", "dampers"]);
  return found;
}

function inOrder(row, keys) {
  const place = (key) => (keys.includes(key) ? keys.indexOf(key) : keys.length);
  const entries = Object.entries(row).sort(([a], [b]) => place(a) - place(b));
  for (const [key] of entries) delete row[key];
  Object.assign(row, Object.fromEntries(entries));
}
