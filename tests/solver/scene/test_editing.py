"""Changed TOML holds exactly what is wanted and keeps the words of everything else."""

import json
import random
import tomllib
from copy import deepcopy
from importlib import resources
from typing import Any

import pytest

from solver.scene import editing
from solver.scene.editing import edited, place_at, places

SHIPPED = {
    file.name.removesuffix(".toml"): file.read_text("utf-8")
    for file in (resources.files("solver.scene") / "shipped").iterdir()
    if file.name.endswith(".toml")
}
ODD = '''# top
title = "a # no comment" # but this is one
when = 1979-05-27 07:32:00
"odd key" = 'it''s' # two words, joined by nobody
[a.b]
c.d = 1
c.e = [ 1, 2, # two
  # above three
  3 ]
text = """one "quoted"
[not.a.header]
"""
raw = \'\'\'x = 1 # \'\'\'
[a]
z = { x = 1, y = { w = [] } } # inline
# about the list
[[a.list]]
n = 1
[[a.list.deep]]
k = "]"

[[a.list]] # second
n = 0x1F
'''.replace("'it''s'", '"it\'s"')


def read(text: str) -> dict[str, Any]:
    """The tables of a text as JSON has them: dates are words."""
    found: dict[str, Any] = json.loads(json.dumps(tomllib.loads(text), default=str))
    return found


def changed(text: str, wanted: dict[str, Any]) -> str:
    """The text changed, which must hold what is wanted."""
    found = edited(text, wanted, read)
    assert read(found) == wanted
    return found


def lines_lost(before: str, after: str) -> list[str]:
    """The lines of a text that are not in another."""
    kept = after.splitlines()
    return [line for line in before.splitlines() if line not in kept]


@pytest.mark.parametrize("name", SHIPPED)
def test_an_unchanged_scene_keeps_every_letter(name: str) -> None:
    assert edited(SHIPPED[name], tomllib.loads(SHIPPED[name])) == SHIPPED[name]


def test_a_value_changes_its_line_alone() -> None:
    scene = tomllib.loads(SHIPPED["bladed-disk"])
    scene["contacts"][0]["N0"] = 150
    scene["structure"]["springs"][1]["k"] = 8e6
    scene["structure"]["masses"]["disk"] = 0.13
    text = changed(SHIPPED["bladed-disk"], scene)
    assert lines_lost(SHIPPED["bladed-disk"], text) == [
        "masses = { tip = 0.02, middle = 0.03, root = 0.04, disk = 0.12 } # kg",
        '  { name = "middle_root", between = ["middle", "root"], k = 8.26e6 },',
        "N0 = 200.0 # N",
    ]
    assert "N0 = 150.0 # N\n" in text, "what was a float is written as one"


def test_rows_are_added_taken_out_and_doubled_without_loss_of_others() -> None:
    text = SHIPPED["bladed-disk"]
    scene = tomllib.loads(text)
    springs = scene["structure"]["springs"]
    springs.insert(1, deepcopy(springs[0]) | {"name": "twin"})
    del springs[3]
    scene["contacts"].insert(1, deepcopy(scene["contacts"][0]) | {"name": "second"})
    del scene["contacts"][2]
    scene["structure"]["axis"] = [0.0, 0.0, 1.0]
    scene["loads"] = [{"name": "pull", "dof": "tip", "force": 5.0}]
    del scene["contacts"][0]["N1_ratio"]
    found = changed(text, scene)
    gone = lines_lost(text, found)
    assert '  { name = "root_disk", between = ["root", "disk"], k = 1.71e6 },' in gone
    assert [line for line in gone if "#" in line] == []
    assert found.count("[[contacts]]") == 2


def test_every_row_may_go_and_come_back() -> None:
    scene = tomllib.loads(SHIPPED["two-dof"])
    bare = deepcopy(scene)
    bare["contacts"] = []
    bare["structure"]["springs"] = []
    text = changed(SHIPPED["two-dof"], bare)
    assert "# Two masses in a chain" in text
    again = changed(text, scene)
    assert "{ m1 = 1.0, m2 = 1.0 } # kg" in again
    assert "[[contacts]]" in again


