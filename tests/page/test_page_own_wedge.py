"""A stranger's wedge, from its file to an answer on a wider range: by few presses, and by keyboard alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from page_site import Site, Watch

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page, Route

Profile = tuple["BrowserContext", Watch]
FILE = Path(__file__).with_name("own_wedge.toml")
LONG_MS = 240_000
MOST_PRESSES = 8


def first_screen(context: BrowserContext, site: Site) -> Page:
    page = context.new_page()
    page.goto(site.url)
    page.locator("html[data-ready]").wait_for(state="attached")
    expect(page.locator("#first")).to_be_visible()
    return page


def test_a_strangers_wedge_is_answered_on_a_wider_range_in_few_presses(profile: Profile, site: Site) -> None:
    page = first_screen(profile[0], site)
    page.evaluate("addEventListener('click', (event) => { window.presses = (window.presses ?? 0) + 1; })")
    with page.expect_file_chooser() as chosen:
        page.click("#first-open")
    chosen.value.set_files(FILE)
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("own-wedge")
    page.click("#study")
    expect(page.locator("#answer-stale")).to_contain_text("Best at the upper bound", timeout=LONG_MS)
    before = page.input_value("#high")
    page.click("#widen")
    expect(page.locator("#answer-stale")).not_to_contain_text(f"{before} g", timeout=LONG_MS)
    expect(page.locator("#answer-peak .large")).to_be_visible(timeout=LONG_MS)
    assert float(page.input_value("#high")) == pytest.approx(10.0 * float(before))
    assert page.evaluate("window.presses") <= MOST_PRESSES


def test_a_form_is_not_used_before_its_scene_was_read(profile: Profile, site: Site) -> None:
    """The button is pressed while the pane for text still loads: the press waits, and is not lost."""
    page = first_screen(profile[0], site)

    def slowly(route: Route) -> None:
        page.wait_for_timeout(1500)
        route.continue_()

    page.route("**/codemirror*", slowly)
    with page.expect_file_chooser() as chosen:
        page.click("#first-open")
    chosen.value.set_files(FILE)
    page.locator("#editor-form").wait_for(state="attached")
    assert page.locator("#editor-form").evaluate("form => form.inert")
    page.get_by_role("button", name="Use this scene", include_hidden=True).click()
    expect(page.locator("#scene")).to_have_value("own-wedge")


def tab_to(page: Page, selector: str, most: int = 300) -> None:
    """Press Tab until the focus is there."""
    for _ in range(most):
        page.keyboard.press("Tab")
        if page.evaluate("(wanted) => document.activeElement.matches(wanted)", selector):
            return
    raise AssertionError(f"Tab does not lead to {selector}")


def test_open_change_design_and_report_by_keyboard_alone(profile: Profile, site: Site) -> None:
    page = first_screen(profile[0], site)
    with page.expect_file_chooser() as chosen:
        tab_to(page, "#first-open")
        page.keyboard.press("Enter")
    chosen.value.set_files(FILE)
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong with this scene.")
    tab_to(page, "#editor button[type=submit]")
    page.keyboard.press("Enter")
    expect(page.locator("#live-status")).to_contain_text("peak")
    tab_to(page, "#slide-wedge-mu")
    before = page.url
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    expect(page).not_to_have_url(before)
    expect(page).to_have_url(re.compile("wedge.mu:"))
    tab_to(page, "#study")
    page.keyboard.press("Enter")
    expect(page.locator("#answer-peak .large")).to_be_visible(timeout=LONG_MS)
    tab_to(page, "#save-report")
    with page.expect_download(timeout=LONG_MS) as taken:
        page.keyboard.press("Enter")
    assert "wedge.mass" in Path(taken.value.path()).read_text(encoding="utf-8")
