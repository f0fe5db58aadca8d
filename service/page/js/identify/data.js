// Measured data of the page: files that were chosen, dropped or pasted, read by the service against the scene; of exports of
// rigs first what stands below each raw heading and in which unit, with the first rows.

import { button, byId, details, dropsOn, el, note, onFiles, onSubmit, options, scrolled, show, table } from "../base/dom.js";
import { number, valuesSaid } from "../base/format.js";
import { on } from "../base/state.js";
import { patiently, post, Problem } from "../network/api.js";
import { asked } from "../scene/scenes.js";

const PASTED = "pasted";
let files = [];
let changed = () => undefined;

// Files to be chosen or dropped, or a table to be pasted; what was read, and what is wrong with it.
export const dataPart = () => el("fieldset", { id: "identify-data" }, el("legend", {}, "Measured data"),
  el("div", { class: "row" }, button("Choose files…", () => byId("identify-file").click(), { id: "identify-open" }),
    el("input", { type: "file", id: "identify-file", class: "unseen", multiple: true, accept: ".csv,.tsv,.txt", "aria-label": "Files of measured data, CSV", tabindex: "-1" }),
    el("span", { class: "note" }, "CSV at one or several levels; files may be dropped here too.")),
  el("div", { id: "identify-files" }), el("div", { id: "identify-columns" }),
  details("Paste a table", el("label", { for: "identify-paste" }, "Rows of CSV under a line of column heads"),
    el("textarea", { id: "identify-paste", rows: 6, spellcheck: "false", placeholder: "# damper.N0 = 100\nfrequency [Hz],amplitude [mm],phase [deg]\n1.00,1930,-12" }),
    el("div", { class: "row tight" }, button("Take it", paste, { id: "identify-paste-take" }))),
  el("div", { id: "identify-data-wrong", class: "scroll", role: "alert" }));

export function startData(onChange) {
  changed = onChange;
  onFiles(byId("identify-file"), takeFiles);
  dropsOn(byId("identify-data"), (given) => given.then(takeFiles));
  on("rig-files", takeFiles);
}

async function paste() {
  const field = byId("identify-paste");
  if (field.value.trim() && await take([{ name: fresh(PASTED), text: field.value }])) field.value = "";
}

// A name that no other file has.
function fresh(name) {
  for (let i = 1; ; i += 1) {
    const wanted = i === 1 ? name : `${name} ${i}`;
    if (!files.some((file) => file.name === wanted)) return wanted;
  }
}

// Text in UTF-8 or UTF-16 (a byte order mark, or every other byte zero), else in the code page of western Windows.
async function textOf(file) {
  const bytes = await file.arrayBuffer();
  const first = new Uint8Array(bytes.slice(0, 4096));
  const zeros = (from) => first.filter((byte, i) => i % 2 === from && byte === 0).length > first.length / 4;
  for (const [name, low, high, from] of [["utf-16le", 0xff, 0xfe, 1], ["utf-16be", 0xfe, 0xff, 0]]) {
    if (first[0] === low && first[1] === high || zeros(from)) return new TextDecoder(name).decode(bytes);
  }
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder("windows-1252").decode(bytes);
  }
}

const takeFiles = async (list) => take(await Promise.all(list.map(async (file) => ({ name: file.name, text: await textOf(file) }))));

// Asks the service about texts; what it refuses is said beside the files. Null then.
async function asks(path, texts) {
  const { scene, set } = asked();
  try {
    return await patiently(() => post(path, { scene, set, files: texts }));
  } catch (error) {
    if (!(error instanceof Problem)) throw error;
    issues((error.errors?.length ? error.errors : [error]).map((each) => ({ file: texts.map(({ name }) => name).join(", "), line: null, column: null, detail: each.detail ?? each.message })));
    return null;
  }
}

// Reads texts whose headings are known; of an export is first said what its columns are. Whether nothing is wrong.
async function take(texts) {
  if (!texts.length) return true;
  const looked = await asks("/v1/measurements/look", texts);
  if (!looked) return false;
  const exports = looked.files.filter(({ known }) => !known);
  const plain = texts.filter(({ name }) => !exports.some((each) => each.name === name));
  const good = !plain.length || await readTexts(plain);
  askColumns(byId("identify-columns"), exports, looked.quantities, (layout, columns) => readTexts([{ ...texts.find(({ name }) => name === layout.name), columns }]));
  return good;
}

