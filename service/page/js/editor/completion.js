// Keys and words that may stand where one types in the text of a scene, from its schema.

import { partOf } from "./scene_data.js";
import { keyOf, keysOf } from "./schema.js";

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

export function completionAt(context, scene) {
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
