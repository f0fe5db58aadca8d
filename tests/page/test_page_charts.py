"""Charts: through their peaks, zoomed, logarithmic, linked, pinned; numbers that fit, with their units."""

from __future__ import annotations

import re
from itertools import pairwise
from math import log10
from typing import TYPE_CHECKING

import httpx
import pytest
from page_site import Site, Watch
from page_visits import visit

import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
LABELS = """figure => [...figure.querySelectorAll("text.soft[text-anchor=middle]")]
  .map(node => node.getBoundingClientRect()).map(({left, right, top}) => [left, right, top])"""


@pytest.fixture(scope="module")
def swept(site: Site) -> str:
    """The address of two-dof with its sweep, on the tab of responses."""
    answer = httpx.post(
        f"{site.url}/v1/jobs",
        json={"kind": "sweep", "scene": "two-dof"},
        headers={"Prefer": "wait=60"},
        timeout=90,
    )
    return f"?scene=two-dof&tab=response&sweep={answer.json()['id']}"


def ends(page: Page, figure: str) -> tuple[float, float]:
    """The ends of the abscissa, from the places of its numbers: charts of other widths have other numbers."""
    chart = page.locator(f"#{figure}-figure svg.chart")
    numbers = chart.locator("text.soft[text-anchor=middle]")
    values = [float(text) for text in numbers.all_text_contents()]
    places = [float(node.get_attribute("x") or "nan") for node in numbers.all()]
    frame = chart.locator("clipPath rect").first
    left, width = (float(frame.get_attribute(name) or "nan") for name in ("x", "width"))
    slope = (values[-1] - values[0]) / (places[-1] - places[0])
    low, high = (values[0] + slope * (place - places[0]) for place in (left, left + width))
    return low, high


SERIES = "svg.chart g[clip-path] > path.series"


def places(d: str) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in re.findall(r"[ML](-?[\d.]+),(-?[\d.]+)", d)]


def path(page: Page, figure: str, index: int = 0) -> list[tuple[float, float]]:
    d = page.locator(f"#{figure}-figure {SERIES}").nth(index).get_attribute("d")
    assert d is not None
    return places(d)


def test_a_curve_goes_through_its_peak(profile: Profile, site: Site, swept: str) -> None:
    page = visit(profile[0], site, swept)
    expect(page.locator("#response-facts")).to_contain_text("highest peak")
    for figure in ("live",):
        expect(page.locator(f"#{figure}-figure circle.f2")).to_have_count(1)
        # At once: between two readings what is still on its way may draw the chart anew, to another scale.
        cx, cy, d = page.locator(f"#{figure}-figure").evaluate(
            """(figure, series) => {
              const [mark, curve] = [figure.querySelector("circle.f2"), figure.querySelector(series)];
              return [mark.getAttribute("cx"), mark.getAttribute("cy"), curve.getAttribute("d")];
            }""",
            SERIES,
        )
        gap = min(max(abs(x - float(cx)), abs(y - float(cy))) for x, y in places(d))
        assert gap <= 0.06, f"{figure}: the curve passes its peak by {gap:.1f} pixels"


