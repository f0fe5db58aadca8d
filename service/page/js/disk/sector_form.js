// What the matrices of one sector of a disk need besides: how many there are, the boundaries, the wave.

import { el, show } from "../base/dom.js";

const AXES = { z: [0, 0, 1], y: [0, 1, 0], x: [1, 0, 0] };

// A set of the deck by its name, or nodes with commas.
const nodes = (written) => {
  const parts = written.split(",").map((part) => part.trim()).filter(Boolean);
  return parts.length && parts.every((part) => /^\d+$/.test(part)) ? parts.map(Number) : written.trim();
};

// The fields, made by `field(label, control, pointers, hint)`; `changed` is told when it becomes a disk or none.
export function sectorForm(field, changed) {
  const sets = el("datalist", { id: "matrix-sets" });
  const sectors = el("input", { type: "number", min: 1, max: 10000, step: 1, id: "matrix-sectors" });
  const boundary = (id) => el("input", { type: "text", spellcheck: false, autocomplete: "off", list: "matrix-sets", id });
  const [low, high] = ["matrix-low", "matrix-high"].map(boundary);
  const axis = el("select", {}, Object.keys(AXES).map((name) => el("option", { value: name }, name)));
  const order = el("input", { type: "number", min: 0, max: 10000, step: 1, value: 1 });
  order.setAttribute("value", "1");
  let reduced = false;
  const count = field("Sectors", sectors, () => ["/structure/sectors"], "How many make the disk. Left empty, the files are the whole structure.");
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
    fields: [count, ...ends, ...rest],
    node: el("fieldset", {}, el("legend", {}, "One sector of a disk"), sets, el("div", { class: "fields" }, [count, ...ends, ...rest])),
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
