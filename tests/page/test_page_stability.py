"""What is not stable is dashed on the page, in the live response and in that of a job."""

from __future__ import annotations

from typing import TYPE_CHECKING

import httpx
import pytest
from moving_scenes import bending_scene
from page_site import Site, Watch
from page_visits import visit

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext

DASHED = "svg.chart g[clip-path] > path.series.c1[stroke-dasharray='7 4']"


def stored(site: Site) -> str:
    scene = bending_scene(0)
    answer = httpx.post(f"{site.url}/v1/scenes", json=scene.to_dict(), timeout=60.0)
    assert answer.status_code in (200, 201, 409)
    return scene.name


@pytest.mark.long
def test_a_stretch_that_is_not_stable_is_dashed(profile: tuple[BrowserContext, Watch], site: Site) -> None:
    page = visit(profile[0], site, f"?scene={stored(site)}")
    expect(page.locator(f"#live-figure {DASHED}")).to_have_count(1)
    expect(page.locator("#live-figure svg.chart")).to_contain_text("not stable")


@pytest.mark.long
def test_so_it_is_in_the_response_of_a_job(profile: tuple[BrowserContext, Watch], site: Site) -> None:
    page = visit(profile[0], site, f"?scene={stored(site)}")
    page.click("#study")
    expect(page.locator(f"#live-figure {DASHED}")).to_have_count(1, timeout=180_000)
    expect(page.locator("#response-facts")).to_contain_text("fold")
