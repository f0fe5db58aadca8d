"""The equations of nonlinear modes: their Jacobian against differences of their residual."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import solver
from solver.modes import sparse
from solver.modes.mode_curve import scales
from solver.modes.mode_equations import Equations, step
from solver.modes.nonlinear_mode import pose

SCENES = [
    ("two-dof", None, 4), ("bladed-disk", 2, 3), ("platform-wedge", None, 2), ("shroud-3d", 3, 2),
    ("fe-disk", 3, 2),
]  # fmt: skip


@pytest.mark.parametrize(("name", "diameter", "harmonics"), SCENES)
def test_the_jacobian_is_the_slope_of_the_residual(name: str, diameter: int | None, harmonics: int) -> None:
    equations = pose(solver.load_scene(name), 1, diameter, harmonics).equations
    rng = np.random.default_rng(8)
    coordinates = equations.structure.force.size
    compared = 0
    for _ in range(4):
        y = rng.standard_normal(equations.size + 4) * 10.0 ** rng.uniform(-6.0, -4.0)
        y[-2], y[-1] = rng.uniform(200.0, 5000.0), rng.uniform(0.0, 0.1)
        phase = rng.standard_normal(coordinates) + 1j * rng.standard_normal(coordinates)
        at = equations.evaluate(y, -3.0, phase, 0)
        if at is None:
            continue
        units = np.concatenate([np.full(equations.size + 2, np.abs(y[:-2]).max()), [y[-2], 1.0]])
        for _ in range(6):
            direction = units * rng.standard_normal(y.size)
            slope = at.jacobian @ direction
            ends = []
            for share in (1e-6, -1e-6):
                there = equations.evaluate(y + share * direction, -3.0, phase, 0)
                assert there is not None
                ends.append((there.residual - at.residual) / share)
            sizes = np.abs(at.jacobian) @ np.abs(direction)
            if np.any(np.abs(ends[0] - ends[1]) > 1e-4 * sizes):
                continue  # a contact changes its state between them
            # Sliding in the plane is integrated to a tolerance, force and slopes each.
            assert np.all(np.abs(0.5 * (ends[0] + ends[1]) - slope) <= 1e-5 * sizes)
            compared += 1
    assert compared >= 10


def test_singular_steps_are_none() -> None:
    J = np.array([[1.0, 2.0], [2.0, 4.0]])
    assert step(J, np.ones(2), np.ones(2)) is None
    assert step(J * np.nan, np.ones(2), np.ones(2)) is None
    found = step(J + np.eye(2), np.ones(2), np.array([1.0, 1e-6]))
    np.testing.assert_allclose((J + np.eye(2)) @ found, np.ones(2), rtol=1e-14)


def _lap(nodes: int) -> solver.Scene:
    """Two rows of nodes pressed together that rub in two directions; damping keeps it out of modes."""
    names = [[f"{row}{i}" for i in range(nodes)] for row in "ab"]
    springs: list[dict[str, Any]] = [
        {"between": [f"{one}{axis}", f"{other}{axis}"], "k": 5e7, "c": 5.0}
        for row in names
        for one, other in pairwise(row)
        for axis in "xyz"
    ]
    springs += [{"between": [f"a0{axis}", "ground"], "k": 1e7, "c": 5.0} for axis in "xyz"]
    springs += [{"between": ["tip", f"b{nodes - 1}z"], "k": 3e5, "c": 2.0}]
    springs += [{"between": [f"b{nodes - 1}z", f"a{nodes - 1}z"], "k": 1e4, "c": 1.0}]
    contacts = [
        {
            "name": f"c{i}", "law": "coulomb-3d", "between": [f"b{i}x", f"a{i}x"],
            "between_second": [f"b{i}y", f"a{i}y"], "normal_between": [f"b{i}z", f"a{i}z"],
            "kt": 2e8 / nodes, "kn": 3e8 / nodes, "mu": 0.3, "N0": 2400.0 / nodes, "prestressed": True,
        }
        for i in range(nodes)
    ]  # fmt: skip
    return solver.Scene.from_dict(
        {
            "name": "lap",
            "structure": {
                "kind": "lumped",
                "masses": {f"{node}{axis}": 0.01 for row in names for node in row for axis in "xyz"}
                | {"tip": 0.5},
                "springs": springs,
            },
            "contacts": contacts,
            "excitation": {"forces": {"tip": 1.0, f"b{nodes - 1}x": 2.0}, "amplitude": 3.0},
            "observe": {"dof": "tip", "band": [60.0, 140.0]},
        }
    )


def _both(scene: solver.Scene, monkeypatch: pytest.MonkeyPatch) -> tuple[Equations, Equations]:
    """Return the equations with entries kept alone, and with whole matrices."""
    monkeypatch.setattr(sparse, "SPARSE", 1.0)
    monkeypatch.setattr(sparse, "SPARSE_FROM", 1)
    alone = pose(scene, 1, None, 3).equations
    monkeypatch.setattr(sparse, "SPARSE_FROM", 10**9)
    return alone, pose(scene, 1, None, 3).equations


def test_sparse_steps_are_those_of_whole_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    """With contacts that stick, slip and part; also where nothing holds the mean of a part."""
    alone, whole = _both(_lap(5), monkeypatch)
    assert alone.structure.pattern is not None
    assert whole.structure.pattern is None
    rng = np.random.default_rng(3)
    loose = 0
    for size in (1e-8, 1e-6, 1e-5, 1e-4, 1e-3):
        y = rng.standard_normal(alone.size + 4) * size
        y[-2], y[-1] = rng.uniform(400.0, 900.0), rng.uniform(0.0, 0.05)
        y[: alone.size : alone.n] *= 0.01  # pressed on the mean
        phase = rng.standard_normal(alone.structure.force.size) + 0j
        one, other = (each.evaluate(y, -3.0, phase, 0) for each in (alone, whole))
        assert one is not None
        assert other is not None
        loose += len(one.loose[0]) > 0
        np.testing.assert_allclose(one.residual, other.residual, atol=1e-12 * np.abs(other.residual).max())
        J = other.jacobian
        np.testing.assert_allclose(one.jacobian, J, rtol=0.0, atol=1e-10 * np.abs(J).max())
        columns, rhs, border = scales(y, alone.size), *rng.standard_normal((2, y.size + 1))
        for given in ((rhs[:-1], columns), (rhs, columns, border)):
            found, wanted = one.step(*given), other.step(*given)
            assert found is not None
            assert wanted is not None
            np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-8 * np.abs(wanted).max())
    assert loose > 0


def test_a_mode_of_sparse_matrices_is_that_of_whole_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    curves = []
    for least in (1, 10**9):
        monkeypatch.setattr(sparse, "SPARSE", 1.0)
        monkeypatch.setattr(sparse, "SPARSE_FROM", least)
        curves.append(solver.nonlinear_mode(_lap(6), 1, amplitudes=(1e-3, 1e-2), harmonics=3))
    one, other = curves
    assert one.reached
    assert np.any(one.states[-1] != one.states[0])
    np.testing.assert_allclose(one.amplitude, other.amplitude, rtol=1e-8)
    np.testing.assert_allclose(one.frequency_hz, other.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(one.damping_ratio, other.damping_ratio, rtol=1e-8)
    np.testing.assert_allclose(one.frequency_error, other.frequency_error, rtol=1e-5, atol=1e-9)
