"""A hasty reader: screens, scenes, tabs and sliders at random, without a wait for what was asked before."""

from __future__ import annotations

import os
import random
from typing import TYPE_CHECKING

import pytest
from page_site import Site, opened
from service_helpers import until

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

STEPS = 40
SEEDS = range(int(os.environ.get("STICKSLIP_WANDERERS", "2")))
# A step is taken where its control is seen and hears, as a reader's is, who does not wait for one.
HEARS = "const hears = (node) => node?.checkVisibility() && !node.closest('[inert]');"
CLICK = f"(path) => {{ {HEARS} const node = document.querySelector(path); if (hears(node)) node.click(); }}"
CHOOSE = """(name) => {
  const node = document.getElementById("scene");
  if (!node.checkVisibility()) return;
  node.value = name;
  node.dispatchEvent(new Event("change", { bubbles: true }));
}"""
DRAG = f"""(to) => {{
  {HEARS}
  const node = document.querySelector("#sliders input[type=range]");
  if (!hears(node)) return;
  node.value = to;
  node.dispatchEvent(new Event("input", {{ bubbles: true }}));
}}"""
TAB = """(share) => {
  const seen = [...document.querySelectorAll("#tabs [role=tab]")].filter((node) => node.checkVisibility());
  seen[Math.floor(share * seen.length)]?.click();
}"""
# Dear scenes are left as hastily as cheap ones, but nobody waits for their responses at the end.
PASSED = ("bladed-disk", "shroud-3d", "platform-wedge", "two-dof")
LAST = "two-dof"
SHOWN = """() => {
  const text = (id) => document.getElementById(id).textContent;
  const value = (id) => document.getElementById(id).value;
  return [...["scene", "variable", "low", "high", "harmonics"].map(value), text("variable"),
    [...document.querySelectorAll("#sliders input")].map((node) => node.value),
    text("live-status").split(" · ")[0]];
}"""


def step(page: Page, by: random.Random) -> None:
    ways = (
        (CLICK, "#home"),
        (CLICK, f"#first-shipped a[href='?scene={by.choice(PASSED)}']"),
        (CHOOSE, by.choice(PASSED)),
        (DRAG, str(by.randint(0, 400))),
        (TAB, by.random()),
        ("() => { if (navigation.currentEntry.index) history.back(); }", None),
        ("() => history.forward()", None),
    )
    page.evaluate(*by.choice(ways))
    page.wait_for_timeout(by.choice((0, 20, 100, 300)))


def rests(page: Page) -> list[object]:
    expect(page.locator("#live-status")).to_contain_text("peak")
    return list(page.evaluate(SHOWN))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_hasty_reader_meets_no_error_and_ends_where_a_fresh_page_would(
    browser: Browser, site: Site, seed: int
) -> None:
    by = random.Random(seed)
    with opened(browser, site) as (context, watch):
        # On a busy machine the response of a dear scene is not followed live, which the page says.
        watch.allowed += ("status of 503", "status of 429")
        page = context.new_page()
        page.goto(f"{site.url}/?scene={LAST}")
        page.locator("html[data-ready][data-live]").wait_for(state="attached")
        for _ in range(STEPS):
            step(page, by)
        page.evaluate(CLICK, "#home")
        expect(page.locator("#first")).to_be_visible()
        page.locator(f"#first-shipped a[href='?scene={LAST}']").click()
        rests(page)
        page.evaluate(DRAG, str(by.randint(0, 400)))
        page.wait_for_url("**set=*")
        other = context.new_page()
        other.goto(page.url)
        # Answers may be under way on both, and a coarser one may come first.
        until(lambda: rests(other) == rests(page))
