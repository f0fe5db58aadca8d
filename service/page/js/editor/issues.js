// What is wrong with a scene: marked at the fields it is about, and listed with ways to field and line.

import { el } from "../base/dom.js";

// "/structure/springs/0/k" is "structure › springs 1 › k".
function placeOf(pointer) {
  const words = [];
  for (const part of pointer.split("/").slice(1)) {
    if (/^\d+$/.test(part) && words.length) words[words.length - 1] += ` ${Number(part) + 1}`;
    else words.push(part.replaceAll("~1", "/").replaceAll("~0", "~"));
  }
  return words.join(" › ") || "scene";
}

// The field an issue is about: its own, that around it, or the first one in it.
function fieldOf(fields, pointer) {
  if (!pointer) return null;
  const exact = fields.find((node) => node.dataset.pointer === pointer);
  if (exact?.matches("input, select")) return exact;
  const around = fields.filter((node) => node.matches("input, select") && pointer.startsWith(`${node.dataset.pointer}/`)).pop();
  if (around) return around;
  const inside = fields.find((node) => node.matches("input, select") && node.dataset.pointer.startsWith(`${pointer}/`));
  return inside ?? exact?.querySelector("input, select") ?? null;
}

export function markFields(host, issues) {
  for (const node of host.querySelectorAll(".message")) node.remove();
  for (const node of host.querySelectorAll("[aria-invalid]")) {
    node.removeAttribute("aria-invalid");
    node.removeAttribute("aria-describedby");
    delete node.dataset.issues;
  }
  for (const node of host.querySelectorAll(".wrong")) node.classList.remove("wrong");
  const fields = [...host.querySelectorAll("[data-pointer]")];
  for (const { pointer, detail } of issues) {
    const field = fieldOf(fields, pointer);
    if (!field) continue;
    const id = `${field.id}-message`;
    const before = document.getElementById(id);
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-describedby", id);
    field.dataset.issues = `${field.dataset.issues ?? ""} ${pointer}`.trim();
    const row = field.closest("tr");
    (row ?? field.closest(".field"))?.classList.add("wrong");
    if (before) before.append(` ${detail}`);
    else if (row) below(row, el("span", { id }, detail));
    else field.closest(".field")?.append(el("span", { class: "message", id }, detail));
  }
}

// A row of words under a row of fields.
function below(row, words) {
  const next = row.nextElementSibling;
  if (next?.classList.contains("message")) next.firstElementChild.append(words);
  else row.after(el("tr", { class: "message" }, el("td", { colspan: String(row.cells.length) }, words)));
}

export function issueList(issues, go) {
  if (!issues.length) return null;
  return el("ul", { class: "issues issue-list", "aria-label": "What is wrong" }, issues.map((issue) => el("li", {},
    el("button", { type: "button", class: "link", onclick: () => go(issue) }, `${placeOf(issue.pointer)}${issue.line ? `, line ${issue.line}` : ""}`), ` ${issue.detail}`)));
}
