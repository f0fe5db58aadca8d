"""Scenes: what they accept, how they report what is wrong, parameter paths."""

import copy
import json
import math
import pickle
from pathlib import Path
from typing import Any

import pytest
from each import each

from solver.errors import SceneError, SettingError
from solver.scene.scene import Contact, Mass, Scene, load_scene, parse_end, shipped_scenes

Raw = dict[str, Any]


def lumped(**changes: Any) -> Raw:
    raw: Raw = {
        "name": "pair",
        "structure": {
            "kind": "lumped",
            "masses": {"a": 1.0, "b": {"m": 2.0, "name": "mb"}},
            "springs": [
                {"between": ["ground", "a"], "k": 10.0, "name": "k1"},
                {"between": ["a", "b"], "k": 5},
            ],
            "dampers": [{"between": ["b", "ground"], "c": 0.1, "name": "d1"}],
        },
        "contacts": [
            {"name": "left", "between": ["b", "ground"], "kt": 3.0, "mu": 0.3, "N0": 4.0, "group": "both"},
            {
                "name": "right",
                "between": ["a", "b"],
                "kt": 3.0,
                "mu": 0.3,
                "N0": 8.0,
                "N1": 2.0,
                "group": "both",
            },
        ],
        "excitation": [
            {"dof": "a", "amplitude": 2.0},
            {"dof": "b", "amplitude": 1.0, "harmonic": 3, "phase": 0.5},
        ],
        "observe": {"dof": "b", "band": [0.1, 1.0]},
    }
    return {**raw, **changes}


def put(raw: Raw, path: str, value: Any) -> Raw:
    """A copy with the value at a slash-separated place."""
    raw = copy.deepcopy(raw)
    *way, last = [int(step) if step.isdigit() else step for step in path.split("/")]
    place: Any = raw
    for step in way:
        place = place[step]
    place[last] = value
    return raw


def issues(raw: object) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(raw)  # type: ignore[arg-type]
    return {issue.pointer: issue.said() for issue in caught.value.issues}


def test_shipped_scenes_have_the_published_values():
    assert shipped_scenes() == (
        "bladed-disk", "fe-disk", "platform-cylinder", "platform-wedge", "shroud-3d", "two-dof",
    )  # fmt: skip
    scene = load_scene("two-dof")
    assert [spring.k for spring in scene.structure.springs] == [(4 * math.pi) ** 2, (2 * math.pi) ** 2]
    damper = scene.contacts[0]
    assert (damper.kt, damper.mu, damper.N0, damper.N1_value) == (30.0, 0.3, 100.0, 30.0)
    disk = load_scene("bladed-disk")
    assert disk.engine_order == 1
    assert disk.structure.dofs == ("tip", "middle", "root", "disk")
    assert [contact.N1_value for contact in disk.contacts] == [60.0, 0.0]


@pytest.mark.parametrize("name", shipped_scenes())
def test_round_trip_is_exact(name: str, tmp_path: Path):
    scene = load_scene(name).with_values({"excitation.amplitude": 1.0 / 3.0})
    text = json.dumps(scene.to_dict(), allow_nan=False)
    assert Scene.from_dict(json.loads(text)) == scene
    assert pickle.loads(pickle.dumps(scene)) == scene
    file = tmp_path / "scene.json"
    file.write_text(text)
    assert load_scene(file) == scene == load_scene(str(file))


def test_named_masses_and_several_forces_round_trip():
    scene = Scene.from_dict(lumped())
    again = scene.to_dict()
    assert again["structure"]["masses"] == {"a": 1.0, "b": {"m": 2.0, "name": "mb"}}  # type: ignore[index]
    assert Scene.from_dict(again) == scene
    assert scene.structure.masses[1] == Mass(dof="b", m=2.0, name="mb")


def test_a_scene_is_frozen_and_built_from_parts():
    scene = load_scene("two-dof")
    with pytest.raises(ValueError, match="frozen"):
        scene.name = "other"  # type: ignore[misc]
    parts = {key: getattr(scene, key) for key in Scene.model_fields}
    assert Scene(**parts) == scene == Scene.model_validate(scene)
    assert "masses" in json.dumps(Scene.model_json_schema())


