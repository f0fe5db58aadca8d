// A design problem between the panel's fields and the words of the service.

const RANGE = /^\s*(\S+?)\s*(?:to|–|…|:)\s*(\S+)\s*$/;
const PLAIN = ["max_peak", "max_band_hz", "limit", "max_friction_work", "basins", "quantile", "samples"];
const RANGES = ["forbidden_hz", "speeds_rpm"];
const WORDS = ["method", "aim"];

// What can not be read as what it should be, with the key it is about.
export class Unreadable extends Error {
  constructor(pointer, detail) {
    super(detail);
    this.errors = [{ pointer, detail }];
  }
}

function numberOf(pointer, text, words) {
  const value = Number(text);
  if (text === undefined || !Number.isFinite(value)) throw new Unreadable(pointer, `${words} must be a number, got ${text === undefined ? "nothing" : `“${text}”`}.`);
  return value;
}

function rangesOf(key, text) {
  return text.split(",").filter((part) => part.trim()).map((part) => {
    const found = RANGE.exec(part);
    if (!found) throw new Unreadable(`/${key}`, `Ranges are written as 520 to 560, 600 to 620; “${part.trim()}” is none.`);
    return found.slice(1).map((end) => numberOf(`/${key}`, end, "The end of a range"));
  });
}

function valuesOf(text, pointer) {
  return Object.fromEntries(text.split(",").filter((part) => part.trim()).map((part) => {
    const [path, value, more] = part.split("=").map((word) => word.trim());
    if (!value || more !== undefined) throw new Unreadable(pointer, `Values are written as damper.mu = 0.3, with commas; “${part.trim()}” is none.`);
    return [path, numberOf(pointer, value, path)];
  }));
}

function caseOf(row, index) {
  const at = (key) => `/cases/${index}/${key}`;
  const found = row.name ? { name: row.name } : {};
  for (const key of ["engine_order", "order", "weight"]) if (row[key] !== undefined) found[key] = numberOf(at(key), row[key], key.replace("_", " "));
  const set = row.values ? valuesOf(row.values, at("set")) : {};
  if (row.level !== undefined) set["excitation.amplitude"] = numberOf(at("set"), row.level, "The force");
  if (Object.keys(set).length) found.set = set;
  if (row.low !== undefined || row.high !== undefined) found.band = [numberOf(at("band"), row.low, "The beginning of the band"), numberOf(at("band"), row.high, "The end of the band")];
  return found;
}

function uncertainOf(row) {
  const pointer = "/uncertain";
  const from = numberOf(pointer, row.from, `${row.path}, from or ±,`);
  if (row.how === "between") return [row.path, [from, numberOf(pointer, row.to, `${row.path}, to,`)]];
  const ends = row.to === undefined ? from : [from, numberOf(pointer, row.to, `${row.path}, to,`)];
  return [row.path, { [row.how === "± share" ? "deviation" : "absolute_deviation"]: ends }];
}

// The keys of a problem from what the fields say; an `Unreadable` where one says nothing that can be meant.
export function bodyOf({ variables, cases, uncertain, fields, contacts, weights }) {
  const body = { variables: {} };
  const scaling = {};
  for (const { path, low, high, how } of variables) {
    if (path in body.variables) throw new Unreadable("/variables", `${path} stands there twice.`);
    body.variables[path] = [numberOf("/variables", low, `${path}, from,`), numberOf("/variables", high, `${path}, to,`)];
    if (how && how !== "auto") scaling[path] = how;
  }
  if (Object.keys(scaling).length) body.scaling = scaling;
  for (const key of PLAIN) if (fields[key]) body[key] = numberOf(`/${key}`, fields[key], key.replaceAll("_", " "));
  for (const key of RANGES) if (fields[key]) body[key] = rangesOf(key, fields[key]);
  for (const key of WORDS) if (fields[key] && (key !== "aim" || uncertain.length)) body[key] = fields[key];
  if (contacts.length) body.contact_states = Object.fromEntries(contacts.map((name) => [name, "never-separates"]));
  if (cases.length) body.cases = cases.map(caseOf);
  if (uncertain.length) body.uncertain = Object.fromEntries(uncertain.map(uncertainOf));
  const given = Object.entries(weights).filter(([, value]) => value);
  if (given.length) body.weights = Object.fromEntries(given.map(([key, value]) => [key, numberOf("/weights", value, `The weight of the ${key}`)]));
  return body;
}

const ranged = (list) => (list ?? []).map(([low, high]) => `${low} to ${high}`).join(", ");

function caseRow({ name, engine_order: engine, order, weight, band, set = {} }) {
  const { "excitation.amplitude": level, ...others } = set;
  return { name, engine_order: engine, order, weight, low: band?.[0], high: band?.[1], level, values: Object.entries(others).map(([path, value]) => `${path} = ${value}`).join(", ") || undefined };
}

function uncertainRow([path, how]) {
  if (Array.isArray(how)) return { path, how: "between", from: how[0], to: how[1] };
  const [word, ends] = "deviation" in how ? ["± share", how.deviation] : ["± value", how.absolute_deviation];
  return Array.isArray(ends) ? { path, how: word, from: ends[0], to: ends[1] } : { path, how: word, from: ends };
}

const listed = (uncertain) => uncertain && !Array.isArray(uncertain) && Object.values(uncertain).every((how) => Array.isArray(how) || "deviation" in Object(how) || "absolute_deviation" in Object(how));

// The fields of a problem that was asked. What is given as an ellipsoid or by samples has no fields here.
export const fieldsOf = (request) => ({
  variables: Object.entries(request.variables ?? {}).map(([path, [low, high]]) => ({ path, low, high, how: request.scaling?.[path] ?? "auto" })),
  cases: (request.cases ?? []).map(caseRow),
  uncertain: listed(request.uncertain) ? Object.entries(request.uncertain).map(uncertainRow) : [],
  fields: Object.fromEntries([...PLAIN, ...WORDS].map((key) => [key, request[key] ?? ""]).concat(RANGES.map((key) => [key, ranged(request[key])]))),
  contacts: Object.keys(request.contact_states ?? {}),
  weights: request.weights ?? {},
});
