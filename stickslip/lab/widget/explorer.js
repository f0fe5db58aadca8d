// Curve and sliders of `stickslip.explore` in a notebook. Colours are the notebook's own text colour.

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT, LEFT, BOTTOM, TOP] = [560, 280, 64, 34, 12];

function node(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function ticks(low, high, count = 5) {
  const raw = (high - low) / count;
  const size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((each) => each * size).find((each) => each >= raw);
  const found = [];
  for (let at = Math.ceil(low / step) * step; at <= high * (1 + 1e-9); at += step) found.push(at);
  return found;
}

const told = (value) => Number(value.toPrecision(4)).toString();

function draw(svg, curve, before) {
  const all = [curve, before].filter(({ hertz }) => hertz?.length);
  svg.replaceChildren();
  if (!all.length) return;
  const low = Math.min(...all.map(({ hertz }) => Math.min(...hertz)));
  const high = Math.max(...all.map(({ hertz }) => Math.max(...hertz)));
  const most = 1.05e3 * Math.max(...all.map(({ amplitude }) => Math.max(...amplitude)));
  const x = (hertz) => LEFT + ((WIDTH - LEFT - 8) * (hertz - low)) / (high - low || 1);
  const y = (mm) => HEIGHT - BOTTOM - ((HEIGHT - BOTTOM - TOP) * mm) / (most || 1);
  const text = (words, at) => node("text", { fill: "currentColor", "font-size": 11, ...at }, words);
  for (const at of ticks(low, high)) {
    svg.append(text(told(at), { x: x(at), y: HEIGHT - BOTTOM + 14, "text-anchor": "middle" }));
  }
  for (const at of ticks(0, most)) {
    svg.append(node("line", { x1: LEFT, x2: WIDTH - 8, y1: y(at), y2: y(at), stroke: "currentColor", opacity: 0.15 }));
    svg.append(text(told(at), { x: LEFT - 6, y: y(at) + 4, "text-anchor": "end" }));
  }
  svg.append(text("frequency [Hz]", { x: (LEFT + WIDTH) / 2, y: HEIGHT - 4, "text-anchor": "middle" }));
  svg.append(text(`${curve.name} [mm]`, { x: 4, y: TOP }));
  const line = ({ hertz, amplitude }) => hertz.map((at, i) => `${i ? "L" : "M"}${x(at)} ${y(1e3 * amplitude[i])}`).join("");
  svg.append(node("path", { d: line(before), fill: "none", stroke: "currentColor", opacity: 0.35, "stroke-dasharray": "4 3" }));
  svg.append(node("path", { d: line(curve), fill: "none", stroke: "#0072b2", "stroke-width": 2, class: "curve" }));
  if (curve.peak) svg.append(node("circle", { cx: x(curve.peak[0]), cy: y(1e3 * curve.peak[1]), r: 4, fill: "#0072b2" }));
}

function render({ model, el }) {
  const svg = node("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", style: "max-width: 40rem; display: block" });
  const words = document.createElement("p");
  const rows = document.createElement("div");
  words.setAttribute("role", "status");
  el.append(svg, words, rows);
  let wanted = null;
  let waiting = false;

  // One response at a time: what a slider passes meanwhile is left out, where it stops is computed.
  function send() {
    if (waiting || wanted === null) return;
    waiting = true;
    model.set("places", wanted);
    wanted = null;
    model.save_changes();
  }

  const inputs = model.get("sliders").map(({ name, place }) => {
    const row = document.createElement("label");
    const input = document.createElement("input");
    const value = document.createElement("output");
    Object.assign(input, { type: "range", min: 0, max: 1, step: 0.001, value: place });
    input.addEventListener("input", () => {
      wanted = { ...model.get("places"), ...wanted, [name]: Number(input.value) };
      send();
    });
    row.style.cssText = "display: grid; grid-template-columns: 10rem 18rem auto; gap: 0.5rem; align-items: center";
    row.append(name, input, value);
    rows.append(row);
    return value;
  });

  function shown() {
    const curve = model.get("curve");
    draw(svg, curve, model.get("before"));
    const peak = curve.peak ? `peak ${told(1e3 * curve.peak[1])} mm at ${told(curve.peak[0])} Hz` : "no peak";
    words.textContent = curve.told ? `${peak}. ${curve.told}` : peak;
    svg.setAttribute("aria-label", `Response: ${words.textContent}`);
    model.get("sliders").forEach(({ value, unit }, i) => { inputs[i].textContent = `${told(value)} ${unit}`; });
    waiting = false;
    send();
  }

  model.on("change:curve", shown);
  shown();
}

export default { render };
