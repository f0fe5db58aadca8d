// Elements without markup in strings: data reaches the document as text only.

const SVG = "http://www.w3.org/2000/svg";
const present = (children) => children.flat(Infinity).filter((child) => child !== null && child !== undefined);

export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name in node && typeof value !== "string") node[name] = value;
    else node.setAttribute(name, value === true ? "" : String(value));
  }
  node.append(...present(children));
  return node;
}

export function svg(tag, attributes = {}, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== undefined && value !== null) node.setAttribute(name, String(value));
  node.append(...present(children));
  return node;
}

export const byId = (id) => document.getElementById(id);
export const show = (node, ...children) => node.replaceChildren(...present(children));

// Shows anew what has the focus: it stays where it was, by `data-focus`.
export function redrawn(host, ...children) {
  const focused = host.contains(document.activeElement) ? document.activeElement.dataset.focus : null;
  show(host, ...children);
  if (focused) host.querySelector(`[data-focus="${focused}"]`)?.focus();
}

// Gives the focus back to what was pressed, or where that is folded away to the content.
export const refocus = (id) => (byId(id).checkVisibility() ? byId(id) : byId("main")).focus();

export function say(id, text, bad = false) {
  const node = byId(id);
  if (node.textContent !== text) node.textContent = text;
  node.classList.toggle("bad", bad);
}

// What stands in many places of the page.
export const button = (words, onclick, more = {}) => el("button", { type: "button", onclick, ...more }, words);
export const note = (...words) => el("p", { class: "note" }, ...words);
export const bad = (words) => el("span", { class: "bad" }, words);
export const titled = (words, ...parts) => el("div", {}, el("h3", {}, words), parts);
export const details = (words, ...content) => el("details", {}, el("summary", {}, words), ...content);
export const scrolled = (label, node, more = "") => el("div", { class: `scroll ${more}`.trim(), role: "region", "aria-label": label, tabindex: 0 }, node);

// Options by their values, or as [value, words].
export const options = (list, chosen) => list.map((each) => {
  const [value, words = value] = [each].flat();
  return el("option", { value, selected: value === chosen }, words);
});

// A form does what it is for in the page; a choice of files is taken, and may be made again.
export const onSubmit = (form, act) => form.addEventListener("submit", (event) => {
  event.preventDefault();
  act();
});

export const onFiles = (input, take) => input.addEventListener("change", () => {
  const given = [...input.files];
  input.value = "";
  if (given.length) take(given);
});

// Every file of what was dropped, those in folders too.
async function filesOf(transfer) {
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

// Files that are dropped on a card: it is marked while they are over it, and takes them alone, when they are known.
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
    take(filesOf(event.dataTransfer));
  });
}

export const facts = (pairs) =>
  el("dl", { class: "facts" }, pairs.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));

export const numeric = (text) => ({ text, number: true });

export function table(headings, rows, caption) {
  const cell = (tag, item) => {
    const entry = item !== null && typeof item === "object" && !(item instanceof Node) ? item : { text: item };
    const scope = tag === "th" ? { scope: "col" } : {};
    return el(tag, { ...scope, class: entry.class ?? (entry.number ? "number" : undefined), title: entry.title }, entry.text ?? "");
  };
  return el(
    "table",
    {},
    caption ? el("caption", { class: "unseen" }, caption) : null,
    el("thead", {}, el("tr", {}, headings.map((item) => cell("th", item)))),
    el("tbody", {}, rows.map((row) => el("tr", {}, row.map((item) => cell("td", item))))),
  );
}

export const scrolledTable = (label, headings, rows, { caption = label, more = "" } = {}) => scrolled(label, table(headings, rows, caption), more);
