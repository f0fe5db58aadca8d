// What a result says of itself beside its numbers: flags, and what is known between the points of a response.

import { el } from "./dom.js";

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
