"""The panel of a design problem: variables, limits, cases, what is not known, and what holds the result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from page_site import Site, Watch
from page_visits import visit

import optim
import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
LONG_MS = 120_000


def fill(page: Page, row: str, **values: str) -> None:
    """Fill fields of a row of the panel, by the names of their keys."""
    for name, value in values.items():
        field = page.locator(f"[role=group][aria-label='{row}'] [name='{name}']")
        if field.evaluate("node => node.tagName") == "SELECT":
            field.select_option(value)
        else:
            field.fill(value)


def asked(site: Site, page: Page) -> dict[str, Any]:
    """The request of the design that the page shows."""
    job = next(part for part in page.url.split("&") if part.startswith("design=")).removeprefix("design=")
    request: dict[str, Any] = httpx.get(f"{site.url}/v1/jobs/{job}").json()["request"]
    return request


@pytest.mark.long
def test_two_variables_two_cases_and_a_limit(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=design&harmonics=3")
    fill(page, "variable 1", path="damper.N0", low="20", high="500")
    page.click("#problem-variables-add")
    fill(page, "variable 2", path="damper.kt", low="0.5", high="50")
    page.click("#problem-limits-fold summary")
    page.fill("#problem-max_band_hz", "0.35")
    page.click("#problem-cases-fold summary")
    for case, level in (("low", ""), ("high", "1.5")):
        page.click("#problem-cases-add")
        fill(page, f"case {1 if case == 'low' else 2}", name=case, **{"excitation.amplitude": level})
    page.click("#study")
    expect(page.locator("#design-status")).to_contain_text("wider bounds would do better", timeout=LONG_MS)
    keys = {
        "variables": {"damper.N0": [20, 500], "damper.kt": [0.5, 50]},
        "cases": [{"name": "low"}, {"name": "high", "set": {"excitation.amplitude": 1.5}}],
        "max_band_hz": 0.35,
        "harmonics": 3,
    }
    request = asked(site, page)
    assert {key: request[key] for key in keys} == keys
    direct = optim.design(solver.load_scene("two-dof"), **keys)  # type: ignore[arg-type]
    assert direct.peak is not None
    expect(page.locator("#design-facts")).to_contain_text(f"{direct.optimum['damper.N0']:.4g} N")
    limits = page.get_by_role("region", name="Limits of the design").locator("tbody tr")
    expect(limits).to_have_count(2)
    expect(limits.first).to_contain_text("low0.35 Hz0.35 Hz")
    page.locator("#design-facts summary", has_text="What holds it").click()
    expect(page.get_by_role("region", name="Multipliers of the design")).to_contain_text(
        "upper bound of damper.kt"
    )
    optima = page.get_by_role("region", name="Local optima").locator("tbody tr")
    assert optima.count() == len(direct.to_json()["basins"]) >= 2
    expect(page.locator("#answer-peak .large")).to_contain_text(f"{direct.peak.value:.4g} m")
    expect(page.locator("#answer-stale")).to_be_empty()
    page.reload()
    expect(page.locator("[role=group][aria-label='variable 2'] [name=high]")).to_have_value("50")
    expect(page.locator("#problem-max_band_hz")).to_have_value("0.35")
    expect(page.locator("[role=group][aria-label='case 2'] [name='excitation.amplitude']")).to_have_value(
        "1.5"
    )


@pytest.mark.long
def test_a_robust_design_is_shown_beside_the_nominal_one(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=design&harmonics=3")
    fill(page, "variable 1", path="damper.N0", low="20", high="500")
    page.click("#problem-uncertainty-fold summary")
    page.click("#problem-uncertain-add")
    fill(page, "uncertain parameter 1", path="damper.mu", how="between", to="0.4")
    fill(page, "uncertain parameter 1", **{"from": "0.2"})
    page.fill("#problem-samples", "4")
    page.click("#study")
    expect(page.locator("#design-status")).to_contain_text("over the uncertainty", timeout=LONG_MS)
    assert asked(site, page)["uncertain"] == {"damper.mu": [0.2, 0.4]}
    rows = page.get_by_role("region", name="Nominal and robust design").locator("tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.first).to_contain_text("damper.mu = 0.2")
    expect(page.locator("#answer-peak")).to_contain_text("Worst peak")
    expect(page.locator("#answer-peak .large")).to_contain_text("→")
    page.fill("#harmonics", "2")
    page.press("#harmonics", "Tab")
    expect(page.locator("#answer-stale")).to_contain_text("3 harmonics, now 2")
    page.locator("#answer-stale button").click()
    expect(page.locator("#answer-stale")).to_be_empty(timeout=LONG_MS)
    again = asked(site, page)
    assert (again["uncertain"], again["harmonics"]) == ({"damper.mu": [0.2, 0.4]}, 2), (
        "the problem stays what it was"
    )


@pytest.mark.few(4)
@pytest.mark.parametrize(
    ("fold", "field", "text", "words"),
    [
        ("limits", "forbidden_hz", "520-560-600", "520 to 560, 600 to 620"),
        ("limits", "max_peak", "two", "max peak must be a number"),
        ("limits", "max_band_hz", "-3", "max band must be a number above 0"),
        ("method", "basins", "2.5", "basins must be a whole number"),
    ],
)
def test_what_is_wrong_with_a_problem_is_said_at_its_field(
    profile: Profile, site: Site, fold: str, field: str, text: str, words: str
) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    page = visit(context, site, "?scene=two-dof&tab=design")
    page.click(f"#problem-{fold}-fold summary")
    page.fill(f"#problem-{field}", text)
    page.click("#study")
    expect(page.locator(f".field:has(#problem-{field}) .message")).to_contain_text(words)
    expect(page.locator(f"#problem-{field}")).to_have_attribute("aria-invalid", "true")
    expect(page.locator(f"#problem-{field}")).to_be_focused()


@pytest.mark.long
def test_rows_are_added_and_removed_by_keyboard(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=design")
    page.locator("#problem-variables-add").press("Enter")
    expect(page.locator("#problem-variables [role=group]")).to_have_count(2)
    page.get_by_role("button", name="Remove variable 1").press("Enter")
    expect(page.locator("#problem-variables [role=group]")).to_have_count(1)
    expect(page.get_by_role("button", name="Remove variable 1")).to_be_hidden()
    page.locator("#problem-variables [name=path]").select_option("damper.kt")
    fill(page, "variable 1", low="30", high="20")
    page.click("#study")
    expect(page.locator("#settings-wrong")).to_contain_text("30 < 20 is not so")


def test_the_fields_of_a_problem_are_in_the_units_that_people_use(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=platform-wedge&tab=design")
    fill(page, "variable 1", path="wedge.angle")
    row = page.locator("[role=group][aria-label='variable 1']")
    expect(row).to_contain_text("°")
    fill(page, "variable 1", low="15", high="40")
    expect(page.locator("#problem-words")).to_contain_text("wedge.angle (15 – 40 °)")
    page.click("#problem-uncertainty-fold summary")
    page.click("#problem-uncertain-add")
    fill(page, "uncertain parameter 1", path="wedge.kt", how="± value", **{"from": "2"})
    expect(page.locator("#problem-words")).to_contain_text("wedge.kt ± 2 value MN/m")


@pytest.mark.long
def test_from_nothing_to_a_compared_named_and_reported_design(profile: Profile, site: Site) -> None:
    """Two variables, three engine orders and a limit, in a project, beside a design without the limit."""
    page = visit(profile[0], site, "?scene=bladed-disk&tab=design&harmonics=3")
    page.click("#project-new")
    page.fill("#project-name", "Stage 3")
    page.press("#project-name", "Enter")
    expect(page.locator("#project-form")).to_be_hidden()
    fill(page, "variable 1", path="shroud.N0", low="100", high="400")
    page.click("#problem-variables-add")
    fill(page, "variable 2", path="shroud.kt", low="4", high="8")  # MN/m
    page.click("#problem-cases-fold summary")
    for number in (1, 2, 3):
        page.click("#problem-cases-add")
        fill(page, f"case {number}", name=f"order {number}", engine_order=str(number))
    page.click("#study")
    expect(page.locator("#design-status")).to_contain_text("Found in", timeout=LONG_MS)
    assert asked(site, page)["variables"] == {"shroud.N0": [100, 400], "shroud.kt": [4e6, 8e6]}
    page.click("#problem-limits-fold summary")
    page.fill("#problem-max_band_hz", "120")
    page.click("#study")
    expect(page.locator("#design-status")).to_contain_text("waits")
    expect(page.locator("#design-status")).to_contain_text("Found in", timeout=LONG_MS)
    page.click("#tab-runs")
    runs = page.locator("#runs-table tr[data-run]", has_text="bladed-disk")
    expect(runs).to_have_count(2)
    runs.first.get_by_role("button", name="More of run").click()
    form = page.locator("#runs-table tr[data-more]")
    form.get_by_label("Name").fill("with a narrow band")
    form.get_by_role("button", name="Save").click()
    expect(page.locator("#runs-table .run-name").first).to_have_text("with a narrow band")
    for index in (0, 1):
        page.locator("#runs-table input[type=checkbox]").nth(index).check()
    expect(page.get_by_role("region", name="Differences of two runs")).to_contain_text("max band")
    with page.expect_download() as taken:
        page.click("#save-report")
    text = Path(taken.value.path()).read_text(encoding="utf-8")
    assert "shroud.N0" in text
    assert "Stage 3" in text
    assert "with a narrow band" in text
