// The interference diagram of a disk: natural frequencies over the nodal diameter, and the engine orders there.

import { byId, details, el, note, numeric, scrolledTable } from "../base/dom.js";
import { hertz, number } from "../base/format.js";
import { chart } from "../charts/chart.js";
import { refusedFor } from "../scene/kinds.js";
import { figurePart, formPart, statusPart, view } from "./view.js";

const HEADROOM = 1.05;
const MOST_NAMED = 40;
const SHIFT = { forward: 0.07, backward: -0.07 };

export const interference = view({
  kind: "interference", id: "interference", title: "Interference diagram", tabs: "disk", wide: true, hidden: true, priority: 3, pressed: true,
  form: { words: "Show", top: ["speed_rpm", "within"], groups: [{ legend: "Orders, families, frequencies", id: "more" }] },
  about: "Natural frequencies over the nodal diameter, with what the engine orders excite at a speed.",
  work: "diagram", goes: ({ took }) => `Nodal diameters:${took}.`,
  figure: (host) => chart(host, { label: "Interference diagram", file: "interference", height: 380 }),
  parts: () => [statusPart("interference"), formPart("interference"), figurePart("interference-figure"), el("div", { id: "interference-facts" })],
  scene: () => { byId("interference").hidden = refusedFor("interference") !== ""; },
  result(found) {
    draw(found);
    const inside = found.crossings.filter((one) => one.inside).length;
    const missing = found.missing.length ? ` The sector was not reduced for the nodal diameters ${found.missing.join(", ")}.` : "";
    const met = found.speed_rpm === null ? "" : ` At ${number(found.speed_rpm, 6)} /min engine orders meet families at ${inside} places and come near them at ${found.crossings.length - inside} more.`;
    interference.say(`${found.sectors} sectors. Friction moves each natural frequency between open and stuck.${met}${missing}`);
    interference.facts(crossings(found), frequencies(found));
  },
});

const place = (point) => point.diameter + (SHIFT[point.wave] ?? 0);

// The i-th frequencies of all nodal diameters as lines, with gaps between them; each direction has its own.
function families(points, key) {
  const [x, y] = [[], []];
  const ways = points.some(({ wave }) => wave === "backward") ? ["forward", "backward"] : ["forward"];
  const most = Math.max(0, ...points.map((point) => point[key].length));
  for (const way of ways) {
    const mine = points.filter(({ wave }) => wave === way || wave === "standing" || wave === "both");
    for (let i = 0; i < most; i += 1) {
      x.push(...mine.map(place), null);
      y.push(...mine.map((point) => point[key][i] ?? null), null);
    }
  }
  return { x, y };
}

// From open to stuck at each nodal diameter: where friction may put the resonance.
function ranges(points) {
  return {
    x: points.flatMap((point) => point.open_hz.flatMap(() => [place(point), place(point), null])),
    y: points.flatMap(({ open_hz: open, stuck_hz: stuck }) => open.flatMap((hertz, i) => [hertz, stuck[i], null])),
  };
}

// The line that the orders lie on, folded at 0 and at half the sectors.
function folded({ sectors, speed_rpm: speed }, top) {
  const half = sectors / 2;
  const perOrder = speed / 60;
  const [x, y] = [[0], [0]];
  for (let fold = 1; y[y.length - 1] < top; fold += 1) {
    x.push(fold % 2 ? half : 0);
    y.push(fold * half * perOrder);
  }
  return { x, y };
}

