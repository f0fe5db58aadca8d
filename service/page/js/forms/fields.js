// What a key takes, by its JSON Schema: its kind, unit, words and ends, how it is written in a field and read from one.

const UNIT = /\[([^\]]+)\]/;
// A unit that the name of a key ends with is said beside its field.
const SUFFIXES = { _hz: "Hz", _rpm: "1/min", _hz_per_s: "Hz/s" };
// A bound that stands for 0, which is out.
const TINY = 1e-6;
const RANGE = /^\s*(\S+?)\s*(?:to|–|…|:)\s*(\S+)\s*$/;

// What can not be read as what it should be, with the pointer to it.
export class Unreadable extends Error {
  constructor(pointer, detail) {
    super(detail);
    this.errors = [{ pointer, detail }];
  }
}

const isNumber = ({ type }) => type === "number" || type === "integer";

function kindOf(node, defs) {
  if (node.anyOf) return kindOf(node.anyOf.find((one) => one.type === "array" && one.items?.type === "string") ?? node.anyOf.find((one) => one.type !== "null" && one.type !== "object") ?? node.anyOf[0], defs);
  if (node.type === "boolean") return { kind: "truth" };
  if (node.enum ?? node.const) return { kind: "choice", choices: node.enum ?? [node.const] };
  if (isNumber(node)) return { kind: "number", whole: node.type === "integer" };
  if (node.type === "string") return { kind: "text" };
  if (node.type === "array") {
    const items = node.items?.$ref ? defs[node.items.$ref.split("/").pop()] : node.items ?? {};
    if (isNumber(items)) return { kind: node.minItems === 2 && node.maxItems === 2 ? "pair" : "numbers" };
    if (items.type === "array") return { kind: "pairs" };
    if (items.type === "string") return { kind: "texts" };
    if (items.properties) return { kind: "rows", columns: Object.entries(items.properties).map(([key, each]) => fieldOf(key, each, defs)) };
  }
  const [[pattern, inside] = []] = Object.entries(node.patternProperties ?? {});
  const value = inside ?? (typeof node.additionalProperties === "object" ? node.additionalProperties : null);
  if (node.type === "object" && value) return { kind: "table", by: pattern ?? "", names: node.propertyNames?.enum ?? null, of: fieldOf("", value, defs) };
  return { kind: "json" };
}

// One key of a body: {key, label, kind, unit, words, ends, otherwise, …}.
function fieldOf(key, schema, defs, required = false) {
  const suffix = Object.keys(SUFFIXES).find((end) => key.endsWith(end));
  return {
    key, required, words: schema.description ?? "", unit: UNIT.exec(schema.description ?? "")?.[1] ?? SUFFIXES[suffix] ?? "",
    label: (suffix ? key.slice(0, -suffix.length) : key).replaceAll("_", " "), otherwise: schema.default, schema, ends: endsOf(schema), ...kindOf(schema, defs),
  };
}

export const fieldsOf = ({ properties, required = [], $defs = {} }) =>
  Object.entries(properties).map(([key, schema]) => fieldOf(key, schema, $defs, required.includes(key)));

// The ends that a number keeps within, in words.
export function endsOf({ minimum, exclusiveMinimum: above, maximum, exclusiveMaximum: below }) {
  const far = (end) => end === undefined || Math.abs(end) >= 1e9;
  if (minimum > 0 && minimum < TINY) return endsOf({ exclusiveMinimum: 0, maximum, exclusiveMaximum: below });
  return [above !== undefined && !far(above) ? `above ${above}` : far(minimum) ? "" : `from ${minimum}`,
    below !== undefined && !far(below) ? `below ${below}` : far(maximum) ? "" : `to ${maximum}`].filter(Boolean).join(" ");
}

const HINTS = { pairs: "520 to 560, 600 to 620", numbers: "with commas", texts: "with commas", pair: "500 to 900" };

