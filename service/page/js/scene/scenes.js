// The scene that is looked at: its tables, its values as set, its paths.

import { request } from "../network/api.js";
import { state } from "../base/address.js";
import { learnUnits } from "../base/format.js";

// Its parameters as the service tells them, by path.
export const current = { body: null, parameters: new Map() };

export async function listScenes() {
  const items = [];
  for (let path = "/v1/scenes"; path; ) {
    const page = await request(path);
    items.push(...page.items);
    path = page.next;
  }
  return items;
}

export async function loadScene(name) {
  const [{ scene }, { items }] = await Promise.all([
    request(`/v1/scenes/${encodeURIComponent(name)}`),
    request("/v1/scenes/parameters", { method: "POST", body: { scene: name } }),
  ]);
  current.body = scene;
  current.parameters = new Map(items.map((parameter) => [parameter.path, parameter]));
  learnUnits(items.map(({ name: own, unit }) => [own, unit]));
  return current.body;
}

// The contacts, dampers, bodies and loads that have something to vary by hand.
export const variedParts = () =>
  [...new Set([...current.parameters.values()].filter(({ slider }) => slider).map(({ part }) => part))];

// The contact that is looked at, if the part is one.
export const chosenContact = () => (current.body?.contacts ?? []).find(({ name }) => name === state.contact)?.name ?? null;

export const firstForce = () => {
  const { excitation } = current.body;
  return Array.isArray(excitation) ? excitation[0] : excitation;
};

// The value that the scene itself writes down; none where it follows from others.
export function givenByScene(path) {
  if (path === "excitation.amplitude") return firstForce().amplitude;
  const known = current.parameters.get(path);
  return known && !known.otherwise ? known.value : undefined;
}

// The value of a path as the scene has it, before anything is set; what it leaves out follows from others.
export function ownValue(path) {
  if (path === "excitation.amplitude") return firstForce().amplitude;
  const known = current.parameters.get(path);
  return known?.otherwise ? known.otherwise.reduce((product, other) => product * (value(other) ?? 0), 1) : known?.value ?? null;
}

export const value = (path) => state.set[path] ?? ownValue(path);

// What the sliders of a part cover: a path, its words, its ends.
export const ranges = (name) =>
  [...current.parameters.values()].filter(({ part, slider }) => slider && part === name).map(({ path, symbol, words, slider, ...own }) => ({
    path, low: slider.low, high: slider.high, log: slider.logarithmic, text: path === name ? symbol : `${symbol} of ${name}`, words: words || own.name,
  }));

// What may be designed: what is positive, or may be.
export const variables = () =>
  variedParts().flatMap(ranges).filter(({ path, log }) => log || ownValue(path) > 0).map(({ path }) => path);

const variablesOf = (part) => variables().filter((path) => current.parameters.get(path).part === part);

// The path that is designed: the one chosen, else the first of the contact.
export function variable() {
  const known = variablesOf(state.contact);
  return known.find((path) => path === `${state.contact}.${state.variable}`) ?? known[0] ?? "";
}

export function chooseVariable(path) {
  [state.contact, state.variable = ""] = path.split(".");
  if (variablesOf(state.contact)[0] === path) state.variable = "";
}

// What a request about this scene says.
export const asked = () => ({ scene: state.scene, set: { ...state.set }, harmonics: state.harmonics });

// The scene as a drawing shows it: contacts and dampers with the values set.
export function shownScene() {
  const asSet = (part) => {
    const own = Object.entries(state.set).filter(([path]) => path.split(".")[0] === part.name);
    return { ...part, ...Object.fromEntries(own.map(([path, number]) => [path.split(".")[1], number])) };
  };
  const { contacts = [], dampers = [] } = current.body;
  return { ...current.body, contacts: contacts.map(asSet), dampers: dampers.map(asSet) };
}

export function defaultRange() {
  const path = variable();
  const size = Math.abs(ownValue(path)) || 100;
  const { log, high } = ranges(state.contact).find((each) => each.path === path);
  return [size / 10, log ? size * 15 : Math.min(size * 15, high)].map((end) => Number(end.toPrecision(3)));
}
