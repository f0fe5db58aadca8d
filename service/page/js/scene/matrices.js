// Matrices of a finite-element program become a scene: files in, what was read, what is needed, the editor.

import { Problem, post, request } from "../network/api.js";
import { button, byId, details, el, facts, onFiles, onSubmit, refocus, say, show } from "../base/dom.js";
import { edit } from "../editor/editor.js";
import { on } from "../base/state.js";
import { hertz, measured, number } from "../base/format.js";
import { matrixFiles } from "./files.js";
import { joined, matrixForm } from "./matrix_form.js";

const MOST_SUFFIXES = 4;
let files = null;
let form = null;
let turn = 0;
let made = null;

export function openMatrices(given = []) {
  const panel = byId("matrices");
  if (!files) build(panel);
  panel.hidden = false;
  if (given.length) files.add(given);
  else byId("matrix-choose").focus();
  panel.scrollIntoView({ block: "nearest" });
}

// The panel has done its part once its scene is used.
on("scene-stored", (name) => {
  if (name === made) byId("matrices").hidden = true;
});

function close() {
  byId("matrices").hidden = true;
  refocus("open-matrices");
}

// What can be read, as the service says.
async function formats(input) {
  try {
    const { items } = await request("/v1/matrices/formats");
    input.accept = items.flatMap(({ suffixes }) => suffixes).join();
    show(byId("matrix-formats"), facts(items.map(({ name, suffixes, help }) => [name, `${help} (${suffixes.slice(0, MOST_SUFFIXES).join(", ")}${suffixes.length > MOST_SUFFIXES ? ", …" : ""})`])));
  } catch (error) {
    if (!(error instanceof Problem)) throw error;
    show(byId("matrix-formats"), el("p", { class: "bad" }, error.message));
  }
}

function build(panel) {
  const input = el("input", { type: "file", id: "matrix-input", class: "unseen", multiple: true, tabindex: -1, "aria-label": "Files of matrices" });
  const list = el("ul", { class: "plain", id: "matrix-files" });
  const rest = el("form", { novalidate: true, id: "matrix-form", hidden: true });
  const fields = el("div");
  onFiles(input, (given) => files.add(given));
  show(panel,
    el("fieldset", { id: "matrix-drop" }, el("legend", {}, "Files of matrices"),
      el("div", { class: "row" }, button("Choose files…", () => input.click(), { id: "matrix-choose" }), input,
        el("span", {}, "or drop them here: mass and stiffness; damping, the names of the rows, and the deck of a sector of a disk if there are such.")),
      details("Which files?", el("div", { id: "matrix-formats" })),
      list, el("p", { id: "matrix-status", class: "status", role: "status" }), el("div", { id: "matrix-report" })),
    rest, el("div", { class: "row" }, button("Close", close)));
  show(rest, fields, el("div", { class: "row" }, el("button", { type: "submit", class: "main-button" }, "Make the scene"), el("p", { id: "matrix-made", role: "status" })));
  files = matrixFiles(list, arrived);
  form = matrixForm(fields, { onUnits: () => arrived(false) });
  formats(input);
  onSubmit(rest, make);
}

// Looks at what was sent: anew, or with what each file is as chosen.
async function arrived(anew) {
  const mine = (turn += 1);
  const ids = files.ids();
  if (!ids.length) {
    byId("matrix-form").hidden = true;
    show(byId("matrix-report"));
    return say("matrix-status", files.broken() ? "No file could be read; each says why." : "", files.broken());
  }
  const units = form.units();
  const chosen = files.structure();
  say("matrix-status", "The files are being looked at …");
  try {
    const body = anew ? { uploads: ids } : { structure: { ...chosen, units } };
    let found = await post("/v1/matrices", body);
    if (anew && units !== "SI") found = await post("/v1/matrices", { structure: { ...found.structure, units } });
    if (mine !== turn) return undefined;
    if (anew) files.take(found.structure);
    files.blame([]);
    report(found);
    form.learn(found, files.first());
    byId("matrix-form").hidden = false;
  } catch (error) {
    if (mine !== turn) return undefined;
    show(byId("matrix-report"));
    refused(error, "matrix-status");
  }
  return undefined;
}

function report(found) {
  const [what] = found.diameters ? [`A sector of ${found.rows} coordinates at the nodal diameters ${found.diameters.join(", ")}`] : found.modes ? [`${found.modes} modes of ${found.rows} rows`] : [`${found.matrices.map(({ name }) => name).join(", ")} with ${found.rows} rows`];
  say("matrix-status", found.diameters ? `${what} was read.` : `${what} were read and fit together.`);
  const { labels, mass, frequencies_hz: hz, reduction } = found;
  const rows = [
    ...found.matrices.map(({ name, rows: n, entries }) => [name, `${n} × ${n}, ${entries} entries`]),
    ["rows", labels ? `named: nodes ${labels.nodes[0]} to ${labels.nodes[1]}, ${labels.components.join(", ")}` : "not named by the files"],
    ...(mass ? [["mass", `${measured(mass.kg, "kg")} in ${mass.direction}, without what is held`]] : []),
    ["first frequencies", hz ? `${hz.slice(0, 6).map((f) => number(f)).join(", ")} Hz, without contacts` : "known once the model is reduced"],
    ...(found.sets ? [["sets of the deck", found.sets.map(({ name, nodes }) => `${name} (${nodes} nodes)`).join(", ") || "none"]] : []),
    ...(reduction ? [["reduced to", `${Object.keys(found.scene.structure.dofs).length} DOFs and ${reduction.modes} modes${reduction.diameters ? ` at each of ${reduction.diameters.length} nodal diameters` : ""} up to ${hertz(reduction.highest_hz)}`],
      ["good to", `${hertz(reduction.good_to_hz)}: frequencies up to there are exact to 0.1 %; the harmonics that matter should lie below`]] : []),
  ];
  const notes = found.notes.length ? el("ul", { class: "issues", "aria-label": "What looks wrong" }, found.notes.map((note) => el("li", {}, note))) : null;
  show(byId("matrix-report"), notes, facts(rows));
}

async function make() {
  const missing = form.missing();
  if (missing.length) {
    form.blame(missing);
    return say("matrix-made", "Some DOFs have no place yet.", true);
  }
  say("matrix-made", "The scene is being made …");
  try {
    const found = await post("/v1/matrices", { structure: joined(files.structure(), form.structure()), ...form.asked() });
    form.blame([]);
    report(found);
    say("matrix-made", "The scene is below: its contacts begin as stiff as the structure is where they act, under a load of the size of the force.");
    made = found.scene.name;
    edit(found.scene);
  } catch (error) {
    refused(error, "matrix-made");
  }
  return undefined;
}

// What is wrong goes beside the file or the field it is about, the rest into the status `id`.
function refused(error, id) {
  const issues = error instanceof Problem ? error.errors : [];
  const left = form.blame(files.blame(issues));
  const words = left.map(({ detail }) => detail).join(" ");
  if (!issues.length) say(id, error.message, true);
  else say(id, words || "Something does not fit; it is said beside its field.", true);
}