@pytest.mark.long
def test_a_curve_whose_points_miss_its_peak_is_drawn_to_it(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    found = page.evaluate(
        """async () => {
          const source = new URL("charts/curves.js", document.querySelector("script[type=module]").src);
          const { throughPeak } = await import(source);
          return throughPeak({
            parameter: [1, 2, 3, 4, 3, 2, 3, 4], amplitude: [0.1, 0.2, 0.4, 0.5, 0.3, 0.2, 0.15, 0.1],
            unstable: [[4, 5]], peak: { at: 3.4, value: 3.18 },
          });
        }"""
    )
    assert found["parameter"] == [1, 2, 3, 3.4, 4, 3, 2, 3, 4]
    assert found["amplitude"] == [0.1, 0.2, 0.4, 3.18, 0.5, 0.3, 0.2, 0.15, 0.1]
    assert found["unstable"] == [[5, 6]], "the stretches stay where they were on the curve"


@pytest.mark.long
def test_zoom_is_linked_and_comes_back(profile: Profile, site: Site, swept: str) -> None:
    page = visit(profile[0], site, swept)
    expect(page.locator("#response-facts")).to_contain_text("highest peak")
    expect(page.locator("#live-status")).to_contain_text("peak")
    whole = ends(page, "live")
    page.locator("#live-figure svg.chart").focus()
    page.keyboard.press("+")
    low, high = ends(page, "live")
    assert whole[0] < low < high < whole[1]
    assert ends(page, "live") == pytest.approx((low, high), rel=1e-3)
    page.keyboard.press("0")
    assert ends(page, "live") == pytest.approx(whole)
    assert ends(page, "live") == pytest.approx(whole, rel=1e-3)
    box = page.locator("#live-figure svg.chart").bounding_box()
    assert box is not None
    y = box["y"] + 0.5 * box["height"]
    point = page.input_value("#point-at")
    page.mouse.move(box["x"] + 0.4 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], y, steps=4)
    page.mouse.up()
    low, high = ends(page, "live")
    assert whole[0] < low < high < whole[1]
    assert page.input_value("#point-at") == point, "a drag is no click"
    page.mouse.move(box["x"] + 0.5 * box["width"], y)
    expect(page.locator("#live-figure path.cursor")).to_have_count(1)
    page.get_by_role("button", name="Frequency response: the whole", exact=True).click()
    assert ends(page, "live") == pytest.approx(whole, rel=1e-3)


def test_the_cursor_of_one_chart_stands_in_all_of_the_same_abscissa(profile: Profile, site: Site) -> None:
    """By mouse and by keyboard: at the same place, with the value of each chart."""
    body = {"kind": "modes", "scene": "two-dof", "from": 0.1, "to": 3, "harmonics": 3}
    job = httpx.post(f"{site.url}/v1/jobs", json=body, headers={"Prefer": "wait=60"}, timeout=90).json()
    page = visit(profile[0], site, f"?scene=two-dof&tab=modes&modes={job['id']}")
    frequency, damping, peaks = (page.locator(f"#modes-{name}") for name in ("frequency", "damping", "peaks"))
    expect(frequency.locator("path.series").first).to_be_visible()
    frequency.locator("svg.chart").focus()
    for key in ("End", "ArrowLeft"):
        page.keyboard.press(key)
    result = httpx.get(f"{site.url}/v1/jobs/{job['id']}/results").json()["result"]
    amplitude, ratio = (result[name][-2] for name in ("amplitude", "damping_ratio"))
    expect(damping.locator("path.cursor")).to_have_count(1)
    number = re.search(r"[\d.]+", damping.locator(".chart-read").inner_text())
    assert number is not None
    assert float(number[0]) == pytest.approx(amplitude, rel=1e-2)
    assert f"{100 * ratio:.4g}" in damping.locator(".chart-read").inner_text()
    expect(peaks.locator("path.cursor")).to_have_count(0)
    place = damping.locator("svg.chart").bounding_box()
    assert place is not None
    page.mouse.move(place["x"] + 0.5 * place["width"], place["y"] + 0.5 * place["height"])
    lines = [
        re.search(r"M([\d.]+) ", chart.locator("path.cursor").get_attribute("d") or "")
        for chart in (frequency, damping)
    ]
    assert lines[0] is not None
    assert lines[1] is not None
    assert float(lines[0][1]) == pytest.approx(float(lines[1][1]), abs=1.0)
    page.mouse.move(2, 2)
    expect(frequency.locator("path.cursor")).to_have_count(0)


@pytest.mark.long
def test_an_axis_is_logarithmic_on_request(profile: Profile, site: Site, swept: str) -> None:
    page = visit(profile[0], site, swept)
    expect(page.locator("#live-status")).to_contain_text("peak")
    before = path(page, "live")
    button = page.get_by_role("button", name="Frequency response: logarithmic", exact=True)
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")
    after = path(page, "live")
    branch = solver.sweep(solver.load_scene("two-dof"))
    assert branch.peak is not None
    assert len(before) == len(after)
    ticks = page.locator("#live-figure text.soft[text-anchor=end]")
    values = [float(text) for text in ticks.all_text_contents()]
    places = [float(node.get_attribute("y") or "nan") for node in ticks.all()]
    ratios = [(places[i + 1] - places[i]) / log10(values[i + 1] / values[i]) for i in range(len(values) - 1)]
    assert len(values) >= 3
    assert ratios == pytest.approx([ratios[0]] * len(ratios), rel=0.02)
    branch = solver.sweep(solver.load_scene("two-dof"))
    assert branch.peak is not None
    rise = ratios[0] * log10(branch.peak.value / branch.amplitude[0])
    assert min(y for _, y in after) - after[0][1] == pytest.approx(rise, abs=2.0)


