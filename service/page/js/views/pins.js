// Earlier responses pinned under the live one: what a change did is seen beside what was before.

import { state } from "../base/address.js";
import { byId, el, show } from "../base/dom.js";
import { on, tell } from "../base/events.js";
import { length, quantity } from "../base/format.js";

const MOST = 4;
let pins = [];

// The buttons; `present` is asked for the response that is seen.
export function pinned(present) {
  const pin = el("button", { type: "button", id: "pin", onclick: () => {
    const answer = present();
    if (!answer) return;
    pins = [...pins, { answer, name: nameOf(answer) }].slice(-MOST);
    changed();
  } }, "Pin this curve");
  const unpin = el("button", { type: "button", id: "unpin", hidden: true, onclick: () => {
    pins = [];
    changed();
    pin.focus();
  } }, "Unpin all");
  show(byId("pins"), pin, unpin);
  on("scene", () => {
    pins = [];
    changed();
  });
}

function changed() {
  byId("unpin").hidden = pins.length === 0;
  tell("pins");
}

const nameOf = ({ peak }) => {
  const values = Object.entries(state.set).map(([path, value]) => `${path} ${quantity(path, value)}`);
  return [values.length ? values.slice(-2).join(", ") : "values of the scene", peak ? length(peak.value) : ""].filter(Boolean).join(": ");
};

export const ghosts = () =>
  pins.map(({ answer, name }, i) => ({ name, x: answer.parameter, y: answer.amplitude, colour: [7, 5, 4, 3][i], dash: "dotted", width: 1.6 }));