// Reads texts against the scene; what is wrong is said with file, line and column. Whether nothing is.
async function readTexts(texts) {
  const answer = await asks("/v1/measurements/read", texts);
  if (!answer) return false;
  for (const one of answer.files) {
    const text = texts.find(({ name }) => name === one.name)?.text;
    files = [...files.filter(({ name }) => name !== one.name), { ...one, text }];
  }
  issues(answer.issues);
  changed();
  return answer.issues.length === 0;
}

// Without the place, which has columns of its own.
const short = ({ file, line, column, detail }) => {
  const where = `${file}${line === null ? "" : `, line ${line}`}${column === null ? "" : `, \`${column}\``}: `;
  return detail.startsWith(where) ? detail.slice(where.length) : detail;
};

function issues(list) {
  const rows = list.map((issue) => [issue.file, issue.line ?? "–", issue.column ?? "–", short(issue)]);
  show(byId("identify-data-wrong"), list.length ? table(["file", "line", "column", "what is wrong"], rows.map((row) => row.map((text) => ({ text: String(text), class: "bad" }))), "What is wrong with the data") : null);
}

export function clearData() {
  files = [];
  show(byId("identify-columns"));
  issues([]);
  list();
}

export const tables = () => files.map(({ table }) => table);
export const sourceNames = () => files.map(({ name }) => name);
export const runsRead = () => files.flatMap(({ runs }) => runs);

// The data of a job that was asked before, as tables without their text.
export function fillData(data) {
  if (JSON.stringify(data) === JSON.stringify(tables())) return;
  files = data.map((table, i) => ({ name: `data ${i + 1}`, table, runs: [] }));
  list();
}

const conditionsOf = (runs) => [...new Set(runs.map(({ conditions }) => valuesSaid(conditions)))];

export function list() {
  show(byId("identify-files"), files.length ? el("ul", { class: "plain" }, files.map((file) => el("li", { class: "measured" },
    el("strong", {}, file.name),
    el("span", { class: "note" }, file.runs.length ? ` ${file.runs.length} run${file.runs.length > 1 ? "s" : ""}, ${number(file.runs.reduce((sum, run) => sum + run.points, 0))} points: ${conditionsOf(file.runs).join(" · ") || "as the scene has it"}` : " of the run that is shown"),
    button("×", () => {
      files = files.filter((each) => each !== file);
      changed();
    }, { "aria-label": `Remove ${file.name}` })))) : note("No data yet."));
}

const KEPT = "stickslip-columns";
const SEPARATORS = { ";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars" };
const SIZES = ["amplitude", "max_abs", "half_peak_to_peak"];
const kept = () => JSON.parse(localStorage.getItem(KEPT) ?? "{}");
const nameOf = ({ columns }) => columns.map(({ heading }) => heading).join("\u0000");

// One export after the other in `host`; `read(layout, columns)` says whether nothing was wrong with it.
function askColumns(host, layouts, quantities, read) {
  const [layout, ...rest] = layouts;
  if (!layout) return show(host);
  const next = () => askColumns(host, rest, quantities, read);
  const before = kept()[nameOf(layout)];
  const units = new Map(quantities.map(({ name, units: each }) => [name, each]));
  const chosen = layout.columns.map((column) => ({ heading: column.heading, ...(before?.[column.heading] ?? { quantity: column.quantity, unit: column.unit }) }));
  const status = el("p", { class: "note", role: "status" });
  const submit = el("button", { type: "submit", class: "main-button" }, `Read ${layout.rows} rows`);
  const heads = layout.columns.map(() => el("th", { scope: "col" }));
  const cells = layout.columns[0].cells.map((_, row) => layout.columns.map((column) => el("td", { class: "number" }, column.cells[row])));
  const command = el("code", {});
  const form = el("form", { class: "columns", "aria-label": `Columns of ${layout.name}` },
    el("h3", {}, layout.name), note(`${SEPARATORS[layout.separator]} between, decimal ${layout.decimal === "," ? "commas" : "points"}, headings in line ${layout.head_line}, ${layout.rows} rows. `,
      before ? el("span", { class: "chip good" }, "as last time") : null),
    scrolled(`First rows of ${layout.name}`, el("table", {}, el("thead", {}, el("tr", {}, heads)), el("tbody", {}, cells.map((row) => el("tr", {}, row))))),
    status, note("The same from the command: ", command), el("div", { class: "row" }, submit, button("Leave the file out", next)));

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
    submit.disabled = !used.length;
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
