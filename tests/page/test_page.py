"""The page in a real browser: the newcomer's way from an empty database to files in hand."""

from __future__ import annotations

import csv
import io
import tomllib
from typing import TYPE_CHECKING

import httpx
import numpy as np
import pytest
from page_site import Site, Watch
from page_visits import BAD_SCENE, downloaded, visit

import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
LONG_MS = 120_000


def values(page: Page) -> dict[str, float]:
    """The values that the address of a page sets."""
    words = page.url.partition("set=")[2].partition("&")[0]
    return {name: float(value) for name, _, value in (one.partition(":") for one in words.split(","))}


def has_paths(page: Page, figure: str, count: int) -> None:
    expect(page.locator(f"#{figure} svg.chart g[clip-path] > path.series")).to_have_count(count)


def the_map_zooms(page: Page) -> None:
    """Linked with the responses, and back; both axes of the map change."""

    def drawn(figure: str) -> str:
        return page.locator(f"#{figure}-figure g[clip-path] path.series").first.get_attribute("d") or ""

    whole = drawn("map"), drawn("live")
    page.locator("#map-figure svg.chart").focus()
    page.keyboard.press("+")
    assert drawn("map") != whole[0]
    assert drawn("live") != whole[1]
    page.keyboard.press("0")
    assert (drawn("map"), drawn("live")) == whole
    button = page.get_by_role("button", name="Map of amplitude over frequency and load: logarithmic y")
    expect(button).to_have_attribute("aria-pressed", "true")
    button.click()
    expect(button).to_have_attribute("aria-pressed", "false")
    button.click()


def test_a_newcomer_presses_one_button_and_takes_results_away(profile: Profile, site: Site) -> None:
    assert httpx.get(f"{site.url}/v1/jobs").json()["items"] == []
    context, _ = profile
    page = visit(context, site)
    expect(page.locator("#structure-figure svg[role=img] circle.mass").first).to_be_visible()
    assert page.locator("#structure-figure circle.mass").count() >= 32
    check_interference(page)
    page.select_option("#scene", "two-dof")
    expect(page.locator("#interference")).to_be_hidden()
    expect(page.locator("#plan-facts")).to_contain_text("condensation")
    page.click("#study")
    expect(page.locator("#study-status")).to_have_text("Everything is there.", timeout=LONG_MS)
    for status in ("response", "design", "map", "front", "accuracy", "campbell"):
        expect(page.locator(f"#{status}-status")).not_to_have_class("bad")
    expect(page.locator("#response-facts")).to_contain_text("highest peak2.35 m ± 73 µm at 1.037")
    expect(page.locator("#response-facts")).to_contain_text("resonance band")
    expect(page.locator("#design-facts")).to_contain_text("104.8 N")
    expect(page.locator("#plan-facts")).to_contain_text("left out")
    expect(page.locator("#march-status")).to_contain_text("% apart")
    expect(page.locator("#map-facts")).to_contain_text("least peak2.346 m at 104.8 N")
    has_paths(page, "live-figure", 3)
    has_paths(page, "front-figure", 1)
    # At half power of each peak the highest peaks would have the narrowest bands: designs that damp nothing.
    expect(page.locator("#front-status")).to_contain_text("the band at 1.659 m")
    expect(page.locator("#front-limit")).to_have_value("1.659")
    highest = page.locator("#front-facts tbody tr").first.locator("td").nth(1)
    assert float((highest.text_content() or "nan").removesuffix(" m")) < 3.0
    the_map_zooms(page)
    for motion in ("path.stick", "path.slip", "circle.f7"):
        assert page.locator(f"#loops-figure g[clip-path] > {motion}").count() >= 1
    assert page.locator("#campbell-figure path.f7").count() >= 2
    assert page.locator("#accuracy-figure circle.f1").count() >= 5
    assert page.get_attribute("#map-figure", "data-milliseconds"), "the map is drawn"
    check_files(page)
    check_clicks(page)
    head = page.locator("#runs-table tbody tr", has_text="design").first
    expect(head).to_contain_text("and 6 more")
    expect(head).to_contain_text("damper.N0 104.8 N")


