"""The scene editor: tables and TOML side by side, errors at the field and the line, scenes from nothing."""

from __future__ import annotations

import re
import tomllib
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from page_site import Site, Watch
from page_visits import downloaded, visit

expect = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed").expect
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

Profile = tuple["BrowserContext", Watch]
MINE = """# the blade of May
name = "blade-of-may"

[structure]
kind = "lumped"
masses = { blade = 0.05 } # kg
springs = [
  { name = "airfoil", between = ["blade", "ground"], k = 4.0e5, c = 2.0 }, # by test
]

[[contacts]]
name = "damper"
between = ["blade", "ground"]
kt = 5.0e5
N0 = 40.0 # guessed

[excitation]
dof = "blade"
amplitude = 5.0

[observe]
dof = "blade"
band = [300.0, 900.0]
"""


def open_text(page: Page, text: str) -> None:
    file: Any = {"name": "mine.toml", "mimeType": "application/toml", "buffer": text.encode()}
    page.set_input_files("#file", [file])


def row(page: Page, section: str, index: int) -> Any:
    return page.locator(f"[data-row='{section}:{index}']")


def text_of(page: Page) -> str:
    """The text of the editor, as it is saved."""
    return downloaded(page, "#editor button:has-text('Save as TOML')").decode()


def tables(page: Page) -> dict[str, Any]:
    """The tables in the text of the editor."""
    return tomllib.loads(text_of(page))


def retype(page: Page, line: str, text: str) -> None:
    """Type another text over a line."""
    page.locator(".cm-line").filter(has_text=line).click()
    for key in ("Home", "Shift+End"):
        page.keyboard.press(key)
    page.keyboard.type(text)


def marked(page: Page) -> Any:
    """What is marked as wrong in the text."""
    return page.locator(".cm-lintRange-error")


def settled(page: Page, words: str = "Nothing is wrong") -> None:
    expect(page.locator("#editor-form")).to_have_attribute("aria-busy", "false")
    expect(page.locator("#editor-status")).to_contain_text(words)


def serious(page: Page) -> list[str]:
    found = axe.Axe().run(page).response["violations"]
    return [
        f"{one['id']}: {node['target']} {node['failureSummary']}"
        for one in found
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"]
    ]


def test_what_is_wrong_is_said_at_its_field_and_its_line(profile: Profile, site: Site) -> None:
    """A file without `mu` is no dead end: tables and text repair each other, comments stay."""
    page = visit(profile[0], site)
    open_text(page, MINE)
    friction = page.locator("#field-contacts-0-mu")
    expect(friction).to_be_focused()
    expect(friction).to_have_attribute("aria-invalid", "true")
    expect(page.locator("#field-contacts-0-mu-message")).to_contain_text("`mu` is missing")
    expect(page.locator(".issue-list")).to_contain_text("contacts 1 › mu, line 11")
    expect(marked(page)).to_have_text(["[[contacts]]"])
    friction.fill("0.3")
    settled(page)
    wanted = MINE.replace("N0 = 40.0 # guessed\n", "N0 = 40.0 # guessed\nmu = 0.3\n")
    assert text_of(page) == wanted
    # The other way round, with a syntax error on the way.
    retype(page, "kt = 5.0e5", "kt = = 5.0e5")
    expect(page.locator("#editor [role=alert]")).to_contain_text("not valid TOML: Invalid value (at line 14")
    expect(marked(page)).to_have_text(["kt = = 5.0e5"])
    retype(page, "kt = = 5.0e5", "kt = 6.0e5")
    expect(page.locator("#field-contacts-0-kt")).to_have_value("600000")
    settled(page)
    page.locator("#field-contacts-0-between-1").fill("wing")
    expect(marked(page)).to_have_text(['between = ["blade", "wing"]'])
    expect(page.locator("#field-contacts-0-between-1-message")).to_contain_text("no DOF 'wing'")
    page.keyboard.press("Control+z")
    expect(page.locator("#field-contacts-0-between-1")).to_have_value("ground")
    settled(page)
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("blade-of-may")
    expect(page.locator("#editor")).to_be_hidden()
    expect(page.locator("#live-status")).to_contain_text("peak")
    stored = httpx.get(f"{site.url}/v1/scenes/blade-of-may").json()["scene"]
    assert (stored["contacts"][0]["kt"], stored["contacts"][0]["mu"]) == (6e5, 0.3)


