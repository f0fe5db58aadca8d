// The variable, its range and the number of harmonics: what is wrong is said beside its field.

import { state, tell, write } from "../base/state.js";
import { byId, options, say, show } from "../base/dom.js";
import { chooseVariable, defaultRange, fieldUnit, inField, ofField, variable, variables } from "./scenes.js";

const MOST_HARMONICS = 200;
const FIELDS = ["low", "high", "harmonics"];

export function startSettings() {
  for (const id of FIELDS) byId(id).addEventListener("change", readSettings);
  byId("variable").addEventListener("change", () => {
    chooseVariable(byId("variable").value);
    state.range = null;
    fillSettings();
    write();
    tell("scene-contact");
    tell("values");
  });
}

export function fillSettings() {
  const path = variable();
  show(byId("variable"), options(variables()));
  byId("variable").value = path;
  byId("variable-unit").textContent = fieldUnit(path).name;
  if (!path) say("study-status", "The scene has no contact to design.");
  state.range ??= path ? defaultRange() : null;
  if (state.range) [byId("low").value, byId("high").value] = state.range.map((end) => String(inField(path, end)));
  byId("harmonics").value = String(state.harmonics);
  complain({});
}

function wrong() {
  const [low, high] = [byId("low").valueAsNumber, byId("high").valueAsNumber];
  const harmonics = byId("harmonics").valueAsNumber;
  const found = {};
  if (variable() && !(low > 0)) found.low = `The range of the variable must have 0 < from < to, from is ${shown("low")}.`;
  else if (variable() && !(high > low)) found.high = `The range of the variable must have 0 < from < to, ${shown("low")} < ${shown("high")} is not so.`;
  if (!(Number.isInteger(harmonics) && harmonics >= 1 && harmonics <= MOST_HARMONICS)) {
    found.harmonics = `Harmonics must be a whole number from 1 to ${MOST_HARMONICS}, such as 11, not ${shown("harmonics")}.`;
  }
  return found;
}

const shown = (id) => byId(id).value.trim() || "nothing";

function complain(found) {
  for (const id of FIELDS) {
    if (id in found) byId(id).setAttribute("aria-invalid", "true");
    else byId(id).removeAttribute("aria-invalid");
  }
  say("settings-wrong", Object.values(found).join(" "), true);
}

// Takes what is in the fields if all of it is right; whether it is.
export function readSettings() {
  const found = wrong();
  complain(found);
  if (Object.keys(found).length) return false;
  const harmonics = byId("harmonics").valueAsNumber;
  const range = variable() ? ["low", "high"].map((id) => ofField(variable(), byId(id).valueAsNumber)) : null;
  const other = harmonics !== state.harmonics;
  Object.assign(state, { range, harmonics });
  write();
  if (other) tell("values");
  tell("settings");
  return true;
}
