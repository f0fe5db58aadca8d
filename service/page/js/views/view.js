// A view of a kind of study is one object: its card, what it says while a job goes on, how its result is drawn.
// What everything else knows of it (forms, tabs, the one button, what is stale) follows from its entry in views.js.

import { byId, el, say, show } from "../base/dom.js";
import { on } from "../base/state.js";

// {kind: the job it shows; id, title, tabs: of its card, the first of the tabs shows what was found; wide, hidden;
//  priority: of its jobs, the most wanted first; pressed: whether the one button begins it too;
//  form: {words, primary, hide, top, groups, fold} of the keys of its body; bar: {form, words, free}, where the button of
//  the bar is that of its form while its tab is seen, `free` without a variable to design;
//  about: what it says before anything is computed; work: what waits for a worker; goes(job): how far it is;
//  figure(host): its chart; parts(): what the card has in its order; begin(): before anything is asked; start(): once,
//  when the cards are there; scene(): at each scene;
//  result, points, submitted: what jobs tell; drawings(result): of a kind without a card, in that of its question}
export function view({ id, title, work, goes, about = "", ...own }) {
  const self = {
    id, title, about, goes,
    plot: null,
    say: (words, bad) => say(`${id}-status`, words, bad),
    facts: (...nodes) => show(byId(`${id}-facts`), ...nodes),
    waiting: () => self.say(`The ${work} waits for a worker.`),
    progress: (job) => self.say(goes(job)),
    failed: (words) => self.say(words, true),
    parts: () => [formPart(id), statusPart(id), self.figure && figurePart(`${id}-figure`), el("div", { id: `${id}-facts` })],
    begin() {},
    start() {},
    scene() {},
    clear() {
      self.plot?.clear();
      self.say(about);
      self.facts();
    },
    ...own,
  };
  return self;
}

export const formPart = (id) => el("form", { id: `${id}-form`, novalidate: true });
export const statusPart = (id) => el("p", { class: "status", id: `${id}-status`, role: "status" });
export const figurePart = (id) => el("div", { class: "figure", id });

// Puts the cards of views into the panel, before those of the runs.
export const placeCards = (views) => byId("runs").before(...views.filter(({ title }) => title).map(cardOf));

export function startViews(views) {
  for (const each of views) {
    if (each.figure) each.plot = each.figure(byId(`${each.id}-figure`));
    each.start();
    if (each.title) on("scene", () => {
      each.clear();
      each.scene();
    });
  }
}

function cardOf({ id, title, tabs, kind, wide, hidden, parts }) {
  const stale = kind ? el("div", { class: "stale", id: `${id}-stale`, role: "status", hidden: true }) : null;
  return el("section", { class: wide ? "card wide" : "card", id, "data-tabs": tabs, "aria-labelledby": `${id}-title`, hidden },
    el("h2", { id: `${id}-title` }, title), stale, parts());
}

// A view whose form says what is wrong with a job that it asked for.
export const complaining = (of, form) => ({ ...of, failed(words, errors = [], job) {
  of.failed(words, errors, job);
  form?.complain(errors);
} });
