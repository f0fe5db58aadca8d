"""The plan of a scene: what is computed, what is left out, and why."""

import json
import re
from typing import Any

import pytest
from scene_cases import bladed_disk, critically_damped, loose_mass, mixed_disk, oscillator, two_dof

from solver import Effects, Plan, Scene, SettingError, plan
from solver.balance.balance import build


def effect(scene: Scene, name: str) -> Any:
    (found,) = [effect for effect in plan(scene).effects if effect.name == name]
    return found


@pytest.mark.parametrize("harmonics", [0, 1, 11, 40])
@pytest.mark.parametrize("scene", [two_dof(), bladed_disk(), oscillator(k=1.0, c=0.1)], ids=lambda s: s.name)
def test_sizes_are_those_of_the_balance(scene: Scene, harmonics: int):
    planned = plan(scene, harmonics=harmonics)
    assert planned.unknowns == build(scene, harmonics=harmonics).n_unknowns
    assert planned.unknowns <= len(scene.contacts) * (2 * max(harmonics, 1) + 1)
    assert planned.linear_dofs == len(scene.structure.dofs)
    assert planned.contacts == len(scene.contacts)
    assert planned.harmonics == harmonics
    assert planned.scene == scene.name


def test_every_effect_has_a_reason():
    for scene in (two_dof(), bladed_disk(N1=400.0), mixed_disk(), loose_mass()):
        for found in plan(scene).effects:
            assert isinstance(found.used, bool)
            assert len(found.reason) > 20


def test_condensation():
    found = effect(bladed_disk(), "condensation")
    assert found.used
    assert re.search(r"\b4\b.*\b46\b.*\b92\b", found.reason)


def test_one_sector_stands_for_the_annulus():
    whole = plan(bladed_disk(), effects=Effects(every_sector=True))
    assert (whole.linear_dofs, whole.contacts) == (8 * 4, 8 * 2)
    assert effect(bladed_disk(), "one sector for the annulus").used
    assert "8" in effect(bladed_disk(), "one sector for the annulus").reason
    assert not effect(two_dof(), "one sector for the annulus").used


@pytest.mark.parametrize(
    ("N1", "opens"), [(0.0, False), (99.0, False), (100.0, False), (101.0, True), (-150.0, True)]
)
def test_separation(N1: float, opens: bool):
    found = effect(two_dof(N1=N1), "separation of damper")
    assert found.used == opens
    assert f"{100.0 - abs(N1):g} N" in found.reason


def test_form_of_the_linear_part():
    assert "poles" in effect(two_dof(), "linear part").reason
    assert "undamped modes" in effect(bladed_disk(), "linear part").reason
    # Two poles in one: the eigenvectors do not span the state space.
    assert "matrices themselves" in effect(critically_damped(), "linear part").reason


def test_stiffness_moved_where_contacts_hold_a_part():
    assert effect(loose_mass(), "contact stiffness in the structure").used
    assert not effect(two_dof(), "contact stiffness in the structure").used


def test_cost_grows_with_size():
    costs = [plan(two_dof(), harmonics=h).seconds_a_point for h in (1, 5, 11, 31, 61)]
    assert costs == sorted(costs)
    assert 1e-6 < costs[2] < 1e-2


def test_json():
    planned = plan(bladed_disk())
    assert isinstance(planned, Plan)
    obj = json.loads(json.dumps(planned.to_json(), allow_nan=False))
    assert obj["unknowns"] == 46
    assert obj["scene"] == "bladed-disk"
    assert {"name", "used", "reason"} == set(obj["effects"][0])
    assert obj["estimated_seconds_a_point"] == planned.seconds_a_point


@pytest.mark.parametrize("harmonics", [-1, 1.5, 5000, "11"])
def test_bad_arguments_name_field_and_value(harmonics: object):
    with pytest.raises(SettingError) as error:
        plan(two_dof(), harmonics=harmonics)  # type: ignore[arg-type]
    assert error.value.name == "harmonics"
    assert repr(harmonics) in str(error.value)
