// The report of a design as one file that needs nothing else: figures, what holds it, charts, the plan, how to have it again.

import { saveText, svgText } from "../base/exports.js";
import { byId } from "../base/dom.js";
import { commands } from "../base/toml.js";
import { state } from "../base/address.js";
import { request as ask } from "../network/api.js";
import { opened } from "../workbench/projects.js";

const CHARTS = [["structure", "Scene"], ["response", "Frequency response"], ["map", "Map"], ["front", "Peak against band"]];
const FACTS = [["design-facts", "What holds the design"], ["design-sensitivities", "What one per cent does"], ["response-facts", "Frequency response"], ["plan-facts", "Effects in use and left out"]];
const STYLE = "body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1b1f24;background:#fff}"
  + "dl{display:grid;grid-template-columns:max-content 1fr;gap:.1rem 1rem}dd{margin:0}dt{color:#505a66}svg{max-width:100%;height:auto}"
  + "th,td{text-align:left;padding:.2rem .8rem .2rem 0}.stale{color:#a3261b}pre{white-space:pre-wrap}li{list-style:none}";
const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" };

const escaped = (text) => String(text).replace(/[&<>"]/g, (sign) => ESCAPES[sign]);

// What a part of the page says, without its buttons.
function facts(id) {
  const copy = byId(id).cloneNode(true);
  for (const node of copy.querySelectorAll("button, .row, .chart-tools")) node.remove();
  for (const node of copy.querySelectorAll("details")) node.setAttribute("open", "");
  copy.removeAttribute("id");
  return copy.textContent.trim() ? new XMLSerializer().serializeToString(copy) : "";
}

function drawn(name) {
  const drawing = byId(`${name}-figure`).querySelector("svg.chart, svg[role=img]");
  if (!drawing || drawing.querySelector(".nothing")) return "";
  return svgText(drawing, byId(`${name}-figure`).querySelector(".canvas-host canvas"));
}

const part = (title, body) => (body ? `<h2>${escaped(title)}</h2>\n${body}\n` : "");

// What is said of the run: whose it is, its name, notes and tags.
const aboutRun = (run) => (run
  ? [run.owner && `by ${run.owner}`, run.name, run.tags.join(", "), run.notes].filter(Boolean).map((words) => `<p>${escaped(words)}</p>`) : []);

export function reportText({ request, result }, figures, changed, run = null) {
  const title = `Damper of ${state.scene}`;
  const values = Object.entries(request.set ?? {}).map(([path, value]) => `${path} = ${value}`).join(", ");
  const rows = figures.map(([name, value, more]) => `<tr><th scope="row">${escaped(name)}</th><td><strong>${escaped(value)}</strong></td><td>${escaped(more ?? "")}</td></tr>`);
  const again = [...commands(`${state.scene}.toml`), `stickslip report ${state.jobs.design ?? "JOB"} --out report.html --url ${location.origin}`];
  const project = opened();
  return [
    `<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>${escaped(title)}</title><style>${STYLE}</style></head><body>`,
    `<h1>${escaped(title)}</h1>`,
    project ? `<p>Project ${escaped(project.name)}${project.notes ? `: ${escaped(project.notes)}` : ""}</p>` : "",
    ...aboutRun(run),
    `<p>${escaped(new Date().toLocaleString())}. ${escaped(result.status)} Scene ${escaped(state.scene)}${values ? ` with ${escaped(values)}` : ""}, ${request.harmonics ?? 11} harmonics.</p>`,
    changed.length ? `<p class="stale">Stale when it was saved: computed for ${escaped(changed.join("; "))}.</p>` : "",
    `<table>${rows.join("\n")}</table>`,
    ...FACTS.map(([id, words]) => part(words, facts(id))),
    ...CHARTS.map(([name, words]) => part(`${words}, drawn`, drawn(name))),
    part("The same from the command", `<pre>${escaped(again.join("\n"))}</pre>`),
    "</body></html>\n",
  ].join("\n");
}

export async function saveReport(...given) {
  // Without a word of its run a report is still one: a run in the bin or a service away keeps nobody from it.
  const run = await ask(`/v1/runs/${state.jobs.design}`).catch(() => null);
  saveText(reportText(...given, run), `report-${state.scene}.html`, "text/html");
}
