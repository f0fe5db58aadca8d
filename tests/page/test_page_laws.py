"""Sliders, design variables and fields of the page follow from the contact laws, also from outside."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from joined_scene import JOINED
from page_site import Site, opened
from page_visits import visit

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).resolve().parent.parent.parent
IN_SPACE: dict[str, Any] = {
    "name": "in-space",
    "structure": {
        "kind": "lumped",
        "masses": {"x": 1.0, "y": 1.0, "z": 1.0},
        "springs": [{"between": [dof, "ground"], "k": 10.0, "c": 0.05} for dof in "xyz"],
    },
    "contacts": [
        {
            "name": "pad", "law": "coulomb-3d", "between": ["x", "ground"], "between_second": ["y", "ground"],
            "normal_between": ["z", "ground"], "kt": 5.0, "kn": 8.0, "mu": 0.3, "N0": 2.0,
        },
        {"name": "stop", "law": "gap", "between": ["y", "ground"], "k": 3.0, "gap": 0.5},
        {"name": "rubber", "law": "polynomial", "between": ["x", "ground"], "a1": 1.0, "a3": 0.1},
    ],
    "excitation": {"dof": "x", "amplitude": 0.5},
    "observe": {"dof": "x", "band": [0.4, 0.8]},
}  # fmt: skip


@pytest.fixture(scope="module")
def stored(site: Site) -> Site:
    """Scenes of other laws, one of them from outside the package, are stored."""
    for scene in (JOINED, IN_SPACE):
        assert httpx.post(f"{site.url}/v1/scenes", json=scene, timeout=60.0).status_code == 201
    return site


@pytest.fixture
def page_of(browser: Browser, stored: Site) -> Iterator[Any]:
    """Visits to the page with a scene."""
    with opened(browser, stored) as (context, _):
        yield lambda scene: visit(context, stored, f"?scene={scene}")


def sliders(page: Page) -> list[str]:
    return page.locator("#sliders .slider label").all_inner_texts()


def columns(page: Page) -> list[str]:
    """Of the table of contacts, those behind the state."""
    return page.locator("#structure-states th").all_inner_texts()[3:]


def variables(page: Page) -> list[str]:
    return page.locator("#variable option").all_inner_texts()


@pytest.mark.long
def test_coulomb_friction_has_the_sliders_it_had(page_of: Any) -> None:
    page = page_of("two-dof")
    assert sliders(page) == ["N0 of damper", "N1 of damper", "kt of damper", "μ of damper", "f0, the force"]
    assert variables(page)[0] == page.input_value("#variable") == "damper.N0"
    assert columns(page) == ["N0", "kt", "μ"]
    assert (page.input_value("#low"), page.input_value("#high")) == ("10", "1500")
    # The load's amplitude is tied to its mean.
    assert page.input_value("#slide-damper-N1 >> xpath=../span/input") == "30"
    page.fill("#slide-damper-N0 >> xpath=../span/input", "200")
    page.press("#slide-damper-N0 >> xpath=../span/input", "Tab")
    assert page.input_value("#slide-damper-N1 >> xpath=../span/input") == "60"


@pytest.mark.long
def test_a_law_from_outside_has_sliders_and_is_designed(page_of: Any) -> None:
    page = page_of("joined")
    assert sliders(page) == ["k of joint", "limit of joint", "f0, the force"]
    assert variables(page) == ["joint.k", "joint.limit"]
    assert columns(page) == ["k", "limit"]
    expect(page.locator("#live-status")).to_contain_text("peak 4.298 m")
    page.focus("#slide-joint-limit")
    page.keyboard.press("Home")
    expect(page.locator("#live-status")).not_to_contain_text("peak 4.298 m")
    expect(page).to_have_url(re.compile(r"set=joint\.limit:0\.04&"))
    page.select_option("#variable", "joint.limit")
    expect(page.locator("#variable-unit")).to_have_text("N")
    page.click("#study")
    expect(page.locator("#design-facts")).to_contain_text("joint.limit", timeout=120_000)
    assert "variable=limit" in page.url
    page.reload()
    page.locator("html[data-ready]").wait_for(state="attached")
    assert page.input_value("#variable") == "joint.limit"


@pytest.mark.long
def test_every_law_has_its_sliders_and_units(page_of: Any) -> None:
    page = page_of("in-space")
    pad = ["N0", "N1", "kt", "μ", "kt_second", "kn"]
    assert sliders(page) == [*(f"{name} of pad" for name in pad), "f0, the force"]
    for contact, names in (("stop", ["k", "gap"]), ("rubber", ["a1", "a3"])):
        page.select_option("#contact", contact)
        assert sliders(page) == [*(f"{name} of {contact}" for name in names), "f0, the force"]
        assert page.input_value("#variable") == f"{contact}.{names[0]}"
    assert {"pad.kn", "pad.kt_second", "stop.gap", "rubber.a3"} <= set(variables(page))
    assert columns(page) == ["law", "N0", "kt", "μ", "kn", "k", "gap", "a1", "a3"]
    page.click("#scene-menu")
    page.click("#edit-scene")
    expect(page.locator("#editor-status")).to_contain_text("Nothing is wrong")
    heads = page.locator("#field-contacts th").all_inner_texts()
    assert {"kn [N/m]", "gap [m]", "a3 [N/m^3]"} <= set(heads)


@pytest.mark.long
def test_what_is_left_out_follows_what_it_is_taken_from(page_of: Any) -> None:
    page = page_of("in-space")
    page.fill("#slide-pad-kt >> xpath=../span/input", "6")
    page.press("#slide-pad-kt >> xpath=../span/input", "Tab")
    assert page.input_value("#slide-pad-kt_second >> xpath=../span/input") == "6"


@pytest.mark.long
def test_a_damper_between_blades_is_drawn_varied_and_designed(page_of: Any) -> None:
    """The wedge of a shipped scene: sliders of its mass, friction and angle, which the response follows."""
    page = page_of("platform-wedge")
    assert {"mass of wedge", "μ of wedge", "angle of wedge"} <= set(sliders(page))
    expect(page.get_by_role("img", name=re.compile("to scale: wedge"))).to_be_visible()
    expect(page.locator("#structure-states")).to_contain_text("wedge")
    expect(page.locator("#structure-states")).not_to_contain_text("linear")
    assert {"wedge.mass", "wedge.mu", "wedge.kn", "speed"} <= set(variables(page))
    expect(page.locator("#study")).to_be_enabled()
    assert page.input_value("#variable") == "wedge.mass"
    angle = page.locator("#slide-wedge-angle >> xpath=..")
    expect(angle).to_contain_text("°")
    expect(angle.locator("input[type=number]")).to_have_value("20.0535")  # 0.35 rad
    expect(page.locator("#variable-unit")).to_have_text("g")
    assert (page.input_value("#low"), page.input_value("#high")) == ("0.4", "60")
    expect(page.locator("#search-words")).to_have_text("wedge.mass 0.4 g – 60 g")
    page.fill("#slide-wedge-mass >> xpath=../span/input", "8")
    page.press("#slide-wedge-mass >> xpath=../span/input", "Tab")
    expect(page).to_have_url(re.compile(r"set=wedge\.mass:0\.008"))
    expect(page.locator("#live-status")).to_contain_text("peak")
    page.locator("#contact").select_option("speed")
    assert sliders(page)[0] == "speed"
    # No preview comes any more: the curve of this scene does not stay under the name of the next.
    page.route("**/v1/previews", lambda _: None)
    page.get_by_role("button", name="two-dof", exact=True).click()
    expect(page.locator("#slide-damper-N0")).to_be_visible()
    expect(page.locator("#live-figure")).to_contain_text("The response is on its way.")
