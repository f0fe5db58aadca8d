// The buttons that take a map away: its CSV is a table of every cell.

import { saving } from "./chart.js";
import { el } from "../base/dom.js";

function columns({ x, y, rows }) {
  const [xs, ys, values] = [[], [], []];
  y.values.forEach((b, j) => {
    x.values.forEach((a, i) => {
      xs.push(a);
      ys.push(b);
      values.push(rows[j][i]);
    });
  });
  return [[x.name, xs], [y.name, ys], ["amplitude [m]", values]];
}

export function chartTools(self, file, label, more) {
  self.columns = () => columns(self.shown);
  return el("div", { class: "chart-tools" }, more, saving(self, file, label, () => self.canvas));
}
