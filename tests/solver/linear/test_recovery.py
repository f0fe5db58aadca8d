"""Stresses and other sums of DOFs as what is observed."""

from typing import Any

import numpy as np
import pytest

import solver
from solver.errors import SceneError, SettingError
from solver.scene.scene import Scene

STRESS = {"name": "bending", "unit": "MPa", "terms": {"x": 3.0, "y": -2.0}}
STRAIN = {"name": "gauge", "unit": "m", "terms": {"x": 1.0, "y": -1.0}}


def chain(observed: str, **more: Any) -> dict[str, Any]:
    springs = [
        {"between": ["x", "ground"], "k": 40.0, "c": 0.6},
        {"between": ["x", "y"], "k": 20.0, "c": 0.3},
    ]
    return {
        "name": "chain", "structure": {"kind": "lumped", "masses": {"x": 1.0, "y": 0.5}, "springs": springs},
        "contacts": [{"name": "rub", "between": ["x", "y"], "kt": 30.0, "mu": 0.3, "N0": 1.1}],
        "excitation": {"dof": "y", "amplitude": 1.0}, "recovery": [STRESS, STRAIN],
        "observe": {"dof": observed, "band": [0.3, 2.0]},
    } | more  # fmt: skip


def test_a_recovered_quantity_is_the_sum_of_its_dofs() -> None:
    found = solver.solve(Scene.from_dict(chain("bending")), frequency_hz=0.8, harmonics=9)
    x, y = (solver.time_history(found, dof, samples=2048)[1] for dof in "xy")
    assert found.max_abs == pytest.approx(np.abs(3.0 * x - 2.0 * y).max(), rel=1e-5)
    assert solver.time_history(found, "bending", samples=2048)[1] == pytest.approx(
        3.0 * x - 2.0 * y, abs=1e-12
    )
    assert "amplitude_in_MPa" in found.flags
    branch = solver.sweep(Scene.from_dict(chain("bending")), harmonics=5)
    assert "amplitude_in_MPa" in branch.flags
    with pytest.raises(SettingError, match="observe DOFs"):
        solver.march(Scene.from_dict(chain("bending")), frequency_hz=0.8)


def test_a_sum_in_metres_marches_to_its_balance() -> None:
    scene = Scene.from_dict(chain("gauge"))
    found = solver.solve(scene, frequency_hz=0.8, harmonics=61)
    marched = solver.march(scene, frequency_hz=0.8)
    assert found.half_peak_to_peak == pytest.approx(marched.half_peak_to_peak, rel=1e-6)


def test_a_sector_has_its_own() -> None:
    structure = {
        "kind": "cyclic", "sectors": 5, "masses": {"x": 1.0, "y": 0.5},
        "springs": [*chain("gauge")["structure"]["springs"], {"between": ["x", "x@next"], "k": 9.0}],
    }  # fmt: skip
    force = {"dof": "y", "amplitude": 1.0, "engine_order": 2}
    one, third = (
        solver.solve(
            Scene.from_dict(chain(name, structure=structure, excitation=force)), frequency_hz=0.8, harmonics=5
        ).max_abs
        for name in ("bending", "bending@3")
    )
    assert one == pytest.approx(third, rel=1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"recovery": [STRESS | {"terms": {"z": 1.0}}]}, "there is no DOF 'z'"),
        ({"recovery": [STRESS, STRESS]}, "is taken by"),
        ({"recovery": [STRESS | {"name": "x"}]}, "is that of a DOF"),
        ({"recovery": []}, "there is no DOF 'bending'"),
    ],
)
def test_what_is_wrong_is_said(change: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Scene.from_dict(chain("bending", **change))
