"""The equations of nonlinear modes: their Jacobian against differences of their residual."""

from __future__ import annotations

import numpy as np
import pytest

import solver
from solver.modes.corrector import step
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
    assert step(J, np.ones(2), np.ones(2), least_squares=False) is None
    assert step(J * np.nan, np.ones(2), np.ones(2), least_squares=False) is None
    found = step(J + np.eye(2), np.ones(2), np.array([1.0, 1e-6]), least_squares=False)
    np.testing.assert_allclose((J + np.eye(2)) @ found, np.ones(2), rtol=1e-14)
