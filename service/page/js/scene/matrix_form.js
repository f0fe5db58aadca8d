// What a scene of matrices needs beside its files: DOFs by name, what acts on them, what is kept; of one sector of a disk
// besides how many there are, the boundaries, the wave.

import { button, el, options, show } from "../base/dom.js";

const GROUND = "ground";
const FEW_ROWS = 300;
const USUAL_MODES = 20;
const AXES = { z: [0, 0, 1], y: [0, 1, 0], x: [1, 0, 0] };
let count = 0;

// A control with its label above and what is wrong below; its pointers are those of the issues about it.
function field(label, control, pointers, hint = "") {
  const id = (control.id ||= `matrix-field-${(count += 1)}`);
  const message = el("span", { class: "message", id: `${id}-message` });
  const node = el("div", { class: "field" }, el("label", { for: id }, label), control, hint ? el("span", { class: "note", id: `${id}-hint` }, hint) : null, message);
  if (hint) control.setAttribute("aria-describedby", `${id}-hint`);
  node.pointers = pointers;
  node.blame = (text) => {
    message.textContent = text;
    node.classList.toggle("wrong", Boolean(text));
    if (text) control.setAttribute("aria-invalid", "true");
    else control.removeAttribute("aria-invalid");
    control.setAttribute("aria-describedby", [hint && `${id}-hint`, text && `${id}-message`].filter(Boolean).join(" "));
  };
  return node;
}

const group = (title, ...content) => el("fieldset", {}, el("legend", {}, title), ...content);
const text = (value, more = {}) => el("input", { type: "text", spellcheck: false, autocomplete: "off", value, ...more });
const filled = (value, more) => {
  const input = text(value, more);
  input.setAttribute("value", value);
  return input;
};

const amount = (value, more) => {
  const input = el("input", { type: "number", min: 0, ...more });
  input.setAttribute("value", value);
  return input;
};

