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

export const parameterOf = (contact, key) => laws.get(contact.law ?? usual)?.find(({ name }) => name === key);
