"""A scene drawn in place: where the solver has its bodies, with what they do, and no words over others."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from page_site import Site, Watch, opened
from page_visits import visit

import solver

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
SHIPPED = ["bladed-disk", "fe-disk", "platform-cylinder", "platform-wedge", "shroud-3d", "two-dof"]
IN_PLACE = ["platform-cylinder", "platform-wedge", "shroud-3d"]
WORDS = """() => [...document.querySelectorAll("#structure-figure > svg text")].map((text) => {
  const { x, y, width, height } = text.getBoundingClientRect();
  return { words: text.textContent, x, y, width, height };
})"""
FRAME = """() => {
  const { x, y, width, height } = document.querySelector("#structure-figure > svg").getBoundingClientRect();
  return { x, y, width, height };
}"""
TITLES = """() => {
 const marks = document.querySelectorAll("#structure-figure > svg :is(.node.full, .spot)");
 return [...marks].map((mark) => {
  const { x, y, width, height } = mark.getBBox();
  return { title: mark.textContent, state: mark.getAttribute("class"), at: [x + width / 2, y + height / 2] };
 });
}"""
SMALL = """async (scenes) => {
  const base = new URL(".", document.querySelector("script[type=module]").src);
  const { drawScene } = await import(`${base}scene/structure.js`);
  const found = {};
  for (const name of scenes) {
    const { scene } = await (await fetch(`/v1/scenes/${name}`)).json();
    const host = document.getElementById("main").appendChild(document.createElement("div"));
    drawScene(host, scene, { small: true });
    const [drawing] = host.children;
    found[name] = { parts: host.children.length, words: drawing.querySelectorAll("text").length, ids: drawing.querySelectorAll("[id]").length,
      faces: drawing.querySelectorAll(".face").length, plates: drawing.querySelectorAll("rect.contact").length, lines: drawing.querySelectorAll("path").length, high: drawing.getBoundingClientRect().height };
    host.remove();
  }
  return found;
}"""  # noqa: E501


def shown(page: Page, scene: str) -> None:
    """Waits until the drawing has what the contacts do, and in place their loads too."""
    drawing = page.locator("#structure-figure > svg")
    expect(drawing).to_have_attribute("aria-label", re.compile("stick|slip|open|closed"))
    if scene in IN_PLACE:
        expect(drawing.locator("g.load:not(.stale)").first).to_be_attached()


def meet(a: dict[str, float], b: dict[str, float]) -> bool:
    apart = 1.0  # px: the boxes of lines of text are higher than their letters
    return (
        a["x"] + apart < b["x"] + b["width"] and b["x"] + apart < a["x"] + a["width"]
        and a["y"] + apart < b["y"] + b["height"] and b["y"] + apart < a["y"] + a["height"]
    )  # fmt: skip


@pytest.mark.parametrize("size", [(1366, 768), (1024, 768), (390, 844)])
def test_no_words_of_a_drawing_stand_over_others(browser: Browser, site: Site, size: tuple[int, int]) -> None:
    with opened(browser, site) as (context, _):
        page = context.new_page()
        page.set_viewport_size({"width": size[0], "height": size[1]})
        for scene in SHIPPED:
            page.goto(f"{site.url}/?scene={scene}&tab=response")
            shown(page, scene)
            words, frame = page.evaluate(WORDS), page.evaluate(FRAME)
            assert len(words) >= 2, scene
            for i, one in enumerate(words):
                over = [other["words"] for other in words[i + 1 :] if meet(one, other)]
                assert over == [], f"{one['words']!r} of {scene}"
                assert one["x"] >= frame["x"] - 1, (scene, one)
                assert one["x"] + one["width"] <= frame["x"] + frame["width"] + 1, (scene, one)
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert wide <= size[0], scene


def places(scene: solver.Scene, named: str) -> list[float]:
    """Where the solver has a node or a contact, in the directions of the first damper."""
    damper = scene.dampers[0]
    out, axial = np.array(damper.out), np.array(damper.axial)
    known = {node.name: node.at for node in scene.nodes}
    known |= {table["name"]: tuple(table["at"]) for table in damper.contacts()}
    at = np.array(known[named]) - np.array(damper.at)
    up = -axial if damper.shape == "shroud" else out
    return [float(np.cross(out, axial) @ at), float(up @ at)]


@pytest.mark.parametrize(
    ("scene", "values"),
    [
        ("platform-wedge", {}),
        ("platform-wedge", {"wedge.angle": 0.8, "wedge.width": 0.009}),
        ("platform-cylinder", {"cylinder.angle": 0.6}),
        ("shroud-3d", {"shroud.angle": 0.7}),
    ],
)
def test_what_is_drawn_in_place_is_where_the_solver_has_it(
    profile: Profile, site: Site, scene: str, values: dict[str, float]
) -> None:
    given = ",".join(f"{path}:{value}" for path, value in values.items())
    page = visit(profile[0], site, f"?scene={scene}&tab=response&harmonics=3&set={given}")
    shown(page, scene)
    known = solver.load_scene(scene).with_values(values)
    marks = page.evaluate(TITLES)
    pairs = []
    for mark in marks:
        names = re.findall(r"(?:^|; )([\w-]+(?:@next)?)(?=[: ])", mark["title"])
        assert names, mark
        pairs += [(places(known, name), mark["at"]) for name in names if "@" not in name]
    assert len(pairs) >= (3 if scene == "shroud-3d" else 6)
    # One scale for both directions: x = a + s X, y = b - s Y.
    rows = [row for (X, Y), _ in pairs for row in ([1.0, 0.0, X], [0.0, 1.0, -Y])]
    drawn = np.array([value for _, at in pairs for value in at])
    fit = np.linalg.lstsq(np.array(rows), drawn, rcond=None)[0]
    assert fit[2] > 1000.0  # px a metre
    assert np.abs(np.array(rows) @ fit - drawn).max() < 0.3


def test_faces_show_what_they_do_at_the_peak_and_follow_a_slider(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=platform-wedge&tab=response&harmonics=3")
    shown(page, "platform-wedge")
    expect(page.locator("#structure-figure .note")).to_have_count(0)
    told = {each["title"].split()[0]: each for each in page.evaluate(TITLES) if "spot" in each["state"]}
    asked = {"kind": "sweep", "scene": "platform-wedge", "harmonics": 3}
    swept = page.request.post(f"{site.url}/v1/previews", data=asked).json()
    at = swept["peak"]["at"]
    point = page.request.post(f"{site.url}/v1/previews", data={**asked, "kind": "point", "frequency_hz": at})
    contacts = {each["name"]: each for each in point.json()["period"]["contacts"]}
    assert told.keys() == contacts.keys()
    for name, each in contacts.items():
        slips = swept["states"][name] == "stick and slip"
        assert ("is-slip" in told[name]["state"]) is slips
        newtons = float(re.search(r", ([\d.]+) N", told[name]["title"])[1])  # type: ignore[index]
        assert newtons == pytest.approx(np.mean(each["load"][1:]), rel=0.01)
    assert any("is-slip" in each["state"] for each in told.values())
    assert page.locator("#structure-figure .face.hatched").count() > 0
    loads = page.locator("#structure-figure > svg g.load")
    assert loads.count() == 4
    assert page.locator("#structure-figure > svg g.force").count() == 2
    assert page.locator("#structure-figure text", has_text="60 N").count() == 2
    # Two rings where it is observed.
    assert page.locator("#structure-figure .node:not(.full)").count() == 1
    # A wedge under a hundredth of the force sticks.
    box = page.locator("#slide-excitation-amplitude").locator("xpath=..").locator("input[type=number]")
    box.fill("3")
    box.press("Tab")
    expect(page.locator("#structure-figure .face.hatched")).to_have_count(0)
    expect(page.locator("#structure-figure .spot.is-stick")).to_have_count(4)


def test_what_has_no_place_stays_a_chain_and_says_so(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    expect(page.locator("#structure-figure .note")).to_have_text("No [[nodes]]: not to scale.")
    assert page.locator("#structure-figure circle.mass").count() >= 2
    # Beside its settings; what is drawn in place stands below the curve.
    assert page.locator("#live + #structure").count() == 0
    page.select_option("#scene", "platform-wedge")
    expect(page.locator("#live + #structure")).to_have_count(1)
    page.select_option("#scene", "two-dof")
    expect(page.locator(".side #structure")).to_have_count(1)


def test_a_card_has_a_drawing_without_words(profile: Profile, site: Site) -> None:
    page = visit(profile[0], site, "?scene=two-dof&tab=response")
    found: dict[str, Any] = page.evaluate(SMALL, SHIPPED)
    for name, drawing in found.items():
        assert (drawing["parts"], drawing["words"], drawing["ids"]) == (1, 0, 0), name
        assert drawing["lines"] >= 3, name
        assert drawing["high"] > 50, name
    assert all(found[name]["faces"] > 0 for name in IN_PLACE)
    assert all(found[name]["plates"] > 0 for name in SHIPPED if name not in IN_PLACE)
