// What a drawing of a scene says of its contacts: signs and words of their states, plates that rub, the key to them.

import { el, svg } from "../base/dom.js";

export const ownName = (end) => end.split("@")[0];
export const STATES = {
  "stuck": ["is-stick", "sticks"],
  "closed": ["is-stick", "closed"],
  "stick and slip": ["is-slip", "sticks and slips"],
  "deforms": ["is-slip", "deforms"],
  "stick, slip and separation": ["is-apart", "sticks, slips and opens"],
  "opens and closes": ["is-apart", "opens and closes"],
  "separated": ["is-apart", "open"],
};
export const classOf = (state) => STATES[state]?.[0] ?? "is-unknown";
export const wordsOf = (state) => STATES[state]?.[1] ?? "not computed yet";

// The state of a joint, of several contacts the first; of a disk written out every sector j has its own.
export const stateIn = (states, { contacts }, j) => states?.[`${contacts[0]}@${j}`] ?? states?.[contacts[0]];

// What the contacts of a joint do, in words; where they or sectors differ, in how many of them.
export function statesOf(states, { contacts }) {
  const counts = new Map();
  for (const [contact, found] of Object.entries(states ?? {})) {
    if (contacts.includes(ownName(contact))) counts.set(wordsOf(found), (counts.get(wordsOf(found)) ?? 0) + 1);
  }
  if (counts.size < 2) return [...counts.keys()][0] ?? wordsOf(undefined);
  return [...counts].map(([words, count]) => `${words} in ${count}`).join(", ");
}

// Two plates that rub, across the way from a to b.
export function plates(a, b, size, state, title) {
  const angle = (Math.atan2(b.y - a.y, b.x - a.x) * 180) / Math.PI;
  const length = Math.hypot(b.x - a.x, b.y - a.y);
  const long = Math.min(1.5 * size, 0.7 * length);
  const node = svg(
    "g",
    { transform: `translate(${(a.x + b.x) / 2} ${(a.y + b.y) / 2}) rotate(${angle})` },
    svg("path", { class: "earth", d: `M${-length / 2} 0H${-long / 2}M${long / 2} 0H${length / 2}` }),
    svg("rect", { class: `contact ${state}`, x: -long / 2, y: -size * 0.62, width: long, height: size * 0.5 }),
    svg("rect", { class: `contact ${state}`, x: -long / 2, y: size * 0.12, width: long, height: size * 0.5 }),
  );
  if (title) node.append(svg("title", {}, title));
  return node;
}

export const pattern = () =>
  svg(
    "defs",
    {},
    svg(
      "pattern",
      { id: "hatch-slip", width: 5, height: 5, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
      svg("rect", { class: "hatch-ground", width: 5, height: 5 }),
      svg("rect", { class: "hatch-line", width: 2.4, height: 5 }),
    ),
  );

// What the plates of a contact say.
export function stateKey() {
  const entry = (state, words) =>
    el("li", {}, svg("svg", { width: 30, height: 16, "aria-hidden": "true" }, plates({ x: 4, y: 8 }, { x: 26, y: 8 }, 11, classOf(state))), ` ${words}`);
  return [entry("stuck", "sticks"), entry("stick and slip", "sticks and slips"), entry("separated", "opens")];
}

export const legend = () => el("ul", { class: "legend" }, stateKey(), el("li", {}, "double ring: observed · arrow: force"));