// What stands in an empty field: what holds then, or how it is written.
export const hintOf = ({ otherwise, kind, ends, of, schema }) =>
  (of?.kind === "table" && schema.examples ? JSON.stringify(schema.examples[0]) : otherwise !== undefined && otherwise !== null && typeof otherwise !== "object" ? String(otherwise) : HINTS[kind] ?? (kind === "number" ? ends : ""));

const plainTable = (value) => Object.entries(value).map(([path, one]) => `${path} = ${one}`).join(", ");

// A value as it is written in a field; `per` of the unit of the field are one of the service.
export function written(field, value, per = 1) {
  if (value === undefined || value === null) return "";
  if (field.kind === "pair") return value.join(" to ");
  if (field.kind === "pairs") return value.map((pair) => pair.join(" to ")).join(", ");
  if (Array.isArray(value) && value.every((one) => typeof one !== "object")) return value.join(", ");
  if (field.kind === "number" && typeof value === "number") return String(Number((value * per).toPrecision(12)));
  const plain = field.kind === "table" && Object.values(value).every((one) => typeof one !== "object");
  return plain ? plainTable(value) : typeof value === "object" ? JSON.stringify(value) : String(value);
}

export function numberOf(text, pointer, words) {
  const value = Number(String(text ?? "").trim().replace(/^([+-]?\d+),(\d+)$/, "$1.$2"));
  if (text === undefined || String(text).trim() === "" || !Number.isFinite(value)) throw new Unreadable(pointer, `${words} must be a number, got ${text ? `“${text}”` : "nothing"}.`);
  return value;
}

// A number that keeps what the schema says of it.
function within({ label, schema, whole, ends }, value, pointer) {
  const { minimum = -Infinity, exclusiveMinimum: above = -Infinity, maximum = Infinity, exclusiveMaximum: below = Infinity } = schema;
  if (whole && !Number.isInteger(value)) throw new Unreadable(pointer, `${label} must be a whole number, got ${value}.`);
  if (value < minimum || value > maximum || value <= above || value >= below) throw new Unreadable(pointer, `${label} must be a number ${ends}, got ${value}.`);
  return value;
}

const parts = (text) => text.split(",").map((part) => part.trim()).filter(Boolean);

function rangeOf(part, pointer) {
  const found = RANGE.exec(part);
  if (!found) throw new Unreadable(pointer, `Ranges are written as 520 to 560, 600 to 620; “${part}” is none.`);
  return found.slice(1).map((end) => numberOf(end, pointer, "The end of a range"));
}

function tableOf(text, pointer) {
  return Object.fromEntries(parts(text).map((part) => {
    const [path, value, more] = part.split("=").map((word) => word.trim());
    if (!value || more !== undefined) throw new Unreadable(pointer, `Values are written as damper.mu = 0.3, with commas; “${part}” is none.`);
    return [path, numberOf(value, pointer, path)];
  }));
}

// What was written in a field; undefined if nothing was.
export function readField(field, text, pointer, per = 1) {
  const { kind, label } = field;
  if (typeof text !== "string" || text.trim() === "") return undefined;
  if (kind === "number") return within(field, per === 1 ? numberOf(text, pointer, label) : Number((numberOf(text, pointer, label) / per).toPrecision(12)), pointer);
  if (kind === "choice" || kind === "text") return text.trim();
  if (kind === "numbers") return parts(text).map((part) => numberOf(part, pointer, label));
  if (kind === "texts") return parts(text);
  if (kind === "pair") return rangeOf(text.trim(), pointer);
  if (kind === "pairs") return parts(text).map((part) => rangeOf(part, pointer));
  if (kind === "table" && field.of.kind === "number" && !text.trim().startsWith("{")) return tableOf(text, pointer);
  try {
    return JSON.parse(text);
  } catch {
    throw new Unreadable(pointer, `${label} takes JSON, got “${text.trim()}”.`);
  }
}
