// What is said of a run: name, notes, tags, project; its results as a file; into the bin; its stored sweeps: what tells
// them apart, each loaded or taken as a file.

import { button, el, note, numeric, onSubmit, options, scrolledTable, show } from "../base/dom.js";
import { saveFrom } from "../base/exports.js";
import { length, number, quantity } from "../base/format.js";
import { tell } from "../base/state.js";
import { orNotice, patched, request } from "../network/api.js";
import { current } from "../scene/scenes.js";
import { load } from "../views/design.js";
import { projectsKnown, undoable } from "./projects.js";
import { isUnderWay, PINNED, PRESS } from "./run_list.js";

// Tags that say something to this page and nothing to people.
export const isHidden = (tag) => tag.startsWith(PRESS) || tag === PINNED;

export function runForm(run, title) {
  const field = (name, words, input) => [el("label", { for: `run-${name}-${run.id}` }, words), input];
  const input = (name, value) => el("input", { type: "text", id: `run-${name}-${run.id}`, name, value });
  const notes = el("textarea", { id: `run-notes-${run.id}`, name: "notes", rows: 3 }, run.notes);
  const project = el("select", { id: `run-project-${run.id}`, name: "project", onfocus: () => offer(project, project.value) });
  offer(project, run.project ?? "");
  const wrong = el("p", { class: "bad", role: "alert" });
  const form = el("form", { class: "run-form" },
    field("name", "Name", input("name", run.name)), field("notes", "Notes", notes),
    field("tags", "Tags, with commas", input("tags", run.tags.filter((tag) => !isHidden(tag)).join(", "))), field("project", "Project", project), wrong,
    el("div", { class: "row tight" }, el("button", { type: "submit" }, "Save"),
      button("JSON", () => saveFrom(`/v1/jobs/${run.id}/results`, "application/json", `${run.kind}-${run.id}.json`), { "aria-label": `Results of run ${title} as JSON` }),
      isUnderWay(run) ? null : button("Delete", () => remove(run, title), { "aria-label": `Delete run ${title}` })));
  onSubmit(form, () => save(run, form, wrong));
  return [form, run.sweeps ? sweepsOf(run, title) : null];
}

// The projects there are; the one it has stays chosen while they are not known yet.
function offer(select, chosen) {
  const known = projectsKnown();
  const own = !chosen || known.some(({ id }) => id === chosen) ? [] : [[chosen, "its project"]];
  show(select, options([["", "none"], ...own, ...known.map(({ id, name }) => [id, name])]));
  select.value = chosen;
}

async function save(run, form, wrong) {
  const given = new FormData(form);
  const body = {
    name: given.get("name").trim(), notes: given.get("notes"), project: given.get("project") || null,
    tags: [...given.get("tags").split(",").map((tag) => tag.trim()).filter(Boolean), ...run.tags.filter(isHidden)],
  };
  try {
    await patched(`/v1/runs/${run.id}`, run, body);
    document.activeElement?.blur();
    tell("runs-changed");
    tell("projects-changed");
  } catch (error) {
    wrong.textContent = error.status === 412 ? "Somebody changed this run meanwhile: close More and open it again." : error.message;
  }
}

const remove = (run, title) =>
  undoable(`Run “${title}” is in the bin.`, `/v1/runs/${run.id}`, () => tell("runs-changed"));

const MOST = 50;
const VALUES = ["N0", "N1", "kt", "mu"];
const FORMS = [["CSV", "text/csv", ""], ["npz", "application/x-npz", ""], ["Parquet", "application/vnd.apache.parquet", ""], ["SVG", "image/svg+xml", "/plot.svg"], ["PNG", "image/png", "/plot.png"]];

// The values that stayed fixed, as paths.
function fixedIn({ contacts, excitation_amplitude: force }) {
  const values = Object.fromEntries(Object.entries(contacts).flatMap(([name, contact]) => VALUES.filter((key) => contact[key] !== null).map((key) => [`${name}.${key}`, contact[key]])));
  return force === null ? values : { ...values, "excitation.amplitude": force };
}

