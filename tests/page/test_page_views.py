"""The views of nonlinear modes and of identification, and the front against an amplitude of one's own."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import httpx
import numpy as np
import pytest
from page_site import Site, Watch
from page_visits import DROP, visit

import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]


def request_of(site: Site, page: Page, kind: str) -> dict:
    job = re.search(rf"[?&]{kind}=([0-9a-f-]{{36}})", page.url)
    assert job is not None
    return httpx.get(f"{site.url}/v1/jobs/{job[1]}").json()["request"]


def abscissa(page: Page, figure: str) -> list[str]:
    return page.locator(f"#{figure} svg.chart text.soft[text-anchor=middle]").all_text_contents()


@pytest.mark.long
def test_a_mode_is_followed_and_its_points_are_looked_at(profile: Profile, site: Site) -> None:
    context, watch = profile
    page = visit(context, site, "?scene=two-dof&tab=modes&harmonics=3")
    expect(page.locator("#modes-frequency")).to_contain_text("press “Follow the mode”")
    page.fill("#modes-from", "400")
    page.fill("#modes-to", "300")
    watch.allowed += ("422",)
    page.click("#study")
    expect(page.locator(".field:has(#modes-to) .message")).to_contain_text("must be above")
    page.fill("#modes-from", "0.1")
    page.fill("#modes-exact_peaks", "3")
    page.click("#study")
    mode = solver.nonlinear_mode(solver.load_scene("two-dof"), 1, amplitudes=(0.1, 300.0), harmonics=3)
    expect(page.locator("#modes-status")).to_contain_text(f"{mode.amplitude.size} points in")
    expect(page.locator("#modes-facts")).to_contain_text(f"{mode.frequency_hz[0]:.6g} Hz")
    expect(page.locator("#modes-facts")).to_contain_text(f"ζ {100 * mode.damping_ratio.max():.4g} %")
    expect(page.locator("#modes-peaks path.f2")).to_have_count(4)  # three responses, and their name
    best = page.locator("#modes-loop path.series").get_attribute("d")
    page.locator("#modes-frequency svg.chart").focus()
    page.keyboard.press("Home")
    page.keyboard.press("Enter")
    expect(page.locator("#modes-loop-more")).to_contain_text("At a = 0.1 √kg m")
    assert page.locator("#modes-loop path.series").get_attribute("d") != best
    whole = abscissa(page, "modes-damping")
    page.keyboard.press("+")
    assert abscissa(page, "modes-damping") == abscissa(page, "modes-frequency") != whole
    page.keyboard.press("0")
    page.locator("#modes-tools").get_by_role("button", name="Pin this curve").click()
    expect(page.locator("#modes-frequency path[stroke-dasharray='2 4']")).to_have_count(2)  # curve and name
    with page.expect_download() as saved:
        page.locator("#modes-tools").get_by_role("button", name="Curve as CSV").click()
    rows = saved.value.path().read_text().splitlines()
    assert len(rows) == mode.amplitude.size + 1
    assert float(rows[-1].split(",")[2]) == pytest.approx(mode.frequency_hz[-1], rel=1e-9)
    page.click("#tab-response")
    friction = page.locator("#slide-damper-mu >> xpath=../span/input")
    friction.fill("0.35")
    friction.press("Tab")
    page.click("#tab-modes")
    expect(page.locator("#modes-stale")).to_contain_text("damper.mu 0.3, now 0.35")
    page.locator("#modes-stale button").click()
    expect(page.locator("#modes-stale")).to_be_hidden()
    assert request_of(site, page, "modes")["set"] == {"damper.mu": 0.35}
    page.reload()
    expect(page.locator("#modes-status")).to_contain_text("points in")
    expect(page.locator("#modes-to")).to_have_value("300")


@pytest.mark.long
def test_parameters_are_identified_from_what_is_pasted(profile: Profile, site: Site) -> None:
    truth = solver.load_scene("two-dof").with_values({"damper.mu": 0.27})
    lines = ["damper.N0,frequency [Hz],amplitude [mm]"]
    for load in (100, 50):
        for hertz in np.linspace(0.9, 1.4, 9):
            found = solver.solve(truth.with_values({"damper.N0": load}), frequency_hz=hertz, harmonics=3)
            size = 1e3 * abs(complex(found.observed[1], -found.observed[2]))
            lines.append(f"{load},{hertz:.4f},{size:.9g}")
    page = visit(profile[0], site, "?scene=two-dof&tab=identify&harmonics=3")
    page.locator("#identify summary", has_text="Paste a table").click()
    page.fill("#identify-paste", "\n".join([*lines[:4], lines[4].replace("100,", "100,x"), *lines[5:]]))
    page.click("#identify-paste-take")
    wrong = page.locator("#identify-data-wrong tbody td")
    expect(wrong).to_have_count(4)
    assert wrong.all_text_contents()[:3] == ["pasted", "5", "frequency [Hz]"]
    page.fill("#identify-paste", "\n".join(lines))
    page.click("#identify-paste-take")
    expect(page.locator("#identify-files")).to_contain_text("2 runs, 18 points")
    page.get_by_role("button", name="Remove unknown 1").click()
    expect(page.locator("#identify-unknowns [name=path]")).to_have_value("damper.mu")
    page.click("#study")
    expect(page.locator("#identify-status")).to_contain_text("The data tell every unknown.")
    row = page.get_by_role("region", name="Estimates").locator("tbody tr").first
    assert float(row.locator("td").nth(1).text_content() or "nan") == pytest.approx(0.27, rel=1e-3)
    expect(page.locator("#identify-response path.series")).to_have_count(2)
    page.fill("#harmonics", "2")
    page.press("#harmonics", "Tab")
    expect(page.locator("#identify-stale")).to_contain_text("3 harmonics, now 2")
    page.fill("#harmonics", "3")
    page.press("#harmonics", "Tab")
    expect(page.locator("#identify-stale")).to_be_hidden()
    page.click("#identify-robust-design")
    expect(page.locator("#tab-design")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#problem-given")).to_contain_text("identified: damper.mu")
    assert "damper.mu:0.2" in page.url, "the values are set too"


@pytest.mark.long
def test_what_was_identified_becomes_a_robust_design(profile: Profile, site: Site) -> None:
    truth = solver.load_scene("two-dof")
    frequencies = np.linspace(0.9, 1.4, 9)
    sizes = [
        abs(complex(*solver.solve(truth, frequency_hz=f, harmonics=3).observed[1:3])) for f in frequencies
    ]
    text = "\n".join(
        ["frequency,amplitude", *(f"{f:.4f},{a:.9g}" for f, a in zip(frequencies, sizes, strict=True))]
    )
    page = visit(profile[0], site, "?scene=two-dof&tab=identify&harmonics=3")
    file = {"name": "rig.csv", "mimeType": "text/csv", "buffer": text.encode()}
    page.set_input_files("#identify-file", [file])
    expect(page.locator("#identify-files")).to_contain_text("rig.csv")
    page.click("#study")
    expect(page.locator("#identify-result")).to_be_visible()
    page.click("#identify-robust-design")
    page.click("#study")
    expect(page.locator("#design-facts")).to_contain_text("Nominal and robust design", timeout=90_000)
    assert set(request_of(site, page, "design")["uncertain"]) >= {"centre", "covariance"}


@pytest.mark.long
def test_a_front_against_an_amplitude_of_ones_own(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=map&harmonics=1")
    page.fill("#front-limit", "2200")
    page.select_option("#front-limit-unit", "mm")
    page.fill("#front-points", "3")
    page.click("#front-form button")
    expect(page.locator("#front-status")).to_contain_text("3 designs", timeout=60_000)
    expect(page.locator("#front-status")).to_contain_text("the band at 2.2 m")
    request = request_of(site, page, "pareto")
    assert (request["limit"], request["points"]) == (2.2, 3)
    page.locator("#front-facts button").nth(1).click()
    expect(page.locator("#front-facts button").nth(1)).to_have_text("Loaded")
    expect(page.locator("#front-facts button").nth(1)).to_be_focused()
    assert "set=damper.N0:" in page.url
    expect(page.locator("#front-figure path.f2")).to_have_count(1)


def test_an_export_of_a_rig_is_shown_before_it_is_read(profile: Profile, site: Site) -> None:
    """Semicolons, decimal commas, German headings, units to be chosen; remembered for the next file."""
    lines = ["Messung vom 12.3.", "Frequenz [Hz];Kraft [N];Weg;T_Platte [°C];Bemerkung"]
    rows = [(0.9 + 0.05 * i, 100, 1500 + 90 * i) for i in range(8)]
    lines += [f"{f:.2f};{n};{x:.1f};41,2;ok".replace(".", ",") for f, n, x in rows]
    file = {"name": "Prüfstand.csv", "mimeType": "text/csv", "buffer": "\r\n".join(lines).encode("cp1252")}
    page = visit(profile[0], site, "?scene=two-dof&tab=identify&harmonics=3")
    page.set_input_files("#identify-file", [file])
    form = page.locator("#identify-columns form")
    expect(form).to_contain_text("semicolons between, decimal commas, headings in line 2, 8 rows.")
    expect(form.get_by_label("Frequenz [Hz] is")).to_have_value("frequency")
    expect(form.get_by_label("Unit of Kraft [N]")).to_have_value("N")
    expect(form.get_by_label("Weg is")).to_have_value("amplitude")
    expect(form.get_by_label("Bemerkung is")).to_have_value("")
    form.get_by_label("Weg is").select_option("max_abs")
    form.get_by_label("Unit of Weg").select_option("mm")
    expect(form).to_contain_text("it is read as max_abs")
    expect(form.locator("code")).to_contain_text('--column "Weg=max_abs:mm"')
    form.get_by_role("button", name="Read 8 rows").click()
    expect(page.locator("#identify-files")).to_contain_text("1 run, 8 points")
    expect(page.locator("#identify-files")).to_contain_text("excitation.amplitude 100 N")
    expect(form).to_have_count(0)
    page.set_input_files("#identify-file", [{**file, "name": "second.csv"}])
    expect(form.get_by_label("Unit of Weg")).to_have_value("mm")
    expect(form).to_contain_text("as last time")
    form.get_by_role("button", name="Leave the file out").click()
    expect(page.locator("#identify-files")).not_to_contain_text("second.csv")


def test_data_dropped_on_their_card_are_taken_for_data_alone(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=identify")
    expect(page.locator("#live-status")).to_contain_text("peak")
    text = "frequency [Hz],amplitude [m]\n1.0,1.93\n1.2,1.77\n"
    page.evaluate(DROP, ["#identify-data", "rig.csv", text])
    expect(page.locator("#identify")).to_contain_text("rig.csv")
    expect(page.locator("#matrices")).to_be_hidden()
    expect(page.locator(".dropping")).to_have_count(0)
