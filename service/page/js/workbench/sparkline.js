// A response as a line of a few pixels.

import { svg } from "../base/dom.js";

const [WIDE, HIGH] = [84, 22];

export function sparkline(curve) {
  if (!curve?.amplitude.length) return "";
  const { frequency_hz: x, amplitude: y } = curve;
  const [first, last, top] = [x[0], x[x.length - 1], Math.max(...y)];
  const at = x.map((hertz, i) => `${((WIDE * (hertz - first)) / (last - first || 1)).toFixed(1)} ${(HIGH - 2 - ((HIGH - 4) * y[i]) / (top || 1)).toFixed(1)}`);
  return svg("svg", { class: "spark", viewBox: `0 0 ${WIDE} ${HIGH}`, width: WIDE, height: HIGH, "aria-hidden": "true" }, svg("path", { class: "series c1", d: `M${at.join("L")}` }));
}
