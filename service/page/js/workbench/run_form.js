// What is said of a run: name, notes, tags, project; its sweeps; its results as a file; into the bin.

import { patched } from "../network/api.js";
import { button, el, onSubmit, options, show } from "../base/dom.js";
import { tell } from "../base/events.js";
import { saveFrom } from "../base/exports.js";
import { projectsKnown, undoable } from "./projects.js";
import { isUnderWay, PINNED, PRESS } from "./run_list.js";
import { sweepsOf } from "./sweeps.js";

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
