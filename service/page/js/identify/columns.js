// Exports of rigs as they stand: raw headings, below each what it is and in which unit, the first rows, then read.

import { button as buttonOf, el, note, onSubmit, options, scrolled, show } from "../base/dom.js";

const KEPT = "stickslip-columns";
const SEPARATORS = { ";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars" };
const SIZES = ["amplitude", "max_abs", "half_peak_to_peak"];

const kept = () => JSON.parse(localStorage.getItem(KEPT) ?? "{}");

const nameOf = ({ columns }) => columns.map(({ heading }) => heading).join("\u0000");

// One export after the other in `host`; `read(layout, columns)` says whether nothing was wrong with it.
export function askColumns(host, layouts, quantities, read) {
  const [layout, ...rest] = layouts;
  if (!layout) return show(host);
  const next = () => askColumns(host, rest, quantities, read);
  const before = kept()[nameOf(layout)];
  const units = new Map(quantities.map(({ name, units: each }) => [name, each]));
  const chosen = layout.columns.map((column) => ({ heading: column.heading, ...(before?.[column.heading] ?? { quantity: column.quantity, unit: column.unit }) }));
  const status = el("p", { class: "note", role: "status" });
  const button = el("button", { type: "submit", class: "main-button" }, `Read ${layout.rows} rows`);
  const heads = layout.columns.map(() => el("th", { scope: "col" }));
  const cells = layout.columns[0].cells.map((_, row) => layout.columns.map((column) => el("td", { class: "number" }, column.cells[row])));
  const command = el("code", {});
  const form = el("form", { class: "columns", "aria-label": `Columns of ${layout.name}` },
    el("h3", {}, layout.name), note(`${SEPARATORS[layout.separator]} between, decimal ${layout.decimal === "," ? "commas" : "points"}, headings in line ${layout.head_line}, ${layout.rows} rows. `,
      before ? el("span", { class: "chip good" }, "as last time") : null),
    scrolled(`First rows of ${layout.name}`, el("table", {}, el("thead", {}, el("tr", {}, heads)), el("tbody", {}, cells.map((row) => el("tr", {}, row))))),
    status, note("The same from the command: ", command), el("div", { class: "row" }, button, buttonOf("Leave the file out", next)));

  function head(i) {
    const { heading, quantity, unit } = chosen[i];
    // A unit of the heading that is not in the list, such as mm/lbf or g rms, is offered too: another would scale the data.
    const its = layout.columns[i].quantity === quantity ? layout.columns[i].unit : null;
    const of = [...new Set([...(its ? [its] : []), ...(units.get(quantity) ?? [])])];
    if (quantity && of.length && !of.includes(unit)) chosen[i].unit = of[0];
    const what = el("select", { "aria-label": `${heading} is` }, el("option", { value: "" }, "leave out"), quantities.map(({ name, words }) => el("option", { value: name, title: words, selected: name === quantity }, name)));
    const unitOf = el("select", { "aria-label": `Unit of ${heading}`, disabled: !of.length }, of.length ? [] : el("option", { value: "" }, "–"), options(of, chosen[i].unit));
    what.addEventListener("change", () => {
      chosen[i] = { heading, quantity: what.value, unit: layout.columns[i].unit ?? unit };
      draw();
      heads[i].querySelector("select").focus();
    });
    unitOf.addEventListener("change", () => { chosen[i].unit = unitOf.value || null; draw(); });
    show(heads[i], el("div", {}, heading), what, unitOf);
  }

  function draw() {
    chosen.forEach((_, i) => head(i));
    for (const row of cells) row.forEach((cell, i) => cell.classList.toggle("left-out", !chosen[i].quantity));
    const used = chosen.filter(({ quantity }) => quantity);
    const size = used.find(({ quantity }) => SIZES.includes(quantity));
    const left = chosen.length - used.length;
    button.disabled = !used.length;
    status.textContent = [left ? `${left} column${left > 1 ? "s are" : " is"} left out.` : "", size ? `Is ${size.heading} the largest displacement (max_abs) or the first harmonic (amplitude)? A wrong one shifts what is identified; it is read as ${size.quantity}.` : ""].filter(Boolean).join(" ");
    command.textContent = used.map(({ heading, quantity, unit }) => `--column "${heading}=${quantity}${unit ? `:${unit}` : ""}"`).join(" ");
  }

  onSubmit(form, async () => {
    const columns = Object.fromEntries(chosen.filter(({ quantity }) => quantity).map(({ heading, quantity, unit }) => [heading, { quantity, unit }]));
    if (!(await read(layout, columns))) return;
    localStorage.setItem(KEPT, JSON.stringify({ ...kept(), [nameOf(layout)]: Object.fromEntries(chosen.map(({ heading, quantity, unit }) => [heading, { quantity, unit }])) }));
    next();
  });
  draw();
  show(host, form);
  form.querySelector("select").focus();
  return undefined;
}
