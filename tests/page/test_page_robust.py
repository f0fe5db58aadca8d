"""The page when things happen under it: a reload, the service stopped and started, several tabs, keys."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from launch import COMMAND
from page_site import Site, Watch, opened
from page_visits import visit

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext

Profile = tuple["BrowserContext", Watch]
AWAY = ("ERR_CONNECTION_REFUSED", "ERR_EMPTY_RESPONSE", "ERR_INCOMPLETE_CHUNKED_ENCODING",
        "ERR_CONNECTION_RESET", "ERR_SOCKET_NOT_CONNECTED", "status of 503")  # fmt: skip
LONG_MAP: dict[str, Any] = {
    "kind": "map", "scene": "two-dof", "parameter": "damper.N0", "from": 20, "to": 1000, "steps": 200,
    "frequencies": 2000, "harmonics": 15, "ridge": False, "fresh": True,
}  # fmt: skip


def submit(site: Site, **changes: object) -> str:
    job: str = httpx.post(f"{site.url}/v1/jobs", json={**LONG_MAP, **changes}).json()["id"]
    return job


@pytest.fixture
def endless(site: Site) -> Iterator[str]:
    """A map that takes a quarter of an hour and more: it ends because it is stopped."""
    job = submit(site, to=60, steps=4000, frequencies=120, harmonics=200)
    yield job
    httpx.delete(f"{site.url}/v1/jobs/{job}")


@pytest.mark.long
def test_a_reload_goes_on_watching_and_two_tabs_do_not_disturb_each_other(
    profile: Profile, site: Site, endless: str
) -> None:
    context, _ = profile
    job = endless
    page = visit(context, site, f"?scene=two-dof&map={job}")
    expect(page.locator("#map-status")).to_contain_text("%")
    page.reload()
    expect(page.locator("#map-status")).to_contain_text("%")
    assert f"map={job}" in page.url
    other = visit(context, site, "?scene=bladed-disk")
    expect(other.locator("#live-status")).to_contain_text("0.1016 mm")
    expect(other.locator("#map-status")).not_to_contain_text("%")
    expect(page.locator("#live-status")).to_contain_text("2.35 m")
    twin = visit(context, site, f"?scene=two-dof&map={job}")
    expect(twin.locator("#map-status")).to_contain_text("%")
    stop = page.locator("#runs-list").get_by_role("button", name="Stop run map of two-dof")
    stop.focus()
    said = page.inner_text("#runs-list .run-time")
    expect(page.locator("#runs-list .run-time")).not_to_have_text(said)
    expect(stop).to_be_focused()
    stop.click()
    for tab in (page, twin):
        expect(tab.locator("#runs-list li.run").first).to_contain_text("stopped")
        expect(tab.locator("#map-status")).to_contain_text("The job was stopped.")


@pytest.mark.long
def test_another_scene_in_the_middle_of_a_study_begins_anew(profile: Profile, site: Site) -> None:
    context, _ = profile
    page = visit(context, site, "?scene=two-dof&set=damper.mu:0.31")
    page.click("#study")
    expect(page.locator("#study-status")).to_contain_text("jobs are under way")
    page.select_option("#scene", "bladed-disk")
    expect(page.locator("#live-status")).to_contain_text("0.1016 mm")
    expect(page.locator("#study-status")).to_have_text("")
    assert page.url.endswith("?scene=bladed-disk&contact=shroud&range=20:3000&tab=all")
    for job in httpx.get(f"{site.url}/v1/jobs").json()["items"]:
        if job["status"] in ("accepted", "running"):
            httpx.delete(f"{site.url}/v1/jobs/{job['id']}")


@pytest.mark.long
def test_a_study_that_falls_short_says_so(profile: Profile, site: Site) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    page = visit(context, site, "?scene=two-dof")
    page.fill("#low", "2000")
    page.click("#study")
    expect(page.locator("#settings-wrong")).to_contain_text("0 < from < to")
    page.fill("#low", "99.9")
    page.fill("#high", "1e200")
    page.click("#study")
    expect(page.locator("#design-status")).to_have_class("status bad")
    expect(page.locator("#map-status")).to_contain_text("must be")
    expect(page.locator("#study-status")).to_contain_text("did not come to their end", timeout=60_000)


@pytest.mark.long
def test_the_service_stopped_and_started_under_the_page(profile: Profile, site: Site) -> None:
    context, watch = profile
    watch.allowed = AWAY
    job = submit(site, steps=200, frequencies=400)
    page = visit(context, site, f"?scene=two-dof&map={job}")
    expect(page.locator("#map-status")).to_contain_text("Map")
    site.stop()
    expect(page.locator("#banner")).to_contain_text("The service does not answer")
    # A wish made meanwhile is kept.
    page.focus("#slide-damper-N0")
    page.keyboard.press("PageUp")
    site.start()
    expect(page.locator("#banner")).to_be_hidden(timeout=30_000)
    expect(page.locator("#map-status")).to_contain_text("Every point is a solution", timeout=60_000)
    expect(page.locator("#live-status")).not_to_contain_text("2.35 m")
    assert httpx.get(f"{site.url}/v1/jobs/{job}").json()["status"] == "successful"


def test_a_link_to_what_is_gone_opens_all_the_same(profile: Profile, site: Site) -> None:
    context, watch = profile
    # The response of the scene is asked for before it is known that there is none.
    watch.allowed = ("status of 404", "status of 422")
    page = visit(context, site, "?scene=none&set=x:1e999,y&range=1&map=01a20065-53fc-74ea-b480-fc88aa1910b2")
    expect(page.locator("#scene")).to_have_value("bladed-disk")
    expect(page.locator("#map-figure")).to_contain_text("Nothing computed yet.")
    assert "map=" not in page.url


@pytest.fixture(scope="module")
def locked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A service that wants a key."""
    made = Site(tmp_path_factory.mktemp("locked"), STICKSLIP_REQUIRE_KEYS="true")
    made.start()
    yield made
    made.stop()


@pytest.mark.long
def test_a_service_with_keys_asks_for_one(browser: Browser, locked: Site) -> None:
    command = [
        *COMMAND,
        "keys",
        "create",
        "--owner",
        "ann",
        "--scope",
        "submit",
        "--database",
        locked.database,
    ]
    key = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()[0]
    with opened(browser, locked) as (context, watch):
        watch.allowed = ("status of 401",)
        page = visit(context, locked)
        expect(page.locator("#key-form")).to_be_visible()
        page.fill("#key", "stickslip_wrong")
        page.press("#key", "Enter")
        expect(page.locator("#key-status")).to_contain_text("key")
        expect(page.locator("#key-form")).to_be_visible()
        page.fill("#key", key)
        page.press("#key", "Enter")
        expect(page.locator("#live-status")).to_contain_text("0.1016 mm")
        expect(page.locator("#key-form")).to_be_hidden()
        page.get_by_role("button", name="Find the best damper").click()
        expect(page.locator("#design-facts")).to_contain_text("185.5 N")
        page.reload()
        expect(page.locator("#design-facts")).to_contain_text("185.5 N")
