// What one per cent of each parameter does to the best design: to its peaks and to its band.

import { state } from "../base/address.js";
import { byId, el, show, table } from "../base/dom.js";
import { on } from "../base/events.js";
import { length, number } from "../base/format.js";
import { previewer } from "../network/previews.js";

const FIRST = 6;
let ask = null;
let asked = "";

export function startSensitivities() {
  ask = previewer("sensitivities", (found, { token }) => token === asked && draw(found), (error, token) => {
    if (token === asked) show(byId("design-sensitivities"), el("p", { class: "note" }, `Sensitivities: ${error.message}`));
  });
  on("scene-left", clear);
  on("job-begun", (kind) => kind === "design" && clear());
  on("computed", ({ kind, request, result }) => {
    if (kind !== "design" || !Object.keys(result.optimum ?? {}).length) return;
    const body = { kind: "sensitivities", scene: state.scene, set: valuesAt(request, result.optimum), harmonics: request.harmonics ?? 11 };
    if (result.limit) body.limit = result.limit;
    asked = JSON.stringify(body);
    cases = Boolean(request.cases?.length);
    ask(body, asked);
  });
}

let cases = false;

function clear() {
  asked = "";
  show(byId("design-sensitivities"));
}

// The values a design was computed with, and those it found; paths that share one are separated by commas.
function valuesAt({ set = {} }, optimum) {
  const shared = Object.entries(optimum).flatMap(([names, value]) => names.split(",").map((path) => [path.trim(), value]));
  return { ...set, ...Object.fromEntries(shared) };
}

const percent = (share) => ({ text: share === null ? "–" : `${share > 0 ? "+" : share < 0 ? "−" : ""}${number(Math.abs(share), 3)} %`, number: true });

function draw({ peaks, rows, left_out: without, band_hz: band, limit, n_harmonics: kept, status, reached }) {
  const host = byId("design-sensitivities");
  if (!reached || !rows.length) return show(host, el("p", { class: "note" }, `Sensitivities: ${status}`));
  const heads = ["parameter", { text: "value", number: true }, ...peaks.map(({ at }) => ({ text: `peak at ${number(at, 5)} Hz`, number: true })), { text: "band", number: true }];
  const lines = rows.map(({ path, value, unit, peaks_percent: each, band_percent: width }) => [path, { text: `${number(value, 5)} ${unit}`.trim(), number: true }, ...each.map(percent), percent(width)]);
  const part = (some, name) => el("div", { class: "scroll", role: "region", "aria-label": name, tabindex: 0 }, table(heads, some, name));
  const of = [`For one per cent more of a parameter${band === null ? "" : `; the band is measured at ${length(limit)}`}.`, `${kept} harmonics.`,
    cases ? "Of the scene as it is set, without the load cases." : ""].filter(Boolean).join(" ");
  return show(host, el("h3", {}, "Sensitivities at the design"), el("p", { class: "note" }, of), part(lines.slice(0, FIRST), "Sensitivities at the design"),
    lines.length > FIRST ? el("details", {}, el("summary", {}, `${lines.length - FIRST} further parameters, which matter less`), part(lines.slice(FIRST), "Further sensitivities")) : null,
    without.map(({ path, reason }) => el("p", { class: "note" }, `Left out: ${path}: ${reason}`)));
}
