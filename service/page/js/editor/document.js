// The scene that is being edited: its text and its tables, kept alike by the service.

import { Offline, Problem, post } from "../network/api.js";

const PAUSE_MS = 220;

// `shown(what)` is told whenever text, tables or issues are others: {from: "text" | "tables" | "scene" | "file"}.
export function sceneDocument(shown) {
  let now = { text: "", scene: {} };
  let issues = [];
  let unreadable = false;
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
    shown({ from });
  }

  return {
    get text() { return now.text; },
    get scene() { return now.scene; },
    get issues() { return issues; },
    get unreadable() { return unreadable; },
    get settled() { return pending === null; },
    // Begins with a text, or with tables of which one is made.
    open({ text = "", scene = null }) {
      now = { text, scene: scene ?? {} };
      [issues, unreadable] = [[], false];
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
    blame(found) {
      issues = found;
      shown({ from: "tables" });
    },
  };
}
