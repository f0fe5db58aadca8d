"""Hostile names and data in a real Chromium: page and report show them, run nothing and fetch nothing."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")

from page_site import Address, opened
from playwright.sync_api import expect
from service_helpers import serving

import optim
from service.jobs.kinds import SHIPPED
from service.rendering.report.design_report import design_report
from service.rendering.report.sections import Designed
from solver.scene.scene import load_scene

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

BAD = (
    '"><img src=x onerror="window.hurt=1"><script src="http://evil.invalid/a.js"></script>'
    '<svg onload="window.hurt=1"><a href="javascript:window.hurt=1">${window.hurt=1}'
)


@pytest.fixture(scope="module")
def poisoned(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Address]:
    """A service whose database somebody has filled with markup."""
    folder = tmp_path_factory.mktemp("poisoned")
    with serving(folder, SHIPPED, max_body_bytes=4_000_000, preview_seconds=60.0) as client:
        body = {"kind": "sweep", "scene": "two-dof", "harmonics": 3}
        done = client.post("/v1/jobs", json=body, headers={"Prefer": "wait=60"}).json()
        assert done["status"] == "successful"
        with closing(sqlite3.connect(folder / "jobs.db")) as connection, connection:
            connection.execute("UPDATE result SET scene_name = ?, status = ?", [BAD, BAD])
            connection.execute("UPDATE quantity SET label = ? WHERE name = 'parameter'", [BAD])
            connection.execute("UPDATE quantity SET label = ? WHERE label = 'damper'", [BAD])
            connection.execute("UPDATE job SET scene_name = ?", [BAD])
        yield Address(str(client.base_url).rstrip("/"))


def unhurt(page: Page) -> None:
    page.wait_for_timeout(300)
    assert page.evaluate("window.hurt") is None
    assert page.locator("img[src=x], script[src*='evil'], a[href^='javascript']").count() == 0


def test_stored_markup_is_text_on_the_page(browser: Browser, poisoned: Address) -> None:
    with opened(browser, poisoned) as (context, _):
        page = context.new_page()
        page.goto(f"{poisoned.url}/?scene=two-dof")
        page.locator("html[data-ready]").wait_for(state="attached")
        expect(page.locator("body")).to_contain_text("<img src=x onerror=")
        unhurt(page)


@pytest.mark.long
@pytest.mark.parametrize(
    "text",
    [f"'{BAD}' = 1", f"name = '{BAD}'", f"[[contacts]]\nname = '{BAD}'", f"[structure]\nkind = '{BAD}'"],
)
def test_markup_in_a_scene_file_is_text_in_the_messages(
    browser: Browser, poisoned: Address, text: str
) -> None:
    with opened(browser, poisoned) as (context, watch):
        watch.allowed = ("status of 4",)
        page = context.new_page()
        page.goto(f"{poisoned.url}/?scene=two-dof")
        page.locator("html[data-ready]").wait_for(state="attached")
        name = "<img src=x onerror=hurt=1>.toml"
        file: Any = {"name": name, "mimeType": "text/plain", "buffer": text.encode()}
        page.set_input_files("#file", [file])
        expect(page.locator("#editor")).to_be_visible()
        unhurt(page)


def test_markup_in_a_result_is_text_in_a_report(browser: Browser, tmp_path: Path) -> None:
    scene = load_scene("two-dof")
    result = optim.design(scene, variables={"damper.N0": (20.0, 500.0)}, harmonics=3).to_json()
    result |= {"status": BAD, "method": BAD}
    problem = {"variables": {"damper.N0": [20.0, 500.0]}, "harmonics": 3}
    written = tmp_path / "report.html"
    written.write_text(design_report(Designed(scene=scene, problem=problem, result=result)), "utf-8")
    asked: list[str] = []
    context = browser.new_context()
    try:
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.goto(written.as_uri())
        expect(page.locator("body")).to_contain_text("<img src=x onerror=")
        unhurt(page)
    finally:
        context.close()
    assert [url for url in asked if not re.match(r"(file|data):", url)] == []
