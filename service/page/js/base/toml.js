// The scene as set, in TOML, with the commands that reproduce what is seen.

import { state } from "./address.js";
import { saveFrom } from "./exports.js";
import { current, variable } from "../scene/scenes.js";

export function commands(file) {
  const { observe } = current.body;
  const [low, high] = observe.band;
  const lines = [`stickslip sweep ${file} --from ${low} --to ${high} --harmonics ${state.harmonics}`];
  if (state.contact && state.range) {
    const [from, to] = state.range;
    lines.push(`stickslip design ${file} --variable ${variable()} ${from} ${to} --harmonics ${state.harmonics}`);
    lines.push(`stickslip map ${file} --parameter ${variable()} --from ${from} --to ${to} --harmonics ${state.harmonics}`);
  }
  return lines;
}

export const saveToml = (name) =>
  saveFrom("/v1/scenes/text", "application/toml", name, {
    method: "POST",
    body: { scene: state.scene, set: state.set, comments: ["As set on the page of stickslip. The same from the command:", ...commands(name)] },
  });
