from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from page_site import Site, Watch, opened

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext

TESTS = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def chromium() -> str:
    """The browser's program; without it no service is started either."""
    pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("chromium is not installed (Debian's package `chromium`)")
    return program


# Playwright keeps an event loop running in its thread, which other tests' own loops do not bear beside them:
# it ends with each file.
@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    """A real Chromium."""
    from playwright import sync_api as api

    # The first preview waits for its worker, on a machine that may have other work.
    api.expect.set_options(timeout=90_000)
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def site(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A service that begins with an empty database, shared by all tests of the page.

    It has a law and a kind of job from outside the package besides: those of tests/extensions.
    """
    del chromium  # without it nobody looks
    made = Site(
        tmp_path_factory.mktemp("page"),
        PYTHONPATH=os.pathsep.join(str(TESTS / folder) for folder in ("..", "cases", "extensions")),
        STICKSLIP_EXTENSIONS=json.dumps(["sliders:SlidersContact"]),
        STICKSLIP_KINDS=json.dumps(["test_a_kind:DISTORTION"]),
    )
    made.start()
    yield made
    made.stop()


@pytest.fixture
def profile(browser: Browser, site: Site) -> Iterator[tuple[BrowserContext, Watch]]:
    """A fresh profile, checked for complaints and requests elsewhere at the end."""
    with opened(browser, site) as made:
        yield made
