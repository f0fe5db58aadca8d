"""The first screen: what is being started, one's own scene, shipped scenes, recent runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from page_site import Site, Watch, opened
from service_helpers import until
from test_page_frame import SIDEWAYS

import solver

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
SIZES = {"desk": (1366, 768), "tablet": (1024, 768), "zoomed": (683, 384), "phone": (390, 844)}
COMPILE_MS = 900_000
OF_A_SCENE = ("#rail", "#tabs", "#scene", "#study", "#share", "#answer", "#rail-open", "#search-menu")
RIG = "frequency [Hz],amplitude [m],phase [deg]\n1.0,1.93,-12\n1.05,2.1,-80\n1.1,1.5,-140\n"
WORDS = "(node) => node.id || node.textContent"
# What Tab reaches, in the order of the document, and so of what is read.
REACHED = f"""() => [...document.querySelectorAll("a, button, select, input, textarea, [tabindex]")]
  .filter((node) => node.tabIndex >= 0 && node.checkVisibility()).map({WORDS})"""
# What banner and strip say, whenever one of them changes.
SEEN = """() => {
  window.seen = [];
  const [banner, strip] = ["banner", "starting"].map((id) => document.getElementById(id));
  const words = (node) => node.hidden ? "" : node.textContent;
  const look = new MutationObserver(() => seen.push([words(banner), words(strip)]));
  const all = { attributes: true, childList: true, subtree: true };
  for (const node of [banner, strip]) look.observe(node, all);
}"""


def first(context: BrowserContext, site: Site) -> Page:
    page = context.new_page()
    page.goto(site.url)
    page.locator("html[data-ready]").wait_for(state="attached")
    expect(page.locator("#first-shipped svg")).to_have_count(len(solver.shipped_scenes()))
    expect(page.locator("#first-templates svg")).to_have_count(4)
    return page


def all_ready(site: Site) -> bool:
    parts = httpx.get(f"{site.url}/health/ready").json()["parts"]
    return all(part["state"] == "ready" for part in parts)


def is_first(page: Page) -> None:
    expect(page.locator("#first")).to_be_visible()
    for part in OF_A_SCENE:
        expect(page.locator(part)).to_be_hidden()


def shows(page: Page, scene: str) -> None:
    expect(page.locator("#scene")).to_have_value(scene)
    expect(page.locator("#live-status")).to_contain_text("peak")
    expect(page.locator("#first")).to_be_hidden()


def test_a_scene_is_opened_from_its_card_and_back_leads_to_the_first_screen(
    profile: Profile, site: Site
) -> None:
    until(lambda: all_ready(site))
    page = first(profile[0], site)
    is_first(page)
    expect(page.locator("#starting")).to_be_hidden()
    expect(page.locator("#banner")).to_be_hidden()
    cards = page.locator("#first-shipped a")
    assert [one.locator("b").text_content() for one in cards.all()] == list(solver.shipped_scenes())
    expect(cards.filter(has_text="two-dof")).to_contain_text("Two masses in a chain")
    cards.filter(has_text="two-dof").click()
    shows(page, "two-dof")
    assert "scene=two-dof" in page.url
    page.go_back()
    is_first(page)
    assert page.url == f"{site.url}/"
    page.go_forward()
    shows(page, "two-dof")
    page.select_option("#scene", "shroud-3d")
    expect(page.locator("#live-status")).to_contain_text("441")
    page.click("#home")
    is_first(page)
    page.go_back()
    shows(page, "shroud-3d")
    page.go_back()
    shows(page, "two-dof")
    page.go_back()
    is_first(page)


def test_a_scene_left_before_it_was_loaded_asks_for_nothing(profile: Profile, site: Site) -> None:
    page = first(profile[0], site)
    page.locator("#first-shipped a").filter(has_text="two-dof").click()
    shows(page, "two-dof")
    page.click("#home")
    is_first(page)
    held: list[Any] = []
    page.route("**/v1/scenes/parameters", lambda route: held.append(route), times=1)
    page.go_back()
    expect(page.locator("#scene")).to_have_value("two-dof")
    until(lambda: page.evaluate("true") and held)
    # Nothing of it is known yet, and what was said before it is not said of it.
    expect(page.locator("#live-status")).to_be_empty()
    page.go_back()
    is_first(page)
    with page.expect_response("**/v1/scenes/parameters"):
        held[0].continue_()
    page.go_forward()
    # That the service refused nothing meanwhile is asked of the whole profile.
    shows(page, "two-dof")


def test_other_words_of_an_address_show_a_scene_as_ever(profile: Profile, site: Site) -> None:
    page = profile[0].new_page()
    page.goto(f"{site.url}/?tab=runs")
    expect(page.locator("#scene")).to_have_value("bladed-disk")
    expect(page.locator("#runs-table")).to_be_visible()
    expect(page.locator("#first")).to_be_hidden()


def test_a_template_opens_as_a_commented_scene_and_is_among_ones_own_then(
    profile: Profile, site: Site
) -> None:
    page = first(profile[0], site)
    page.click("#template-ground-damper")
    expect(page.locator("#editor-status")).to_have_text("Nothing is wrong with this scene.")
    expect(page.locator(".toml-pane")).to_contain_text("# Blade with a damper to the ground.")
    expect(page.locator("#first")).to_be_hidden()
    page.locator("#editor").get_by_role("button", name="Close").click()
    expect(page.locator("#template-ground-damper")).to_be_focused()
    page.click("#template-ground-damper")
    expect(page.locator("#editor-status")).to_have_text("Nothing is wrong with this scene.")
    name = page.locator("#editor-tables input").first.input_value()
    page.get_by_role("button", name="Use this scene").click()
    shows(page, name)
    page.go_back()
    is_first(page)
    own = page.locator(".own-scene", has_text=name).first
    expect(own.locator("svg")).to_be_visible()
    own.click()
    shows(page, name)


def test_questions_and_matrices_are_a_press_away_and_come_back(profile: Profile, site: Site) -> None:
    page = first(profile[0], site)
    page.click("#first-questions")
    expect(page.locator(".choice-card").first).to_be_visible()
    page.locator("#editor").get_by_role("button", name="Close").click()
    page.click("#first-matrices")
    expect(page.locator("#matrix-choose")).to_be_focused()
    expect(page.locator("#first")).to_be_hidden()
    page.locator("#matrices").get_by_role("button", name="Close").click()
    is_first(page)
    expect(page.locator("main")).to_be_focused()


def test_what_a_rig_measured_is_read_for_the_scene_it_is_of(profile: Profile, site: Site) -> None:
    page = first(profile[0], site)
    page.set_input_files("#file", {"name": "rig.csv", "mimeType": "text/csv", "buffer": RIG.encode()})
    expect(page.locator("#first-rig")).to_contain_text("rig.csv was measured on")
    page.select_option("#first-rig-scene", "two-dof")
    page.click("#first-rig-open")
    shows(page, "two-dof")
    expect(page.locator("#identify-files")).to_contain_text("1 run, 3 points")
    expect(page.locator("#tab-identify")).to_have_attribute("aria-selected", "true")


def test_a_recent_run_is_shown_and_opened_as_it_was(profile: Profile, site: Site) -> None:
    body = {
        "kind": "sweep",
        "scene": "two-dof",
        "set": {"damper.N0": 90.0},
        "harmonics": 3,
        "name": "at 90 N",
    }
    job = httpx.post(f"{site.url}/v1/jobs", json=body).json()["id"]
    page = first(profile[0], site)
    run = page.locator("#first-recent .run", has_text="at 90 N")
    expect(run.locator("svg.spark")).to_be_visible()
    run.locator("button").click()
    shows(page, "two-dof")
    expect(page.locator("#chips")).to_contain_text("damper.N0 = 90 N")
    assert job in page.url
    page.go_back()
    is_first(page)
    page.get_by_role("link", name="All runs").click()
    expect(page.locator("#first")).to_be_hidden()
    expect(page.locator("#runs-table")).to_be_visible()
    expect(page.locator("#runs-table")).to_contain_text("at 90 N")


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.long)])
def test_everybody_can_read_and_reach_it_at_every_size(browser: Browser, site: Site, scheme: Any) -> None:
    with opened(browser, site, color_scheme=scheme) as (context, _):
        page = first(context, site)
        for size, (width, height) in SIZES.items():
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate(SIDEWAYS) <= 0, size
            assert [one["id"] for one in axe.Axe().run(page).response["violations"]] == [], size
            wanted, found = page.evaluate(REACHED), [page.locator(".skip").evaluate(WORDS)]
            page.locator(".skip").focus()
            for _ in wanted[1:]:
                page.keyboard.press("Tab")
                found.append(page.evaluate(f"({WORDS})(document.activeElement)"))
            assert found == wanted, size


def test_after_a_kill_and_a_restart_nothing_false_stays(browser: Browser, tmp_path: Path) -> None:
    site = Site(tmp_path)
    site.start()
    try:
        with opened(browser, site) as (context, watch):
            watch.allowed = (
                "ERR_CONNECTION_REFUSED",
                "ERR_EMPTY_RESPONSE",
                "ERR_INCOMPLETE",
                "503",
                "ERR_CONNECTION_RESET",
            )
            page = first(context, site)
            expect(page.locator("#starting")).to_be_hidden()
            page.evaluate(SEEN)
            site.kill()
            expect(page.locator("#banner")).to_contain_text("The service does not answer.")
            is_first(page)
            site.start()
            expect(page.locator("#banner")).to_be_hidden()
            expect(page.locator("#starting")).to_be_hidden()
            seen = page.evaluate("seen")
            assert any("Getting ready" in strip and not banner for banner, strip in seen)
            assert not any(banner and strip for banner, strip in seen)
            page.reload()
            page.locator("#first-shipped a", has_text="two-dof").click()
            shows(page, "two-dof")
            expect(page.locator("#banner")).to_be_hidden()
            expect(page.locator("#starting")).to_be_hidden()
    finally:
        site.stop()


@pytest.mark.long
def test_a_first_start_says_how_far_it_is_until_all_is_there(browser: Browser, tmp_path: Path) -> None:
    """Kernels are compiled, some minutes; scenes are opened and edited meanwhile."""
    site = Site(tmp_path, NUMBA_CACHE_DIR=str(tmp_path), STICKSLIP_KERNELS="")
    site.start()
    try:
        with opened(browser, site) as (context, _):
            page = first(context, site)
            strip = page.locator("#starting")
            expect(strip.locator("div.is-compiles")).to_contain_text(
                re.compile(r"Worker 1 compiles[1-9]\d* of")
            )
            expect(strip).to_contain_text("Service and store ready")
            expect(strip).to_contain_text("Live curves waits")
            for width, height in SIZES.values():
                page.set_viewport_size({"width": width, "height": height})
                assert page.evaluate(SIDEWAYS) <= 0
                assert [one["id"] for one in axe.Axe().run(page).response["violations"]] == []
            kernels = strip.locator("div.is-compiles progress")
            before = kernels.evaluate("node => node.value")
            expect(strip.locator(".starting-head")).to_have_text(
                re.compile(r"Getting ready: about \d+ s more")
            )
            page.click("#template-platform-damper")
            expect(page.locator("#editor-status")).to_have_text("Nothing is wrong with this scene.")
            assert 0 < before < kernels.evaluate("node => node.value") < 1
            expect(strip).to_be_hidden(timeout=COMPILE_MS)
            expect(page.locator("#banner")).to_be_hidden()
            page.get_by_role("button", name="Use this scene").click()
            expect(page.locator("#live-status")).to_contain_text("peak")
    finally:
        site.stop()
