// The scene that is looked at: its tables, its values as set, its paths.

import { everyItem, request } from "../network/api.js";
import { state } from "../base/state.js";
import { learnUnits, shownUnit, unitOf } from "../base/format.js";

// What the service tells of it beside its tables: parameters by path, joints, what each study begins with.
export const current = { body: null, parameters: new Map(), joints: [], studies: new Map() };
const FORCE = "excitation";
export const listScenes = () => everyItem("/v1/scenes");

// Whether it is the one that is looked at still, once the service has told.
export async function loadScene(name) {
  const [{ scene }, { items, joints, studies }] = await Promise.all([request(`/v1/scenes/${encodeURIComponent(name)}`), request("/v1/scenes/parameters", { method: "POST", body: { scene: name } })]);
  if (name !== state.scene) return false;
  Object.assign(current, { body: scene, joints, parameters: new Map(items.map((parameter) => [parameter.path, parameter])), studies: new Map(studies.map((study) => [study.kind, study])) });
  learnUnits(items.flatMap(({ path, name: own, unit }) => [[path, unit], [own, unit]]));
  return true;
}

// The contacts, dampers, bodies and loads that have something to vary by hand.
export const variedParts = () =>
  [...new Set([...current.parameters.values()].filter(({ slider, part }) => slider && part !== FORCE).map(({ part }) => part))];

// The contact that is looked at, if the part is one that stands by itself.
export const chosenContact = () => current.joints.find(({ name, contacts }) => name === state.contact && contacts.includes(name))?.name ?? null;

// The contacts that a normal load presses.
export const contactsOf = () => current.joints.filter(({ friction }) => friction).flatMap(({ contacts }) => contacts);

// The value that the scene itself writes down; none where it follows from others.
export function givenByScene(path) {
  const known = current.parameters.get(path);
  return known && !known.otherwise ? known.value : undefined;
}

// The value of a path as the scene has it, before anything is set; what it leaves out follows from others.
export function ownValue(path) {
  const known = current.parameters.get(path);
  return known?.otherwise ? known.otherwise.reduce((product, other) => product * (value(other) ?? 0), 1) : known?.value ?? null;
}

export const value = (path) => state.set[path] ?? ownValue(path);

// The unit of a field for a path, with how many of it make one in SI: that of the scene's own value, while it is set too.
export function fieldUnit(path) {
  const [known, unit] = [current.parameters.get(path), unitOf(path)];
  if (unit === "rad") return { name: "°", per: 180 / Math.PI };
  const { name, perMetre: per } = shownUnit(known?.value || known?.slider?.high || known?.bounds?.[1], unit);
  return { name, per };
}

// A number of a field and of the scene, each as the other: without what rounding adds.
export const inField = (path, number, digits = 12) => Number((number * fieldUnit(path).per).toPrecision(digits));
export const ofField = (path, number) => Number((number / fieldUnit(path).per).toPrecision(12));

// What the sliders of a part cover: a path, its words, its ends.
const ranges = (name) =>
  [...current.parameters.values()].filter(({ part, slider }) => slider && part === name).map(({ path, symbol, words, slider, ...own }) => ({
    path, low: slider.low, high: slider.high, log: slider.logarithmic, words: words || own.name,
    text: name === FORCE ? `${symbol}, the force` : path === name ? symbol : `${symbol} of ${name}`,
  }));

// Those of the part that is looked at, and of the force.
export const sliders = () => [...ranges(state.contact), ...ranges(FORCE)];

// What may be designed.
export const variables = () => [...current.parameters.values()].filter(({ bounds }) => bounds).map(({ path }) => path);
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
export const defaultRange = () => current.parameters.get(variable()).bounds.map((end) => ofField(variable(), inField(variable(), end, 3)));
