"""Matrices of a finite-element program through the page: files in, a scene, its response; what is wrong."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING

import httpx
import numpy as np
import pytest
from fe_files import coordinate, hbmat
from matrix_cases import beam
from page_matrices import ANSYS, K, M, file, place
from page_site import Site, Watch
from page_visits import DROP, visit
from sector_files import SECTORS, sector_files

from solver.matrices.readers.reader_registry import readers

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]


@pytest.mark.long
@pytest.mark.parametrize("sector", [False, True])
def test_matrices_become_a_scene_and_its_response(profile: Profile, site: Site, sector: bool) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    page = visit(context, site)
    page.click("#scene-menu")
    page.get_by_role("button", name="Matrices…").press("Enter")
    expect(page.locator("#matrix-choose")).to_be_focused()
    endings = [suffix for reader in readers() for suffix in reader.suffixes]
    expect(page.locator("#matrix-input")).to_have_attribute("accept", ",".join(endings))
    damaged = hbmat(K).replace("D+", "X+", 1)
    page.evaluate(DROP, ["#start", "blade K.matrix", damaged])
    expect(page.locator("#matrix-files .message")).to_contain_text("line 163, column 1")
    page.set_input_files("#matrix-input", ANSYS)
    report = page.locator("#matrix-report")
    expect(report).to_contain_text("named: nodes 2 to 21, ROTZ, UY")
    expect(report).to_contain_text("58.11 g in UY")
    expect(report).to_contain_text("1142, 7158")
    expect(page.get_by_label("blade K.matrix (")).to_have_value("K")
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []
    place(page, "", "11.UY")
    expect(page.get_by_label("Node and direction, or row").first).to_be_focused()
    place(page, "99.UY")
    wrong = page.get_by_label("Node and direction, or row").first
    expect(wrong).to_have_attribute("aria-invalid", "true")
    expect(page.locator(f"#{wrong.get_attribute('id')}-message")).to_contain_text("no node 99 in use")
    page.get_by_label("Modes kept of the rest").fill("6")
    place(page, "21.UY")
    expect(report).to_contain_text("2 DOFs and 6 modes")
    assert page.input_value("#field-structure-K").startswith("upload:")
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#matrices")).to_be_hidden()
    expect(page.locator("#scene")).to_have_value("blade")
    expect(page.locator("#live-status")).to_contain_text("µm at")
    page.locator("#live-figure svg.chart").click(position={"x": 250, "y": 100})
    expect(page.locator("#point-facts")).to_contain_text("max |x|")
    stored = httpx.get(f"{site.url}/v1/scenes/blade").json()["scene"]["structure"]
    assert stored["reduction"]["dofs"] == len(M)
    page.click("#scene-menu")
    page.click("#edit-scene")
    expect(page.locator("#field-structure-damping-ratio")).to_have_value("0.001")
    assert page.locator("#editor input").count() < 40, "nobody edits a matrix number by number"
    if sector:
        check_sector(page, site)


def check_sector(page: Page, site: Site) -> None:
    """One sector of a disk: its deck tells the sets and the places, and the sector is drawn."""
    page.click("#scene-menu")
    page.get_by_role("button", name="Matrices…").click()
    for name in ("blade_K.matrix", "blade_M.matrix", "blade_K.mapping"):
        page.get_by_role("button", name=f"Leave out {name.replace('_', ' ')}").click()
    page.set_input_files("#matrix-input", [file(name, data) for name, data in sector_files().items()])
    expect(page.locator("#matrix-report")).to_contain_text("HIGH (3 nodes), LOW (3 nodes)")
    page.locator("#matrix-sectors").fill(str(SECTORS))
    expect(page.locator("#matrix-low")).to_have_value("LOW")
    page.get_by_label("Engine order of the force").fill("2")
    page.get_by_label("Modes kept of the rest").fill("3")
    page.get_by_label("Name of the scene").fill("ring")
    page.locator("#matrix-low").fill("SIDE")
    place(page, "6.UZ", "4.UX")
    expect(page.locator("#matrix-low-message")).to_contain_text("there is no set 'SIDE'")
    page.locator("#matrix-low").fill("LOW")
    page.get_by_role("button", name="Make the scene").click()
    expect(page.locator("#matrix-report")).to_contain_text("3 modes at each of 2 nodal diameters")
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("ring")
    drawn = page.locator("#structure-figure svg[role=img]")
    expect(drawn).to_have_attribute("aria-label", re.compile("one of 6 sectors.*3 nodes on the boundary"))
    expect(page.locator("#structure-figure .note")).to_contain_text("no elements that can be drawn")
    stored = httpx.get(f"{site.url}/v1/scenes/ring").json()["scene"]["structure"]
    assert len(stored["outline"]["points"]) == 9


@pytest.mark.long
def test_files_that_do_not_fit_are_told_beside_them(profile: Profile, site: Site) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    page = visit(context, site)
    page.evaluate(DROP, ["#start", "job.sti", coordinate(K)])
    expect(page.locator("#matrix-status")).to_contain_text("'job.sti' alone must hold M and K")
    small = io.BytesIO()
    np.save(small, beam(5)[0])
    page.set_input_files("#matrix-input", [file("mass.npy", small.getvalue()), file("notes.txt", "hello")])
    expect(page.locator("#matrix-files")).to_contain_text("Its suffix tells no format")
    expect(page.locator("#matrix-status")).to_contain_text("M has 10 rows, K has 40 rows: export all of them")
    page.get_by_role("button", name="Leave out mass.npy").click()
    expect(page.locator("#matrix-form")).to_be_hidden()
    page.set_input_files("#matrix-input", [file("mass.mas", coordinate(M * 1e-9))])
    expect(page.get_by_label("What looks wrong")).to_contain_text("units that go together")
    page.get_by_label("mass.mas (").select_option("C")
    expect(page.locator("#matrix-status")).to_contain_text("`M` (the mass matrix) is missing")


@pytest.mark.long
def test_a_scene_that_refers_to_a_file_asks_for_it(profile: Profile, site: Site) -> None:
    """The scene alone, then its matrices; both at once; and one that is larger than the service takes."""
    buffer = io.BytesIO()
    np.savez(buffer, M=M, K=K)
    matrices = file("blade.npz", buffer.getvalue())
    text = f"""