WRONG = [
    ("name", "a b", "/name", "letters, digits"),
    ("name", 3, "/name", "must be a text, got 3"),
    ("nam", 3, "/nam", "did you mean `name`"),
    ("structure", 3, "/structure", "must be a table"),
    ("structure/kind", "mesh", "/structure/kind", "one of lumped, cyclic, matrices, got 'mesh'"),
    ("structure/sectors", 8, "/structure/sectors", "not a key of a lumped structure"),
    ("structure/masses", {}, "/structure/masses", "must not be empty"),
    ("structure/masses", [1.0], "/structure/masses", "must be a table"),
    ("structure/masses/a", -1.0, "/structure/masses/a", "`a` must be > 0 kg, got -1.0"),
    ("structure/masses/a", 0.0, "/structure/masses/a", "> 0"),
    ("structure/masses/a", {"m": 1.0, "nam": "x"}, "/structure/masses/a/nam", "did you mean `name`"),
    ("structure/masses/ground", 1.0, "/structure/masses/ground", "reserved"),
    ("structure/masses/c d", 1.0, "/structure/masses/c d", "letters, digits"),
    ("structure/springs/0/k", -1.0, "/structure/springs/0/k", ">= 0 N/m, got -1.0"),
    ("structure/springs/0/k", "5", "/structure/springs/0/k", "must be a number without quotes, got '5'"),
    ("structure/springs/0/k", True, "/structure/springs/0/k", "must be a number"),
    ("structure/springs/0/k", 1e16, "/structure/springs/0/k", "<= 1e15 N/m"),
    ("structure/springs/0/k", 10**400, "/structure/springs/0/k", "`k`"),
    ("structure/springs/0/c", math.nan, "/structure/springs/0/c", "finite"),
    ("structure/springs/0/between", ["a"], "/structure/springs/0/between", "too few entries"),
    ("structure/springs/0/between", ["a", "b", "a"], "/structure/springs/0/between", "2 entries at most"),
    ("structure/springs/0/between", ["a", "a"], "/structure/springs/0/between", "different ends"),
    ("structure/springs/0/between", ["a", "bb"], "/structure/springs/0/between/1", "did you mean `b`"),
    ("structure/springs/0/between", ["a", "b@next"], "/structure/springs/0/between/1", "cyclic"),
    ("structure/springs/0/name", "d1", "/structure/dampers/0/name", "taken"),
    ("structure/dampers/0/c", -1, "/structure/dampers/0/c", ">= 0 N s/m, got -1"),
    ("structure/dampers/0/name", "mb", "/structure/dampers/0/name", "taken"),
    ("contacts", {}, "/contacts", "must be a list"),
    ("contacts/0", 3, "/contacts/0", "`contacts[0]` must be a table, got 3"),
    ("contacts/0/mu", -0.1, "/contacts/0/mu", "`mu` must be >= 0, got -0.1"),
    ("contacts/0/kt", 0, "/contacts/0/kt", "`kt` must be > 0 N/m, got 0"),
    ("contacts/0/N0", math.inf, "/contacts/0/N0", "finite"),
    ("contacts/0/NO", 1.0, "/contacts/0/NO", "not a key of a contact"),
    ("contacts/0/name", "right", "/contacts/1/name", "taken"),
    ("contacts/0/name", "structure", "/contacts/0/name", "reserved"),
    ("contacts/0/group", "right", "/contacts/0/group", "also the name of a contact"),
    ("contacts/1/N1_ratio", 0.3, "/contacts/1", "exclude each other"),
    ("excitation", [], "/excitation", "at least one force"),
    ("excitation", "a", "/excitation", "must be a list"),
    ("excitation", {"dof": "aa", "amplitude": 1.0}, "/excitation/dof", "did you mean `a`"),
    ("excitation/0/dof", "ground", "/excitation/0/dof", "no DOF 'ground'"),
    ("excitation/0/harmonic", 1.5, "/excitation/0/harmonic", "whole number"),
    ("excitation/1/harmonic", 0, "/excitation/1", "static load"),
    ("excitation/0/engine_order", 1, "/excitation/0/engine_order", "cyclic"),
    ("observe/dof", "c", "/observe/dof", "known: a, b"),
    ("observe/band", [1.0, 0.1], "/observe/band", "low < high, got [1.0, 0.1]"),
    ("observe/band", [1.0, 1.0], "/observe/band", "low < high"),
    ("observe/band", [0.0, 1.0], "/observe/band/0", "> 0"),
]


