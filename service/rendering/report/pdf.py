"""Pages as PDF, printed by a browser that is there."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from service.errors import InputError
from solver.results.files import whole

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_SECONDS = 120.0


def browser() -> str:
    """The browser that prints.

    Raises
    ------
    InputError
        There is none.
    """
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise InputError(
            "a PDF needs Chromium or Chrome here, and there is none: write a file that ends in .html and "
            "print it, or install one"
        )
    return found


def write_pdf(page: str, target: Path, program: str) -> None:
    """Print a page of HTML to a file, whole or not at all.

    Raises
    ------
    InputError
        The browser did not print.
    """
    with tempfile.TemporaryDirectory() as folder, whole(target) as temporary:
        source = Path(folder) / "report.html"
        source.write_text(page, "utf-8")
        command = [
            program, "--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer",
            f"--user-data-dir={folder}/profile", f"--print-to-pdf={temporary.absolute()}", source.as_uri(),
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
        if done.returncode != 0 or not temporary.is_file():
            last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
            raise InputError(f"{program} did not print the report: {last:.200}")