name = "referring"
[structure]
kind = "matrices"
M = "models/blade.npz"
K = "models/blade.npz"
damping_ratio = 0.001
dofs = {{ tip = {len(M) - 2}, middle = 20 }}
[[contacts]]
name = "damper"
between = ["tip", "ground"]
kt = 1e5
mu = 0.3
N0 = 10.0
[excitation]
dof = "middle"
amplitude = 1.0
[observe]
dof = "tip"
band = [800.0, 1600.0]
"""
    scene = {"name": "referring.toml", "mimeType": "application/toml", "buffer": text.encode()}
    page = visit(profile[0], site)
    page.set_input_files("#file", [scene])
    expect(page.locator("#editor")).to_contain_text("The scene refers to blade.npz: choose it too")
    page.set_input_files("#scene-files", [matrices])
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong with this scene.")
    page.set_input_files("#file", [scene, matrices])
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong with this scene.")
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#live-status")).to_contain_text("peak")
    page.route(
        "**/v1/matrices/formats",
        lambda route: route.fulfill(json={"items": [], "most_bytes": 100, "most_parts": 2}),
    )
    page.set_input_files("#file", [scene, matrices])
    expect(page.locator("#editor")).to_contain_text(
        "raise STICKSLIP_MAX_UPLOAD_BYTES or STICKSLIP_MAX_UPLOAD_PARTS there, or reduce the model first"
    )
    expect(page.locator("#editor")).to_contain_text("--reduce")
    page.unroute("**/v1/matrices/formats")
    limits = {"items": [], "most_bytes": 8000, "most_parts": 8}  # less than the service takes in one piece
    page.route("**/v1/matrices/formats", lambda route: route.fulfill(json=limits))
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if "/v1/uploads?" in request.url else None)
    with page.expect_response(lambda answer: "&part=" in answer.url) as joined:
        page.set_input_files("#file", [scene, matrices])
    assert joined.value.ok
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong with this scene.")
    assert 2 <= sum("format=part" in url for url in sent) == sent[-1].count("&part=") <= 8
