"""Pictures of every view of the page at four sizes, light and dark, in docs/img/page/views.

NAME-THEME.png is 1440 × 900, NAME-sizes-THEME.png has the others beside one another.
python docs/page_pictures.py [VIEW …] starts a service with an empty database, computes the shipped disk and
the finite-element disk, and needs playwright and Chromium.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import solver

FOLDER = Path(__file__).resolve().parent / "img" / "page" / "views"
SIZE = {"width": 1440, "height": 900}
OTHERS = ((1366, 768), (1024, 768), (390, 844))
GAP = 24  # px between them
PORT = 8791
URL = f"http://127.0.0.1:{PORT}"
PATIENCE = 240_000  # ms
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader"]
# Whatever else the machine does meanwhile.
SLOWLY = {"STICKSLIP_PREVIEW_SECONDS": "60"}


def main() -> int:
    """Take the pictures that are asked for."""
    program = shutil.which("chromium")
    if program is None:
        print("Chromium is not installed (Debian's package `chromium`)", file=sys.stderr)
        return 1
    FOLDER.mkdir(parents=True, exist_ok=True)
    asked = sys.argv[1:] or list(VIEWS)
    with tempfile.TemporaryDirectory() as folder:
        serve = [sys.executable, "-c", "from service.cli import main; main()", "serve", "--port", str(PORT)]
        service = subprocess.Popen(
            [*serve, "--database", f"sqlite:///{folder}/pictures.db", "--workers", "2"],
            env={**os.environ, **SLOWLY},
        )
        try:
            _wait()
            with sync_playwright() as api:
                browser = api.chromium.launch(executable_path=program, args=FLAGS)
                for scheme in ("light", "dark"):
                    context = browser.new_context(viewport=SIZE, color_scheme=scheme, accept_downloads=True)
                    context.set_default_timeout(PATIENCE)
                    page = context.new_page()
                    prepare(page, first=scheme == "light")
                    for name in asked:
                        show, card = VIEWS[name]
                        show(page)
                        page.wait_for_timeout(700)
                        take(page, name, scheme, card)
                        print(f"{name}-{scheme}.png")
                browser.close()
        finally:
            service.terminate()
            service.wait(timeout=120)
    return 0


def _wait() -> None:
    end = time.monotonic() + 120.0
    while time.monotonic() < end:
        try:
            with urllib.request.urlopen(f"{URL}/health/ready", timeout=5.0) as answer:
                if answer.status == 200:
                    return
        except (urllib.error.URLError, OSError):
            time.sleep(0.2)
    raise TimeoutError("the service did not become ready within two minutes")


def prepare(page: Any, *, first: bool) -> None:
    """Open the shipped disk; at the first time take the page that has nothing yet, and compute everything."""
    page.goto(f"{URL}/?scene=bladed-disk")
    page.locator("#study").wait_for()
    page.locator("#study:enabled").wait_for()
    if first:
        page.locator("#live-status").get_by_text("peak").wait_for()
        take(page, "nothing-yet", "light")
        study(page)
        # A second run, to be compared with the first.
        page.fill("#high", "60")
        study(page)
        page.goto(f"{URL}/?scene=bladed-disk")
    study(page)


def take(page: Any, name: str, scheme: str, card: str | None = None) -> None:
    """Keep what the window shows, then the same in windows of the other sizes."""
    _scroll(page, card)
    _keep(_seen(page), f"{name}-{scheme}.png")
    width, height = sum(size[0] + GAP for size in OTHERS) - GAP, max(size[1] for size in OTHERS)
    sheet, left = Image.new("RGB", (width, height), "#808080"), 0
    for size in OTHERS:
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.wait_for_timeout(500)
        _scroll(page, card)
        sheet.paste(_seen(page), (left, 0))
        left += size[0] + GAP
    _keep(sheet, f"{name}-sizes-{scheme}.png")
    page.set_viewport_size(SIZE)


def _scroll(page: Any, card: str | None) -> None:
    if card is not None:
        page.locator(f"#{card}").evaluate("card => card.scrollIntoView()")


def _seen(page: Any) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def _keep(picture: Image.Image, name: str) -> None:
    """Keep a picture in as many colours as a palette has: a third of the size."""
    picture.quantize(256, dither=Image.Dither.NONE).save(FOLDER / name, optimize=True)


def study(page: Any) -> None:
    """Press the one button, and wait until everything is there."""
    page.locator("#study").click()
    page.get_by_text("Everything is there.").wait_for()


Show = Callable[[Any], None]


def tab(name: str, do: Show | None = None) -> Show:
    """Return what opens a tab and does something there."""

    def show(page: Any) -> None:
        page.locator(f"#tab-{name}").click()
        page.mouse.move(5, 5)
        page.evaluate("window.scrollTo(0, 0)")
        if do is not None:
            do(page)

    return show


def top(page: Any) -> None:
    """Show the answer, with the pointer away from everything."""
    page.locator("#tab-response").click()
    page.mouse.move(5, 5)
    page.evaluate("window.scrollTo(0, 0)")


def open_shape(page: Any) -> None:
    """Show how the sector of finite elements moves near its peak."""
    anew(page, "fe-disk")
    page.fill("#point-at", "263")
    page.click("#point-show")
    page.locator("#shape-open").click()
    page.locator("#shape canvas[data-drawn]").wait_for()
    page.locator("#shape-by").select_option("state")
    page.locator("#shape").get_by_role("button", name="Whole view").click()


def follow_mode(page: Any) -> None:
    """Follow a nonlinear mode, with whole responses beside the peaks of its curve."""
    page.fill("#modes-exact_peaks", "5")
    page.click("#study")
    page.locator("#modes-status").get_by_text("points in").wait_for()


def identify(page: Any) -> None:
    """Identify the friction of the two masses from responses with 2 % of noise."""
    anew(page, "two-dof", "&tab=identify&harmonics=3")
    page.locator("#identify summary", has_text="Paste a table").click()
    page.fill("#identify-paste", measured())
    page.click("#identify-paste-take")
    page.locator("#identify-files").get_by_text("30 points").wait_for()
    page.get_by_role("button", name="Remove unknown 1").click()
    page.click("#study")
    page.locator("#identify-result").wait_for()


def measured() -> str:
    """Return a table of responses at two loads, with noise that is the same every time."""
    scene, noise = solver.load_scene("two-dof"), np.random.default_rng(1)
    lines = ["damper.N0,frequency [Hz],amplitude [mm]"]
    for load in (100, 50):
        for hertz in np.linspace(0.9, 1.4, 15):
            here = scene.with_values({"damper.N0": load, "damper.mu": 0.27})
            _, cosine, sine = solver.solve(here, frequency_hz=hertz, harmonics=3).observed[:3]
            size = 1e3 * abs(complex(cosine, sine)) * (1.0 + 0.02 * noise.standard_normal())
            lines.append(f"{load},{hertz:.4f},{size:.6g}")
    return "\n".join(lines)


def anew(page: Any, scene: str = "bladed-disk", rest: str = "") -> None:
    """Open the page anew, and wait until its buttons answer."""
    page.goto(f"{URL}/?scene={scene}{rest}")
    page.locator("#study:enabled").wait_for()


def edit(page: Any) -> None:
    """Open the editor of the scene."""
    anew(page)
    page.click("#scene-menu")
    page.locator("#edit-scene").click()
    page.locator("#editor-form[aria-busy=false]").wait_for()


def choose(page: Any) -> None:
    """Open the choice of cases for a new scene."""
    anew(page)
    page.click("#scene-menu")
    page.locator("#new-scene").click()
    page.locator(".choice-card").first.wait_for()


def question(page: Any) -> None:
    """Open the questions of a platform damper."""
    choose(page)
    page.locator(".choice-card", has_text="platform").first.click()
    page.locator("#wizard-form").wait_for()


def matrices(page: Any) -> None:
    """Open the form for the matrices of a finite-element program."""
    anew(page)
    page.click("#scene-menu")
    page.locator("#open-matrices").click()


def sector(page: Any) -> None:
    """Show the finite-element sector with its boundaries and contacts."""
    anew(page, "fe-disk", "&tab=disk")
    page.locator("#structure svg").first.wait_for()


def interference(page: Any) -> None:
    """Show the interference diagram of the finite-element disk."""
    anew(page, "fe-disk", "&tab=disk")
    page.fill("#interference-speed_rpm", "11000")
    page.locator("#interference-submit").click()
    page.locator("#interference-figure path.series").first.wait_for()


def compare(page: Any) -> None:
    """Show two runs side by side."""
    anew(page)
    page.click("#tab-runs")
    runs = page.locator("#runs-table tr[data-run]", has_text="design")
    runs.first.wait_for()
    # That of the smaller range ends at its bound.
    for one in (runs.first, runs.filter(has_text="shroud.N0 60 N").first):
        one.locator("input[type=checkbox]").first.check()
    page.locator("#runs-compare-body table").first.wait_for()


VIEWS: dict[str, tuple[Show, str | None]] = {
    "answer": (top, None),
    "response": (tab("response"), "tabs"),
    "live": (tab("response"), "live"),
    "curve": (tab("response"), "response"),
    "point": (tab("response"), "point"),
    "map": (tab("map"), "tabs"),
    "front": (tab("map"), "front"),
    "design": (tab("design"), "tabs"),
    "result": (tab("design"), "design"),
    "disk": (tab("disk"), "tabs"),
    "campbell": (tab("disk"), "campbell"),
    "modes": (tab("modes", follow_mode), "tabs"),
    "mode-peaks": (tab("modes"), "modes-frequency"),
    "accuracy": (tab("accuracy"), "tabs"),
    "runs": (tab("runs"), "tabs"),
    # From here on each opens the page anew.
    "shape": (open_shape, None),
    "identify": (identify, None),
    "estimates": (lambda page: page.locator("#identify-response").wait_for(), "identify-response"),
    "editor": (edit, "editor"),
    "new-scene": (choose, None),
    "wizard": (question, None),
    "matrices": (matrices, None),
    "sector": (sector, "structure"),
    "interference": (interference, "interference"),
    "compare": (compare, "runs-compare"),
}
"""What opens a view, and the card of it that is scrolled to the top, if any."""


if __name__ == "__main__":
    sys.exit(main())
