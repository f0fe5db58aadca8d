// What a nonlinear mode is asked with: which one, over which amplitudes, and what goes along.

import { byId, el, show } from "../base/dom.js";
import { current, value } from "../scene/scenes.js";

const FALLBACK = [1e-7, 0.1];
const AROUND = [0.05, 300];

// [key, words, attributes]; an empty field is left out of the body.
const FIELDS = [
  ["mode", "Mode, 1 the slowest", { min: 1, step: 1, value: "1" }],
  ["from", "Modal amplitude from [√kg m]", { min: 0, step: "any" }],
  ["to", "to [√kg m]", { min: 0, step: "any" }],
  ["nodal_diameter", "Nodal diameter", { step: 1 }],
  ["aero_damping", "Aerodynamic damping ζ_aero", { step: "any", placeholder: "-0.02 feeds the mode" }],
  ["exact_peaks", "Whole responses to compare", { min: 0, max: 40, step: 1, value: "8" }],
];

export function buildForm(host, submit) {
  show(host,
    el("div", { class: "fields" }, FIELDS.map(([key, words, more]) =>
      el("div", { class: "field", id: `modes-field-${key}` }, el("label", { for: `modes-${key}` }, words),
        el("input", { type: "number", id: `modes-${key}`, name: key, "aria-describedby": `modes-${key}-wrong`, ...more }), el("span", { class: "message", role: "alert", id: `modes-${key}-wrong` })))),
    el("div", { class: "row" }, el("button", { type: "submit", id: "modes-submit", class: "main-button" }, "Follow the mode"),
      el("span", { class: "note" }, "Frequency and damping of the free motion, with its loops, shape and the peaks that follow from it.")));
  host.addEventListener("submit", (event) => {
    event.preventDefault();
    submit();
  });
}

const input = (key) => byId(`modes-${key}`);

// Amplitudes around the one at which the contacts begin to slip, as far as the scene says it.
function usual() {
  const { structure, contacts = [] } = current.body;
  const slips = contacts.map(({ name }) => ["mu", "N0", "kt"].map((key) => value(`${name}.${key}`))).filter((all) => all.every((one) => one > 0)).map(([mu, load, kt]) => (mu * load) / kt);
  const masses = Object.values(structure.masses ?? {}).filter((mass) => typeof mass === "number");
  if (!slips.length || !masses.length) return FALLBACK;
  const mass = Math.sqrt(masses.reduce((sum, each) => sum + each, 0));
  return [AROUND[0] * Math.min(...slips) * mass, AROUND[1] * Math.max(...slips) * mass].map((end) => Number(end.toPrecision(2)));
}

export function fillForm(request = null) {
  const [from, to] = request ? [request.from, request.to] : usual();
  input("from").value = String(from);
  input("to").value = String(to);
  input("mode").value = String(request?.mode ?? 1);
  for (const key of ["nodal_diameter", "aero_damping"]) input(key).value = request?.[key] ?? "";
  input("exact_peaks").value = String(request?.exact_peaks ?? 8);
  byId("modes-field-nodal_diameter").hidden = !current.body?.structure.sectors;
  complain([]);
}

// The keys of the body. What is no number goes as it is not: the service says so at the field.
export function readForm() {
  const body = { performance: true, motions: true };
  for (const [key] of FIELDS) if (!input(key).closest(".field").hidden && input(key).value !== "") body[key] = input(key).valueAsNumber;
  return body;
}

// Says what is wrong beside the field it is about.
export function complain(errors) {
  for (const [key] of FIELDS) {
    const mine = errors.filter(({ pointer }) => pointer.split("/")[1] === key);
    input(key).closest(".field").classList.toggle("wrong", mine.length > 0);
    if (mine.length) input(key).setAttribute("aria-invalid", "true");
    else input(key).removeAttribute("aria-invalid");
    byId(`modes-${key}-wrong`).textContent = mine.map(({ detail }) => detail).join(" ");
  }
}