@each(("place", "value", "pointer", "says"), WRONG)
def test_each_mistake_is_named(place: str, value: object, pointer: str, says: str):
    found = issues(put(lumped(), place, value))
    assert pointer in found
    assert says in found[pointer]


WRONG_CYCLIC = [
    ("structure/sectors", 0, "/structure/sectors", ">= 1, got 0"),
    ("structure/sectors", 8.5, "/structure/sectors", "whole number"),
    ("structure/masses/tip@1", 1.0, "/structure/masses/tip@1", "no '@'"),
    ("contacts/0/name", "shroud@1", "/contacts/0/name", "no '@'"),
    ("contacts/0/between", ["tip@next", "root@next"], "/contacts/0/between", "one end in this sector"),
    ("contacts/0/between", ["tip", "tap@next"], "/contacts/0/between/1", "did you mean `tip`"),
    ("excitation/engine_order", -1, "/excitation/engine_order", ">= 0, got -1"),
]


@pytest.mark.parametrize(("place", "value", "pointer", "says"), WRONG_CYCLIC)
def test_each_mistake_in_a_cyclic_scene_is_named(place: str, value: object, pointer: str, says: str):
    found = issues(put(load_scene("bladed-disk").to_dict(), place, value))
    assert says in found[pointer]


def test_engine_orders_must_agree():
    raw = load_scene("bladed-disk").to_dict()
    force = {"dof": "tip", "amplitude": 1.0}
    assert Scene.from_dict({**raw, "excitation": [force, {**force, "engine_order": 2}]}).engine_order == 2
    found = issues({**raw, "excitation": [{**force, "engine_order": 1}, {**force, "engine_order": 2}]})
    assert "got 2 after 1" in found["/excitation/1/engine_order"]


def test_all_mistakes_are_listed_at_once():
    raw = put(put(put(lumped(), "contacts/0/mu", -1.0), "observe/dof", "x"), "structure/masses/a", "heavy")
    found = issues(raw)
    assert set(found) == {"/contacts/0/mu", "/observe/dof", "/structure/masses/a"}
    with pytest.raises(SceneError, match=r"`mu` must be >= 0, got -1\.0.*no DOF 'x'"):
        Scene.from_dict(raw)


@pytest.mark.parametrize("kept", [[], [1], "x", {"parts": 3}, {"diameters": [0], "M": [], "K": {}}])
def test_what_is_no_table_of_nodal_diameters_is_refused_by_name(kept: object):
    raw: Raw = load_scene("fe-disk").to_dict()
    raw["structure"] |= {"diameters": kept, "mistuning": {"of": ["K"], "values": [1.0]}}
    with pytest.raises(SceneError, match=r"`diameters` must be|`M` must have a table"):
        Scene.from_dict(raw)


def test_a_shape_whose_body_is_none_is_refused_by_its_name():
    raw: Raw = load_scene("platform-cylinder").to_dict()
    raw["dampers"][0]["inertia"] = 3.0
    with pytest.raises(SceneError, match=r"`inertia` of body .* must be three moments"):
        Scene.from_dict(raw)


def test_missing_keys_are_listed():
    assert set(issues({})) == {"/name", "/structure", "/excitation", "/observe"}
    raw = lumped(contacts=[{}])
    assert set(issues(raw)) == {f"/contacts/0/{key}" for key in ("name", "between", "kt", "mu", "N0")}
    assert "a contact needs it" in issues(raw)["/contacts/0/kt"]


@pytest.mark.parametrize("raw", [[], 3, None, "two-dof"])
def test_a_scene_is_a_table(raw: object):
    assert "must be a table" in issues(raw)[""]


def test_hostile_values_are_only_wrong_values():
    deep: list[object] = []
    for _ in range(5000):
        deep = [deep]
    for bad in (deep, 10**5000, "x" * 10**6, {str(i): i for i in range(1000)}):
        assert all(len(message) < 400 for message in issues(put(lumped(), "contacts/0/mu", bad)).values())
        assert "/contacts/0/between" in issues(put(lumped(), "contacts/0/between", bad))
        assert issues(put(lumped(), "name", bad))