def check_interference(page: Page) -> None:
    """The diagram of the disk at a speed that is typed in, by keyboard: orders, what they meet, in words."""
    page.fill("#interference-speed_rpm", "-3")
    page.press("#interference-speed_rpm", "Enter")
    expect(page.locator(".field:has(#interference-speed_rpm) .message")).to_contain_text(
        "must be a number above 0"
    )
    page.fill("#interference-speed_rpm", "11000")
    page.press("#interference-speed_rpm", "Enter")
    rows = page.locator("#interference-facts tbody").first.locator("tr")
    expect(rows.first).to_have_text("33 forward5501513.86 – 781.25meets")
    found = solver.interference_diagram(solver.load_scene("bladed-disk"), speed_rpm=11e3, up_to_hz=1800.0)
    assert rows.count() == len(found.crossings)
    stiffness = page.locator("#slide-shroud-kt >> xpath=../span/input")
    own = stiffness.input_value()
    stiffness.fill("6e6")
    stiffness.press("Tab")
    expect(page.locator("#interference-stale")).to_contain_text("shroud.kt")
    stiffness.fill(own)
    stiffness.press("Tab")
    expect(page.locator("#interference-stale")).to_be_hidden()
    figure = page.locator("#interference-figure svg.chart")
    expect(figure.locator("g[clip-path] > path.f2")).not_to_have_count(0)
    figure.press("End")
    figure.press("ArrowLeft")
    expect(page.locator("#interference-figure .chart-read")).to_contain_text(
        "order 6: nodal diameter 2 backward"
    )


def check_files(page: Page) -> None:
    rows = list(
        csv.DictReader(io.StringIO(downloaded(page, "#response-facts button:text-is('CSV')").decode()))
    )
    branch = solver.sweep(solver.load_scene("two-dof"))
    assert [float(row["amplitude"]) for row in rows] == pytest.approx(branch.amplitude.tolist(), rel=1e-9)
    with np.load(io.BytesIO(downloaded(page, "#response-facts button:text-is('npz')"))) as arrays:
        assert np.allclose(arrays["amplitude"], branch.amplitude)
    assert downloaded(page, "#response-facts button:text-is('Parquet')").startswith(b"PAR1")
    scene = tomllib.loads(downloaded(page, "#response-facts button:has-text('TOML')").decode())
    assert solver.Scene.from_dict(scene) == solver.load_scene("two-dof")
    drawing = downloaded(page, "#live-figure button:text-is('SVG')")
    assert b"<svg" in drawing
    assert b"class=" not in drawing
    for figure in ("live", "map"):
        png = downloaded(page, f"#{figure}-figure button:text-is('PNG')")
        assert png.startswith(b"\x89PNG")
        assert len(png) > 10_000
    assert len(downloaded(page, "#map-figure button:text-is('CSV')").splitlines()) == 60 * 400 + 1


def check_clicks(page: Page) -> None:
    """A click on the map and on the front loads the design there."""
    before = page.input_value("#slide-damper-N0")
    page.locator("#map-figure svg.chart").click(position={"x": 300, "y": 60})
    expect(page.locator("#slide-damper-N0")).not_to_have_value(before)
    expect(page.locator("#point-facts")).to_contain_text("max |x|")
    loaded = page.input_value("#slide-damper-N0")
    page.locator("#front-figure svg.chart circle.f1").last.click(force=True)
    expect(page.locator("#slide-damper-N0")).not_to_have_value(loaded)
    assert "set=damper.N0:" in page.url


@pytest.mark.long
def test_sweeps_are_filtered_compared_and_shared(profile: Profile, site: Site) -> None:
    for load, friction in ((50, 0.3), (80, 0.3), (120, 0.3), (110, 0.3), (110, 0.2)):
        values = {"damper.N0": load, "damper.mu": friction}
        body = {"kind": "sweep", "scene": "two-dof", "set": values}
        assert httpx.post(f"{site.url}/v1/jobs", json=body, headers={"Prefer": "wait=30"}).status_code == 200
    context, _ = profile
    page = visit(context, site, "?scene=two-dof&tab=runs")
    page.select_option("#runs-kind", "sweep")
    rows = page.locator("#runs-table tbody tr")
    page.fill("#runs-text", "damper.n0 110, peak < 2400 mm")
    expect(rows).to_have_count(1)
    expect(rows).to_contain_text("damper.N0 110 N, damper.mu 0.3")
    page.fill("#runs-text", "damper.mu 0.3")
    expect(rows.filter(has_text="damper.N0 50 N")).to_have_count(1)
    expect(rows.filter(has_text="damper.mu 0.2")).to_have_count(0)
    for load in (80, 120):
        rows.filter(has_text=f"damper.N0 {load} N").locator("input[type=checkbox]").check()
    heads = page.get_by_role("region", name="Differences of two runs").locator("thead")
    expect(heads).to_contain_text("damper.N0 80 N")
    has_paths(page, "runs-compare-figure", 2)
    rows.filter(has_text="damper.N0 80 N").get_by_role("button", name="More of run").click()
    page.locator("#runs-table summary", has_text="Its sweep").click()
    name = "two-dof, damper.N0 80 N"
    page.get_by_label(f"Files of {name}").first.click()
    forms = {form: downloaded(page, f"button[aria-label='{form} of {name}'] >> nth=0")
             for form in ("CSV", "Parquet", "SVG", "PNG", "TOML")}  # fmt: skip
    assert forms["Parquet"].startswith(b"PAR1")
    assert forms["PNG"].startswith(b"\x89PNG")
    again = solver.sweep(solver.Scene.from_dict(tomllib.loads(forms["TOML"].decode())))
    table = list(csv.DictReader(io.StringIO(forms["CSV"].decode())))
    assert [float(row["amplitude"]) for row in table] == pytest.approx(again.amplitude.tolist(), rel=1e-9)
    other = visit(context, site, page.url.removeprefix(f"{site.url}/"))
    heads = other.get_by_role("region", name="Differences of two runs").locator("thead")
    expect(heads).to_contain_text("damper.N0 120 N")


