// Taking things away: files of charts, numbers and answers.

import { fetched, orNotice, Problem } from "../network/api.js";
import { current, variable } from "../scene/scenes.js";
import { state } from "./state.js";

const PAINT = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "stroke-linecap", "opacity",
  "font-size", "font-family", "font-weight", "paint-order"];
const DOTS = 2;

export function saveBlob(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

export const saveText = (text, name, type) => saveBlob(new Blob([text], { type }), name);

// A file of the service; a refusal is said, not thrown.
export const saveFrom = (path, accept, name, options = {}) => orNotice(async () => {
  const answer = await fetched(path, { ...options, headers: { Accept: accept } });
  saveBlob(await answer.blob(), name);
}, (error) => (error instanceof Problem ? `${name}: ${error.message}` : error.message));

// The scene as set, in TOML, with the commands that reproduce what is seen.
export function saveToml(name) {
  const harmonics = `--harmonics ${state.harmonics}`;
  const [low, high] = current.body.observe.band;
  const commands = [`stickslip sweep ${name} --from ${low} --to ${high} ${harmonics}`];
  if (state.contact && state.range) {
    const [from, to] = state.range;
    commands.push(`stickslip design ${name} --variable ${variable()} ${from} ${to} ${harmonics}`, `stickslip map ${name} --parameter ${variable()} --from ${from} --to ${to} ${harmonics}`);
  }
  const comments = ["As set on the page of stickslip. The same from the command:", ...commands];
  return saveFrom("/v1/scenes/text", "application/toml", name, { method: "POST", body: { scene: state.scene, set: state.set, comments } });
}

// The drawing with its computed paint as attributes: it looks the same outside the page. The copy stands in a document
// of its own, which loads nothing: what the page may load says nothing about a picture inside a file.
function standalone(drawing, canvas) {
  const copy = document.implementation.createHTMLDocument("").importNode(drawing, true);
  const [from, to] = [drawing.querySelectorAll("*"), copy.querySelectorAll("*")];
  from.forEach((node, i) => {
    const style = getComputedStyle(node);
    for (const name of PAINT) {
      const value = style.getPropertyValue(name);
      if (value) to[i].setAttribute(name, value.replaceAll('"', "'"));
    }
    to[i].removeAttribute("class");
  });
  for (const name of ["class", "tabindex", "role", "aria-label", "aria-roledescription"]) copy.removeAttribute(name);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  if (canvas) underlay(copy, canvas);
  return copy;
}

function underlay(copy, canvas) {
  const place = { x: canvas.offsetLeft, y: canvas.offsetTop, width: canvas.offsetWidth, height: canvas.offsetHeight };
  const image = copy.ownerDocument.createElementNS("http://www.w3.org/2000/svg", "image");
  for (const [name, value] of Object.entries(place)) image.setAttribute(name, value);
  image.setAttribute("preserveAspectRatio", "none");
  image.setAttribute("href", canvas.toDataURL("image/png"));
  copy.prepend(image);
}

export const paperColour = () => getComputedStyle(document.querySelector(".card")).backgroundColor;
export const svgText = (drawing, canvas) => new XMLSerializer().serializeToString(standalone(drawing, canvas));

export async function pngBlob(drawing, canvas) {
  const source = URL.createObjectURL(new Blob([svgText(drawing)], { type: "image/svg+xml" }));
  try {
    const image = new Image();
    image.src = source;
    await image.decode();
    const page = document.createElement("canvas");
    const [width, height] = [Number(drawing.getAttribute("width")), Number(drawing.getAttribute("height"))];
    [page.width, page.height] = [DOTS * width, DOTS * height];
    const brush = page.getContext("2d");
    brush.scale(DOTS, DOTS);
    brush.fillStyle = paperColour();
    brush.fillRect(0, 0, width, height);
    if (canvas) {
      brush.drawImage(canvas, canvas.offsetLeft, canvas.offsetTop, canvas.offsetWidth, canvas.offsetHeight);
    }
    brush.drawImage(image, 0, 0, width, height);
    return await new Promise((resolve) => page.toBlob(resolve, "image/png"));
  } finally {
    URL.revokeObjectURL(source);
  }
}

export function csvText(columns) {
  const rows = Math.max(...columns.map(([, values]) => values.length));
  const lines = [columns.map(([name]) => `"${name.replaceAll('"', '""')}"`).join(",")];
  for (let i = 0; i < rows; i += 1) lines.push(columns.map(([, values]) => values[i] ?? "").join(","));
  return `${lines.join("\r\n")}\r\n`;
}
