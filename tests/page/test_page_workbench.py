"""The rail and the tabs: projects, runs with their names, comparison, the bin, what is under way."""

from __future__ import annotations

import re
from datetime import date, timedelta
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from page_site import Site, Watch
from page_visits import visit

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
# What is said of a job at a quarter after 12 s and after 12 min, just begun, and at its end.
TIMING = """async () => {
  const source = document.querySelector('link[rel=modulepreload][href$="base/timing.js"]').href;
  const { timing } = await import(source);
  const started = "2026-01-01T00:00:00Z", at = (s) => Date.parse(started) + 1000 * s;
  const runs = (progress, s) => timing({ status: "running", progress, started }, at(s));
  return [runs(0.25, 12), runs(0.25, 720), runs(0, 5), timing({ status: "successful", started }, at(9))];
}"""


def run_of(site: Site, **body: Any) -> str:
    """The id of a run that has ended."""
    answer = httpx.post(
        f"{site.url}/v1/jobs",
        json={"kind": "sweep", "scene": "two-dof", **body},
        headers={"Prefer": "wait=60"},
        timeout=90,
    )
    assert answer.status_code == 200, answer.text
    job: str = answer.json()["id"]
    return job


def row(page: Page, run: str) -> Any:
    return page.locator(f"#runs-list li.run:has([data-focus='open-{run}'])")


