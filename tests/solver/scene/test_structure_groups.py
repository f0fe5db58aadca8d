"""Groups of masses, springs and dashpots: one value for many parts, each with its factor."""

import copy
from typing import Any

import numpy as np
import pytest
from mistuned_cases import VALUES, disk, with_mistuning
from scene_cases import two_dof

from solver import Scene, SceneError, SettingError, annulus, load_scene, mistuned, solve, sweep
from solver.balance.balance import resolve
from solver.linear.assembly import linear_model, structure_derivative


def grouped() -> Scene:
    """The two springs of the chain in one group, the second a quarter of the first."""
    raw = copy.deepcopy(two_dof().to_dict())
    first, second = raw["structure"]["springs"]  # type: ignore[index]
    first |= {"group": "both", "k": 160.0}
    second |= {"group": "both", "factor": 0.25, "k": 40.0}
    return Scene.from_dict(raw)


def test_a_group_sets_its_members_by_their_factors():
    scene = grouped()
    assert scene.value("structure.both") == 160.0
    assert "structure.both" in scene.parameter_paths()
    moved = scene.with_values({"structure.both": 200.0})
    assert [spring.k for spring in moved.structure.springs] == [200.0, 50.0]
    alone = moved.with_values({"structure.k2": 44.0})
    assert [spring.k for spring in alone.structure.springs] == [200.0, 44.0]
    assert Scene.from_dict(moved.to_dict()) == moved
    with pytest.raises(SettingError, match=r"`structure.both` cannot be set together with `structure.k2`"):
        scene.with_values({"structure.k2": 44.0, "structure.both": 200.0})


@pytest.mark.parametrize(
    ("scene", "name"),
    [
        (grouped(), "both"),
        *[
            (mistuned(disk(), of=["root", "drag", "blade_mass"], values=VALUES), name)
            for name in ("root", "drag", "blade_mass", "ring", "root@2")
        ],
    ],
)
def test_derivatives_by_a_group(scene: Scene, name: str):
    path = f"structure.{name}"
    found = structure_derivative(scene, path)
    here = scene.value(path)
    step = 0.25 * here
    up, down = (linear_model(scene.with_values({path: here + sign * step})) for sign in (1, -1))
    for derivative, matrix in ((found.M, "M"), (found.C0, "C0"), (found.K0, "K0")):
        expected = (getattr(up, matrix) - getattr(down, matrix)) / (2.0 * step)
        np.testing.assert_allclose(derivative, expected, atol=1e-9)
    assert found.affine
    assert any(np.abs(d).max() > 0.5 for d in (found.M, found.C0, found.K0))


@pytest.mark.parametrize(
    ("scene", "units"),
    [
        (grouped(), {"both": "N/m", "k1": "N/m"}),
        (disk(), {"root": "N/m", "drag": "N s/m", "blade_mass": "kg"}),
        (load_scene("fe-disk"), {"stiffness_proportional_damping": "s", "mass_proportional_damping": "1/s"}),
    ],
)
def test_parts_have_the_units_of_their_values(scene: Scene, units: dict[str, str]):
    assert {name: resolve(scene, f"structure.{name}").unit for name in units} == units


def test_paths_set_before_or_after_writing_out():
    scene = with_mistuning(disk(), of=["root", "blade_mass"], values=VALUES)
    values = {"structure.root": 450.0, "structure.blade_mass": 1.25, "structure.ring": 200.0}
    before, after = annulus(scene.with_values(values)), annulus(scene).with_values(values)
    for one, other in zip(before.structure.springs, after.structure.springs, strict=True):
        assert one.k == pytest.approx(other.k, rel=1e-15)
    for light, heavy in zip(before.structure.masses, after.structure.masses, strict=True):
        assert light.m == pytest.approx(heavy.m, rel=1e-15)
    assert annulus(scene).value("structure.root") == pytest.approx(400.0, rel=1e-15)


@pytest.mark.parametrize(
    ("path", "start", "stop"), [("structure.root", 380.0, 430.0), ("structure.blade_mass", 1.1, 0.9)]
)
def test_continuation_of_a_mistuned_disk_in_its_structure(path: str, start: float, stop: float):
    scene = with_mistuning(disk(), of=["root", "blade_mass"], values=VALUES)
    branch = sweep(scene, path, start, stop, frequency_hz=3.4, harmonics=3)
    assert branch.reached
    for i in (0, len(branch.values) // 2, -1):
        moved = scene.with_values({path: float(branch.values[i])})
        point = solve(moved, frequency_hz=3.4, harmonics=3)
        assert branch.half_peak_to_peak[i] == pytest.approx(point.half_peak_to_peak, rel=1e-7)


def put(place: str, value: dict[str, Any]) -> dict[str, Any]:
    raw = copy.deepcopy(grouped().to_dict())
    table: Any = raw["structure"]
    for step in place.split("/"):
        table = table[int(step) if step.isdigit() else step]
    table.update(value)
    return raw


@pytest.mark.parametrize(
    ("raw", "pointer", "says"),
    [
        (put("springs/0", {"group": "k2"}), "/structure/springs/0/group", "also the name of a part"),
        (put("springs/0", {"factor": 0.0}), "/structure/springs/0/factor", "must be > 0"),
        (put("springs/0", {"group": "a b"}), "/structure/springs/0/group", "letters, digits"),
        (
            put("masses", {"m1": {"m": 1.0, "group": "both"}}),
            "/structure/springs/0/group",
            "has masses in it already, and no springs",
        ),
        (put("masses", {"m1": {"m": 1.0, "factor": 2.0}}), "/structure/masses/m1", "needs a `group`"),
    ],
)
def test_bad_groups_are_named(raw: dict[str, Any], pointer: str, says: str):
    with pytest.raises(SceneError, match=says) as caught:
        Scene.from_dict(raw)
    assert pointer in [issue.pointer for issue in caught.value.issues]


def test_a_cyclic_structure_has_its_own_groups():
    raw = copy.deepcopy(disk().to_dict())
    raw["structure"]["springs"][0]["group"] = "all"  # type: ignore[index]
    with pytest.raises(SceneError, match="is a group already"):
        Scene.from_dict(raw)


def test_an_unknown_member():
    with pytest.raises(SettingError, match=r"structure\.both, structure\.k1, structure\.k2"):
        structure_derivative(grouped(), "structure.k3")
