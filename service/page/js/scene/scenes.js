// The scene that is looked at: its tables, its values as set, its paths.

import { request } from "../network/api.js";
import { state } from "../base/address.js";
import { givenValue, parameterOf, parametersOf } from "./laws.js";

export const current = { body: null };

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
  current.body = (await request(`/v1/scenes/${encodeURIComponent(name)}`)).scene;
  return current.body;
}

const contactOf = (path) => (current.body?.contacts ?? []).find(({ name }) => name === path.split(".")[0]);

// The paths of a contact that are varied by hand.
const pathsOf = (contact) =>
  parametersOf(contact).filter(({ slider }) => slider).map(({ name }) => `${contact.name}.${name}`).filter((path) => ownValue(path) !== null);

export const variedContacts = () => (current.body?.contacts ?? []).filter((contact) => pathsOf(contact).length);

export const firstForce = () => {
  const { excitation } = current.body;
  return Array.isArray(excitation) ? excitation[0] : excitation;
};

// The value that the scene itself writes down; none where it follows from others.
export function givenByScene(path) {
  if (path === "excitation.amplitude") return firstForce().amplitude;
  const value = contactOf(path)?.[path.split(".")[1]];
  return typeof value === "number" ? value : undefined;
}

// The value of a path as the scene has it, before anything is set.
export function ownValue(path) {
  if (path === "excitation.amplitude") return firstForce().amplitude;
  const [name, keyName] = path.split(".");
  const contact = contactOf(path);
  return contact ? givenValue(contact, keyName, (other) => value(`${name}.${other}`)) : null;
}

export const value = (path) => state.set[path] ?? ownValue(path);

// What the sliders of a contact cover: a path, its words, its ends.
export function ranges(name) {
  const contact = contactOf(name);
  return contact ? pathsOf(contact).map((path) => range(contact, path)) : [];
}

function range(contact, path) {
  const { name, symbol, words, slider } = parameterOf(contact, path.split(".")[1]);
  const size = slider.of === null ? 1 : Math.abs(ownValue(`${contact.name}.${slider.of}`)) || 1;
  const negative = ownValue(path) < 0;
  const [low, high] = [negative ? -slider.high : slider.low, slider.high].map((end) => end * size);
  return { path, low, high, log: slider.logarithmic && !negative, text: `${symbol} of ${contact.name}`, words: words || name };
}

// What may be designed: what is positive, or may be.
export const variables = () =>
  variedContacts().flatMap(({ name }) => ranges(name)).filter(({ path, log }) => log || ownValue(path) > 0).map(({ path }) => path);

// The path that is designed: the one chosen, else the first of the contact.
export function variable() {
  const known = variables().filter((path) => path.startsWith(`${state.contact}.`));
  return known.find((path) => path === `${state.contact}.${state.variable}`) ?? known[0] ?? "";
}

export function chooseVariable(path) {
  [state.contact, state.variable] = path.split(".");
  if (variables().find((other) => other.startsWith(`${state.contact}.`)) === path) state.variable = "";
}

// What a request about this scene says.
export const asked = () => ({ scene: state.scene, set: { ...state.set }, harmonics: state.harmonics });

// The scene as a drawing shows it: contacts with the values set.
export function shownScene() {
  const contacts = (current.body.contacts ?? []).map((contact) => {
    const shown = { ...contact };
    for (const [path, number] of Object.entries(state.set)) {
      const [name, keyName] = path.split(".");
      if (name === contact.name) shown[keyName] = number;
    }
    return shown;
  });
  return { ...current.body, contacts };
}

export function defaultRange() {
  const path = variable();
  const size = Math.abs(ownValue(path)) || 100;
  const { log, high } = ranges(state.contact).find((each) => each.path === path);
  return [size / 10, log ? size * 15 : Math.min(size * 15, high)].map((end) => Number(end.toPrecision(3)));
}