def test_the_response_follows_the_sliders_and_nothing_is_stored(profile: Profile, site: Site) -> None:
    context, _ = profile
    page = visit(context, site, "?scene=two-dof")
    expect(page.locator("#live-status")).to_contain_text("peak 2.35 m")
    jobs = httpx.get(f"{site.url}/v1/jobs").json()["items"]
    for name in ("N0", "N1", "kt", "mu"):
        before = page.inner_text("#live-status").split("·")[0]
        page.focus(f"#slide-damper-{name}")
        page.keyboard.press("PageDown")
        expect(page.locator("#live-status")).not_to_contain_text(before)
    page.get_by_label("f0, the force, number").fill("0.1")
    page.keyboard.press("Enter")
    expect(page.locator("#live-status")).to_contain_text("mm at")
    # The chart tells millimetres, its file metres, as every other file does.
    text = downloaded(page, "#live-figure button:text-is('CSV')").decode()
    table = list(csv.reader(io.StringIO(text)))
    assert [head.rpartition(" ")[2] for head in table[0]] == ["[Hz]", "[m]"]
    page.wait_for_url("**excitation.amplitude:0.1**")
    weak = solver.sweep(solver.load_scene("two-dof").with_values(values(page)))
    assert weak.peak is not None
    assert max(float(line[1]) for line in table[1:]) == pytest.approx(weak.peak.value, rel=1e-6)
    expect(page.locator("#structure-states")).to_contain_text("sticks")
    assert httpx.get(f"{site.url}/v1/jobs").json()["items"] == jobs
    page.get_by_role("button", name="Values of the scene").click()
    expect(page.locator("#live-status")).to_contain_text("peak 2.35 m")


@pytest.mark.long
def test_what_is_too_large_for_the_sliders_says_so_and_becomes_a_job(profile: Profile, site: Site) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    whole = solver.load_scene("bladed-disk").to_dict() | {"name": "whole"}
    whole["structure"] |= {"sectors": 6, "mistuning": {"of": ["tip"], "spread": 0.02, "seed": 1}}
    assert httpx.post(f"{site.url}/v1/scenes", json=whole).status_code in (200, 201)
    page = visit(context, site, "?scene=whole")
    expect(page.locator("#live-status")).to_contain_text("with 4 of 11 harmonics, to answer at once")
    expect(page.locator("#plan-facts summary").first).to_have_text("and 5 further sectors")
    page.goto(f"{site.url}/?scene=two-dof&harmonics=50&tab=all")
    expect(page.locator("#live-status")).to_contain_text("must be at most 41, got 50")
    page.get_by_role("button", name="Compute it as a job").press("Enter")
    expect(page.locator("#live-status")).to_contain_text("Of a job, with 50 harmonics: peak 2.35 m")
    expect(page.locator("#response-facts")).to_contain_text("highest peak")


@pytest.mark.long
def test_what_is_wrong_with_a_scene_is_said_beside_its_field(profile: Profile, site: Site) -> None:
    context, _ = profile
    page = visit(context, site)
    file = {"name": "mine.toml", "mimeType": "application/toml", "buffer": BAD_SCENE.encode()}
    page.set_input_files("#file", [file])
    friction = page.get_by_label("mu of damper", exact=True)
    expect(friction).to_be_focused()
    expect(friction).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#field-contacts-0-mu-message")).to_contain_text("`mu` must be >= 0, got -0.3")
    expect(page.locator("#field-excitation-dof-message")).to_contain_text("wing")
    friction.fill("0.3")
    page.locator("#field-excitation-dof").fill("blade")
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong")
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("my-damper")
    expect(page.locator("#editor")).to_be_hidden()
    expect(page.locator("#live-status")).to_contain_text("peak")
    assert httpx.get(f"{site.url}/v1/scenes/my-damper").status_code == 200


@pytest.mark.long
@pytest.mark.parametrize("text", ["name = = 3", "{", "<script>alert(1)</script>"])
def test_a_file_that_is_no_scene_is_refused(profile: Profile, site: Site, text: str) -> None:
    page = visit(profile[0], site)
    page.set_input_files("#file", [{"name": "a.toml", "mimeType": "text/plain", "buffer": text.encode()}])  # type: ignore[list-item]
    expect(page.locator("#editor [role=alert]")).to_contain_text(
        "The file cannot be read: this is not valid TOML"
    )