@pytest.mark.long
def test_what_the_cursor_reads_follows_the_sliders(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    expect(page.locator("#live-status")).to_contain_text("peak 2.35 m")
    page.locator("#live-figure svg.chart").hover(position={"x": 220, "y": 120})
    read = page.locator("#live-figure .chart-read")
    expect(read).to_contain_text("Hz: ")
    before = read.inner_text()
    page.locator("#slide-damper-mu").focus()
    page.keyboard.press("PageUp")
    expect(read).not_to_have_text(before)
    at, value = re.findall(r"[\d.]+", read.inner_text())[:2]
    points = path(page, "live")
    mark = page.locator("#live-figure circle.f7")
    cy = float(mark.get_attribute("cy") or "nan")
    cx = float(mark.get_attribute("cx") or "nan")
    assert min(max(abs(x - cx), abs(y - cy)) for x, y in points) <= 0.06, f"{at} {value} is not on the curve"


@pytest.mark.long
def test_a_curve_is_pinned_beside_those_after_it(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    expect(page.locator("#live-status")).to_contain_text("peak 2.35 m")
    page.click("#pin")
    lines = page.locator("#live-figure g[clip-path] > path.series")
    expect(lines).to_have_count(2)
    pinned = path(page, "live", 1)
    page.locator("#slide-damper-mu").focus()
    page.keyboard.press("PageUp")
    expect(page.locator("#live-status")).not_to_contain_text("peak 2.35 m")
    expect(page.locator("#live-figure svg.chart")).to_contain_text("values of the scene: 2.35 m")
    assert path(page, "live", 0) != pinned
    page.click("#unpin")
    expect(lines).to_have_count(1)


@pytest.mark.long
def test_numbers_of_an_axis_do_not_overlap(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=all")
    expect(page.locator("#live-status")).to_contain_text("peak")
    page.set_viewport_size({"width": 640, "height": 900})
    page.wait_for_timeout(300)
    page.get_by_role("button", name="Frequency response: zoom in", exact=True).click()
    for _ in range(6):
        page.get_by_role("button", name="Frequency response: zoom in", exact=True).click()
        labels = [tuple(box) for box in page.locator("#live-figure svg.chart").evaluate(LABELS)]
        assert len(labels) >= 2
        for (_, right, _), (left, _, _) in pairwise(labels):
            assert right <= left, "two numbers of the axis stand on one another"


@pytest.mark.long
def test_a_length_has_a_unit_of_its_size(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    said = page.evaluate(
        """async () => {
          const source = new URL("base/format.js", document.querySelector("script[type=module]").src);
          const { learnUnits, length, quantity } = await import(source);
          learnUnits([["kt", "N/m"], ["N0", "N"]]);
          return [length(4.8e-14), length(3e-9), length(2.5e-5),
            quantity("damper.kt", 509000), quantity("shroud.N0", 92.7)];
        }"""
    )
    assert said == ["4.8e-14 m", "3 nm", "25 µm", "509 kN/m", "92.7 N"]


@pytest.mark.long
@pytest.mark.parametrize("harmonics", ["2.5", "0", "201", ""])
def test_harmonics_that_cannot_be_are_refused_where_they_stand(
    profile: Profile, site: Site, harmonics: str
) -> None:
    page = visit(profile[0], site, "?scene=two-dof")
    jobs = httpx.get(f"{site.url}/v1/jobs").json()["items"]
    page.fill("#harmonics", harmonics)
    page.click("#study")
    expect(page.locator("#settings-wrong")).to_contain_text("Harmonics must be a whole number from 1 to 200")
    expect(page.locator("#harmonics")).to_have_attribute("aria-invalid", "true")
    assert httpx.get(f"{site.url}/v1/jobs").json()["items"] == jobs
