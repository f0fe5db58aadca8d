// The scene that is being edited: its text and its tables, kept alike by the service, and what they were before.

import { Offline, Problem, post } from "../network/api.js";

const PAUSE_MS = 220;
const MOST_STEPS = 200;

// `shown(what)` is told whenever text, tables or issues are others: {from: "text" | "tables" | "history" | "scene" | "file"}.
export function sceneDocument(shown) {
  let now = { text: "", scene: {} };
  let issues = [];
  let unreadable = false;
  let steps = [];
  let at = -1;
  let turn = 0;
  let timer = 0;
  let pending = null;
  let running = Promise.resolve();

  function later(from) {
    pending = from;
    turn += 1;
    clearTimeout(timer);
    timer = setTimeout(settle, PAUSE_MS);
  }

  function settle() {
    clearTimeout(timer);
    if (pending === null) return running;
    const from = pending;
    pending = null;
    running = ask(from, turn);
    return running;
  }

  async function ask(from, mine) {
    let found;
    try {
      found = await post("/v1/scenes/edit", ["tables", "scene"].includes(from) ? { text: now.text, scene: now.scene } : { text: now.text });
    } catch (error) {
      if (!(error instanceof Problem || error instanceof Offline)) throw error;
      if (mine === turn) shown({ from, failed: error.message, errors: error.errors ?? [] });
      return;
    }
    // What came of an earlier state is of no use: the present one is on its way.
    if (mine !== turn) return;
    unreadable = found.scene === null;
    issues = found.issues;
    now = { text: found.text, scene: found.scene ?? now.scene };
    if (!unreadable && from !== "history") remember();
    shown({ from });
  }

  function remember() {
    const step = JSON.stringify([now.text, now.scene]);
    if (steps[at] === step) return;
    steps = [...steps.slice(Math.max(0, at + 2 - MOST_STEPS), at + 1), step];
    at = steps.length - 1;
  }

  function move(by) {
    if (at + by < 0 || at + by >= steps.length) return false;
    at += by;
    const [text, scene] = JSON.parse(steps[at]);
    now = { text, scene };
    unreadable = false;
    pending = "history";
    turn += 1;
    shown({ from: "history", before: true });
    settle();
    return true;
  }

  return {
    get text() { return now.text; },
    get scene() { return now.scene; },
    get issues() { return issues; },
    get unreadable() { return unreadable; },
    get settled() { return pending === null; },
    get canUndo() { return at > 0; },
    get canRedo() { return at < steps.length - 1; },
    // Begins with a text, or with tables of which one is made.
    open({ text = "", scene = null }) {
      now = { text, scene: scene ?? {} };
      [issues, unreadable, steps, at] = [[], false, [], -1];
      turn += 1;
      pending = null;
      running = ask(scene ? "scene" : "file", turn);
      return running;
    },
    type(text) {
      now = { ...now, text };
      later("text");
    },
    change(how) {
      const scene = structuredClone(now.scene);
      how(scene);
      now = { ...now, scene };
      later("tables");
    },
    settle,
    undo: () => (pending !== null ? (steps.length ? move(0) : false) : move(-1)),
    redo: () => move(1),
    blame(found) {
      issues = found;
      shown({ from: "tables" });
    },
  };
}
