"""The page for everybody: by keyboard alone, at 200 %, narrow, in light and dark, for screen readers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from page_site import Site, Watch, opened
from page_visits import with_all

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
SERIOUS = ("serious", "critical")
NEXT = """() => {
  const now = document.activeElement;
  // Day, month and year of a date are stops of one field.
  if (now === window.__last && now.type === "date") return true;
  window.__last = now;
  if (now === document.body || window.__seen.has(now)) return false;
  if (getComputedStyle(now).outlineStyle === "none") throw new Error(`no outline: ${now.outerHTML}`);
  window.__seen.add(now);
  return true;
}"""
CUT_OFF = """() => [...document.querySelectorAll("button, label, dd, p, h2, svg.chart")]
  .filter((node) => node.checkVisibility() && !node.closest(".scroll, .unseen, .skip, [role=tablist]"))
  .filter((node) => node.getBoundingClientRect().right > innerWidth + 1)
  .map((node) => node.outerHTML.slice(0, 120))
"""
OVERLAPS = """() => [...document.querySelectorAll("svg.chart")].flatMap((chart) => {
  const boxes = [...chart.querySelectorAll("text.soft")].map((node) => [node, node.getBoundingClientRect()]);
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top + 2 < b.bottom && b.top + 2 < a.bottom;
  return boxes.flatMap(([one, a], i) => boxes.slice(i + 1).filter(([other, b]) => other !== one && meet(a, b))
    .map(([other]) => `${chart.getAttribute("aria-label")}: ${one.textContent} on ${other.textContent}`));
})"""
FOCUSABLE = (
    "a[href], summary, button:not([disabled], [tabindex='-1']), select, textarea, "
    "input:not([tabindex='-1']), [tabindex='0']"
)


ROWS = "\n".join([
    "frequency,amplitude,phase", "1.0,1.93,-20", "1.1,2.12,-95", "1.2,1.77,-120", "1.3,1.48,-135",
    "1.4,1.25,-143",
])  # fmt: skip


def visit(context: BrowserContext, site: Site, words: str = "?scene=two-dof") -> Page:
    page = context.new_page()
    page.goto(f"{site.url}/{with_all(words)}")
    page.locator("html[data-ready]").wait_for(state="attached")
    expect(page.locator("#live-status")).to_contain_text("peak")
    return page


@pytest.fixture(scope="module")
def studied(browser: Browser, site: Site) -> str:
    """The address of a page with everything on it."""
    with opened(browser, site) as (context, _):
        page = visit(context, site)
        page.click("#study")
        expect(page.locator("#study-status")).to_have_text("Everything is there.", timeout=120_000)
        return page.url.removeprefix(f"{site.url}/")


def unfold(page: Page) -> None:
    """Open all that is folded away, with a row in each list of the problem and the forms of the rail."""
    page.evaluate("for (const node of document.querySelectorAll('details')) node.open = true")
    for one in ("variables", "cases", "uncertain"):
        page.click(f"#problem-{one}-add")
    narrow = page.locator("#rail-open").is_visible()
    if narrow:
        page.click("#rail-open")
    page.click("#project-new")
    expect(page.locator("#project-form")).to_be_visible()
    if narrow:
        assert page.evaluate(CUT_OFF) == []
        page.click("#rail-close")


def compute_further(page: Page) -> None:
    """A mode, and parameters from data, whose views are empty else."""
    page.click("#modes-submit")
    page.locator("#identify-paste").evaluate("(node, text) => { node.value = text; }", ROWS)
    page.evaluate("document.getElementById('identify-paste-take').click()")
    expect(page.locator("#identify-files")).to_contain_text("1 run")
    page.click("#identify-submit")
    expect(page.locator("#identify-result")).to_be_visible()
    expect(page.locator("#modes-facts")).to_contain_text("most damping")


def serious(page: Page) -> list[str]:
    """What axe finds of the impacts that shut somebody out."""
    return [
        f"{one['id']}: {node['target']} {node['failureSummary']}"
        for one in axe.Axe().run(page).response["violations"]
        if one["impact"] in SERIOUS
        for node in one["nodes"]
    ]


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.long)])
def test_axe_finds_nothing_serious(browser: Browser, site: Site, studied: str, scheme: str) -> None:
    with opened(browser, site, color_scheme=scheme) as (context, _):
        page = visit(context, site, studied)
        expect(page.locator("#front-facts tbody tr").first).to_be_visible()
        compute_further(page)
        page.click("#scene-menu")
        page.click("#edit-scene")
        expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong")
        unfold(page)
        assert serious(page) == []


@pytest.mark.parametrize("scheme", [pytest.param(one, marks=pytest.mark.long) for one in ("light", "dark")])
def test_the_disk_is_for_everybody_too(browser: Browser, site: Site, scheme: str) -> None:
    """Both diagrams of the disk and the editor of its scene: axe, keyboard, 200 %."""
    with opened(browser, site, color_scheme=scheme) as (context, _):
        page = context.new_page()
        page.goto(f"{site.url}/?scene=bladed-disk&tab=disk&harmonics=3")
        page.locator("html[data-ready]").wait_for(state="attached")
        page.locator("#interference-submit").press("Enter")
        expect(page.locator("#interference-facts tbody tr").first).to_be_visible()
        assert serious(page) == []
        page.reload()  # Tab begins at the beginning again
        expect(page.locator("#interference-facts tbody tr").first).to_be_visible()
        assert tab_through(page) == page.locator(FOCUSABLE).evaluate_all(
            "all => all.filter(e => e.checkVisibility()).length"
        )
        for tab in page.get_by_role("tab").all():
            tab.click()
            expect(tab).to_have_attribute("aria-selected", "true")
            assert serious(page) == [], tab.text_content()
        page.click("#scene-menu")
        page.click("#edit-scene")
        expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong")
        assert serious(page) == []
        page.click("#tab-disk")
        page.set_viewport_size({"width": 640, "height": 450})
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0
        assert page.evaluate(CUT_OFF) == []
        assert page.evaluate(OVERLAPS) == []


@pytest.mark.long
def test_by_keyboard_alone(profile: Profile, site: Site, studied: str) -> None:
    context, _ = profile
    page = visit(context, site, studied)
    expect(page.locator("#front-facts tbody tr").first).to_be_visible()
    reached = tab_through(page)
    assert reached == page.locator(FOCUSABLE).evaluate_all(
        "all => all.filter(e => e.checkVisibility()).length"
    )
    page.locator("#live-figure svg.chart").focus()
    page.keyboard.press("End")
    expect(page.locator("#live-figure .chart-read")).to_contain_text("2.6 Hz")
    page.keyboard.press("Enter")
    expect(page.locator("#point-at")).to_have_value("2.6")
    page.locator("#map-figure svg.chart").focus()
    before = page.input_value("#slide-damper-N0")
    for press in ("ArrowUp", "ArrowRight", "Enter"):
        page.keyboard.press(press)
    expect(page.locator("#slide-damper-N0")).not_to_have_value(before)
    page.locator("#front-figure svg.chart").focus()
    page.keyboard.press("End")
    loaded = page.input_value("#slide-damper-N0")
    page.keyboard.press("Enter")
    expect(page.locator("#slide-damper-N0")).not_to_have_value(loaded)


def tab_through(page: Page) -> int:
    """How many elements Tab reaches, each with a visible outline."""
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0); window.__seen = new Set()")
    for _ in range(800):
        page.keyboard.press("Tab")
        more = page.evaluate(NEXT)
        if not more:
            break
    return int(page.evaluate("window.__seen.size"))


@pytest.mark.long
@pytest.mark.parametrize(("width", "height"), [(640, 450), (320, 600)])
def test_zoomed_and_narrow_nothing_is_cut_off(
    browser: Browser, site: Site, studied: str, width: int, height: int
) -> None:
    """A window of 1280 pixels at 200 % has 640 of them, at 400 % 320."""
    with opened(browser, site) as (context, _):
        page = visit(context, site, studied)
        page.set_viewport_size({"width": width, "height": height})
        expect(page.locator("#front-facts tbody tr").first).to_be_visible()
        unfold(page)
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0
        page.locator("#study").scroll_into_view_if_needed()
        expect(page.locator("#study")).to_be_in_viewport()
        cut = page.evaluate(CUT_OFF)
        assert cut == []
        assert page.locator("svg.chart").count() >= 12
        assert page.evaluate(OVERLAPS) == [], "numbers of an axis stand on one another"


@pytest.mark.long
def test_the_theme_can_be_chosen_and_stays(profile: Profile, site: Site) -> None:
    context, _ = profile
    page = visit(context, site)
    light = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.select_option("#theme", "dark")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != light
    page.reload()
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_questions_are_for_everybody_too(browser: Browser, site: Site, scheme: str) -> None:
    with opened(browser, site, color_scheme=scheme) as (context, _):
        page = visit(context, site, "?scene=two-dof&tab=studies&harmonics=3")
        assert serious(page) == []
        page.locator("#ask-margin-submit").focus()
        page.keyboard.press("Enter")
        expect(page.locator("#ask-margin-result svg.chart").first).to_be_visible()
        assert serious(page) == []
        for width, height in ((640, 450), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
