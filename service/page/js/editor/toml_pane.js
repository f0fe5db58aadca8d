// The text of the scene in CodeMirror, which is loaded when it is wanted: what is wrong is marked at its line, keys
// are completed, and its history is that of the tables too.

import { el, show } from "../base/dom.js";
import { partOf } from "./scene_data.js";
import { keyOf, keysOf } from "./schema.js";

const THEME = {
  "&": { height: "100%", color: "var(--ink)", backgroundColor: "var(--surface)", fontSize: "0.82rem" },
  "&.cm-focused": { outline: "none" },
  ".cm-scroller": { fontFamily: 'ui-monospace, "SFMono-Regular", "DejaVu Sans Mono", "Liberation Mono", monospace', lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--ink)", outline: "none" },
  ".cm-gutters": { color: "var(--ink-2)", backgroundColor: "var(--surface)", border: "0" },
  ".cm-gutter-lint": { width: "0.9em" },
  ".cm-lint-marker-error": { content: "none", width: "0.7em", height: "0.7em", borderRadius: "50%", backgroundColor: "var(--bad)" },
  ".cm-lintRange-error": { backgroundImage: "none", backgroundColor: "var(--bad-soft)", textDecoration: "underline wavy var(--bad) 1px" },
  ".cm-lintRange-error > span": { color: "var(--ink)" },
  ".cm-tooltip": { color: "var(--ink)", backgroundColor: "var(--surface)", border: "1px solid var(--edge)", borderRadius: "6px", font: "var(--t-small)/1.4 var(--font)", maxWidth: "28rem" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { color: "var(--accent-ink) !important", backgroundColor: "var(--accent) !important" },
  ".cm-tooltip-autocomplete > ul": { maxHeight: "none !important", overflow: "hidden !important" },
  ".cm-completionDetail": { color: "inherit" },
  ".cm-diagnostic-error": { borderLeftColor: "var(--bad)" },
};

const colours = ({ HighlightStyle, tags }) => HighlightStyle.define([
  { tag: tags.comment, color: "var(--ink-2)", fontStyle: "italic" },
  { tag: tags.atom, color: "var(--accent)", fontWeight: "650" },
  { tag: tags.propertyName, color: "var(--c4)" },
  { tag: tags.string, color: "var(--c3)" },
  { tag: tags.number, color: "var(--accent)" },
]);

// Numbers with powers of ten too.
const withPowers = (toml) => ({ ...toml, token: (stream, state) => (!state.lhs && !state.inString && stream.match(/^[+-]?\d[\d_.]*e[+-]?\d+/i) ? "number" : toml.token(stream, state)) });

// A change from one text to another, without what both begin and end with.
function between(before, after) {
  let from = 0;
  while (from < before.length && before[from] === after[from]) from += 1;
  let end = 0;
  while (end < Math.min(before.length, after.length) - from && before.at(-1 - end) === after.at(-1 - end)) end += 1;
  return { from, to: before.length - end, insert: after.slice(from, after.length - end) };
}

// `told(text)` of every change that is typed or undone; `sceneOf()` is the scene that the text last held.
export async function tomlPane(host, told, sceneOf) {
  const cm = await import("../vendor/codemirror.js");
  const { EditorState, EditorView } = cm;
  const ours = cm.Annotation.define();
  const box = el("div", { class: "toml", id: "editor-toml" });
  const wrong = el("div", {});
  let invalid = false;
  show(host, box, wrong);
  // The policy of the page allows no style elements; a shadow root takes style sheets that are made.
  const root = box.attachShadow({ mode: "open" });
  const extensions = [
    cm.lineNumbers(), cm.lintGutter(), cm.history(), cm.StreamLanguage.define(withPowers(cm.toml)), cm.syntaxHighlighting(colours(cm)), EditorView.theme(THEME),
    cm.autocompletion({ override: [(context) => completionAt(context, sceneOf())], icons: false, maxRenderedOptions: 12 }),
    cm.keymap.of([...cm.completionKeymap, ...cm.historyKeymap, ...cm.defaultKeymap]),
    EditorView.contentAttributes.of(() => ({ tabindex: "0", "aria-label": "The scene as TOML", "aria-invalid": String(invalid) })),
    // The browser would keep the look of what is typed over in an inline style, which the policy does not allow.
    EditorView.domEventHandlers({ beforeinput(event, of) {
      if (event.inputType !== "insertText" || of.state.selection.main.empty) return false;
      of.dispatch(of.state.replaceSelection(event.data), { userEvent: "input.type" });
      event.preventDefault();
      return true;
    } }),
    EditorView.updateListener.of((update) => {
      if (update.docChanged && !update.transactions.some((one) => one.annotation(ours))) told(update.state.doc.toString());
    }),
  ];
  const view = new EditorView({ root, parent: root });
  const placeOf = (line, column) => {
    const { from, to } = view.state.doc.line(Math.min(line, view.state.doc.lines));
    return Math.min(from + Math.max((column ?? 1) - 1, 0), to);
  };

  return {
    focus: () => view.focus(),
    undo: () => cm.undo(view),
    redo: () => cm.redo(view),
    get canUndo() { return cm.undoDepth(view.state) > 0; },
    get canRedo() { return cm.redoDepth(view.state) > 0; },
    // A text to begin with: nothing was before it.
    begin: (doc) => view.setState(EditorState.create({ doc, extensions })),
    // What the tables made of the text, one step of the history.
    set(text) {
      const before = view.state.doc.toString();
      if (before !== text) view.dispatch({ changes: between(before, text), annotations: [ours.of(true), cm.isolateHistory.of("full")] });
    },
    // Marks lines; what makes the text unreadable is said below it.
    mark(issues, unreadable) {
      invalid = issues.length > 0;
      view.dispatch(cm.setDiagnostics(view.state, issues.map(({ line, detail }) => {
        const { from, to, text } = view.state.doc.line(Math.min(line, view.state.doc.lines));
        return { from: from + text.search(/\S|$/), to, severity: "error", message: detail };
      })));
      const [first] = issues;
      show(wrong, unreadable ? el("p", { class: "issues", role: "alert" }, `The file cannot be read: ${first.detail}`, " ", el("button", { type: "button", class: "link", onclick: () => this.go(first.line, first.column) }, `Line ${first.line}`)) : null);
    },
    // Puts the cursor at a place and shows it.
    go(line, column = 1, focus = true) {
      const at = placeOf(line, column);
      view.dispatch({ ...(focus ? { selection: { anchor: at } } : {}), effects: EditorView.scrollIntoView(at, { y: "center" }) });
      if (focus) view.focus();
    },
  };
}

const HEAD = /^\s*\[\[?\s*([\w.]+)\s*\]\]?/gm;

// The section and the row that the end of a text stands in: under a heading, or in the braces of a list below it.
function placeOf(text) {
  const heads = [...text.matchAll(HEAD)];
  const head = heads.at(-1);
  if (!head) return { path: "", index: 0 };
  const path = head[1].replaceAll(".", "/");
  const below = text.slice(head.index + head[0].length);
  const list = [...below.matchAll(/^\s*(\w+)\s*=\s*\[/gm)].at(-1);
  const inside = list && below.slice(list.index + list[0].length);
  const depth = inside ? inside.replace(/[^[\]{}]/g, "").split("").reduce((sum, one) => sum + ("[{".includes(one) ? 1 : -1), 1) : 0;
  if (depth >= 2) return { path: `${path}/${list[1]}`, index: inside.split("{").length - 2 };
  return { path, index: heads.filter(([, name]) => name === head[1]).length - 1 };
}

// Keys and words that may stand where one types, from the schema of the scene.
function completionAt(context, scene) {
  const before = context.state.sliceDoc(0, context.pos);
  const line = before.slice(before.lastIndexOf("\n") + 1);
  const { path, index } = placeOf(before);
  const part = partOf(scene, path);
  const row = (Array.isArray(part) ? part[index] : part) ?? {};
  const value = /([\w-]+)\s*=\s*"?([\w-]*)$/.exec(line);
  if (value) {
    const known = keyOf(scene, path, row, value[1]);
    const quoted = line.at(-1 - value[2].length) === '"';
    const options = (known?.choices ?? []).map((one) => ({ label: String(one), apply: typeof one !== "string" || quoted ? String(one) : `"${one}"` }));
    return options.length ? { from: context.pos - value[2].length, options, validFor: /^[\w-]*$/ } : null;
  }
  const key = /(?:^|[{,])\s*([\w-]*)$/.exec(line);
  if (!key || (!key[1] && !context.explicit)) return null;
  const options = keysOf(scene, path, row).filter((name) => !(name in row)).map((name) => {
    const { words, unit, required } = keyOf(scene, path, row, name);
    return { label: name, detail: unit ? `[${unit}]` : "", info: words || undefined, apply: `${name} = `, boost: required ? 1 : 0 };
  });
  return { from: context.pos - key[1].length, options, validFor: /^[\w-]*$/ };
}
