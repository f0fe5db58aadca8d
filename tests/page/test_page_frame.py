"""The frame of the page: what a window shows without scrolling, the drawer, menus, chips, Back."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from page_site import Site, Watch, opened

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
DRAWN_ANEW = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"


def visit(context: BrowserContext, site: Site, words: str) -> Page:
    """A page as people see it: one tab."""
    page = context.new_page()
    page.goto(f"{site.url}/{words}")
    page.locator("html[data-ready]").wait_for(state="attached")
    expect(page.locator("#live-status")).to_contain_text("peak")
    return page


def box(page: Page, part: str) -> tuple[float, float, float, float]:
    """Left, top, right, bottom of an element in the window."""
    found = page.locator(part).bounding_box()
    assert found is not None, f"{part} is not shown"
    return found["x"], found["y"], found["x"] + found["width"], found["y"] + found["height"]


@pytest.mark.long
def test_curve_and_sliders_stand_side_by_side_under_the_answer(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    page.click("#study")
    expect(page.locator("#study-status")).to_have_text("Everything is there.", timeout=120_000)
    expect(page.locator("#answer-certificate .large")).to_have_text(
        re.compile("optimum found|best of 2 optima found")
    )
    for width, height in ((1366, 768), (1440, 900), (1024, 768)):
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate(DRAWN_ANEW)
        bar, answer, tabs = (box(page, f"#{name}") for name in ("bar", "answer", "tabs"))
        assert bar[3] <= 60
        for part in ("#scene", "#study"):
            assert bar[1] <= box(page, part)[1]
            assert box(page, part)[3] <= bar[3]
        figures = page.locator("#answer-body .large").evaluate_all(
            "all => all.map((one) => one.getBoundingClientRect().top)"
        )
        assert len(figures) == 5
        assert max(figures) - min(figures) < 1, "the figures stand in one line"
        assert answer[3] <= tabs[1] + 1
        live, sliders = box(page, "#live"), box(page, "#sliders")
        assert live[1] <= (0.25 if width >= 1100 else 0.28) * height, "the view begins high"
        assert live[2] <= sliders[0], "the curve stands beside the sliders"
        for part in (live, box(page, "#live-figure svg.chart"), sliders):
            assert part[3] <= height, "nothing of it is below the window"
        assert page.evaluate(SIDEWAYS) <= 0


@pytest.mark.long
def test_the_rail_is_a_drawer_where_there_is_no_room(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    for width, height, scene in ((1024, 768, "bladed-disk"), (390, 844, "two-dof")):
        expect(page.locator("#rail-open")).to_be_hidden()
        page.set_viewport_size({"width": width, "height": height})
        expect(page.locator("#rail")).to_be_hidden()
        page.click("#rail-open")
        expect(page.locator("#rail")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.locator("#rail")).to_be_hidden()
        expect(page.locator("#rail-open")).to_be_focused()
        page.click("#rail-open")
        page.locator("#scene-list").get_by_role("button", name=scene, exact=True).click()
        expect(page.locator("#rail")).to_be_hidden()
        expect(page.locator("#scene")).to_have_value(scene)
        assert page.evaluate(SIDEWAYS) <= 0
        page.set_viewport_size({"width": 1366, "height": 768})
        expect(page.locator("#rail")).to_be_visible()


@pytest.mark.long
def test_on_a_phone_scene_button_and_answer_come_before_the_curve(browser: Browser, site: Site) -> None:
    with opened(browser, site) as (context, _):
        page = visit(context, site, "?scene=two-dof")
        page.set_viewport_size({"width": 390, "height": 844})
        tops = [box(page, part)[1] for part in ("#scene", "#study", "#answer", "#tabs", "#live", "#sliders")]
        assert tops == sorted(tops)
        assert tops[4] < 844
        page.click("#search-menu")
        expect(page.locator("#high")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.locator("#high")).to_be_hidden()


def test_a_chip_says_what_differs_from_the_scene_and_puts_it_back(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    expect(page.locator("#chips li")).to_have_count(0)
    value = page.locator("#slide-damper-N0 >> xpath=../span/input")
    value.fill("120")
    value.press("Tab")
    expect(page.locator("#chips li")).to_have_text("damper.N0 = 120 N (scene: 100 N)×")
    expect(page.locator(".slider.changed")).to_have_count(1)
    page.click("#tab-studies")
    expect(page.locator("#chips li")).to_be_visible()
    page.click("#chips button")
    expect(page.locator("#chips li")).to_have_count(0)
    assert "set=" not in page.url
    page.click("#tab-response")
    expect(value).to_have_value("100")
    expect(page.locator(".slider.changed")).to_have_count(0)


@pytest.mark.long
def test_what_is_done_with_a_scene_is_in_its_menu(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    expect(page.locator("#new-scene")).to_be_hidden()
    page.click("#scene-menu")
    expect(page.locator("#new-scene")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#scene-menu")).to_be_focused()
    expect(page.locator("#scene-menu")).to_have_attribute("aria-expanded", "false")
    page.click("#scene-menu")
    page.click("#new-scene")
    expect(page.locator(".choice-card").first).to_be_visible()
    expect(page.locator("#new-scene")).to_be_hidden()


def test_back_and_forward_go_through_scenes_and_tabs(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    value = page.locator("#slide-damper-N0 >> xpath=../span/input")
    value.fill("120")
    value.press("Tab")
    expect(page.locator("#chips li")).to_have_count(1)
    page.click("#tab-studies")
    page.click("#tab-design")
    page.select_option("#scene", "bladed-disk")
    expect(page.locator("#live-status")).to_contain_text("0.1016 mm")
    page.go_back()
    expect(page.locator("#scene")).to_have_value("two-dof")
    expect(page.locator("#chips li")).to_have_text("damper.N0 = 120 N (scene: 100 N)×")
    expect(page.locator("#tab-design")).to_have_attribute("aria-selected", "true")
    page.go_back()
    expect(page.locator("#tab-studies")).to_have_attribute("aria-selected", "true")
    page.go_back()
    expect(page.locator("#tab-response")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#live-status")).to_contain_text("m at 1.")
    for _ in range(3):
        page.go_forward()
    expect(page.locator("#scene")).to_have_value("bladed-disk")
    expect(page.locator("#live-status")).to_contain_text("0.1016 mm")
    expect(page.locator("#chips li")).to_have_count(0)


def test_every_name_in_the_page_is_said_once(profile: Profile, site: Site) -> None:
    """Fields that schemas name do not take the names of figures."""
    page = visit(profile[0], site, "?scene=bladed-disk&tab=all")
    twice = page.evaluate(
        """() => Object.entries(Object.groupBy([...document.querySelectorAll("[id]")], ({ id }) => id))
          .filter(([, all]) => all.length > 1).map(([id]) => id)"""
    )
    assert twice == []
