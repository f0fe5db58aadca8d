"""Shapes in space: what is drawn of each kind of scene, against motions of the solver; states, files."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from page_site import Site, Watch, opened

import solver

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

OF_MESH = 97  # the node of the outline of `fe-disk` at `ahead-lower`
DRIVER = "GL Driver Message"  # of WebGL without a graphics card, on reading a frame
DRAW = """async ([body, tau, wanted]) => {
  const base = new URL(".", document.querySelector("script[type=module]").src);
  const { stage } = await import(`${base}shape/stage.js`);
  const three = await import(`${base}vendor/three.js`);
  const headers = { "Content-Type": "application/json" };
  const asked = { method: "POST", headers, body: JSON.stringify({ kind: "shape", ...body }) };
  const { shape } = await (await fetch("/v1/previews", asked)).json();
  const nothing = (sectors) => sectors.map((s) => s.map((h) => h.map(() => [0, 0, 0])));
  const drawn = (what, angle) => {
    const canvas = document.getElementById("main").appendChild(document.createElement("canvas"));
    const made = stage(three, canvas, what);
    made.draw(angle);
    const found = wanted.map(([j, at]) => made.at(j, at >= 0 ? at : shape.names.indexOf(at)));
    made.close();
    canvas.remove();
    return { factor: made.factor, at: found };
  };
  const rest = drawn({ ...shape, real: nothing(shape.real), imag: nothing(shape.imag) }, 0).at;
  return { ...drawn(shape, tau), rest };
}"""


def ready(page: Page, site: Site, scene: str) -> None:
    page.goto(f"{site.url}/?scene={scene}")
    page.locator("html[data-ready]").wait_for(state="attached")


def opened_shape(page: Page, site: Site, scene: str) -> None:
    ready(page, site, scene)
    page.locator("#shape-open").click()
    page.locator("#shape canvas[data-drawn]").wait_for()


def about_the_mean(solution: solver.Solution, dof: str, tau: float) -> float:
    """The motion of a DOF at an angle in the period, without its mean."""
    row = solver.time_history(solution, dof, samples=512)[1]
    return float(np.interp(tau, 2.0 * math.pi * np.arange(513) / 512, np.append(row, row[0])) - row.mean())


def turned(j: int, sectors: int, vector: list[float]) -> np.ndarray:
    angle = 2.0 * math.pi * j / sectors
    rows = [
        [math.cos(angle), -math.sin(angle), 0.0],
        [math.sin(angle), math.cos(angle), 0.0],
        [0.0, 0.0, 1.0],
    ]
    return np.array(rows) @ vector


@pytest.mark.few(4)
@pytest.mark.parametrize(
    ("scene", "hertz", "dofs", "point"),
    [
        ("two-dof", 1.05, ("m2", None, None), "m2"),
        ("bladed-disk", 740.0, (None, None, "tip"), "tip"),
        pytest.param("platform-wedge", 370.0, ("ax", "ay", "az"), "left", marks=pytest.mark.long),
        ("fe-disk", 250.0, ("a1x", "a1y", "a1z"), "ahead-lower"),
        ("fe-disk", 250.0, ("a1x", "a1y", "a1z"), OF_MESH),
    ],
)
def test_points_are_drawn_where_the_solver_moves_them(
    profile: tuple[BrowserContext, Watch], site: Site, scene: str, hertz: float,
    dofs: tuple[str | None, ...], point: str | int,
) -> None:  # fmt: skip
    context, watch = profile
    watch.allowed = (DRIVER,)
    page = context.new_page()
    ready(page, site, scene)
    given, tau = solver.load_scene(scene), 1.1
    sectors = given.structure.sector_count
    drawn_of = (0, 1, 3) if sectors > 1 else (0,)
    body = {"scene": scene, "frequency_hz": hertz, "harmonics": 5}
    found = page.evaluate(DRAW, [body, tau, [[j, point] for j in drawn_of]])
    solution = solver.solve(given, frequency_hz=hertz, harmonics=5)
    turn = 2.0 * math.pi * given.engine_order / sectors
    for j, at, rest in zip(drawn_of, found["at"], found["rest"], strict=True):
        own = [
            0.0 if dof is None else about_the_mean(solution, dof, (tau + j * turn) % (2.0 * math.pi))
            for dof in dofs
        ]
        drawn = (np.array(at) - rest) / found["factor"]
        largest = max(abs(value) for value in own) or 1.0
        assert drawn == pytest.approx(turned(j, sectors, own), abs=2e-2 * largest)


@pytest.mark.long
def test_a_shape_is_opened_coloured_played_and_saved(
    profile: tuple[BrowserContext, Watch], site: Site
) -> None:
    image = pytest.importorskip("PIL.Image", reason="Pillow reads the pictures")
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
    context, watch = profile
    watch.allowed = (DRIVER,)
    page = context.new_page()
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    ready(page, site, "bladed-disk")
    page.locator("#shape-open").wait_for()
    assert not any(url.endswith("vendor/three.js") for url in asked)
    page.locator("#shape-open").click()
    canvas = page.locator("#shape canvas[data-drawn]")
    canvas.wait_for()
    assert sum(url.endswith("vendor/three.js") for url in asked) == 1
    name = canvas.get_attribute("aria-label") or ""
    assert "nodal diameter 1" in name
    assert "shroud sticks and slips" in name

    def saved(button: str) -> Any:
        with page.expect_download() as download:
            page.locator("#shape").get_by_role("button", name=button).click()
        return image.open(io.BytesIO(download.value.path().read_bytes()))

    still = saved("Save this frame as PNG")
    assert still.format == "PNG"
    assert len(still.convert("RGB").getcolors(1 << 24)) > 20
    frames = saved("Save 8 frames")
    assert frames.size == (8 * still.size[0], still.size[1])
    width = still.size[0]
    assert frames.crop((0, 0, width, 200)).tobytes() != frames.crop((4 * width, 0, 5 * width, 200)).tobytes()
    page.get_by_label("Coloured by").first.select_option("state")
    by_state = saved("Save this frame as PNG").convert("RGB")
    token = page.evaluate(
        "() => { const i = document.body.appendChild(document.createElement('i'));"
        " i.style.color = 'var(--slip)'; return getComputedStyle(i).color.match(/\\d+/g).map(Number); }"
    )
    colours = [colour for _, colour in by_state.getcolors(1 << 24)]
    assert any(max(abs(a - b) for a, b in zip(colour, token, strict=True)) <= 6 for colour in colours)
    angle = page.get_by_label("Angle in the period").first
    page.locator("#shape").get_by_role("button", name="Play").click()
    page.wait_for_function("() => Number(document.getElementById('shape-at').value) > 3")
    page.locator("#shape").get_by_role("button", name="Pause").click()
    at = angle.input_value()
    page.wait_for_timeout(200)
    assert angle.input_value() == at
    canvas.focus()
    before = saved("Save this frame as PNG").tobytes()
    canvas.press("ArrowLeft")
    assert saved("Save this frame as PNG").tobytes() != before
    page.locator("#shape").get_by_role("button", name="Whole view").click()
    assert page.locator("dialog.shape-whole").first.is_visible()
    page.keyboard.press("Escape")
    page.locator("#shape > #shape-view > figure").wait_for()
    assert page.evaluate("() => document.activeElement.title") == "Whole view"
    found = axe.Axe().run(page).response["violations"]
    assert [one["id"] for one in found if one["impact"] in ("serious", "critical")] == []


def test_without_webgl_or_with_less_motion_a_sentence_or_steps(browser: Browser, site: Site) -> None:
    with opened(browser, site, reduced_motion="reduce") as (context, watch):
        watch.allowed = (DRIVER,)
        page = context.new_page()
        opened_shape(page, site, "two-dof")
        step = page.locator("#shape").get_by_role("button", name="Step on")
        step.click()
        assert page.locator("#shape-at").input_value() == "6"
        page.add_init_script(
            "const own = HTMLCanvasElement.prototype.getContext;"
            "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
            " return kind.startsWith('webgl') ? null : own.call(this, kind, ...rest); };"
        )
        ready(page, site, "two-dof")
        page.locator("#shape-open").click()
        page.get_by_text("This browser has no WebGL").wait_for()


@pytest.mark.long
def test_a_mode_is_shown_linear_and_at_a_point_of_its_curve(
    profile: tuple[BrowserContext, Watch], site: Site
) -> None:
    context, watch = profile
    watch.allowed = (DRIVER,)
    page = context.new_page()
    ready(page, site, "two-dof&tab=modes")
    page.locator("#mode-space-open").click()
    canvas = page.locator("#modes-shape-view canvas[data-drawn]")
    canvas.wait_for()
    assert "contacts as at rest" in (canvas.get_attribute("aria-label") or "")
    page.fill("#modes-from", "0.1")
    page.fill("#modes-to", "5")
    page.click("#study")
    page.locator("#modes-shape-view canvas[aria-label*='mode 1 at a =']").wait_for()
    name = page.locator("#modes-shape-view canvas").get_attribute("aria-label") or ""
    assert "damper sticks and slips" in name
    assert "1/√kg" in name
