// Words in a drawing, each where there is room: not over other words, over what is kept free or outside. One that
// finds no room is left out.

import { svg } from "../base/dom.js";

const LINE = 14;
const RISE = 11; // of a line above its base
const AROUND = [[1, 0], [-1, 0], [0, -1], [0, 1], [0.8, -0.8], [-0.8, -0.8], [0.8, 0.8], [-0.8, 0.8]];
let pen = null;

function widthOf(words, bold) {
  pen ??= Object.assign(document.createElement("canvas").getContext("2d"), { family: getComputedStyle(document.body).fontFamily });
  pen.font = `${bold ? 700 : 400} 12px ${pen.family}`;
  return 1.03 * pen.measureText(words).width + 2;
}

export function labels({ left = 0, top = 0, width, height }) {
  const taken = [];
  const free = (box) => box.x >= left && box.y >= top && box.x + box.w <= left + width && box.y + box.h <= top + height
    && !taken.some((other) => box.x < other.x + other.w && other.x < box.x + box.w && box.y < other.y + other.h && other.y < box.y + box.h);
  const keep = ({ x, y }, half) => taken.push({ x: x - half, y: y - half, w: 2 * half, h: 2 * half });
  return {
    keep,
    // A line that words must not cover.
    keepLine(a, b, half = 3) {
      const steps = Math.max(1, Math.ceil(Math.hypot(b.x - a.x, b.y - a.y) / (2 * half)));
      for (let i = 0; i <= steps; i += 1) keep({ x: a.x + (i / steps) * (b.x - a.x), y: a.y + (i / steps) * (b.y - a.y) }, half);
    },
    // Words `far` from a place, at the first side with room, or farther off.
    put(words, { x, y }, { far = 8, sides = AROUND, more = 3, class: name = "halo", bold = false } = {}) {
      const w = widthOf(words, bold);
      for (let ring = 1; ring <= more; ring += 1) {
        for (const [across, down] of sides) {
          const at = { x: x + across * (far + (ring - 1) * LINE), y: y + down * (far + (ring - 1) * LINE) };
          const anchor = across > 0.3 ? "start" : across < -0.3 ? "end" : "middle";
          const base = at.y + (down < -0.3 ? -2 : down > 0.3 ? RISE : RISE / 2 - 1);
          const box = { x: at.x - { start: 0, middle: w / 2, end: w }[anchor], y: base - RISE, w, h: LINE };
          if (!free(box)) continue;
          taken.push(box);
          return svg("text", { class: bold ? `${name} bold` : name, x: at.x.toFixed(1), y: base.toFixed(1), "text-anchor": anchor }, words);
        }
      }
      return null;
    },
  };
}
