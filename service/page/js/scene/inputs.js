// What a result was computed for, against what is set now.

import { state } from "../base/state.js";
import { quantity } from "../base/format.js";
import { barRange, hasHarmonics, rangeOf } from "./kinds.js";
import { givenByScene, variable, variables } from "./scenes.js";

const [USUAL_HARMONICS, CLOSE] = [11, 1e-9];
const same = (a, b) => a === b || Math.abs(a - b) <= CLOSE * Math.max(Math.abs(a), Math.abs(b));

// The paths that a study varies itself: what they are set to does not matter to it.
const variedBy = ({ variables, unknowns, parameter }) =>
  [...Object.keys(variables ?? {}), ...Object.keys(unknowns ?? {}), parameter ?? ""].flatMap((names) => names.split(",")).map((name) => name.trim()).filter(Boolean);

const said = (path, value) => (value === undefined || value === null ? "as it follows from others" : quantity(path, value));

function changedValues(request) {
  const [then, free] = [request.set ?? {}, variedBy(request)];
  const paths = [...new Set([...Object.keys(then), ...Object.keys(state.set)])].filter((path) => !free.includes(path));
  return paths.flatMap((path) => {
    const [was, is] = [then, state.set].map((set) => set[path] ?? givenByScene(path));
    return same(was, is) ? [] : [`${path} ${said(path, was)}, now ${said(path, is)}`];
  });
}

function changedRange(kind, request) {
  const asked = rangeOf(request);
  if (!asked || asked[0] === "frequency" || !state.range) return [];
  const [path, [low, high]] = asked;
  // What the form above does not offer it does not change either.
  if (!variables().includes(path)) return [];
  if (path !== variable()) return [`${path} varied, now ${variable() || "nothing"}`];
  const [from, to] = barRange(kind);
  if (same(low, from) && same(high, to)) return [];
  return [`${path} from ${quantity(path, low)} to ${quantity(path, high)}, now ${quantity(path, from)} to ${quantity(path, to)}`];
}

// In words, what has changed since a study of a kind was asked; empty if nothing.
export function differences(kind, request) {
  const [was, is] = [request.harmonics ?? USUAL_HARMONICS, state.harmonics];
  const harmonics = was === is || !hasHarmonics(kind) ? [] : [`${was} harmonics, now ${is}`];
  return [...changedValues(request), ...changedRange(kind, request), ...harmonics];
}

// Whether two requests look at the same scene with the same values.
export const sameValues = (one, other) => {
  const [a, b] = [one.set ?? {}, other.set ?? {}];
  return (one.harmonics ?? USUAL_HARMONICS) === (other.harmonics ?? USUAL_HARMONICS)
    && [...new Set([...Object.keys(a), ...Object.keys(b)])].every((path) => same(a[path] ?? givenByScene(path), b[path] ?? givenByScene(path)));
};

// Whether a design's values, and those it was computed with, are the ones set now.
export const inUse = (request, values) =>
  changedValues(request).length === 0 && Object.entries(values).every(([names, value]) => names.split(",").every((path) => same(state.set[path.trim()], value)));
