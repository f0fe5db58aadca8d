// What the rows of a table by parameters offer: which ones, their values now, the bounds that the service proposes.

import { number, unitOf } from "../base/format.js";
import { contactsOf, current, value, variables } from "../scene/scenes.js";

// Names of contacts, or paths; what is designed comes before what is merely set.
export function namesOfTable(key) {
  if (key === "contact_states") return contactsOf();
  if (key === "variables") return variables();
  return [...new Set([...variables(), ...[...current.parameters.values()].filter(({ slider }) => slider).map(({ path }) => path)])];
}

// What a row says of its path; a path that was chosen anew brings bounds.
export function boundsTold(key, path, changed) {
  const known = current.parameters.get(path);
  const now = { now: known ? number(value(path), 5) : "", unit: unitOf(path) };
  const bounds = known && changed === "path" ? (key === "variables" ? known.bounds : known.around ?? known.bounds) : null;
  return bounds ? { ...now, low: String(bounds[0]), high: String(bounds[1]) } : now;
}
