// The Pareto front of peak against band; a click loads a design.

import { chart } from "../charts/chart.js";
import { load } from "./design.js";
import { byId, el, say, show, table } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { length, lengthUnit, number, quantity, seconds } from "../base/format.js";

const FAR_APART = 8;
let plot = null;
let points = [];
let request = null;

const UNITS = { "m": 1, "mm": 1e-3, "µm": 1e-6 };
let chosen = null;

// The amplitude at which the band is measured, set by the user; without one it is half power of each peak.
function form() {
  const limit = el("input", { type: "number", id: "front-limit", min: 0, step: "any", placeholder: "half power" });
  const unit = el("select", { id: "front-unit", "aria-label": "Unit of the amplitude" }, Object.keys(UNITS).map((name) => el("option", { value: name }, name)));
  const count = el("input", { type: "number", id: "front-points", min: 3, max: 50, step: 1, placeholder: "as usual" });
  byId("front-form").addEventListener("submit", (event) => {
    event.preventDefault();
    if (limit.value !== "" && !(limit.valueAsNumber > 0)) {
      limit.setAttribute("aria-invalid", "true");
      say("front-status", "The amplitude must be a number above 0, or empty for half power.", true);
      return limit.focus();
    }
    limit.removeAttribute("aria-invalid");
    tell("front-wanted", {
      limit: limit.value === "" ? undefined : Number((limit.valueAsNumber * UNITS[unit.value]).toPrecision(9)),
      points: count.value === "" ? undefined : count.valueAsNumber,
    });
    return undefined;
  });
  show(byId("front-form"), el("label", { for: "front-limit" }, "Band measured at the amplitude"), limit, unit,
    el("label", { for: "front-points" }, "Designs"), count, el("button", { type: "submit" }, "Compute the front"));
}

function fillForm({ limit, points: count }, peak) {
  const name = limit === undefined || limit === null ? lengthUnit(peak).name : lengthUnit(limit).name;
  byId("front-unit").value = name in UNITS ? name : "m";
  byId("front-limit").value = limit === undefined || limit === null ? "" : String(Number((limit / UNITS[byId("front-unit").value]).toPrecision(6)));
  byId("front-points").value = count ?? "";
}

export function startFront() {
  form();
  plot = chart(byId("front-figure"), {
    label: "Front of peak against band",
    file: "front",
    height: 300,
    onPick: (_point, at) => points[at] && take(at),
  });
  on("scene", () => {
    [points, chosen] = [[], null];
    plot.clear();
    fillForm({}, 1);
    say("front-status", "Designs of which none has both a lower peak and a narrower band than another.");
    show(byId("front-facts"));
  });
}

export const frontView = {
  waiting: () => say("front-status", "The front waits for a worker."),
  progress: ({ took, points: count }) => say("front-status", `Front:${took}, ${count} evaluations.`),
  result(result, _sweeps, job) {
    ({ request } = job);
    points = [...result.points].sort((a, b) => a.band_hz - b.band_hz);
    if (!points.length) return say("front-status", result.status, true);
    chosen = null;
    fillForm(request, points[0].peak);
    draw();
    const measured = result.limit === null ? "half power of each peak" : length(result.limit);
    say("front-status", `${points.length} designs${result.seconds ? ` in ${seconds(result.seconds)}` : ""}, the band at ${measured}. ${result.status}`);
    return undefined;
  },
  failed(text, errors = []) {
    say("front-status", text, true);
    if (errors.some(({ pointer }) => pointer === "/limit")) byId("front-limit").setAttribute("aria-invalid", "true");
  },
};

const words = (p) => Object.entries(p.values).map(([path, v]) => `${path} ${quantity(path, v)}`).join(", ");

// A design of the front becomes that of the scene, and is marked.
function take(at) {
  chosen = at;
  load(points[at].values, request);
  const inside = byId("front-facts").contains(document.activeElement);
  draw();
  if (inside) byId("front-facts").querySelectorAll("button")[at].focus();
}

function draw() {
  const peaks = points.map((p) => p.peak);
  const unit = lengthUnit(Math.max(...peaks));
  const log = Math.max(...peaks) > FAR_APART * Math.min(...peaks);
  const limit = request.limit ?? null;
  plot.draw({
    x: { name: "resonance band [Hz]", pad: 0.06 },
    y: { name: `highest peak [${unit.name}]`, unit, log, pad: 0.12 },
    series: [{ name: "front", x: points.map((p) => p.band_hz), y: points.map((p) => p.peak * unit.perMetre), colour: 1, shape: "circle", size: 4.5 }],
    limits: limit !== null && limit >= 0.5 * Math.min(...peaks) && limit <= 2 * Math.max(...peaks) ? [{ y: limit * unit.perMetre, name: "the band is measured here" }] : [],
    marks: chosen === null ? [] : [{ x: points[chosen].band_hz, y: points[chosen].peak * unit.perMetre, shape: "diamond", colour: 2, text: "loaded" }],
    describe: (x, y, i) => `${words(points[i])}: peak ${number(y)} ${unit.name}, band ${number(x)} Hz. Enter or a click loads it.`,
  });
  show(
    byId("front-facts"),
    el("div", { class: "scroll", role: "region", "aria-label": "Designs of the front", tabindex: 0 },
      table(["design", { text: "peak", number: true }, { text: "band", number: true }, ""],
        points.map((p, i) => [el(i === chosen ? "strong" : "span", {}, words(p)), { text: length(p.peak), number: true }, { text: `${number(p.band_hz)} Hz`, number: true },
          el("button", { type: "button", "aria-label": `Load the design ${words(p)}`, onclick: () => take(i) }, i === chosen ? "Loaded" : "Load")]),
        "Designs of the front")),
  );
}
