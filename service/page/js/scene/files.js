// Files of matrices: sent to the service one by one, each with what it is and what is wrong beside it; a scene file with
// those it refers to: all chosen at once, a folder that is dropped, or one after the other.

import { button, byId, el, onFiles, options, show } from "../base/dom.js";
import { openText } from "../editor/editor.js";
import { Problem, request, sent } from "../network/api.js";

const SCENES = /\.(toml|json)$/i;
const ROLES = { M: "the mass matrix M", K: "the stiffness matrix K", C: "the damping matrix C", mapping: "the names of the rows", nodes: "the deck: places and sets of nodes", diameters: "a reduced sector of a disk", modes: "modes", "": "not used" };
const LONGEST_NAME = 200;

// The name as the service takes it: letters, digits and what is usual between them.
const plainName = (name) => name.replaceAll(/[^A-Za-z0-9_.\- ]/g, "_").replace(/^[^A-Za-z0-9_]+/, "").slice(-LONGEST_NAME) || "matrices";
const size = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toPrecision(3)} MB`);

// Stores a file, a large one in parts; one that is too large is not sent at all.
async function uploaded(file, name, onProgress = () => undefined) {
  const { most_bytes: most, most_parts: parts } = await request("/v1/matrices/formats");
  if (file.size > most * parts) {
    throw new Error(`It has ${size(file.size)}, the service takes ${size(most * parts)}: raise STICKSLIP_MAX_UPLOAD_BYTES or STICKSLIP_MAX_UPLOAD_PARTS there, or reduce the model first, stickslip import ${file.name} --reduce.`);
  }
  const address = `/v1/uploads?name=${encodeURIComponent(plainName(name))}`;
  if (file.size <= most) return sent(address, file, onProgress);
  const ids = [];
  for (let at = 0; at < file.size; at += most) {
    const part = file.slice(at, at + most);
    const { id } = await sent(`${address}&format=part`, part, (share) => onProgress((at + share * part.size) / file.size));
    ids.push(`&part=${id}`);
  }
  return sent(address + ids.join(""), null, () => undefined);
}

// The files of one model. `changed` is told when what was sent, or what a file is, changed.
export function matrixFiles(host, changed) {
  let files = [];
  let count = 0;

  async function add(list) {
    const fresh = [...list].map((file) => ({ key: (count += 1), file, name: plainName(file.name), id: null, roles: [], words: "is being sent …", error: "" }));
    files = [...files.filter((old) => !fresh.some(({ name }) => name === old.name)), ...fresh];
    draw();
    await Promise.all(fresh.map(send));
    draw();
    changed(true);
  }

  async function send(entry) {
    try {
      const found = await uploaded(entry.file, entry.name, (share) => {
        const words = byId(`matrix-file-${entry.key}-words`);
        if (words) words.textContent = `${Math.round(100 * share)} % is sent, then it is read …`;
      });
      entry.id = found.id;
      entry.words = found.contents.map(contentsOf).join("; ");
    } catch (error) {
      entry.words = "";
      entry.error = error instanceof Problem && error.errors.some(({ pointer }) => pointer === "/format")
        ? "Its suffix tells no format that can be read: give it the one of its program."
        : error.message;
    }
  }

  const contentsOf = ({ name, rows, columns, entries }) =>
    (name === "mapping" ? `names ${rows} rows` : name === "nodes" ? `${rows} nodes` : name === "diameters" ? `${rows} coordinates at ${columns} nodal diameters` : name === "modes" ? `${columns} modes of ${rows} rows` : `${name ? `${name}: ` : ""}${rows} × ${columns}, ${entries} entries`);

  function draw() {
    const focus = document.activeElement?.id;
    show(host, files.map(row));
    if (focus) byId(focus)?.focus();
  }

  function row(entry) {
    const id = `matrix-file-${entry.key}`;
    const several = entry.roles.length > 1;
    const choices = several ? [[entry.roles.join(), `${entry.roles.join(" and ")} in one file`], ["", ROLES[""]]] : Object.entries(ROLES);
    const choose = el("select", { id, disabled: !entry.id, "aria-describedby": `${id}-words` },
      options(choices, entry.roles.join()));
    choose.addEventListener("change", () => {
      const roles = choose.value ? choose.value.split(",") : [];
      for (const other of files) if (other !== entry) other.roles = other.roles.filter((role) => !roles.includes(role));
      entry.roles = roles;
      draw();
      changed(false);
    });
    const drop = button("Leave out", () => {
      files = files.filter((other) => other !== entry);
      draw();
      changed(true);
    }, { "aria-label": `Leave out ${entry.name}` });
    return el("li", { class: entry.error ? "matrix-file wrong" : "matrix-file" },
      el("label", { for: id }, `${entry.name} (${size(entry.file.size)}) is`), choose, drop,
      el("span", { id: `${id}-words`, class: entry.error ? "message" : "note" }, entry.error || entry.words));
  }

  return {
    add,
    ids: () => files.filter(({ id }) => id).map(({ id }) => id),
    // The keys of a structure that refer to the files.
    structure() {
      const { nodes, ...found } = Object.fromEntries(files.flatMap(({ id, roles }) => (id ? roles.map((role) => [role, `upload:${id}`]) : [])));
      return nodes ? { ...found, cyclic: { nodes } } : found;
    },
    take(structure) {
      const named = { ...structure, nodes: structure.cyclic?.nodes };
      for (const entry of files) entry.roles = Object.keys(ROLES).filter((role) => role && named[role] === `upload:${entry.id}`);
      draw();
    },
    // Says what is wrong beside the files it is about; returns what is about none of them.
    blame(issues) {
      for (const entry of files) if (entry.id) entry.error = "";
      const left = issues.filter(({ pointer, detail }) => {
        const [, top, key] = pointer.replace("/cyclic/nodes", "/nodes").split("/");
        const sent = files.filter(({ id }) => id);
        const entry = top === "uploads" ? sent[Number(key)] : top === "structure" ? files.find(({ roles }) => roles.includes(key)) : null;
        if (entry) entry.error = detail;
        return !entry;
      });
      draw();
      return left;
    },
    first: () => files[0]?.name ?? "",
    broken: () => files.some(({ id }) => !id),
  };
}

const REFERS = /^\s*(?:M|K|C|G|K_omega2|modes|mapping|diameters|nodes)\s*=\s*"(?!upload:)([^"\n]+)"|[{,]\s*nodes\s*=\s*"(?!upload:)([^"\n]+)"|"(?:M|K|C|G|K_omega2|modes|mapping|diameters|nodes)"\s*:\s*"(?!upload:)([^"\n]+)"/gm;
const ownName = (path) => path.split(/[\\/]/).pop();

export const sceneIn = (files) => files.find(({ name }) => SCENES.test(name));

// Opens a scene; what it refers to is stored first, what is not among `files` is asked for.
export async function openScene(file, files) {
  const text = await file.text();
  const wanted = [...new Set([...text.matchAll(REFERS)].map((found) => found.slice(1).find(Boolean)))];
  const missing = wanted.filter((path) => !files.some(({ name }) => name === ownName(path)));
  if (missing.length) return ask(missing.map(ownName), (more) => openScene(file, [...files, ...more]));
  const panel = byId("editor");
  let whole = text;
  for (const path of wanted) {
    panel.hidden = false;
    show(panel, el("p", { class: "note", role: "status" }, `${ownName(path)} is being sent …`));
    try {
      const { id } = await uploaded(files.find(({ name }) => name === ownName(path)), ownName(path), (share) => { panel.firstChild.textContent = `${ownName(path)}: ${Math.round(100 * share)} % is sent …`; });
      whole = whole.replaceAll(`"${path}"`, `"upload:${id}"`);
    } catch (error) {
      return show(panel, el("p", { class: "issues", role: "alert" }, `${ownName(path)}: ${error.message}`), closing(panel));
    }
  }
  return openText(whole, file.name.toLowerCase().endsWith(".json") ? "json" : "toml");
}

const closing = (panel) => button("Close", () => { panel.hidden = true; });

function ask(names, take) {
  const panel = byId("editor");
  const input = el("input", { type: "file", multiple: true, class: "unseen", tabindex: -1, id: "scene-files", "aria-label": "Files that the scene refers to" });
  onFiles(input, take);
  panel.hidden = false;
  show(panel, el("p", { role: "status" }, `The scene refers to ${names.join(" and ")}: choose ${names.length > 1 ? "these" : "it"} too, or drop the folder with all of them.`), input,
    el("div", { class: "row" }, button("Choose files…", () => input.click(), { class: "main-button" }), closing(panel)));
  panel.querySelector("button").focus();
}
