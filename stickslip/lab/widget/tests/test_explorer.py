"""The widget for notebooks: its curve is that of a sweep, and it works in a browser."""

from __future__ import annotations

import importlib.util
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stickslip
from solver.errors import SettingError

if importlib.util.find_spec("anywidget") is None:
    pytest.skip("anywidget is not installed", allow_module_level=True)
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


def test_the_curve_is_that_of_the_values() -> None:
    scene = stickslip.load_scene("two-dof")
    widget = stickslip.explore(scene, {"damper.N0": (10.0, 1000.0)}, harmonics=3)
    assert widget.values == {"damper.N0": scene.value("damper.N0")}
    widget.places = {"damper.N0": 0.4}
    assert widget.values["damper.N0"] == pytest.approx(10.0 * 100.0**0.4)
    judge = stickslip.sweep(scene.with_values({"damper.N0": widget.values["damper.N0"]}), harmonics=3)
    assert judge.peak is not None
    assert widget.curve["peak"] == [judge.peak.at, judge.peak.value]
    np.testing.assert_array_equal(widget.curve["amplitude"], judge.amplitude)
    assert widget.before["peak"] != widget.curve["peak"]
    [slider] = widget.sliders
    assert slider["unit"] == "N"
    assert slider["place"] == pytest.approx(0.4)


def test_a_path_that_is_not_there_is_refused() -> None:
    with pytest.raises(SettingError, match=r"damper\.N9"):
        stickslip.explore(stickslip.load_scene("two-dof"), {"damper.N9": (1.0, 2.0)})


HOST = """
async ({ esm, state }) => {
  const url = URL.createObjectURL(new Blob([esm], { type: "text/javascript" }));
  const { default: widget } = await import(url);
  const heard = {};
  window.saved = [];
  window.model = {
    get: (name) => state[name],
    set: (name, value) => { state[name] = value; },
    save_changes: () => window.saved.push(structuredClone(state.places)),
    on: (name, call) => { heard[name] = call; },
  };
  window.answer = (changed) => { Object.assign(state, changed); heard["change:curve"](); };
  await widget.render({ model: window.model, el: document.body });
}
"""


@pytest.mark.long
def test_it_works_in_a_browser(tmp_path: Path) -> None:
    """The module by itself, in a host with a model as front ends of anywidget have it."""
    api = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    program = shutil.which("chromium")
    if program is None:
        pytest.skip("chromium is not installed (Debian's package `chromium`)")
    widget = stickslip.explore(stickslip.load_scene("two-dof"), {"damper.N0": (10.0, 1000.0)}, harmonics=3)

    def state() -> dict[str, Any]:
        names = ("sliders", "places", "curve", "before")
        found: dict[str, Any] = json.loads(json.dumps({name: getattr(widget, name) for name in names}))
        return found

    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page()
        complaints: list[str] = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        (tmp_path / "empty.html").write_text("<!doctype html><title>x</title><body></body>")
        page.goto((tmp_path / "empty.html").as_uri())
        page.evaluate(HOST, {"esm": str(widget._esm), "state": state()})
        first = page.locator("path.curve").get_attribute("d")
        slider = page.get_by_role("slider")
        slider.fill("0.4")
        slider.fill("0.6")
        assert page.evaluate("window.saved") == [{"damper.N0": 0.4}], "one response at a time"
        widget.places = page.evaluate("window.saved")[-1]
        page.evaluate("window.answer", state())
        assert page.locator("path.curve").get_attribute("d") != first
        assert "63.1 N" in page.locator("output").inner_text()
        peak = 1e3 * widget.curve["peak"][1]
        assert f"{peak:.4g}" in page.locator("p").inner_text()
        assert page.evaluate("window.saved")[-1] == {"damper.N0": 0.6}, "where it stopped is asked for"
        assert complaints == []
        page.screenshot(path=tmp_path / "explorer.png")
        browser.close()
