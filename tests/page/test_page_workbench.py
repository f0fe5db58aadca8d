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
  const source = new URL("base/format.js", document.querySelector("script[type=module]").src);
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
    return page.locator(f"#runs-table tr[data-run='{run}']")


def more(page: Page, run: str) -> Any:
    """What a run has besides, unfolded under it."""
    row(page, run).get_by_role("button", name="More of run").click()
    return page.locator(f"#runs-table tr[data-more='{run}']")


@pytest.mark.long
def test_tabs_show_their_cards_and_a_link_keeps_them(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    expect(page.locator("#live")).to_be_visible()
    expect(page.locator("#map")).to_be_hidden()
    page.locator("#tab-response").focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#tab-design")).to_be_focused()
    expect(page.get_by_role("tab", name="Design")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#problem")).to_be_visible()
    expect(page.locator("#live")).to_be_hidden()
    assert "tab=design" in page.url
    page.reload()
    expect(page.locator("#problem")).to_be_visible()
    page.click("#tab-runs")
    expect(page.locator("#runs")).to_be_visible()
    expect(page.locator("#map")).to_be_hidden()


def test_a_project_gathers_runs_that_are_named_found_and_thrown_away(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=runs")
    page.click("#project-new")
    page.fill("#project-name", "Shroud of stage 3")
    page.fill("#project-text", "Loads of May.")
    page.press("#project-name", "Enter")
    expect(page.locator("#project option:checked")).to_have_text("Shroud of stage 3 (0)")
    expect(page.locator("#project-notes")).to_have_text("Loads of May.")
    expect(page.locator("#runs-status")).to_contain_text("No run in this project yet")
    project = page.input_value("#project")
    run = run_of(site, set={"damper.N0": 77.5}, project=project)
    # A form that opens before the projects are known keeps the run's own.
    profile[1].allowed = ("net::ERR_FAILED",)
    page.route("**/v1/projects*", lambda route: route.abort())
    page.reload()
    mine = row(page, run)
    expect(mine).to_contain_text("damper.N0 77.5 N")
    form = more(page, run)
    page.unroute("**/v1/projects*")
    form.get_by_label("Name").fill("too soft")
    form.get_by_label("Notes").fill("it slips all the time")
    form.get_by_label("Tags, with commas").fill("rejected, may")
    form.get_by_role("button", name="Save").click()
    expect(mine.locator(".run-name")).to_have_text("too soft")
    expect(mine.locator(".tags li")).to_have_text(["may", "rejected"])
    told = httpx.get(f"{site.url}/v1/runs/{run}").json()
    assert (told["name"], told["notes"], told["tags"]) == (
        "too soft",
        "it slips all the time",
        ["may", "rejected"],
    )
    for since, count in ((date.today() + timedelta(days=2), 0), (date.today() - timedelta(days=2), 1)):
        page.fill("#runs-since", since.isoformat())
        page.press("#runs-since", "Tab")
        expect(mine).to_have_count(count)
    for text, count in (
        ("soft, two-dof", 1),
        ("soft, < 1 m", 0),
        ("rejected, peak > 1500 mm", 1),
        ("hard", 0),
    ):
        page.fill("#runs-text", text)
        expect(mine).to_have_count(count)
    page.fill("#runs-text", "")
    mine.get_by_role("button", name="Pin run too soft").click()
    expect(mine.get_by_role("button", name="Pin run too soft")).to_have_attribute("aria-pressed", "true")
    assert httpx.get(f"{site.url}/v1/runs/{run}").json()["tags"] == ["may", "pinned", "rejected"]
    expect(mine.locator(".tags li")).to_have_text(["may", "rejected"])
    form.locator("summary", has_text="Its sweep").click()
    expect(form.locator(".run-sweeps tbody tr")).to_have_count(1)
    expect(form.locator(".run-sweeps tbody tr")).to_contain_text("damper.N0 77.5 N")
    form.get_by_role("button", name="Delete run too soft").click()
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
    page = visit(context, site, "?scene=two-dof&tab=runs")
    form = more(page, run)
    form.get_by_label("Name").fill("mine")
    httpx.patch(f"{site.url}/v1/runs/{run}", json={"name": "theirs"})
    form.get_by_role("button", name="Save").click()
    expect(form.get_by_role("alert")).to_contain_text("Somebody changed this run meanwhile")
    assert httpx.get(f"{site.url}/v1/runs/{run}").json()["name"] == "theirs"


@pytest.mark.long
def test_two_runs_are_compared_and_one_is_opened(profile: Profile, site: Site) -> None:
    soft, hard = (run_of(site, set={"damper.N0": load, "damper.mu": 0.3}) for load in (61.0, 140.0))
    page = visit(profile[0], site, "?scene=two-dof&tab=runs")
    for run in (soft, hard):
        row(page, run).locator("input[type=checkbox]").check()
    expect(page.locator("#runs-compare-title")).to_be_focused()
    expect(page.locator("#runs-compare-figure svg.chart g[clip-path] > path.series")).to_have_count(2)
    rows = page.get_by_role("region", name="Differences of two runs", exact=True).locator("tbody tr")
    peaks = [httpx.get(f"{site.url}/v1/runs/{run}/summary").json()["peak"] for run in (soft, hard)]
    below = 100 * abs(peaks[1]["value"] / peaks[0]["value"] - 1)
    # What one looks for first comes first, in one unit, with the difference.
    expect(rows.nth(0)).to_have_text(
        f"Highest peak{peaks[0]['value']:.5g} m{peaks[1]['value']:.5g} m−{below:.2g} %"
    )
    expect(rows.nth(1)).to_contain_text(f"{peaks[1]['at']:.5g} Hz")
    expect(rows.filter(has_text="damper.N0")).to_have_text("damper.N061 N140 N+130 %")
    expect(rows.filter(has_text="damper.mu")).to_have_count(0)
    expect(rows.filter(has_text="Time taken")).to_contain_text(" s")
    for count in ("points", "iterations", "rejected", "residual"):
        expect(rows.filter(has_text=count)).to_have_count(0)
    page.locator("#runs-compare-body summary", has_text="are equal").click()
    equal = page.get_by_role("region", name="Equal quantities of two runs").locator("tbody tr")
    expect(equal.filter(has_text="damper.mu")).to_have_text("damper.mu0.30.3")
    page.reload()
    expect(rows.nth(0)).to_contain_text("Highest peak")
    page.click("#runs-compare-close")
    expect(page.locator("#runs-compare")).to_be_hidden()
    expect(row(page, soft).locator("input[type=checkbox]")).not_to_be_checked()
    disk = run_of(site, scene="bladed-disk", harmonics=1)
    for run in (hard, disk):
        row(page, run).locator("input[type=checkbox]").check()
    expect(page.locator("#runs-compare-body")).to_contain_text("different ones: two-dof and bladed-disk")
    expect(rows.filter(has_text="structure.")).to_have_count(0)
    expect(rows.nth(0)).to_have_text(re.compile(r"Highest peak2.47\d* m0.0\d* m÷ \d+"))
    page.click("#runs-compare-close")
    row(page, hard).locator(".run-name").click()
    expect(page.locator("#tab-response")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#response-facts")).to_contain_text("highest peak")
    assert page.input_value("#slide-damper-N0 >> xpath=../span/input") == "140"
    expect(page.locator("#response-stale")).to_be_hidden()
    assert f"sweep={hard}" in page.url


def test_the_table_is_sorted_folded_and_told_of_what_happens(profile: Profile, site: Site) -> None:
    press = ["press-abc"]
    body = {"kind": "design", "variables": {"damper.N0": [60, 200]}, "harmonics": 1, "tags": press}
    design, sweep = run_of(site, **body), run_of(site, harmonics=1, tags=press, set={"damper.N0": 91.0})
    weak = run_of(site, set={"excitation.amplitude": 0.1}, harmonics=1)
    page = visit(profile[0], site, "?scene=two-dof&tab=runs")
    expect(row(page, design)).to_contain_text("and 1 more")
    expect(row(page, sweep)).to_have_count(0)
    optimum = httpx.get(f"{site.url}/v1/jobs/{design}/results").json()["result"]["optimum"]["damper.N0"]
    expect(row(page, design)).to_contain_text(f"damper.N0 {optimum:.4g} N")
    expect(row(page, design).locator("svg.spark path")).to_have_count(1)
    row(page, design).get_by_role("button", name="1 more runs of the press").click()
    expect(row(page, sweep)).to_contain_text("damper.N0 91 N")
    page.uncheck("#runs-fold")
    page.fill("#runs-text", "two-dof")
    rows = page.locator("#runs-table tbody tr:not(:has(.pin[aria-pressed=true]))")  # pinned ones lead
    expect(page.locator("#runs-table th[aria-sort=descending]")).to_contain_text("When")
    page.locator("#runs-table th button", has_text="Peak").click()
    expect(page.locator("#runs-table th[aria-sort=ascending]")).to_contain_text("Peak")
    # Without the figures of every run the order would be that of those which are known.
    expect(row(page, weak)).to_contain_text("mm")
    expect(rows.first).to_have_attribute("data-run", weak)
    page.locator("#runs-table th button", has_text="When").click()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    later = run_of(site, set={"damper.N0": 92.0}, harmonics=1)
    expect(rows.first).to_have_attribute("data-run", later)
    expect(row(page, later)).to_contain_text("damper.N0 92 N")
    page.wait_for_timeout(3000)
    told = [url.removeprefix(f"{site.url}/v1/runs") for url in asked if "/v1/runs" in url]
    assert [path for path in told if not path.endswith("/summary")] == [], "no list is asked for again"
    assert 1 <= told.count(f"/{later}/summary") <= 2, "as it begins and as it ends"


@pytest.mark.long
def test_a_design_with_a_scene_of_its_own_and_a_kind_without_a_view_are_opened(
    profile: Profile, site: Site
) -> None:
    context, watch = profile
    watch.allowed = ("status of 409",)
    scene = httpx.get(f"{site.url}/v1/scenes/two-dof").json()["scene"]
    other = {**scene, "contacts": [{**scene["contacts"][0], "mu": 0.25}]}  # of the same name, and another one
    given = {"kind": "design", "variables": {"damper.N0": [20, 500]}, "harmonics": 3}
    own = run_of(site, scene={**scene, "name": "from-the-command"}, **given)
    twin = run_of(site, scene=other, **given)
    peaks = run_of(site, kind="peaks", parameter="damper.N0", harmonics=3, **{"from": 60, "to": 150})
    page = visit(context, site, "?scene=bladed-disk&tab=runs")
    for run, name in ((own, "from-the-command"), (twin, "two-dof-2")):
        page.click("#tab-runs")
        row(page, run).locator(".run-name").click()
        expect(page.locator("#scene")).to_have_value(name)
        found = httpx.get(f"{site.url}/v1/jobs/{run}/results").json()["result"]
        expect(page.locator("#design-facts")).to_contain_text(f"{found['optimum']['damper.N0']:.5g} N")
        page.click("#use-design")
        expect(page.locator("#use-design")).to_have_text("In use")
        page.reload()
        expect(page.locator("#design-facts")).to_contain_text(f"{found['optimum']['damper.N0']:.5g} N")
    page.click("#tab-runs")
    row(page, peaks).locator(".run-name").click()
    expect(page.locator("#ask-peaks-status")).to_contain_text("✓")
    expect(page.locator("#ask-peaks-bar")).to_contain_text("from 60 N to 150 N")


@pytest.mark.long
def test_what_is_under_way_is_seen_in_a_fresh_tab(profile: Profile, site: Site) -> None:
    body = {"kind": "map", "scene": "two-dof", "parameter": "damper.N0", "from": 20, "to": 60,
            "steps": 4000, "frequencies": 120, "harmonics": 200, "ridge": False, "fresh": True}  # fmt: skip
    job = httpx.post(f"{site.url}/v1/jobs", json=body).json()["id"]
    try:
        page = visit(profile[0], site, "?scene=two-dof&tab=runs")
        expect(page.locator("#runs-status")).to_contain_text("1 under way")
        expect(row(page, job)).to_contain_text("over damper.N0")
        expect(row(page, job)).to_contain_text(re.compile(r"\d %, \d+ s"))
        before = row(page, job).inner_text()
        expect(row(page, job)).not_to_have_text(before)  # the time goes on where the share holds
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
