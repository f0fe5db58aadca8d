// Projects: the one that is open gathers what is computed from now on, and lists what was. What is deleted, of them and of
// the runs, goes to the bin of the service, and comes back on a click.

import { everyItem, orNotice, patched, post, request } from "../network/api.js";
import { on, state, tell, write } from "../base/state.js";
import { button, byId, el, onSubmit, options, say, show } from "../base/dom.js";

let projects = [];
let editing = null;

export function startProjects() {
  byId("project").addEventListener("change", () => choose(byId("project").value));
  byId("project-new").addEventListener("click", () => form(null));
  byId("project-edit").addEventListener("click", () => form(opened()));
  byId("project-delete").addEventListener("click", remove);
  onSubmit(byId("project-form"), save);
  byId("project-cancel").addEventListener("click", () => form(undefined));
  on("projects-changed", listProjects);
}

const opened = () => projects.find(({ id }) => id === state.project) ?? null;
export const projectsKnown = () => projects;

// Every project of the owner; one that a link names and that is not there is left.
export async function listProjects() {
  projects = await everyItem("/v1/projects");
  if (state.project && !opened()) {
    state.project = "";
    write();
  }
  draw();
}

function draw() {
  show(byId("project"), options([["", "All runs"], ...projects.map(({ id, name, runs }) => [id, `${name} (${runs})`])]));
  byId("project").value = state.project;
  const project = opened();
  for (const id of ["project-edit", "project-delete"]) byId(id).hidden = project === null;
  const words = project?.notes || (projects.length ? "" : "No project yet: New makes one, and gathers the runs of a task under its name.");
  say("project-notes", words);
}

function choose(id) {
  state.project = id;
  write();
  form(undefined);
  draw();
  tell("project", id);
}

// The form for a new project (null), for one that is there, or closed (undefined).
function form(project) {
  editing = project;
  byId("project-form").hidden = project === undefined;
  say("project-wrong", "");
  if (project === undefined) return;
  byId("project-name").value = project?.name ?? "";
  byId("project-text").value = project?.notes ?? "";
  byId("project-name").focus();
}

async function save() {
  const body = { name: byId("project-name").value.trim(), notes: byId("project-text").value };
  try {
    const saved = editing ? await patched(`/v1/projects/${editing.id}`, editing, body) : await post("/v1/projects", body);
    state.project = saved.id;
    await listProjects();
    choose(saved.id);
    byId("project").focus();
  } catch (error) {
    say("project-wrong", error.status === 412 ? "Somebody changed this project meanwhile: choose it again to see how." : error.message, true);
  }
}

function remove() {
  const { id, name } = opened();
  return undoable(`Project “${name}” is in the bin; its runs are where they were.`, `/v1/projects/${id}`, async (gone) => {
    await listProjects();
    choose(gone ? "" : id);
  });
}

// Puts what has an address in the bin and offers to take it out: `after(true)` once it is gone, `after(false)` once it is back.
export const undoable = (words, path, after) => orNotice(async () => {
  await request(path, { method: "DELETE" });
  await after(true);
  const host = byId("undo");
  const back = button("Undo", () => orNotice(async () => {
    await request(`${path}/restore`, { method: "POST" });
    show(host);
    await after(false);
  }));
  show(host, el("span", {}, words), " ", back);
  back.focus();
});
