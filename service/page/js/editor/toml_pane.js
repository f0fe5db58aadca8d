// The text of the scene: numbered lines in colours behind a text field, with what is wrong marked at its line.

import { el, show } from "../base/dom.js";

const MOST_COLOURED = 60_000;
const TOKENS = /(#.*$)|("(?:[^"\\]|\\.)*"|'[^']*')|((?:^\s*|[{,]\s*)[A-Za-z0-9_."-]+(?=\s*=))|\b(true|false)\b|([+-]?\b\d[\d_]*(?:\.\d+)?(?:e[+-]?\d+)?\b)/gi;
const CLASSES = ["", "toml-comment", "toml-text", "toml-key", "toml-number", "toml-number"];

function coloured(line) {
  if (/^\s*\[\[?[^[\]]+\]\]?\s*(#.*)?$/.test(line)) return [el("span", { class: "toml-head" }, line)];
  const parts = [];
  let at = 0;
  for (const found of line.matchAll(TOKENS)) {
    const kind = found.slice(1).findIndex((part) => part !== undefined) + 1;
    parts.push(line.slice(at, found.index), el("span", { class: CLASSES[kind] }, found[0]));
    at = found.index + found[0].length;
  }
  return [...parts, line.slice(at)];
}

export function tomlPane(host, told) {
  const shade = el("pre", { class: "toml-lines", "aria-hidden": "true" });
  const field = el("textarea", { id: "editor-toml", class: "toml-field", spellcheck: false, autocomplete: "off", wrap: "off", "aria-label": "The scene as TOML", "aria-describedby": "editor-toml-wrong" });
  field.setAttribute("autocapitalize", "off");
  const wrong = el("div", { id: "editor-toml-wrong" });
  let marks = new Map();

  show(host, el("div", { class: "toml" }, shade, field), wrong);
  field.addEventListener("input", () => {
    marks = new Map();
    draw();
    told(field.value);
  });
  field.addEventListener("scroll", follow);

  function follow() {
    shade.scrollTop = field.scrollTop;
    shade.scrollLeft = field.scrollLeft;
  }

  function draw() {
    const lines = field.value.split("\n");
    const plain = field.value.length > MOST_COLOURED;
    show(shade, lines.map((line, i) => el("span", { class: marks.has(i + 1) ? "toml-line wrong" : "toml-line" }, plain ? line : coloured(line))));
    host.style.setProperty("--digits", String(String(lines.length).length));
    follow();
  }

  return {
    field,
    set(text) {
      if (field.value === text) return draw();
      const { scrollTop, scrollLeft } = field;
      field.value = text;
      Object.assign(field, { scrollTop, scrollLeft });
      return draw();
    },
    // Marks lines; what makes the text unreadable is said below it.
    mark(issues, unreadable) {
      marks = new Map(issues.map(({ line, detail }) => [line, detail]));
      if (issues.length) field.setAttribute("aria-invalid", "true");
      else field.removeAttribute("aria-invalid");
      const [first] = issues;
      show(wrong, unreadable ? el("p", { class: "issues", role: "alert" }, `The file cannot be read: ${first.detail}`, " ", el("button", { type: "button", class: "link", onclick: () => this.go(first.line, first.column) }, `Line ${first.line}`)) : null);
      draw();
    },
    // Puts the cursor at a place and shows it.
    go(line, column = 1, focus = true) {
      const lines = field.value.split("\n");
      const at = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0) + Math.max((column ?? 1) - 1, 0);
      if (focus) {
        field.focus();
        field.setSelectionRange(at, at);
      }
      const height = field.scrollHeight / Math.max(lines.length, 1);
      if (field.scrollTop > (line - 2) * height || field.scrollTop + field.clientHeight < (line + 1) * height) field.scrollTop = (line - 1) * height - field.clientHeight / 3;
      follow();
    },
  };
}