export function matrixForm(host, { onUnits }) {
  const dofs = el("div", { class: "matrix-rows" });
  const contacts = el("div", { class: "matrix-rows" });
  const places = el("datalist", { id: "matrix-places" });
  const name = filled("my-model");
  const units = el("select", {}, options([["SI", "kg, N, m, s"], ["mm", "t, N, mm, s"], ["in", "lbf s²/in, lbf, in, s"]]));
  const modes = el("input", { type: "number", min: 0, max: 1000, step: 1 });
  const damping = amount("0.001", { step: "any" });
  const force = el("select", {});
  const observed = el("select", {});
  const [named, rubbing] = [[], []];
  let disk = null;

  units.addEventListener("change", onUnits);

  // A further row of fields, with a button that leaves it out again.
  function added(host, list, what, one, ...fields) {
    one.node = el("div", { class: "fields" }, fields, button("Leave out", () => { list.splice(list.indexOf(one), 1); one.node.remove(); choices(); }, { "aria-label": `Leave out the ${what} ${one.label.value}` }));
    list.push(one);
    host.append(one.node);
    choices();
    return one.label;
  }

  function addDof(given) {
    const label = filled(given, { class: "dof-name" });
    const row = text("", { list: "matrix-places" });
    label.addEventListener("change", choices);
    return added(dofs, named, "DOF", { label, row }, field("Name", label, () => []), field("Node and direction, or row", row, () => [`/structure/dofs/${label.value.trim()}`]));
  }

  function addContact(given) {
    const label = filled(given);
    const ends = [el("select", {}), el("select", {})];
    const one = { label, ends };
    const at = () => rubbing.indexOf(one);
    return added(contacts, rubbing, "contact", one,
      field("Contact", label, () => [`/contacts/${at()}/name`, `/contacts/${at()}`]),
      field("rubs between", ends[0], () => [`/contacts/${at()}/between/0`, `/contacts/${at()}/between`]),
      field("and", ends[1], () => [`/contacts/${at()}/between/1`]));
  }

  // The names of the DOFs in every list that offers them; what was chosen stays.
  function choices() {
    const names = named.map(({ label }) => label.value.trim()).filter(Boolean);
    const offer = (select, these, first) => {
      const before = select.value;
      show(select, options(these));
      select.value = these.includes(before) ? before : (first ?? these[0] ?? "");
    };
    offer(force, names, names[1] ?? names[0]);
    offer(observed, names, names[0]);
    for (const { ends } of rubbing) {
      offer(ends[0], names, names[0]);
      offer(ends[1], [GROUND, ...names, ...(disk?.isDisk() ? names.map((name) => `${name}@next`) : [])], GROUND);
    }
  }

  const unitsField = field("Units of the files", units, () => ["/structure/units"]);
  const modesField = field("Modes kept of the rest", modes, () => ["/structure/keep_modes", "/structure/cyclic/keep_modes"], "Craig-Bampton: the DOFs named below stay, the rest moves in so many of its modes. Left empty, nothing is reduced.");
  const others = [
    unitsField,
    modesField,
    field("Damping ratio of every mode", damping, () => ["/structure/damping_ratio"], "0.001 is usual for a blade; what friction adds comes from the contacts."),
    field("Force at", force, () => ["/excitation/dof", "/excitation/0/dof", "/excitation"]),
    field("Observed", observed, () => ["/observe/dof", "/observe"]),
    field("Name of the scene", name, () => ["/name"]),
  ];

  disk = sectorForm(choices);
  const more = (words, add) => button(words, () => add().focus());
  show(host, places,
    group("Units and reduction", el("div", { class: "fields" }, others.slice(0, 3))),
    disk.node,
    group("DOFs in use", el("p", { class: "note", id: "matrix-rows-note" }), dofs, more("Add a DOF", () => addDof(`dof${named.length + 1}`))),
    group("Friction contacts", contacts, more("Add a contact", () => addContact(`contact${rubbing.length + 1}`))),
    group("Force and observation", el("div", { class: "fields" }, others.slice(3))));
  addDof("tip");
  addDof("middle");
  addContact("damper");
  force.value = "middle";

  const all = () => [...others, ...disk.fields, ...[...dofs.children, ...contacts.children].flatMap((row) => [...row.children])].filter((node) => node.blame);

  return {
    units: () => units.value,
    // What was read tells what may be typed.
    learn(found, file) {
      const { labels, rows } = found;
      disk.learn(found);
      const first = labels?.first ?? [];
      show(places, first.map((label) => el("option", { value: label })));
      const example = labels ? `such as ${first[first.length - 1]}: nodes ${labels.nodes[0]} to ${labels.nodes[1]}, ${labels.components.join(", ")}; a row from 0 to ${rows - 1} will do too` : `rows 0 to ${rows - 1}; the files do not name them, a .mapping or .dof file would`;
      host.querySelector("#matrix-rows-note").textContent = `The DOFs that contacts, the force and the observation need, ${example}.`;
      if (modes.value === "" && rows > FEW_ROWS) modes.value = String(USUAL_MODES);
      if (name.value === "my-model" && file) name.value = file.replace(/\.[^.]*$/, "").replaceAll(/[^A-Za-z0-9_-]/g, "-").replace(/[-_]?(mass|stiff\w*|M|K)$/i, "") || "my-model";
    },
    structure() {
      const rows = named.map(({ label, row }) => [label.value.trim(), row.value.trim()]).map(([key, at]) => [key, /^\d+$/.test(at) ? Number(at) : at]);
      const found = { dofs: Object.fromEntries(rows) };
      if (units.value !== "SI") found.units = units.value;
      const kept = modes.value === "" ? undefined : modes.valueAsNumber;
      if (disk.isDisk()) Object.assign(found, disk.structure(kept));
      else if (kept !== undefined) found.keep_modes = kept;
      if (damping.valueAsNumber > 0) found.damping_ratio = damping.valueAsNumber;
      return found;
    },
    asked: () => ({
      name: name.value.trim(),
      contacts: rubbing.map(({ label, ends }) => ({ name: label.value.trim(), between: ends.map((end) => end.value) })),
      excitation: { dof: force.value, ...disk.excitation() },
      observe: { dof: observed.value },
    }),
    // Says what is wrong beside its field, the first of which takes the focus; returns what is about none.
    blame(issues) {
      const fields = all();
      for (const node of fields) node.blame("");
      const left = issues.filter(({ pointer, detail }) => {
        const node = fields.find(({ pointers }) => pointers().includes(pointer));
        node?.blame(detail);
        return !node;
      });
      host.querySelector("[aria-invalid]")?.focus();
      return left;
    },
    // DOFs without a place are said before anything is asked.
    missing: () => named.filter(({ row }) => !row.value.trim()).map(({ label }) => ({ pointer: `/structure/dofs/${label.value.trim()}`, detail: "A node and direction, or a row, is needed." })),
  };
}

