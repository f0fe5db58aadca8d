// A scene file with the files of matrices it refers to: all chosen at once, a folder that is dropped, or one after the other.

import { byId, el, show } from "../base/dom.js";
import { openText } from "../editor/editor.js";
import { SCENES, uploaded } from "./matrix_files.js";

const REFERS = /^\s*(?:M|K|C|G|K_omega2|modes|mapping|diameters|nodes)\s*=\s*"(?!upload:)([^"\n]+)"|[{,]\s*nodes\s*=\s*"(?!upload:)([^"\n]+)"|"(?:M|K|C|G|K_omega2|modes|mapping|diameters|nodes)"\s*:\s*"(?!upload:)([^"\n]+)"/gm;

const ownName = (path) => path.split(/[\\/]/).pop();

// Every file of what was dropped, those in folders too.
export async function filesOf(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some(({ isDirectory }) => isDirectory)) return [...transfer.files];
  const inside = async (entry) => {
    if (entry.isFile) return [await new Promise((resolve, reject) => { entry.file(resolve, reject); })];
    const reader = entry.createReader();
    const found = [];
    for (;;) {
      const some = await new Promise((resolve, reject) => { reader.readEntries(resolve, reject); });
      if (!some.length) return (await Promise.all(found.map(inside))).flat();
      found.push(...some);
    }
  };
  return (await Promise.all(entries.map(inside))).flat();
}

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
      return show(panel, el("p", { class: "issues", role: "alert" }, `${ownName(path)}: ${error.message}`), el("button", { type: "button", onclick: () => { panel.hidden = true; } }, "Close"));
    }
  }
  return openText(whole, file.name.toLowerCase().endsWith(".json") ? "json" : "toml");
}

function ask(names, take) {
  const panel = byId("editor");
  const input = el("input", { type: "file", multiple: true, class: "unseen", tabindex: -1, id: "scene-files", "aria-label": "Files that the scene refers to" });
  input.addEventListener("change", () => input.files.length && take([...input.files]));
  panel.hidden = false;
  show(panel, el("p", { role: "status" }, `The scene refers to ${names.join(" and ")}: choose ${names.length > 1 ? "these" : "it"} too, or drop the folder with all of them.`), input,
    el("div", { class: "row" }, el("button", { type: "button", class: "main-button", onclick: () => input.click() }, "Choose files…"), el("button", { type: "button", onclick: () => { panel.hidden = true; } }, "Close")));
  panel.querySelector("button").focus();
}
