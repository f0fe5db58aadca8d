"""The card of studies without a view of their own, with a kind that the package does not know."""

from __future__ import annotations

from typing import TYPE_CHECKING

import httpx
import pytest
from page_site import Site, opened

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser


def test_a_kind_without_a_view_has_a_form_and_a_result(browser: Browser, site: Site) -> None:
    with opened(browser, site) as (context, watch):
        page = context.new_page()
        page.goto(f"{site.url}/?scene=two-dof&tab=runs")
        page.locator("html[data-ready]").wait_for(state="attached")
        names = page.locator("#others-kind option").all_text_contents()
        assert set(names) == {
            "peaks",
            "plan",
            "solve",
            "margin",
            "mistuning",
            "worst-mistuning",
            "controlled",
            "sensitivities",
            "transient",
            "quasi-periodic",
            "wear",
            "distortion",
        }
        page.select_option("#others-kind", "distortion")
        expect(page.locator("#others-summary")).to_have_text(
            "How much of a response is not in its first harmonic."
        )
        page.get_by_label("frequencies (needed)").fill("0.9, -1")
        watch.allowed += ("422",)
        page.locator("#others-form").get_by_role("button", name="Submit").click()
        expect(page.locator("#others-fields .field.wrong .message")).to_contain_text("got -1")
        page.get_by_label("frequencies (needed)").fill("0.9, 1.2")
        page.locator("#others-form").get_by_role("button", name="Submit").click()
        expect(page.locator("#others-status")).to_contain_text("distortion is done", timeout=60_000)
        [job] = httpx.get(f"{site.url}/v1/jobs?kind=distortion").json()["items"]
        found = httpx.get(f"{site.url}/v1/jobs/{job['id']}/results").json()["result"]
        expect(page.locator("#others-result")).to_contain_text(f"{found['worst']:.6f}"[:7])
        assert f"distortion={job['id']}" in page.url
        page.reload()
        expect(page.locator("#others-status")).to_contain_text("distortion is done")