def test_files_that_cannot_be_read(tmp_path: Path):
    def message(name: object) -> str:
        with pytest.raises(SceneError) as caught:
            load_scene(name)
        return str(caught.value)

    def file(name: str, content: bytes) -> Path:
        (tmp_path / name).write_bytes(content)
        return tmp_path / name

    assert "did you mean 'two-dof'" in message("two-dofs")
    assert "must be a name or a path, got 3" in message(3)
    assert "neither a shipped scene" in message("a\0b")
    assert "it is a folder" in message(tmp_path)
    assert "line 2" in message(file("a.toml", b'name = "x"\nstructure = 1 2\n'))
    assert "line 1 column 2" in message(file("a.json", b"{x}"))
    assert "`name` is given twice" in message(file("b.json", b'{"name": 1, "name": 2}'))
    assert "cannot be read" in message(file("e.json", b'{"a": ' + b"9" * 5000 + b"}"))
    assert "one table, got list" in message(file("c.json", b"[]"))
    assert "nested too deeply" in message(file("d.json", b"[" * 200_000))
    assert "not UTF-8" in message(file("b.toml", b"name = '\xff'"))
    assert "measurements are for `stickslip identify" in message(file("a.txt", b""))
    assert "must end in .toml or .json, got '.yaml'" in message(file("a.yaml", b""))


def test_ends():
    assert parse_end("ground") == (None, False)
    assert parse_end("tip") == ("tip", False)
    assert parse_end("tip@next") == ("tip", True)
    assert parse_end("tip@3") == ("tip@3", False)


def test_every_path_reads_back_what_was_set():
    for scene in (Scene.from_dict(lumped()), *map(load_scene, shipped_scenes())):
        for path in scene.parameter_paths():
            here = scene.value(path)
            new = here + 1.0 if path.endswith(".points") else 1.25 * here + 0.1
            changed = scene.with_values({path: new})
            assert changed.value(path) == new, path
            assert Scene.from_dict(changed.to_dict()) == changed
            scene.check_path(path)
        scene.check_path("frequency")


def test_n1_follows_n0_only_when_tied():
    scene = load_scene("two-dof")
    assert scene.with_values({"damper.N0": 200.0}).value("damper.N1") == 60.0
    untied = scene.with_values({"damper.N1": 50.0, "damper.N0": 200.0})
    assert (untied.value("damper.N1"), untied.value("damper.N1_ratio")) == (50.0, 0.25)
    assert untied.contacts[0].N1_ratio is None
    tied = untied.with_values({"damper.N1_ratio": 0.5, "damper.N0": 10.0})
    assert (tied.value("damper.N1"), tied.contacts[0].N1) == (5.0, None)
    assert scene.with_values({"damper.N0": 0.0, "damper.N1": 0.0}).value("damper.N1_ratio") == 0.0
    with pytest.raises(SettingError, match="undefined with N0 = 0"):
        untied.with_values({"damper.N0": 0.0}).value("damper.N1_ratio")


@pytest.mark.parametrize("paths", [("damper.N1", "damper.N1_ratio"), ("damper.N1_ratio", "damper.N1")])
def test_an_amplitude_is_not_set_in_two_ways(paths: tuple[str, str]):
    wanted = f"`{paths[0]}` cannot be set together with `{paths[1]}`.*got 0.5"
    with pytest.raises(SettingError, match=wanted):
        load_scene("two-dof").with_values(dict(zip(paths, (0.5, 0.7), strict=True)))


def test_nor_by_its_group():
    scene = Scene.from_dict(lumped())
    with pytest.raises(SettingError, match=r"`both.N1` cannot be set together with `right.N1_ratio`"):
        scene.with_values({"right.N1_ratio": 0.5, "both.N1": 0.7})
    assert scene.with_values({"left.N1_ratio": 0.5, "right.N1": 0.7}).value("right.N1") == 0.7


@pytest.mark.parametrize("order", [1, -1])
def test_a_group_is_not_set_beside_one_of_its_members(order: int):
    """The last one counted."""
    values = dict.fromkeys(("both.N0", "right.N0")[::order], 2.0)
    with pytest.raises(SettingError, match=r"`both.N0` cannot be set together with `right.N0`.*got 2.0"):
        Scene.from_dict(lumped()).with_values(values)


