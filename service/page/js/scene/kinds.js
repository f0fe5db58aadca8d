// The studies of the service: the keys of each by the schema of its body, and what the scene suggests for it; its contact
// laws with their parameters.

import { request } from "../network/api.js";
import { fieldsOf } from "../forms/fields.js";
import { on, state, tell } from "../base/state.js";
import { learnUnits, seconds } from "../base/format.js";
import { asked, current, defaultRange, variable } from "./scenes.js";

// The scene, the run and the queue are asked for elsewhere on the page.
const OF_THE_PAGE = ["kind", "scene", "set", "fresh", "priority", "max_seconds", "project", "name", "notes", "tags"];
// What the bar says has no field a second time.
export const OF_THE_BAR = ["parameter", "from", "to", "variables", "scaling", "start"];
let [kinds, price] = [new Map(), 0];
on("cost", (cost) => { price = cost; });

export async function loadKinds() {
  kinds = new Map((await request("/v1/kinds")).items.map((kind) => [kind.name, { ...kind, fields: fieldsOf(kind.body).filter(({ key, kind: what }) => !OF_THE_PAGE.includes(key) && !(key === "harmonics" && what === "number")) }]));
  tell("kinds");
}

export const kindNames = () => [...kinds.keys()];
export const kindOf = (name) => kinds.get(name);
const keyed = (name, key) => kinds.get(name)?.fields.find((field) => field.key === key);

// Whether a kind is asked with a number of harmonics.
export const hasHarmonics = (name) => kinds.get(name)?.body.properties.harmonics?.type === "integer";

// What a request of a kind says of the scene.
export function askedFor(name) {
  const { harmonics, ...body } = asked();
  return hasHarmonics(name) ? { ...body, harmonics } : body;
}

// The range of a study of one variable, as it was asked.
export function rangeOf({ variables, parameter, from, to }) {
  if (parameter && from !== undefined) return [parameter, [from, to]];
  const asked = Object.entries(variables ?? {});
  return asked.length === 1 ? asked[0] : null;
}

// The range of the variable of the bar: as long as it is the scene's own, the one that is proposed for a kind.
export function barRange(name) {
  const [path, own] = rangeOf(proposed(name)) ?? [];
  return path === variable() && String(state.range) === String(defaultRange()) ? own : state.range;
}

// The variable of the bar with its range, in the keys that a kind has for it.
export function ofTheBar(name) {
  if (!state.range) return {};
  const [from, to] = barRange(name);
  if (keyed(name, "variables")) return { variables: { [variable()]: [from, to] } };
  return keyed(name, "parameter")?.required ? { parameter: variable(), from, to } : {};
}

// What the scene suggests for a kind: its question, its keys, what it takes, or why there is none.
export const proposalOf = (name) => current.studies?.get(name);

// The keys of a body that the scene itself suggests.
export const proposed = (name) => proposalOf(name)?.body ?? {};

// How long studies take, about [s]: what the service says each costs, at the price of a point that the plan of the
// scene names. 0 where one is not known.
export const secondsOf = (...names) => price * names.reduce((sum, name) => sum + (proposalOf(name)?.points ?? 0), 0);
export const takes = (...names) => (secondsOf(...names) ? `about ${seconds(secondsOf(...names))}` : "");

// Why the scene has no such study; empty if it has.
export const refusedFor = (name) => proposalOf(name)?.refused ?? "";
let [laws, usual] = [new Map(), null];

export async function loadLaws() {
  const { items } = await request("/v1/laws");
  laws = new Map(items.map((law) => [law.name, law.parameters]));
  usual = items.find((law) => law.default).name;
  learnUnits(items.flatMap((law) => law.parameters).map(({ name, unit }) => [name, unit]));
}

export const parameterOf = (contact, key) => laws.get(contact.law ?? usual)?.find(({ name }) => name === key);
