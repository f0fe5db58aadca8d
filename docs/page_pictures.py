"""Pictures of every view of the page, 1400 × 900, light and dark: docs/img/page/views/NAME-THEME.png.

python docs/page_pictures.py [VIEW …] starts a service with an empty database, computes the shipped disk and
the finite-element disk, and needs playwright and Chromium.
"""

from __future__ import annotations

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

from playwright.sync_api import sync_playwright

FOLDER = Path(__file__).resolve().parent / "img" / "page" / "views"
SIZE = {"width": 1400, "height": 900}
PORT = 8791
URL = f"http://127.0.0.1:{PORT}"
PATIENCE = 240_000  # ms


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
            [*serve, "--database", f"sqlite:///{folder}/pictures.db", "--workers", "2"]
        )
        try:
            _wait()
            with sync_playwright() as api:
                browser = api.chromium.launch(executable_path=program, args=["--no-sandbox"])
                for scheme in ("light", "dark"):
                    context = browser.new_context(viewport=SIZE, color_scheme=scheme, accept_downloads=True)
                    context.set_default_timeout(PATIENCE)
                    page = context.new_page()
                    prepare(page, first=scheme == "light")
                    for name in asked:
                        VIEWS[name](page)
                        page.wait_for_timeout(700)
                        page.screenshot(path=FOLDER / f"{name}-{scheme}.png")
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
    """Open the shipped disk, and at the first time let everything be computed."""
    page.goto(f"{URL}/?scene=bladed-disk")
    page.locator("#study").wait_for()
    page.locator("#study").click()
    page.get_by_text("Everything is there.").wait_for()
    if first:
        page.wait_for_timeout(500)


def tab(name: str, scroll_to: str | None = None) -> Callable[[Any], None]:
    """Return what opens a tab, and scrolls a card of it to the top."""

    def show(page: Any) -> None:
        page.locator(f"#tab-{name}").click()
        page.mouse.move(5, 5)
        page.evaluate("window.scrollTo(0, 0)")
        if scroll_to is not None:
            page.locator(f"#{scroll_to}").evaluate("card => card.scrollIntoView()")

    return show


VIEWS: dict[str, Callable[[Any], None]] = {
    "response": tab("response"),
    "live": tab("response", "live"),
    "curve": tab("response", "response"),
    "point": tab("response", "point"),
    "map": tab("map"),
    "front": tab("map", "front"),
    "design": tab("design"),
    "result": tab("design", "design"),
    "disk": tab("disk"),
    "campbell": tab("disk", "campbell"),
    "modes": tab("modes"),
    "identify": tab("identify"),
    "accuracy": tab("accuracy"),
    "data": tab("data"),
    "library": tab("data", "library"),
}


if __name__ == "__main__":
    sys.exit(main())
