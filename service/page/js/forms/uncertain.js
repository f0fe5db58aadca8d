// What is not known: intervals and deviations as rows, or what an identification gave, held as it is.

import { button, byId, el, show } from "../base/dom.js";
import { boundsTold, namesOfTable, rowsOf } from "./rows.js";
import { numberOf, Unreadable } from "./fields.js";

const HOW = { "± share": "deviation", "± value": "absolute_deviation" };

function intervalOf({ path, how, from, to }) {
  const pointer = `/uncertain/${path}`;
  const first = numberOf(from, pointer, `${path}, from or ±,`);
  const both = () => [first, numberOf(to, pointer, `${path}, to,`)];
  return how === "between" ? both() : { [HOW[how]]: to === undefined ? first : both() };
}

function rowOf([path, how]) {
  if (Array.isArray(how)) return { path, how: "between", from: how[0], to: how[1] };
  const [word, ends] = "deviation" in how ? ["± share", how.deviation] : ["± value", how.absolute_deviation];
  return Array.isArray(ends) ? { path, how: word, from: ends[0], to: ends[1] } : { path, how: word, from: ends };
}

const isListed = (uncertain) => uncertain && !Array.isArray(uncertain) && Object.values(uncertain).every((how) => Array.isArray(how) || "deviation" in Object(how) || "absolute_deviation" in Object(how));

const wordsOf = (uncertain) => (Array.isArray(uncertain) ? `${uncertain.length} samples` : `an ellipsoid of ${Object.keys(uncertain.centre ?? uncertain.half_axes ?? {}).join(", ") || "deviations"}`);

// The part of a form for the key `uncertain`, whose schema takes any table.
export function uncertainPart(id) {
  let rows = null;
  let given = null;

  function hold(found) {
    given = found;
    show(byId(`${id}-given`), given ? el("p", { class: "row" }, el("span", { class: "chip good" }, given.words), el("span", { class: "note" }, "in place of intervals"),
      button("Take it out", () => { hold(null); byId(`${id}-uncertain-add`).focus(); })) : null);
  }

  return {
    node(field) {
      const inner = el("div", { id: `${id}-uncertain` });
      rows = rowsOf(inner, { id: inner.id, one: "uncertain parameter", told: (path, changed) => {
        const { low, high, ...told } = boundsTold("uncertain", path, changed);
        return low === undefined ? told : { ...told, from: low, to: high };
      }, columns: [
        { name: "path", label: "quantity", type: "select", options: () => namesOfTable("uncertain") }, { name: "now", label: "now", type: "now" },
        { name: "how", label: "known", type: "select", options: () => ["between", ...Object.keys(HOW)] }, { name: "from", label: "from, or ±" }, { name: "to", label: "to" }, { name: "unit", label: "unit", type: "now" }] });
      return el("fieldset", {}, el("legend", { title: field.words }, "Not known"), el("div", { id: `${id}-given` }), inner);
    },
    read() {
      const found = rows.read();
      if (given && found.length) throw new Unreadable("/uncertain", "Intervals and what was identified do not go together: take one of them out.");
      return given ? { uncertain: given.uncertain } : found.length ? { uncertain: Object.fromEntries(found.map((row) => [row.path, intervalOf(row)])) } : {};
    },
    fill({ uncertain }) {
      const listed = isListed(uncertain);
      rows.fill(listed ? Object.entries(uncertain).map(rowOf) : []);
      hold(uncertain && !listed ? { uncertain, words: wordsOf(uncertain) } : null);
    },
    blame: (which, words) => Boolean(which) && rows.blame(which, "from", words),
    hold(found) {
      rows.fill([]);
      hold(found);
    },
    words: () => (given ? [given.words] : rows.read().map(({ path, how, from, to }) => `${path} ${how === "between" ? `in ${from ?? "…"} – ${to ?? "…"}` : `${how.replace("±", `± ${from ?? "…"}`)}`}`)),
  };
}
