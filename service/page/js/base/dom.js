// Elements without markup in strings: data reaches the document as text only.

const SVG = "http://www.w3.org/2000/svg";

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name in node && typeof value !== "string") node[name] = value;
    else node.setAttribute(name, value === true ? "" : String(value));
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

export const el = (tag, attributes = {}, ...children) =>
  filled(document.createElement(tag), attributes, children);

export const svg = (tag, attributes = {}, ...children) => {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null) continue;
    node.setAttribute(name, String(value));
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
};

export const byId = (id) => document.getElementById(id);

export function show(node, ...children) {
  node.replaceChildren(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
}

export function say(id, text, bad = false) {
  const node = byId(id);
  if (node.textContent !== text) node.textContent = text;
  node.classList.toggle("bad", bad);
}

// Files that are dropped on a card: it is marked while they are over it, and takes them alone.
export function dropsOn(card, take) {
  const over = (event, on) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    event.stopPropagation();
    card.classList.toggle("dropping", on);
  };
  card.addEventListener("dragover", (event) => over(event, true));
  card.addEventListener("dragleave", (event) => over(event, false));
  card.addEventListener("drop", (event) => {
    over(event, false);
    take(event.dataTransfer);
  });
}

export const facts = (pairs) =>
  el("dl", { class: "facts" }, pairs.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));

export function table(headings, rows, caption) {
  const cell = (tag, item) => {
    const entry = item !== null && typeof item === "object" && !(item instanceof Node) ? item : { text: item };
    const scope = tag === "th" ? { scope: "col" } : {};
    return el(tag, { ...scope, class: entry.number ? "number" : undefined, title: entry.title }, entry.text ?? "");
  };
  return el(
    "table",
    {},
    caption ? el("caption", { class: "unseen" }, caption) : null,
    el("thead", {}, el("tr", {}, headings.map((item) => cell("th", item)))),
    el("tbody", {}, rows.map((row) => el("tr", {}, row.map((item) => cell("td", item))))),
  );
}
