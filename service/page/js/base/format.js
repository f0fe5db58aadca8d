// Numbers and units as people read them, how long a job runs, and what a result says of itself beside its numbers.

import { el } from "./dom.js";

// The prefixes of units by the least size that has them; below the last one only rounding is left: said in the
// unit itself, with its power of ten. The same as `solver.results.units` has.
const SMALL = [[1e-4, "m", 1e3], [1e-7, "µ", 1e6]];
const USUAL = [[1e13, "", 1], [1e9, "G", 1e-9], [1e6, "M", 1e-6], [1e4, "k", 1e-3], [0.1, "", 1], ...SMALL];
const PREFIXES = {
  m: [[0.1, "", 1], ...SMALL, [1e-10, "n", 1e9]], s: [[1, "", 1], [1e-3, "m", 1e3], SMALL[1]],
  g: [[100, "k", 1e-3], [0.1, "", 1], ...SMALL], Hz: [[1e4, "k", 1e-3]], "N": USUAL, "N/m": USUAL, "Pa": USUAL, "J": USUAL, "W": USUAL,
};
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

// The unit with the prefix in which a quantity is a number of few digits: lengths from 0.1 to 100.
export function shownUnit(largest, unit = "m") {
  const size = Math.abs(largest);
  if (!Number.isFinite(size) || size === 0) return { name: unit, perMetre: 1 };
  if (unit === "kg") return (({ name, perMetre }) => ({ name, perMetre: 1e3 * perMetre }))(shownUnit(1e3 * size, "g"));
  const [, prefix, per] = PREFIXES[unit]?.find(([least]) => size >= least) ?? [0, "", 1];
  return { name: prefix + unit, perMetre: per };
}

// A quantity with its unit, and its error beside it, if that is known.
export function measured(value, unit, error = null, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const { name, perMetre: per } = shownUnit(value, unit);
  if (!Number.isFinite(error ?? NaN) || Math.abs(error) < 1e-6 * Math.abs(value)) return `${number(value * per, digits)} ${name}`.trim();
  if (Math.abs(error) < 1e-3 * Math.abs(value)) return `${measured(value, unit, null, digits)} ± ${measured(error, unit, null, 2)}`;
  return `${number(value * per, digits)} ± ${number(error * per, 2)} ${name}`.trim();
}

// What is known of the error of a peak: as it is judged, where max |x| has none.
export const errorOf = ({ error_estimate: error, relative_error: share, peak }) => (typeof error === "number" ? error : typeof share === "number" && peak ? share * peak.value : null);
export const length = (metres) => measured(metres, "m");
export const hertz = (value) => measured(value, "Hz");
export const unitOf = (path) => UNITS.get(path) ?? (path.startsWith("structure.") ? "" : UNITS.get(path.split(".").pop()) ?? "");
export const withUnit = (path) => (unitOf(path) ? `${path} [${unitOf(path)}]` : path);
export const quantity = (path, value) => measured(value, unitOf(path));
export const seconds = (value) => measured(value, "s", null, 3);

// Of today the time alone, over 24 hours.
export function when(text) {
  if (!text) return "–";
  const at = new Date(text);
  const time = at.toLocaleTimeString("en-GB");
  return at.toDateString() === new Date().toDateString() ? time : `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" })} ${time}`;
}

export const percent = (share) => `${Math.round(100 * share)} %`;
export const largest = (values) => values.reduce((most, v) => (Math.abs(v) > most ? Math.abs(v) : most), 0);

// A factor for every number that is known.
export const times = (factor) => (value) => (value === null ? null : factor * value);

// Values by their paths, in words.
export const valuesSaid = (values) => Object.entries(values).map(([path, value]) => `${path} ${quantity(path, value)}`).join(", ");

// The place of the number that is nearest to another.
export const nearestIn = (values, wanted) => values.reduce((best, value, i) => (Math.abs(value - wanted) < Math.abs(values[best] - wanted) ? i : best), 0);
const RELIABLE = 0.03;

const span = (ms) => {
  const total = Math.max(Math.round(ms / 1000), 0);
  if (total < 60) return `${total} s`;
  if (total < 3600) return `${Math.floor(total / 60)} min ${total % 60} s`;
  return `${Math.floor(total / 3600)} h ${Math.floor((total % 3600) / 60)} min`;
};

// " 40 %, 12 s, about 18 s more" of a job that runs; what it will take is not said before there is enough to go by.
export function timing({ status, progress, started }, now = Date.now()) {
  if (status !== "running") return "";
  const share = ` ${Math.round(100 * progress)} %`;
  if (!started) return share;
  const elapsed = now - Date.parse(started);
  const left = progress > RELIABLE && progress < 1 && elapsed > 1000 ? `, about ${span((elapsed * (1 - progress)) / progress)} more` : "";
  return `${share}, ${span(elapsed)}${left}`;
}

const FLAGS = {
  mean_undetermined: "the mean, and with it max|x|, depends on the history: go by half peak to peak",
  history_dependent: "half peak to peak depends on the history too: march from the starts that may occur",
  all_stuck: "every contact sticks all the time",
  separation: "a contact opens during the period",
  mean_load_above_friction: "mean load above friction: dashpots alone, or nothing, hold a part that contacts alone touch",
  not_unique: "its mirror image is a response too, and the symmetric one is unstable",
  symmetric_unstable: "a half-wave symmetric response is unstable: another one, with a mean, is seen",
  travelling_wave_assumed: "the response is assumed to be the travelling wave: compare with every sector",
  worst_mean: "where the mean depends on the history, a stress is judged by the worst mean that stuck contacts may hold",
  mean_stress_open: "how large a mean stress stuck contacts hold is not known: margins are those of an unloaded start",
};

// The flags of a result, one of a newer version as it is, and its notes, without what its warnings say.
export const notes = ({ flags, notes: said, mean_undetermined: free, warnings = [] }) => [
  ...new Set([...(free ? ["mean_undetermined"] : []), ...(flags ?? [])].map((flag) => FLAGS[flag] ?? flag.replaceAll("_", " "))),
  ...(said ?? []).map(({ words }) => words),
].filter((words) => !warnings.includes(words)).map((words) => ["note", words]);

// Nothing of what an earlier version computed.
export function betweenPoints({ peak, peak_certificate: found, band_known: band }) {
  if (!peak || !found) return [];
  if (!found.known) return [["between points", el("span", { class: "bad" }, found.reason)]];
  const open = band === false ? [["note", "the band may have further pieces between points"]] : [];
  return [["between points", "known, no peak is higher"], ...open];
}

// Why it is not known of some of several responses, each reason once.
export const warnings = (certificates) =>
  [...new Set(certificates.filter((one) => one && !one.known).map((one) => one.reason))]
    .map((reason) => ["warning", el("span", { class: "bad" }, `a response may have further peaks. ${reason}`)]);