def test_a_scene_is_drawn_up_from_nothing(profile: Profile, site: Site) -> None:
    """Two masses, a spring between them and a stop beside the damper, by keyboard and mouse."""
    page = visit(profile[0], site)
    page.click("#scene-menu")
    page.get_by_role("button", name="New scene…").press("Enter")
    expect(page.locator(".choice-card").first).to_be_focused()
    page.keyboard.press("Enter")
    settled(page)
    page.get_by_role("textbox", name="name of scene").fill("from-nothing")
    page.get_by_role("button", name="Add mass").press("Enter")
    name = row(page, "structure/masses", 1).locator("[data-key=name]")
    expect(name).to_be_focused()
    name.fill("disk")
    name.press("Tab")
    page.get_by_role("textbox", name="m of disk").fill("0.4")
    page.get_by_role("button", name="Duplicate blade").last.click()
    second = row(page, "structure/springs", 1)
    second.locator("[data-key=name]").fill("web")
    second.locator("[data-key=between]").first.fill("disk")
    row(page, "structure/springs", 0).locator("[data-key=between]").last.fill("disk")
    page.get_by_role("button", name="Add contact").click()
    third = row(page, "contacts", 1)
    expect(page.locator(".cm-content")).to_contain_text('name = "contact"')
    third.locator("[data-key=law]").select_option("gap")
    expect(third.locator("[data-key=gap]")).to_have_value("0.0001")
    expect(third.locator("[data-key=kt]")).to_have_count(0)
    settled(page)
    expect(page.locator(".cm-content")).to_contain_text('law = "gap"')
    page.locator("#editor-undo").click()
    expect(third.locator("[data-key=kt]")).to_have_value("5530000")
    page.get_by_role("button", name="Remove contact").click()
    settled(page)
    scene = tables(page)
    assert scene["structure"]["masses"] == {"blade": 0.15, "disk": 0.4}
    assert [spring["between"] for spring in scene["structure"]["springs"]] == [
        ["blade", "disk"],
        ["disk", "ground"],
    ]
    assert [contact["name"] for contact in scene["contacts"]] == ["damper"]
    assert serious(page) == []
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value("from-nothing")
    expect(page.locator("#live-status")).to_contain_text("peak")


@pytest.mark.long
def test_keys_are_completed_and_the_text_is_left_by_keyboard(profile: Profile, site: Site) -> None:
    """Keys of the section one types in, words of a choice; Escape closes the list, Tab goes on."""
    page = visit(profile[0], site)
    open_text(page, MINE)
    settled(page, "wrong")
    content = page.locator(".cm-content")
    content.get_by_text("N0 = 40.0").click()
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    page.keyboard.type("m")
    options = page.locator(".cm-tooltip-autocomplete li")
    expect(options.first).to_contain_text("mu")
    page.wait_for_timeout(200)  # a list that has just opened takes no key, lest one be meant for the text
    page.keyboard.press("Enter")
    page.keyboard.type("0.3")
    page.keyboard.press("Enter")
    page.keyboard.type("law = ")
    page.keyboard.press("Control+Space")
    expect(options.filter(has_text="coulomb-2d")).to_have_count(1)
    assert serious(page) == []
    page.keyboard.press("Escape")
    expect(options).to_have_count(0)
    expect(content).to_be_focused()
    page.keyboard.type('"coulomb"')
    settled(page)
    assert (tables(page)["contacts"][0]["mu"], tables(page)["contacts"][0]["law"]) == (0.3, "coulomb")
    content.focus()
    page.keyboard.press("Escape")
    page.keyboard.press("Shift+Tab")
    expect(content).not_to_be_focused()
    page.keyboard.press("Tab")
    expect(content).to_be_focused()
    page.keyboard.press("Tab")
    expect(content).not_to_be_focused()


@pytest.mark.long
@pytest.mark.parametrize(
    ("title", "answers", "values"),
    [
        ("Damper under the platforms", {"Frequency": "420", "Number of blades": "36"}, {"sectors": 36}),
        ("Shrouds that touch", {"Engine order": "7"}, {"sectors": 24}),
        ("Split ring under the rim", {"Damping ratio": "0.002"}, {"sectors": 24}),
        ("Blade with a damper to the ground", {"Modal mass": "0.5"}, {"kind": "lumped"}),
    ],
)
def test_a_template_asks_and_makes_a_scene_that_answers(
    profile: Profile, site: Site, title: str, answers: dict[str, str], values: dict[str, Any]
) -> None:
    context, watch = profile
    watch.allowed = ("status of 422",)
    page = visit(context, site)
    page.click("#scene-menu")
    page.click("#new-scene")
    page.get_by_role("button", name=title).click()
    page.get_by_label("Friction coefficient").fill("-1")
    page.get_by_role("button", name="Make the scene").click()
    expect(page.locator("#wizard-mu")).to_be_focused()
    expect(page.locator(".field:has(#wizard-mu) .message")).to_contain_text(
        "must be a number above 0 to 2, got -1"
    )
    page.get_by_label("Friction coefficient").fill("0.25")
    for label, text in answers.items():
        page.locator("#wizard-form").get_by_label(label).fill(text)
    assert serious(page) == []
    page.get_by_role("button", name="Make the scene").click()
    settled(page)
    assert values.items() <= tables(page)["structure"].items()
    assert serious(page) == []
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#editor")).to_be_hidden()
    expect(page.locator("#live-status")).to_contain_text(re.compile("peak"))


@pytest.mark.long
@pytest.mark.parametrize("scene", ["platform-wedge", "shroud-3d", "fe-disk", "bladed-disk"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_shipped_scene_can_be_edited(profile: Profile, site: Site, scene: str, scheme: str) -> None:
    page = visit(profile[0], site, f"?scene={scene}")
    page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
    page.click("#scene-menu")
    page.click("#edit-scene")
    settled(page)
    for contact in page.locator("#editor-tables [aria-label^='N0 of']").all():
        contact.fill("77")
    settled(page)
    page.wait_for_timeout(500)
    made = tables(page)
    assert {each["N0"] for each in [*made.get("contacts", []), *made.get("dampers", [])] if "N0" in each} <= {
        77
    }
    assert serious(page) == []
    for width in (640, 320):
        page.set_viewport_size({"width": width, "height": 700})
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert wide <= 0
    page.get_by_role("button", name="Use this scene").click()
    expect(page.locator("#scene")).to_have_value(f"{scene}-2")
