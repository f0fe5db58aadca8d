"""Visits to the page that several tests begin with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from page_site import Site

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

BAD_SCENE = """
name = "my-damper"
[structure]
kind = "lumped"
masses = { blade = 0.05, disk = 0.4 }
springs = [
  { name = "airfoil", between = ["blade", "disk"], k = 4.0e5, c = 2.0 },
  { name = "web", between = ["disk", "ground"], k = 3.0e6, c = 2.0 },
]
[[contacts]]
name = "damper"
between = ["blade", "disk"]
kt = 5.0e5
mu = -0.3
N0 = 40.0
[excitation]
dof = "wing"
amplitude = 5.0
[observe]
dof = "blade"
band = [300.0, 900.0]
"""
# Drops a file with a text on what a selector names.
DROP = """([selector, name, text]) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  for (const type of ["dragover", "drop"]) {
    const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
    document.querySelector(selector).dispatchEvent(event);
  }
}"""


def with_all(words: str) -> str:
    """The words of an address, of a page with every card under one another unless they name a tab."""
    return words if "tab=" in words else f"{words}{'&' if words else '?'}tab=all"


def visit(context: BrowserContext, site: Site, words: str = "") -> Page:
    page = context.new_page()
    page.goto(f"{site.url}/{with_all(words)}")
    page.locator("html[data-ready]").wait_for(state="attached")
    return page


def downloaded(page: Page, selector: str) -> bytes:
    """What a click downloads."""
    with page.expect_download() as found:
        page.click(selector)
    return Path(found.value.path()).read_bytes()
