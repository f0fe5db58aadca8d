"""The page in a real Chromium: how fast it opens, how fast a map is drawn, how fast sliders are followed."""

from __future__ import annotations

import gzip
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Any

import service
from benchmarks.harness import expect, table
from benchmarks.service_process import serving

# Moves the slider of the load at every frame for so many seconds; the newest position wins.
SLIDE = """async ([seconds, path]) => {
  const slide = document.getElementById(`slide-${path}`);
  const drawn = () => Number(document.documentElement.dataset.live);
  const begun = performance.now(), first = drawn();
  let position = 0;
  while (performance.now() - begun < seconds * 1000) {
    position = (position + 7) % 400;
    slide.value = String(position);
    slide.dispatchEvent(new Event("input", { bubbles: true }));
    await new Promise(requestAnimationFrame);
  }
  return (drawn() - first) / ((performance.now() - begun) / 1000);
}"""
OPENED = """() => [
  performance.getEntriesByName("first-contentful-paint")[0].startTime,
  performance.getEntriesByName("page-ready")[0].startTime,
  performance.getEntriesByName("live-drawn")[0].startTime,
]"""
_MAP = "document.getElementById('map-figure').dataset.milliseconds"


def page() -> None:
    """The page in a real Chromium: opening it, responses a second under a slider, a map, how large it is."""
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    expect("chromium is installed", program is not None)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        database = f"sqlite:///{Path(folder) / 'page.db'}"
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        with serving(database, workers=1, log=Path(folder) / "log") as served:
            url = f"http://127.0.0.1:{served.port}"
            table(
                "The page, from the browser",
                ("what", "", "wanted"),
                [*_opening(browser, url), *_sliding(browser, url), _mapped(browser, url), _compressed()],
            )
        browser.close()


def _visited(browser: Any, url: str) -> Any:
    """A page with its first response drawn."""
    seen = browser.new_page(viewport={"width": 1280, "height": 900})
    seen.goto(url)
    seen.locator("html[data-ready][data-live]").wait_for(state="attached", timeout=120_000)
    return seen


def _opening(browser: Any, url: str) -> list[tuple[str, str, str]]:
    """From the address to the first paint, to the whole page, to the first live response; medians of five."""
    disk = f"{url}/?scene=bladed-disk"
    _visited(browser, disk).close()
    times = []
    for _ in range(5):
        seen = _visited(browser, disk)
        times.append(seen.evaluate(OPENED))
        seen.close()
    names = ("first paint", "everything of an empty page", "first live response of bladed-disk")
    wanted = ("", "", "1000")
    middle = [statistics.median(column) for column in zip(*times, strict=True)]
    return [(f"{n}, ms", f"{t:.0f}", w) for n, t, w in zip(names, middle, wanted, strict=True)]


def _sliding(browser: Any, url: str) -> list[tuple[str, str, str]]:
    rows = []
    for scene, path, wanted in (("two-dof", "damper-N0", "30"), ("bladed-disk", "shroud-N0", "")):
        seen = _visited(browser, f"{url}/?scene={scene}")
        rate = seen.evaluate(SLIDE, [5.0, path])
        expect("the slider is followed", rate > 1.0)
        rows.append((f"responses a second of {scene} under a slider", f"{rate:.1f}", wanted))
        seen.close()
    return rows


def _mapped(browser: Any, url: str) -> tuple[str, str, str]:
    seen = _visited(browser, f"{url}/?scene=two-dof")
    seen.click("#study")
    seen.locator("#map-figure[data-milliseconds]").wait_for(state="attached", timeout=300_000)
    milliseconds = seen.evaluate(_MAP)
    seen.close()
    return "a map of 60 × 400 drawn, ms", str(milliseconds), "100"


def _compressed() -> tuple[str, str, str]:
    folder = Path(service.__file__).parent / "page"
    size = sum(len(gzip.compress(file.read_bytes())) for file in folder.rglob("*") if file.is_file())
    return "code of the page, each file compressed, kB", f"{size / 1e3:.0f}", "600"
