// The scene that is being edited: its text and its tables, kept alike by the service.

import { Offline, Problem, post } from "../network/api.js";

const PAUSE_MS = 220;

// `shown(what)` is told whenever text, tables or issues are others: {from: "text" | "tables" | "scene" | "file"}.
export function sceneDocument(shown) {
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
    if (pending !== null) running = ask(pending, turn);
    pending = null;
    return running;
  }

  async function ask(from, mine) {
    let found;
    try {
      const { text, scene } = self;
      found = await post("/v1/scenes/edit", ["tables", "scene"].includes(from) ? { text, scene } : { text });
    } catch (error) {
      if (!(error instanceof Problem || error instanceof Offline)) throw error;
      if (mine === turn) shown({ from, failed: error.message, errors: error.errors ?? [] });
      return;
    }
    // What came of an earlier state is of no use: the present one is on its way.
    if (mine !== turn) return;
    const { text, scene, issues } = found;
    Object.assign(self, { text, scene: scene ?? self.scene, issues, unreadable: scene === null });
    shown({ from });
  }

  const self = {
    text: "", scene: {}, issues: [], unreadable: false,
    get settled() { return pending === null; },
    // Begins with a text, or with tables of which one is made.
    open({ text = "", scene = null }) {
      Object.assign(self, { text, scene: scene ?? {}, issues: [], unreadable: false });
      turn += 1;
      pending = null;
      running = ask(scene ? "scene" : "file", turn);
      return running;
    },
    type(text) {
      self.text = text;
      later("text");
    },
    change(how) {
      const scene = structuredClone(self.scene);
      how(scene);
      self.scene = scene;
      later("tables");
    },
    settle,
    blame(issues) {
      self.issues = issues;
      shown({ from: "tables" });
    },
  };
  return self;
}