// The loads, and whatever else is not the same in all of them.
function told(sweep, all) {
  const each = all.map((one) => ({ ...fixedIn(one), harmonics: one.harmonics }));
  const mine = { ...fixedIn(sweep), harmonics: sweep.harmonics };
  return Object.keys(mine).filter((path) => path.endsWith(".N0") || each.some((other) => other[path] !== mine[path])).map((path) => (path === "harmonics" ? `${mine[path]} harmonics` : `${path} ${quantity(path, mine[path])}`)).join(", ");
}

function sweepsOf(run, title) {
  const list = el("div", {}, note("…"));
  const node = el("details", {}, el("summary", { "aria-label": `Sweeps of run ${title}` }, `Its ${run.sweeps === 1 ? "sweep" : `${run.sweeps} sweeps`}`), list);
  node.addEventListener("toggle", async () => {
    if (!node.open) return;
    try {
      const { items, next } = await request(`/v1/sweeps?of=${run.id}&limit=${MOST}`);
      const heads = ["over", "values", ...["peak", "at", "band [Hz]", "points"].map(numeric), "take"];
      show(list, scrolledTable(`Sweeps of ${title}`, heads, items.map((sweep) => row(sweep, items)), { more: "run-sweeps" }), next ? note(`The first ${MOST} of ${run.sweeps}.`) : null);
    } catch (error) {
      show(list, el("p", { class: "bad" }, error.message));
    }
  });
  return node;
}

function row(sweep, all) {
  const name = `${sweep.scene}, ${told(sweep, all) || sweep.parameter}`;
  return [`${sweep.parameter} ${number(sweep.from)} … ${number(sweep.to)}`, told(sweep, all), numeric(sweep.peak ? length(sweep.peak.value) : "no peak"), numeric(sweep.peak ? quantity(sweep.parameter, sweep.peak.at) : ""),
    numeric(sweep.band_hz === null ? "–" : number(sweep.band_hz)), numeric(String(sweep.points)), actions(sweep, name)];
}

function actions(sweep, name) {
  const take = (words, act, about = `${words} of ${name}`) => button(words, act, { "aria-label": about });
  const file = ([words, type, below]) => take(words, () => saveFrom(`/v1/sweeps/${sweep.id}${below}`, type, `sweep-${sweep.id}.${words.toLowerCase()}`));
  return el("span", { class: "row tight" }, current.body?.name === sweep.scene ? take("Load", () => use(sweep), `Load ${name}`) : null,
    el("details", {}, el("summary", { "aria-label": `Files of ${name}` }, "Files"), el("span", { class: "row tight" }, FORMS.map(file), take("TOML", () => tomlOf(sweep)))));
}

const withoutSwept = (sweep) => Object.fromEntries(Object.entries(fixedIn(sweep)).filter(([path]) => path !== sweep.parameter));

// The values of a sweep with all that its job had set.
const use = (sweep) => orNotice(async () => {
  const { request: asked } = await request(`/v1/jobs/${sweep.job}`);
  load(withoutSwept(sweep), { scene: sweep.scene, set: asked.set });
});

// The scene of a sweep with its values, and the command that computes the same.
function tomlOf(sweep) {
  const file = `sweep-${sweep.id}.toml`;
  return orNotice(async () => {
    const job = await request(`/v1/jobs/${sweep.job}`);
    if (!["sweep", "design", "pareto"].includes(job.kind) || job.request.cases) {
      throw new Error(`this sweep is of a job of the kind ${job.kind}, which changes more of the scene than these values`);
    }
    const { scene } = await request(`/v1/jobs/${sweep.job}/scene`);
    const at = sweep.frequency_hz ? ` --frequency ${sweep.frequency_hz}` : "";
    const command = `stickslip sweep ${file} --parameter ${sweep.parameter} --from ${sweep.from} --to ${sweep.to}${at} --harmonics ${sweep.harmonics}`;
    await saveFrom("/v1/scenes/text", "application/toml", file, { method: "POST", body: { scene, set: withoutSwept(sweep), comments: ["A stored sweep of stickslip. The same from the command:", command] } });
  }, (error) => `${file}: ${error.message}`);
}