// A set of the deck by its name, or nodes with commas.
const nodes = (written) => {
  const parts = written.split(",").map((part) => part.trim()).filter(Boolean);
  return parts.length && parts.every((part) => /^\d+$/.test(part)) ? parts.map(Number) : written.trim();
};

// The part about a sector; `changed` is told when it becomes a disk or none.
function sectorForm(changed) {
  const sets = el("datalist", { id: "matrix-sets" });
  const sectors = el("input", { type: "number", min: 1, max: 10000, step: 1, id: "matrix-sectors" });
  const [low, high] = ["matrix-low", "matrix-high"].map((id) => text(undefined, { list: "matrix-sets", id }));
  const axis = el("select", {}, options(Object.keys(AXES)));
  const order = amount("1", { max: 10000, step: 1 });
  let reduced = false;
  const many = field("Sectors", sectors, () => ["/structure/sectors"], "How many make the disk. Left empty, the files are the whole structure.");
  const ends = [
    field("Boundary to the sector before", low, () => ["/structure/cyclic/low", "/structure/cyclic/low_rows"], "A set of the deck, or nodes with commas."),
    field("Boundary to the next one", high, () => ["/structure/cyclic/high", "/structure/cyclic/high_rows"], "Where the other comes when turned about the axis by the right-hand rule."),
  ];
  const rest = [
    field("Axis of the disk", axis, () => ["/structure/cyclic/axis", "/structure/cyclic"]),
    field("Engine order of the force", order, () => ["/excitation/engine_order", "/excitation/0/engine_order"]),
  ];
  const isDisk = () => sectors.value !== "";
  function update() {
    for (const node of ends) node.hidden = !isDisk() || reduced;
    for (const node of rest) node.hidden = !isDisk();
    changed(isDisk());
  }
  sectors.addEventListener("input", update);
  for (const node of [...ends, ...rest]) node.hidden = true;

  return {
    fields: [many, ...ends, ...rest],
    node: group("One sector of a disk", sets, el("div", { class: "fields" }, [many, ...ends, ...rest])),
    isDisk,
    learn({ sets: found, structure }) {
      show(sets, (found ?? []).map(({ name, nodes: n }) => el("option", { value: name, label: `${n} nodes` })));
      for (const [input, name] of [[low, "LOW"], [high, "HIGH"]]) if (!input.value && (found ?? []).some((set) => set.name === name)) input.value = name;
      reduced = Boolean(structure.diameters);
      update();
    },
    // The keys of a structure; `modes` is how many are kept of the rest, if any.
    structure(modes) {
      const cyclic = { axis: AXES[axis.value] };
      if (!reduced && low.value.trim()) cyclic.low = nodes(low.value);
      if (!reduced && high.value.trim()) cyclic.high = nodes(high.value);
      if (!reduced && modes !== undefined) cyclic.keep_modes = modes;
      return { sectors: sectors.valueAsNumber, cyclic };
    },
    excitation: () => (isDisk() && Number.isFinite(order.valueAsNumber) ? { engine_order: order.valueAsNumber } : {}),
  };
}

// The keys that refer to files with those of the form: a deck is of use to a sector alone, and not to a reduced one.
export function joined(files, form) {
  const { cyclic: deck, ...given } = files;
  const { cyclic, ...wanted } = form;
  if (!cyclic) return { ...given, ...wanted };
  return { ...given, ...wanted, cyclic: { ...(given.diameters ? {} : deck), ...cyclic } };
}