def test_a_contact_without_n1_has_a_constant_load():
    contact = Contact(name="c", between=("a", "b"), kt=1.0, mu=0.3, N0=1.0)
    assert contact.N1_value == 0.0


def test_a_group_sets_its_members():
    scene = Scene.from_dict(lumped()).with_values({"both.N0": 7.0, "right.mu": 0.5})
    assert [contact.N0 for contact in scene.contacts] == [7.0, 7.0]
    assert [contact.mu for contact in scene.contacts] == [0.3, 0.5]
    assert scene.value("both.mu") == 0.3


def test_excitation_is_scaled_and_shifted_as_a_whole():
    scene = Scene.from_dict(lumped())
    changed = scene.with_values({"excitation.amplitude": 6.0, "excitation.phase": 0.25})
    assert [force.amplitude for force in changed.excitation] == [6.0, 3.0]
    assert [force.phase for force in changed.excitation] == [0.25, 0.75]
    silent = Scene.from_dict(put(lumped(), "excitation/0/amplitude", 0.0))
    with pytest.raises(SettingError, match="the first one is 0"):
        silent.with_values({"excitation.amplitude": 1.0})


def test_static_loads_have_no_phase_to_shift():
    raw = put(lumped(), "excitation/0/harmonic", 0)
    changed = Scene.from_dict(raw).with_values({"excitation.phase": 1.5})
    assert [force.phase for force in changed.excitation] == [0.0, 1.5]
    only = Scene.from_dict({**raw, "excitation": raw["excitation"][0]})
    assert only.value("excitation.phase") == 0.0
    with pytest.raises(SettingError, match="static"):
        only.with_values({"excitation.phase": 1.0})


def test_structural_values():
    scene = Scene.from_dict(lumped()).with_values(
        {"structure.k1": 3.0, "structure.d1": 4.0, "structure.mb": 5.0}
    )
    structure = scene.structure
    assert (structure.springs[0].k, structure.dampers[0].c, structure.masses[1].m) == (3.0, 4.0, 5.0)


@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("dampr.N0", "did you mean `damper.N0`"),
        ("damper.N2", "must be one of"),
        ("structure.k9", "did you mean `structure.k"),
        ("N0", "must be one of"),
        (3, "got 3"),
        ("frequency", "belongs to the run"),
    ],
)
def test_unknown_paths(path: Any, says: str):
    scene = load_scene("two-dof")
    with pytest.raises(SettingError, match=says) as caught:
        scene.with_values({path: 1.0})
    assert caught.value.name == "path"
    with pytest.raises(SettingError, match=says):
        scene.value(path)
    if path != "frequency":
        with pytest.raises(SettingError, match=says):
            scene.check_path(path)


@each(
    ("path", "value", "says"),
    [
        ("damper.N0", -1.0, r"`damper.N0` must be a number >= 0 .*got -1.0"),
        ("damper.mu", -0.1, ">= 0 and <= 100, got -0.1"),
        ("damper.kt", 0.0, "> 0"),
        ("damper.N1", 1e16, "from -1e15 to 1e15"),
        ("damper.N1_ratio", "0.3", "finite number"),
        ("damper.N1_phase", math.nan, "finite number"),
        ("damper.N0", None, "must be a number"),
        ("damper.N0", True, "finite number"),
        ("structure.k1", -1.0, r">= 0 .*\[N/m\], got -1.0"),
        ("excitation.amplitude", math.inf, "finite number"),
        ("excitation.amplitude", 1e16, "from -1e15"),
        ("excitation.phase", 1e5, "from -1e4"),
    ],
)
def test_values_out_of_range(path: str, value: Any, says: str):
    with pytest.raises(SettingError, match=says) as caught:
        load_scene("two-dof").with_values({path: value})
    assert caught.value.name == path


def test_changed_values_share_what_did_not_change():
    """What makes a change cheap: nothing else is read or checked again."""
    scene = load_scene("bladed-disk")
    changed = scene.with_values({"shroud.N0": 150.0})
    assert changed.structure is scene.structure
    assert changed.excitation is scene.excitation
    assert changed != scene
