"""The charts of the page beside libraries of charts: how large each is, how fast it draws.

The libraries are read from a folder into which npm has installed them, ``CHART_LIBRARIES``: uplot, echarts
and plotly.js-cartesian-dist-min. Without it the page's own charts are measured alone.
"""

from __future__ import annotations

import gzip
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import service
from benchmarks.harness import expect, table
from benchmarks.service_process import serving

POINTS, ROWS, COLUMNS = 2000, 60, 400
RUNS = 15
# A response of three lines and a map; every drawing ends when the browser has laid it out and painted it.
DATA = f"""
const x = Array.from({{ length: {POINTS} }}, (_, i) => 500 + (400 * i) / {POINTS - 1});
const line = (n) => x.map((f) => 1 / Math.hypot(1 - (f / (640 + 40 * n)) ** 2, 0.02));
const lines = [line(0), line(1), line(2)];
const rows = Array.from({{ length: {ROWS} }}, (_, j) => Array.from({{ length: {COLUMNS} }}, (_, i) =>
  1e-3 / Math.hypot(1 - (i / (150 + 3 * j)) ** 2, 0.02)));
const across = rows[0].map((_, i) => 500 + i), up = rows.map((_, j) => 20 + 50 * j);
const host = document.createElement("div");
host.style.width = "900px";
host.style.height = "340px";
document.body.prepend(host);
const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
const median = async (draw) => {{
  const found = [];
  for (let run = 0; run < {RUNS}; run += 1) {{
    await painted();
    const begun = performance.now();
    await draw(run);
    host.getBoundingClientRect();
    found.push(performance.now() - begun);
  }}
  return found.sort((a, b) => a - b)[{RUNS // 2}];
}};
"""
OURS = """
const from = (path) => import(new URL(path, document.querySelector("script[type=module]").src));
const { chart } = await from("charts/chart.js"), { heatmap } = await from("charts/heatmap.js");
const axis = (name) => ({ name });
const one = chart(host, { label: "measured", file: "measured" });
const response = await median(() => one.draw({ x: axis("f"), y: axis("a"),
  series: lines.map((y, i) => ({ name: `${i}`, x, y, colour: i + 1 })) }));
const two = heatmap(host, { label: "measured map", file: "measured", onPick: () => {} });
const cells = { x: { name: "f", values: across }, y: { name: "N0", values: up }, rows };
const map = await median(() => two.draw(cells));
return [response, map];
"""
UPLOT = """
const options = { width: 900, height: 340, scales: { x: { time: false } },
  series: [{}, { stroke: "red" }, { stroke: "blue" }, { stroke: "green" }] };
let plot = null;
return [await median(async () => {
  plot?.destroy();
  plot = new uPlot(options, [x, ...lines], host);
  await Promise.resolve();
}), null];
"""
ECHARTS = """
const measured = async (renderer) => {
  const plot = echarts.init(host, null, { renderer, width: 900, height: 340 });
  const series = lines.map((y) => ({ type: "line", showSymbol: false, data: y.map((v, i) => [x[i], v]) }));
  const frame = { animation: false, xAxis: { type: "value", min: 500, max: 900 }, yAxis: {} };
  const response = await median(() => plot.setOption({ ...frame, series }, true));
  const data = rows.flatMap((row, j) => row.map((v, i) => [i, j, v]));
  const colours = { min: 0, max: 0.05 };
  const axes = { animation: false, xAxis: { data: across }, yAxis: { data: up }, visualMap: colours };
  const cells = [{ type: "heatmap", data, progressive: 0 }];
  const map = await median(() => plot.setOption({ ...axes, series: cells }, true));
  plot.dispose();
  return [response, map];
};
return await measured(RENDERER);
"""
PLOTLY = """
const response = await median(() => Plotly.newPlot(host, lines.map((y) => ({ x, y, mode: "lines" })), {}));
const map = await median(() => Plotly.newPlot(host, [{ type: "heatmap", x: across, y: up, z: rows }], {}));
return [response, map];
"""
LIBRARIES = (
    ("uPlot, canvas", "uplot/dist/uPlot.iife.min.js", UPLOT),
    ("ECharts, canvas", "echarts/dist/echarts.min.js", ECHARTS.replace("RENDERER", '"canvas"')),
    ("ECharts, SVG", "echarts/dist/echarts.min.js", ECHARTS.replace("RENDERER", '"svg"')),
    ("Plotly", "plotly.js-cartesian-dist-min/plotly-cartesian.min.js", PLOTLY),
)


def charts() -> None:
    """The charts of the page beside libraries of charts: size, a response and a map drawn."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    expect("chromium is installed", program is not None)
    rows = []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        with serving(f"sqlite:///{Path(folder) / 'page.db'}", workers=1, log=Path(folder) / "log") as served:
            seen = browser.new_page(viewport={"width": 1280, "height": 900})
            seen.goto(f"http://127.0.0.1:{served.port}/?scene=bladed-disk")
            seen.locator("html[data-ready]").wait_for(state="attached", timeout=120_000)
            rows.append(("the page's, SVG and canvas, on D3", _compressed_own(), *_measured(seen, OURS)))
        libraries = os.environ.get("CHART_LIBRARIES")
        for name, place, program_text in LIBRARIES if libraries else ():
            file = Path(libraries or "") / "node_modules" / place
            if not file.exists():
                rows.append((name, f"not installed: {place}", "", ""))
                continue
            seen = browser.new_page(viewport={"width": 1280, "height": 900})
            seen.set_content("<!doctype html><body></body>")
            seen.add_script_tag(path=file)
            size = f"{len(gzip.compress(file.read_bytes())) / 1e3:.0f}"
            rows.append((name, size, *_measured(seen, program_text)))
        browser.close()
    table(
        f"Charts: three lines of {POINTS} points, a map of {ROWS} × {COLUMNS} cells, medians of {RUNS}",
        ("library", "kB compressed", "response, ms", "map, ms"),
        rows,
    )
    if not libraries:
        print("CHART_LIBRARIES names no folder of npm packages: the page's own charts alone")


def _compressed_own() -> str:
    """The modules of the charts with what they have from D3, compressed one by one."""
    folder = Path(service.__file__).parent / "page" / "js"
    files = [path for part in ("charts", "vendor") for path in (folder / part).glob("*.js")]
    return f"{sum(len(gzip.compress(path.read_bytes())) for path in files) / 1e3:.0f}"


def _measured(seen: Any, text: str) -> tuple[str, str]:
    """Return what a program measured: a response and a map [ms], the latter if it can draw one."""
    response, cells = seen.evaluate(f"async () => {{ {DATA} {text} }}")
    return f"{response:.1f}", "none" if cells is None else f"{cells:.1f}"
