"""Studies as questions: those that a scene has something for, a kind that the package does not know."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

import httpx
import pytest
from page_site import Site, opened

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.mark.long
def test_a_kind_without_a_view_has_a_form_and_a_result(browser: Browser, site: Site) -> None:
    with opened(browser, site) as (context, watch):
        page = context.new_page()
        page.goto(f"{site.url}/?scene=two-dof&tab=studies")
        page.locator("html[data-ready]").wait_for(state="attached")
        card = page.locator("#ask-distortion")
        expect(card).to_contain_text("How much of a response is not in its first harmonic.")
        card.get_by_label("frequencies (needed)").fill("0.9, -1")
        watch.allowed += ("422",)
        card.get_by_role("button", name="Run").click()
        expect(card.locator(".field.wrong .message")).to_contain_text("got -1")
        card.get_by_label("frequencies (needed)").fill("0.9, 1.2")
        card.get_by_role("button", name="Run").click()
        expect(page.locator("#ask-distortion-status")).to_contain_text("✓", timeout=60_000)
        [job] = httpx.get(f"{site.url}/v1/jobs?kind=distortion").json()["items"]
        found = httpx.get(f"{site.url}/v1/jobs/{job['id']}/results").json()["result"]
        expect(page.locator("#ask-distortion-result")).to_contain_text(f"{100 * found['worst']:.3f} %")
        assert f"distortion={job['id']}" in page.url
        page.reload()
        expect(page.locator("#ask-distortion-status")).to_contain_text("✓")


def test_studies_are_questions_that_are_filled_in(browser: Browser, site: Site) -> None:
    """A study runs at one press; what a scene has nothing for says why; measurements come as for a fit."""
    with opened(browser, site) as (context, _):
        page = context.new_page()
        page.goto(f"{site.url}/?scene=two-dof&tab=studies&harmonics=3")
        page.locator("html[data-ready][data-live]").wait_for(state="attached")
        kinds = {one["name"] for one in httpx.get(f"{site.url}/v1/kinds").json()["items"]}
        assert page.locator("#questions-cards article").count() == len(kinds)
        expect(page.locator("#ask-mistuning")).to_contain_text("no sectors")
        expect(page.locator("#ask-mistuning button")).to_have_count(0)
        expect(page.locator("#ask-margin-from")).to_have_value("25")
        expect(page.locator("#ask-margin-limit")).not_to_have_value("")
        expect(page.locator("#ask-margin .assumed input")).to_have_attribute("id", "ask-margin-limit")
        page.get_by_role("group", name="Questions about").get_by_role("button", name="Damper").click()
        expect(page.locator("#ask-march")).to_be_hidden()
        page.click("#ask-margin-submit")
        expect(page.locator("#ask-margin-status")).to_contain_text("✓")
        expect(page.locator("#ask-margin-result svg.chart")).to_have_count(2)
        page.get_by_role("group", name="Questions about").get_by_role("button", name="Engine").click()
        page.click("#ask-quasi-periodic-submit")
        answer = page.locator("#ask-quasi-periodic-result")
        expect(answer).to_contain_text(re.compile(r"max\|x\|[\d.]+ m"))
        for key in ("max_abs", "second_hz", "e-"):
            expect(answer).not_to_contain_text(key)
        page.get_by_role("group", name="Questions about").get_by_role("button", name="Rig").click()
        expect(page.locator("#ask-posterior-submit")).to_have_text("Choose measurements…")
        page.click("#ask-posterior-submit")
        expect(page.locator("#identify")).to_be_visible()


def test_a_study_takes_the_range_proposed_for_it_until_the_bar_says_another(
    browser: Browser, site: Site
) -> None:
    """Every mass is designed; of a damper that lifts off only heavy ones are mapped and have a front."""
    with opened(browser, site) as (context, _):
        page = context.new_page()
        page.goto(f"{site.url}/?scene=platform-cylinder&tab=studies")
        page.locator("html[data-ready]").wait_for(state="attached")
        expect(page.locator("#ask-design-bar")).to_have_text("cylinder.mass from 0.4 g to 60 g")
        for kind in ("pareto", "map"):
            expect(page.locator(f"#ask-{kind}-bar")).to_have_text("cylinder.mass from 6 g to 60 g")
        with page.expect_response(lambda one: one.url.endswith("/v1/jobs") and one.status < 300) as answer:
            page.click("#ask-pareto-submit")
        job = answer.value.json()
        assert job["request"]["variables"] == {"cylinder.mass": [0.006, 0.06]}
        httpx.delete(f"{site.url}/v1/jobs/{job['id']}")
        page.fill("#low", "10")
        page.locator("#low").blur()
        for kind in ("design", "pareto", "map"):
            expect(page.locator(f"#ask-{kind}-bar")).to_have_text("cylinder.mass from 10 g to 60 g")


STUDIES = {
    "margin": (
        {
            "scene": "two-dof", "from": 10, "to": 200, "limit": 2.0, "harmonics": 3, "points": 4,
            "dampers": {"light": {"damper.N0": 50}, "heavy": {"damper.N0": 200}},
        },
        {"Amplitude over the excitation": "light heavy", "Share of what is allowed": "margin 1"},
    ),
    "wear": (
        {
            "scene": "two-dof", "hours": 1e-4, "coefficient": {"damper": 1e-11}, "area": {"damper": 2e-4},
            "load_loss_per_depth": {"damper": 4e6}, "limit": 2.36, "harmonics": 3, "points": 9,
        },
        {"Amplitude over the life": "limit", "Loads over the life": "N0 [N]",
         "Depths over the life": "wear depth"},
    ),
    "worst-mistuning": (
        {
            "scene": "bladed-disk", "of": ["tip_middle"], "within": 0.03, "contacts": "stuck", "starts": 6,
            "patterns": ["AB", "ABB"],
        },
        {"Factors of the worst disk": "tip_middle", "Magnification of the peak": "AB ABB Whitehead's bound"},
    ),
}  # fmt: skip


@pytest.mark.few(3)
@pytest.mark.parametrize("kind", STUDIES)
def test_a_study_is_drawn(browser: Browser, site: Site, kind: str) -> None:
    body, drawings = STUDIES[kind]
    job = httpx.post(f"{site.url}/v1/jobs", json={"kind": kind, **body}, timeout=120).json()
    with opened(browser, site) as (context, _):
        page = context.new_page()
        page.goto(f"{site.url}/?scene={body['scene']}&tab=studies&{kind}={job['id']}")
        page.locator("html[data-ready]").wait_for(state="attached")
        expect(page.locator(f"#ask-{kind}-status")).to_contain_text("✓", timeout=90_000)
        expect(page.locator(f"#ask-{kind}-result svg.chart")).to_have_count(len(drawings))
        for label, words in drawings.items():
            chart = page.locator(f'#ask-{kind}-result svg.chart[aria-label="{label}"]')
            expect(chart).to_be_visible()
            for word in words.split():
                expect(chart).to_contain_text(word)
            assert chart.locator("path.series, rect.f1").count() >= 1
            # Inside its frame, whatever the size of the numbers.
            assert "NaN" not in chart.inner_html()
        # The form says what was asked, tables of tables too.
        assert "[object" not in str(
            page.locator(f"#ask-{kind}-form input").evaluate_all("all => all.map(one => one.value)")
        )
        if folder := os.environ.get("PICTURES"):  # to look at them
            page.set_viewport_size({"width": 1100, "height": 2600})
            page.locator(f"#ask-{kind}").screenshot(path=f"{folder}/{kind}.png")