@pytest.mark.long
def test_tabs_show_their_cards_and_a_link_keeps_them(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    expect(page.locator("#live")).to_be_visible()
    expect(page.locator("#map")).to_be_hidden()
    page.locator("#tab-response").focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#tab-map")).to_be_focused()
    expect(page.get_by_role("tab", name="Map")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#map")).to_be_visible()
    expect(page.locator("#live")).to_be_hidden()
    assert "tab=map" in page.url
    page.reload()
    expect(page.locator("#map")).to_be_visible()
    page.click("#tab-data")
    expect(page.locator("#jobs")).to_be_visible()
    expect(page.locator("#map")).to_be_hidden()


def test_a_project_gathers_runs_that_are_named_found_and_thrown_away(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    page.click("#project-new")
    page.fill("#project-name", "Shroud of stage 3")
    page.fill("#project-text", "Loads of May.")
    page.press("#project-name", "Enter")
    expect(page.locator("#project option:checked")).to_have_text("Shroud of stage 3 (0)")
    expect(page.locator("#project-notes")).to_have_text("Loads of May.")
    expect(page.locator("#runs-status")).to_contain_text("No run in this project yet")
    project = page.input_value("#project")
    run = run_of(site, set={"damper.N0": 77.5}, project=project)
    page.reload()
    mine = row(page, run)
    expect(mine).to_contain_text("damper.N0 77.5 N")
    mine.locator("summary", has_text="More").click()
    mine.get_by_label("Name").fill("too soft")
    mine.get_by_label("Notes").fill("it slips all the time")
    mine.get_by_label("Tags, with commas").fill("rejected, may")
    mine.get_by_role("button", name="Save").click()
    expect(mine.locator(".run-name")).to_have_text("too soft")
    expect(mine.locator(".tags li")).to_have_text(["may", "rejected"])
    told = httpx.get(f"{site.url}/v1/runs/{run}").json()
    assert (told["name"], told["notes"], told["tags"]) == (
        "too soft",
        "it slips all the time",
        ["may", "rejected"],
    )
    page.locator("#rail summary", has_text="Filter").click()
    for since, count in ((date.today() + timedelta(days=2), 0), (date.today() - timedelta(days=2), 1)):
        page.fill("#runs-since", since.isoformat())
        page.locator("#runs-form").get_by_role("button", name="Show").click()
        expect(mine).to_have_count(count)
    mine.locator("summary", has_text="Its sweeps").click()
    expect(mine.locator(".run-sweeps li")).to_have_count(1)
    expect(mine.locator(".run-sweeps li")).to_contain_text("damper 77.5 N: ")
    mine.get_by_role("button", name="Delete run too soft").click()
    expect(mine).to_have_count(0)
    assert httpx.get(f"{site.url}/v1/runs/{run}").json()["deleted"]
    page.locator("#undo").get_by_role("button", name="Undo").click()
    expect(mine).to_have_count(1)
    assert httpx.get(f"{site.url}/v1/runs/{run}").json()["deleted"] is None
    page.click("#project-delete")
    expect(page.locator("#project")).to_have_value("")
    page.locator("#undo").get_by_role("button", name="Undo").click()
    expect(page.locator("#project")).to_have_value(project)


@pytest.mark.long
def test_a_run_that_somebody_else_changed_is_not_overwritten(profile: Profile, site: Site) -> None:
    context, watch = profile
    watch.allowed = ("status of 412",)
    run = run_of(site, set={"damper.N0": 78.5})
    page = visit(context, site, "?scene=two-dof&tab=response")
    row(page, run).locator("summary", has_text="More").click()
    row(page, run).get_by_label("Name").fill("mine")
    httpx.patch(f"{site.url}/v1/runs/{run}", json={"name": "theirs"})
    row(page, run).get_by_role("button", name="Save").click()
    expect(row(page, run).get_by_role("alert")).to_contain_text("Somebody changed this run meanwhile")
    assert httpx.get(f"{site.url}/v1/runs/{run}").json()["name"] == "theirs"


@pytest.mark.long
def test_two_runs_are_compared_and_one_is_opened(profile: Profile, site: Site) -> None:
    soft, hard = (run_of(site, set={"damper.N0": load, "damper.mu": 0.3}) for load in (61.0, 140.0))
    page = visit(profile[0], site, "?scene=two-dof&tab=map")
    for run in (soft, hard):
        row(page, run).locator("input[type=checkbox]").check()
    expect(page.locator("#runs-compare-title")).to_be_focused()
    inputs = page.get_by_role("region", name="Inputs of two runs").locator("tbody tr")
    expect(inputs).to_have_count(1)
    expect(inputs.first).to_have_text("damper.N061 N140 N")
    figures = httpx.get(f"{site.url}/v1/runs/compare", params={"a": soft, "b": hard}).json()["results"]
    peak = next(one for one in figures if one["name"] == "peak.value")
    results = page.get_by_role("region", name="Results of two runs", exact=True)
    expect(results.locator("tr", has_text="peak.value")).to_contain_text(f"{peak['a']:.4g} m")
    expect(results.locator("tr", has_text="limit")).not_to_contain_text(" N")
    page.click("#runs-compare-close")
    expect(page.locator("#runs-compare")).to_be_hidden()
    expect(row(page, soft).locator("input[type=checkbox]")).not_to_be_checked()
    disk = run_of(site, scene="bladed-disk", harmonics=1)
    page.reload()
    for run in (hard, disk):
        row(page, run).locator("input[type=checkbox]").check()
    expect(page.locator("#runs-compare-body")).to_contain_text("different ones: two-dof and bladed-disk")
    expect(inputs.filter(has_text="structure.")).to_have_count(0)
    page.click("#runs-compare-close")
    row(page, hard).locator(".run-name").click()
    expect(page.locator("#tab-response")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#response-facts")).to_contain_text("highest peak")
    assert page.input_value("#slide-damper-N0 >> xpath=../span/input") == "140"
    expect(page.locator("#response-stale")).to_be_hidden()
    assert f"sweep={hard}" in page.url


def test_what_is_under_way_is_seen_in_a_fresh_tab(profile: Profile, site: Site) -> None:
    body = {"kind": "map", "scene": "two-dof", "parameter": "damper.N0", "from": 20, "to": 60,
            "steps": 4000, "frequencies": 120, "harmonics": 200, "ridge": False, "fresh": True}  # fmt: skip
    job = httpx.post(f"{site.url}/v1/jobs", json=body).json()["id"]
    try:
        page = visit(profile[0], site, "?scene=two-dof&tab=response")
        expect(page.locator("#runs-status")).to_contain_text("1 under way")
        expect(row(page, job)).to_contain_text("over damper.N0")
        expect(row(page, job)).to_contain_text(re.compile(r"\d %, \d+ s"))
        before = row(page, job).inner_text()
        expect(row(page, job)).not_to_have_text(before)  # the time goes on where the share holds
        page.click("#tab-data")
        expect(page.locator("#jobs-list")).to_contain_text("What others began is told with the runs.")
        said = page.evaluate(TIMING)
        assert said == [
            " 25 %, 12 s, about 36 s more",
            " 25 %, 12 min 0 s, about 36 min 0 s more",
            " 0 %, 5 s",
            "",
        ]
        row(page, job).get_by_role("button", name="Stop").click()
        expect(row(page, job)).to_contain_text("stopped")
    finally:
        httpx.delete(f"{site.url}/v1/jobs/{job}")


@pytest.mark.long
def test_a_scene_that_is_not_there_is_named(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=nosuch&set=damper.N0:5")
    expect(page.locator("#banner")).to_contain_text("There is no scene nosuch at this service")
    expect(page.locator("#scene")).to_have_value("bladed-disk")
    assert "nosuch" not in page.url
    assert "set=" not in page.url
    page.locator("#scene-list").get_by_role("button", name="two-dof", exact=True).click()
    expect(page.locator("#scene")).to_have_value("two-dof")
