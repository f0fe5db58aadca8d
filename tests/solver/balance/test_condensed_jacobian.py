"""The condensed Jacobian solves what the whole one does, directly and transposed, by one factorisation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scene_cases import bladed_disk, mixed_disk, two_dof

from solver.balance.balance import build
from solver.balance.kernels.jacobian import (
    FREE,
    HELD,
    factorise,
    fill_jacobian,
    step_back,
    step_back_transposed,
)
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.jit.lapack import back_substitute, back_substitute_transposed
from solver.jit.lapack import factorise as factorise_block
from solver.scene.scene import Scene

# Scene, frequency [Hz], harmonics, free and held contacts.
CASES = [
    (two_dof(), 1.0, 11, (1, 0)),
    (two_dof(N0=1e5), 1.0, 11, (0, 1)),
    (bladed_disk(N0=150.0), 750.0, 11, (1, 1)),
    (bladed_disk(N0=150.0), 750.0, 3, (1, 1)),
    (mixed_disk(), 700.0, 7, None),
]


@pytest.mark.parametrize(("scene", "frequency", "harmonics", "parts"), CASES)
def test_solves_as_the_whole_jacobian(
    scene: Scene, frequency: float, harmonics: int, parts: tuple[int, int] | None
) -> None:
    workspace = Workspace.of(build(scene, harmonics=harmonics))
    found = workspace.solve(2.0 * math.pi * frequency, None)
    assert found.converged
    fill_jacobian(workspace.system, workspace.linear, workspace.point)
    point = evaluation_by_value(workspace.point)
    J = point.jacobian.copy()
    tangent = np.zeros(found.u.size + 1)
    assert factorise(workspace.system, workspace.linear, workspace.point, tangent, 0.0, 0.0) != 0.0
    if parts is not None:
        assert (point.counts[FREE], point.counts[HELD]) == parts
    rng = np.random.default_rng(5)
    for _ in range(3):
        rhs = rng.normal(size=found.u.size)
        direct, transposed = rhs.copy(), rhs.copy()
        step_back(workspace.system, workspace.point, direct)
        step_back_transposed(workspace.system, workspace.point, transposed)
        assert direct == pytest.approx(np.linalg.solve(J, rhs), rel=1e-9, abs=1e-10 * np.abs(direct).max())
        exact = np.linalg.solve(J.T, rhs)
        assert transposed == pytest.approx(exact, rel=1e-9, abs=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 7, 24, 36, 37, 60])
def test_both_sides_of_one_factorisation(n: int) -> None:
    """Below and above the size from which LAPACK factorises."""
    rng = np.random.default_rng(n)
    matrix, rhs = rng.normal(size=(n, n)), rng.normal(size=n)
    factors, pivots = np.zeros((n + 1, n + 1)), np.zeros(n + 1, np.int32)
    factors[:n, :n] = matrix
    assert factorise_block(factors, n, pivots) == np.sign(np.linalg.det(matrix))
    direct, transposed = rhs.copy(), rhs.copy()
    back_substitute(factors, n, pivots, direct)
    back_substitute_transposed(factors, n, pivots, transposed)
    assert matrix @ direct == pytest.approx(rhs, abs=1e-10)
    assert matrix.T @ transposed == pytest.approx(rhs, abs=1e-10)
