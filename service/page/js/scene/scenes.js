// The scene that is looked at: its tables, its values as set, its paths.

import { request } from "../network/api.js";
import { state } from "../base/address.js";

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

export const frictionContacts = () => (current.body?.contacts ?? []).filter((c) => c.kt !== undefined && c.mu !== undefined);

export const firstForce = () => {
  const { excitation } = current.body;
  return Array.isArray(excitation) ? excitation[0] : excitation;
};

// The value of a path as the scene has it, before anything is set.
export function ownValue(path) {
  if (path === "excitation.amplitude") return firstForce().amplitude;
  const [name, keyName] = path.split(".");
  const contact = current.body.contacts.find((c) => c.name === name);
  if (!contact) return null;
  if (keyName === "N1") return contact.N1 ?? (contact.N1_ratio ?? 0) * value(`${name}.N0`);
  return contact[keyName] ?? null;
}

export const value = (path) => state.set[path] ?? ownValue(path);

export const variable = () => `${state.contact}.N0`;

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
  const load = Math.abs(ownValue(variable())) || 100;
  return [Number((load / 10).toPrecision(3)), Number((load * 15).toPrecision(3))];
}