function draw(found) {
  const points = found.diameters;
  const highest = Math.max(...points.flatMap((point) => [...point.open_hz, point.stuck_hz[0] ?? 0]), 0);
  const top = HEADROOM * Math.max(highest, 1e-9);
  const orders = found.orders.filter((one) => one.frequency_hz <= top);
  const met = new Map();
  for (const one of found.crossings) met.set(one.order, [...(met.get(one.order) ?? []), one]);
  const kind = ({ order }) => (!met.has(order) ? "clear" : met.get(order).some(({ inside }) => inside) ? "meets" : "near");
  const of = (which) => {
    const mine = orders.filter((one) => kind(one) === which);
    return { x: mine.map((one) => one.diameter), y: mine.map((one) => one.frequency_hz) };
  };
  const flagged = orders.filter((one) => kind(one) !== "clear");
  interference.plot.draw({
    x: { name: "nodal diameter", low: -0.35, high: Math.floor(found.sectors / 2) + 0.35, whole: true },
    y: { name: "frequency [Hz]", low: 0, high: top },
    series: [
      { x: orders.map((one) => one.diameter), y: orders.map((one) => one.frequency_hz), colour: 7, shape: "circle", size: 2.6, width: 0 },
      { ...ranges(points), paint: "range", name: "what friction may reach" },
      ...(found.speed_rpm === null ? [] : [{ ...folded(found, top), colour: 7, name: "engine orders", bare: true }]),
      { ...families(points, "open_hz"), colour: 4, dash: "dashed", shape: "square", size: 2.8, name: "all open" },
      { ...families(points, "stuck_hz"), colour: 3, shape: "circle", name: "all stuck", bare: true },
      { ...of("meets"), colour: 2, shape: "diamond", size: 4.5, width: 0, name: "meets a family" },
      { ...of("near"), colour: 5, shape: "triangle", size: 4.5, width: 0, name: `within ${number(100 * found.within)} %` },
    ],
    marks: (flagged.length <= MOST_NAMED ? flagged : []).map((one) => ({
      x: one.diameter, y: one.frequency_hz, text: String(one.order),
      ...(kind(one) === "meets" ? { shape: "diamond", colour: 2 } : { shape: "triangle", colour: 5 }),
    })),
    describe: (x, y, i) => described(orders[i], met.get(orders[i].order) ?? []),
  });
}

const way = ({ wave }) => (wave === "standing" ? "" : ` ${wave}`);

function described(one, found) {
  const what = found.map((each) => (each.inside ? `meets family ${each.family}` : `${number(100 * each.margin, 3)} % from family ${each.family}`));
  return `order ${one.order}: nodal diameter ${one.diameter}${way(one)}, ${hertz(one.frequency_hz)}, ${what.join(", ") || "meets none"}`;
}

// Engine orders that meet a family, or are near one.
function crossings(found) {
  if (found.speed_rpm === null) return null;
  if (!found.crossings.length) return note("No engine order meets a family or is near one.");
  const rows = found.crossings.map((one) => [
    numeric(String(one.order)), `${one.diameter}${way(one)}`, numeric(number(one.frequency_hz, 5)), numeric(String(one.family)), numeric(ends(one.open_hz, one.stuck_hz)),
    one.inside ? el("strong", {}, "meets") : `${number(100 * one.margin, 3)} % away`,
  ]);
  const heads = [numeric("order"), "nodal diameter", ...["at [Hz]", "family", "open – stuck [Hz]"].map(numeric), ""];
  const caption = `Engine orders at ${number(found.speed_rpm, 6)} /min that meet a family or are within ${number(100 * found.within)} % of one`;
  return scrolledTable("Engine orders that meet a family", heads, rows, { caption, more: "disk-table" });
}

const ends = (open, stuck) => `${number(open, 5)} – ${number(stuck, 5)}`;

function frequencies({ diameters }) {
  const each = Array.from({ length: Math.max(0, ...diameters.map((point) => point.open_hz.length)) }, (_, i) => i);
  const rows = diameters.map(({ diameter, wave, open_hz: open, stuck_hz: stuck }) => [
    `${diameter}${wave === "both" ? "" : way({ wave })}`, ...each.map((i) => numeric(open[i] === undefined ? "" : ends(open[i], stuck[i])))]);
  return details("Natural frequencies [Hz], open – stuck",
    scrolledTable("Natural frequencies at each nodal diameter", ["nodal diameter", ...each.map((i) => numeric(`family ${i + 1}`))], rows,
      { caption: "Natural frequencies [Hz] at each nodal diameter, with all contacts open and stuck", more: "disk-table" }));
}
