// Studies of kinds that have no view of their own: a form made of the schema of their body, any result as a table,
// and the drawings of those that have some.

import { on, state } from "../base/state.js";
import { button, byId, details, el, facts, numeric, options, say, scrolledTable, show, titled } from "../base/dom.js";
import { saveText } from "../base/exports.js";
import { notes, number } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { schemaForm } from "../forms/form.js";
import { resume, run } from "../network/jobs.js";
import { askedFor, kindNames, kindOf, ofTheBar, proposed, refusedFor } from "../scene/kinds.js";
import { hasOwnView, viewOf } from "../views.js";
import { view } from "./view.js";

const ROWS = 200;
const forms = new Map();

const others = () => kindNames().filter((name) => !hasOwnView(name));

export function startOthers() {
  byId("others-kind").addEventListener("change", choose);
  on("kinds", () => {
    byId("others").hidden = !others().length;
    show(byId("others-kind"), options(others()));
  });
  on("scene", () => {
    say("others-status", "");
    show(byId("others-result"));
    for (const [name, { form }] of forms) form.fill({ ...proposed(name), ...ofTheBar(name) });
    const asked = others().find((name) => state.jobs[name]);
    if (others().length) choose();
    // Goes on with the job that the address names.
    if (asked) showOther(asked);
  });
}

// A job of a kind without a view of its own: its form as it was asked, its result as a table.
export function showOther(name) {
  byId("others-kind").value = name;
  choose();
  byId("others").scrollIntoView({ block: "nearest" });
  return resume(name, { ...othersView(name), submitted: (job) => forms.get(name).form.fill(job.request) });
}

// The form of the study that is chosen, as it was left.
function choose() {
  const name = byId("others-kind").value;
  byId("others-summary").textContent = kindOf(name).summary;
  if (!forms.has(name)) {
    const host = el("form", { id: "others-form", novalidate: true });
    const form = schemaForm(host, name, { id: "others", words: "Submit", submit: (body) => run(name, { ...askedFor(name), ...body }, othersView(name), 3) });
    form.fill({ ...proposed(name), ...ofTheBar(name) });
    forms.set(name, { host, form });
  }
  show(byId("others-fields"), forms.get(name).host);
  byId("others-submit").disabled = refusedFor(name) !== "";
  say("others-status", refusedFor(name));
}

const plain = (value) => (Array.isArray(value) ? !value.some((one) => typeof one === "object") : typeof value !== "object");

// Any study without a view of its own, by its name.
const othersView = (name) => {
  const self = view({ id: "others", goes: ({ took }) => `${name}:${took}.` });
  return Object.assign(self, {
    waiting() {
      self.say(`${name} waits for a worker.`);
      show(byId("others-result"));
    },
    result(result, sweeps) {
      self.say(sweeps.length ? `${name} is done; its sweeps are stored with it.` : `${name} is done.`);
      const drawings = viewOf(name)?.drawings(result) ?? [];
      const figures = drawings.map(() => el("div", { class: "figure" }));
      show(byId("others-result"), ...drawings.map(({ label }, i) => titled(label, figures[i])), facts([...scalars(result), ...notes({ notes: result.notes })]), columns(result),
        button("Save as JSON", () => saveText(JSON.stringify(result, null, 1), `${name}.json`, "application/json")));
      // Drawn where they stand: a chart is as wide as its place.
      drawings.forEach(({ label, file, draw }, i) => chart(figures[i], { label, file }).draw(draw));
    },
    failed(words, errors) {
      self.say(words, true);
      forms.get(name)?.form.complain(errors);
    },
  });
};

const worded = (value) => (typeof value === "number" ? number(value, 6) : value === null ? "–" : typeof value === "boolean" ? (value ? "yes" : "no") : String(value));

function scalars(item, before = "") {
  return Object.entries(item).flatMap(([key, value]) => {
    if (Array.isArray(value)) return plain(value) && value.length <= 6 ? [[before + key, value.map(worded).join(", ")]] : [[before + key, `${value.length} values`]];
    return value !== null && typeof value === "object" ? scalars(value, `${before}${key}.`) : [[before + key, worded(value)]];
  });
}

// Lists of numbers of the same length, side by side.
function columns(result) {
  const lists = Object.entries(result).filter(([, value]) => Array.isArray(value) && value.length > 6 && value.every((one) => one === null || typeof one === "number"));
  const longest = Math.max(0, ...lists.map(([, value]) => value.length));
  const same = lists.filter(([, value]) => value.length === longest);
  if (!same.length) return null;
  const rows = Array.from({ length: Math.min(longest, ROWS) }, (_, i) => same.map(([, value]) => numeric(worded(value[i]))));
  return details(`Numbers${longest > ROWS ? `, the first ${ROWS}` : ""}`, scrolledTable("Numbers of the result", same.map(([name]) => numeric(name)), rows, { caption: "Numbers" }));
}