def test_places_tell_the_lines_of_pointers() -> None:
    text = SHIPPED["platform-wedge"]
    line = {
        pointer: text.count("\n", 0, place_at(places(text), pointer).start) + 1
        for pointer in (
            "/structure/springs/1/k",
            "/dampers/0/mu",
            "/excitation/1",
            "/observe/band/1",
            "/nodes/9",
        )
    }
    told = text.splitlines()
    assert 'name = "blade_b"' in told[line["/structure/springs/1/k"] - 1]
    assert told[line["/dampers/0/mu"] - 1] == "mu = 0.3"
    assert told[line["/excitation/1"] - 1 : line["/excitation/1"] + 1] == ["[[excitation]]", 'dof = "bx"']
    assert told[line["/observe/band/1"] - 1].startswith("band")
    assert told[line["/nodes/9"] - 1] == "[[nodes]]", "what is not there is told where it would belong"


def test_odd_ways_to_write_are_read_and_kept() -> None:
    held = read(ODD)
    assert edited(ODD, held, read) == ODD
    held["a"]["b"]["c"]["e"] = [1, 3, 4]
    held["a"]["z"]["y"]["w"] = [True]
    held["a"]["list"][1]["n"] = 32
    held["odd key"] = "new"
    found = changed(ODD, held)
    assert {'title = "a # no comment" # but this is one', "  # above three", "# about the list"} <= set(
        found.splitlines()
    )
    assert "z = { x = 1, y = { w = [true] } } # inline" in found


def leaves(item: Any) -> list[tuple[Any, Any]]:
    """Every container with a key of it."""
    keys = list(item) if isinstance(item, dict) else range(len(item)) if isinstance(item, list) else []
    return [(item, key) for key in keys] + [leaf for key in keys for leaf in leaves(item[key])]


@pytest.mark.parametrize(("name", "most"), [*((name, 4) for name in SHIPPED), ("odd", 60)])
def test_any_change_gives_what_is_wanted(name: str, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is changed; the whole is seldom written anew."""
    anew: list[str] = []
    monkeypatch.setattr(editing, "_leading_comments", lambda text: (anew.append(text), ())[1])
    text = ODD if name == "odd" else SHIPPED[name]
    chance = random.Random(name)
    for _ in range(60):
        wanted = read(text)
        owner, key = chance.choice(leaves(wanted))
        action = chance.choice(("set", "drop", "double", "add"))
        if action == "drop":
            del owner[key]
        elif action == "double" and isinstance(owner, list):
            owner.insert(key, deepcopy(owner[key]))
        elif action == "add" and isinstance(owner, dict):
            owner["new"] = chance.choice([1, [1.5], {"x": "y"}, [{"p": 1}], "text"])
        else:
            owner[key] = chance.choice([7, 2.5, "word", True, [1, 2], {"q": 1}])
        changed(text, wanted)
    assert len(anew) <= most


def test_a_list_in_one_line_breaks_where_it_grows_long() -> None:
    row = '{ name = "a", between = ["x", "ground"], k = 4.0e5, c = 2.0 }'
    text = f"springs = [{row}] # by test\n"
    scene = read(text)
    scene["springs"].append({**scene["springs"][0], "name": "b"})
    assert changed(text, scene).startswith(f'springs = [\n  {row},\n  {{ name = "b"')
    scene["springs"] = [{**scene["springs"][0], "name": "a-rather-long-name-for-a-spring-in-one-line"}]
    assert "\n" not in changed(text, scene).strip()


def test_a_text_with_other_line_ends_or_none_is_changed() -> None:
    assert edited("a = 1\r\nb = 2", {"a": 1, "b": 3}) == "a = 1\nb = 3\n"
    assert edited("", {"name": "x", "observe": {"dof": "a"}}) == 'name = "x"\n\n[observe]\ndof = "a"\n'
    assert edited("# mine\n", {"a": {"b": 1}}).startswith("# mine\n")
    assert edited("a = 1\n", {"a": True}) == "a = true\n"
