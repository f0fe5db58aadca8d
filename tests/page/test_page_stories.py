"""Two pieces of work of one's own, by clicks alone; `pytest -s -m long` prints the time they take."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from page_blade import TOML, matrices
from page_site import Site, Watch
from page_visits import visit

import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext

Profile = tuple["BrowserContext", Watch]
PATIENCE_MS = 900_000
pytestmark = pytest.mark.long


def test_from_the_files_of_a_blade_to_the_best_damper_mass_and_a_report(profile: Profile, site: Site) -> None:
    """5 minutes are wanted; the limit here leaves room for a machine with other work."""
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    begun = time.monotonic()
    files = [
        {"name": "own-blade.toml", "mimeType": "application/toml", "buffer": TOML.encode()},
        {"name": "own-blade.npz", "mimeType": "application/octet-stream", "buffer": matrices()},
    ]
    page.set_input_files("#file", files)
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong with this scene.")
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("own-blade")
    page.select_option("#variable", "wedge.mass")
    page.fill("#low", "1")  # g
    page.fill("#high", "20")
    page.fill("#harmonics", "3")
    page.press("#harmonics", "Tab")
    page.click("#tab-design")
    page.click("#study")
    expect(page.locator("#answer-peak .large")).to_be_visible(timeout=PATIENCE_MS)
    with page.expect_download(timeout=PATIENCE_MS) as taken:
        page.click("#save-report")
    took = time.monotonic() - begun
    report = Path(taken.value.path()).read_text(encoding="utf-8")
    assert "wedge.mass" in report
    print(f"\nfiles of a blade to the best damper mass and a report: {took:.0f} s (300 s are wanted)")  # noqa: T201
    assert took < 15 * 60


def export() -> str:
    """A rig's table at two levels: semicolons, decimal commas, German headings, 1 % of noise."""
    truth, noise = solver.load_scene("two-dof").with_values({"damper.mu": 0.27}), np.random.default_rng(7)
    lines = ["Prüfstand 3;;;;", "Frequenz [Hz];Kraft [N];Weg [mm];T_Platte [°C];Bemerkung"]
    for force in (100, 60):
        for hertz in np.linspace(0.9, 1.4, 12):
            here = truth.with_values({"excitation.amplitude": force})
            found = solver.solve(here, frequency_hz=hertz, harmonics=3)
            size = (
                1e3
                * abs(complex(found.observed[1], found.observed[2]))
                * (1.0 + 0.01 * noise.standard_normal())
            )
            lines.append(f"{hertz:.4f};{force};{size:.3f};41,5;ok".replace(".", ","))
    return "\r\n".join(lines)


def test_from_a_german_csv_to_a_robust_design(profile: Profile, site: Site) -> None:
    """3 minutes are wanted."""
    text = export().encode("cp1252")
    page = visit(profile[0], site, "?scene=two-dof&tab=identify&harmonics=3")
    begun = time.monotonic()
    page.set_input_files("#identify-file", [{"name": "Export.csv", "mimeType": "text/csv", "buffer": text}])
    page.get_by_role("button", name="Read 24 rows").click()
    expect(page.locator("#identify-files")).to_contain_text("2 runs, 24 points")
    page.get_by_role("button", name="Remove unknown 1").click()
    page.click("#study")
    expect(page.locator("#identify-status")).to_contain_text(
        "The data tell every unknown.", timeout=PATIENCE_MS
    )
    estimate = page.get_by_role("region", name="Estimates").locator("tbody tr").first.locator("td").nth(1)
    assert float(estimate.text_content() or "nan") == pytest.approx(0.27, rel=0.05)
    page.click("#identify-robust-design")
    page.fill("#problem-samples", "8")
    page.click("#study")
    expect(page.locator("#answer-peak")).to_contain_text("Worst peak", timeout=PATIENCE_MS)
    took = time.monotonic() - begun
    expect(page.locator("#design-facts")).to_contain_text("damper.N0")
    print(f"\na German CSV to a robust design: {took:.0f} s (180 s are wanted)")  # noqa: T201
    assert took < 10 * 60
