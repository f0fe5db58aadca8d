// The contact laws as the service tells them: what parameters a contact has, their units, what sliders cover.

import { request } from "../network/api.js";
import { learnUnits } from "../base/format.js";

let laws = new Map();
let usual = null;

export async function loadLaws() {
  const { items } = await request("/v1/laws");
  laws = new Map(items.map((law) => [law.name, law.parameters]));
  usual = items.find((law) => law.default).name;
  learnUnits(items.flatMap((law) => law.parameters).map(({ name, unit }) => [name, unit]));
}

export const parametersOf = (contact) => laws.get(contact.law ?? usual) ?? [];

export const parameterOf = (contact, key) => parametersOf(contact).find(({ name }) => name === key);

// The value that a scene gives a parameter; what it leaves out follows from others, which `read` knows, or is not there.
export function givenValue(contact, key, read) {
  if (typeof contact[key] === "number") return contact[key];
  const others = parameterOf(contact, key)?.otherwise;
  return others ? others.reduce((product, other) => product * (read(other) ?? 0), 1) : null;
}
