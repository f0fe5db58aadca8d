// Numbers and units as people read them.

const LENGTHS = [
  [0.1, "m", 1],
  [1e-4, "mm", 1e3],
  [1e-7, "µm", 1e6],
  [1e-10, "nm", 1e9],
  // Below an atom's size only rounding is left: said in metres, with its power of ten.
  [0, "m", 1],
];
export const METRES = { "m": 1, "mm": 1e-3, "µm": 1e-6 };
const UNITS = new Map([["frequency", "Hz"], ["amplitude", "N"], ["phase", "rad"]]);

// Units of parameters, by their paths or their names.
export const learnUnits = (found) => found.forEach(([name, unit]) => UNITS.set(name, unit));

export const number = (value, digits = 4) => {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}e${Number(exponent)}`;
  }
  return String(Number(value.toPrecision(digits)));
};

export function lengthUnit(largest) {
  const size = Math.abs(largest);
  if (!Number.isFinite(size) || size === 0) return { name: "m", perMetre: 1 };
  const [, name, perMetre] = LENGTHS.find(([least]) => size >= least);
  return { name, perMetre };
}

export const length = (metres) => {
  if (metres === null || metres === undefined) return "–";
  const unit = lengthUnit(metres);
  return `${number(metres * unit.perMetre)} ${unit.name}`;
};

export const unitOf = (path) => UNITS.get(path) ?? (path.startsWith("structure.") ? "" : UNITS.get(path.split(".").pop()) ?? "");

export const withUnit = (path) => (unitOf(path) ? `${path} [${unitOf(path)}]` : path);

export const quantity = (path, value) => `${number(value, 5)} ${unitOf(path)}`.trim();

export const seconds = (value) => (value < 1 ? `${number(value * 1e3, 3)} ms` : value < 100 ? `${number(value, 3)} s` : `${number(value / 60, 2)} min`);

// Of today the time alone, over 24 hours.
export function when(text) {
  if (!text) return "–";
  const at = new Date(text);
  const time = at.toLocaleTimeString("en-GB");
  return at.toDateString() === new Date().toDateString() ? time : `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" })} ${time}`;
}

export const percent = (share) => `${Math.round(100 * share)} %`;

export const largest = (values) => values.reduce((most, v) => (Math.abs(v) > most ? Math.abs(v) : most), 0);
