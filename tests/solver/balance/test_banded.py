"""Factors in a band solve what the whole Jacobian does: steps, borders, transposes and signs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.space import masses
from solver.balance.balance import build
from solver.balance.kernels.banded import factorise_band, solve_band
from solver.balance.kernels.jacobian import factorise, fill_jacobian, step_back, step_back_transposed
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import BANDED, evaluation_by_value
from solver.jit.fourier import Real


def test_a_band_that_needs_its_rows_exchanged() -> None:
    rng = np.random.default_rng(3)
    n, side = 40, 5
    for _ in range(10):
        whole = np.where(
            np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= side, rng.normal(size=(n, n)), 0.0
        )
        whole[np.arange(n), np.arange(n)] *= 1e-3
        band = np.zeros((n, 3 * side + 1))
        for i in range(n):
            for j in range(max(i - side, 0), min(i + side + 1, n)):
                band[i, j - i + side] = whole[i, j]
        pivots = np.zeros(n, np.int32)
        assert factorise_band(band, n, side, pivots) == np.linalg.slogdet(whole)[0]
        assert not np.array_equal(pivots, np.arange(n))
        for transposed, matrix in ((False, whole), (True, whole.T)):
            x = rng.normal(size=n)
            rhs = matrix @ x
            solve_band(band, n, side, pivots, transposed, rhs)
            assert rhs == pytest.approx(x, rel=1e-8, abs=1e-8)
    assert factorise_band(np.zeros((n, 3 * side + 1)), n, side, pivots) == 0.0


@pytest.mark.parametrize(("law", "count"), [("elastic-normal", 12), ("coulomb-3d", 8)])
def test_masses_in_a_row(law: str, count: int) -> None:
    """With the mean and without it in the balance; some contacts slip, and a random border."""
    workspace = Workspace.of(build(masses(count, law), harmonics=11))
    system, linear, point = workspace.system, workspace.linear, workspace.point
    at = evaluation_by_value(point)
    rng, omega = np.random.default_rng(5), 2.0 * math.pi * 1.2
    found = workspace.solve(omega)
    assert found.converged
    workspace.evaluate(found.u, omega)
    fill_jacobian(system, linear, point)
    J, n = at.jacobian.copy(), found.u.size
    assert (at.states > 0).any()
    signs = set()
    random = rng.normal(size=n + 1)
    for tangent in (random, -random):
        border = np.zeros((n + 1, n + 1))
        weight_u = 1.0 / np.abs(found.u).max() ** 2
        border[:n, :n], border[:n, n] = J, at.dr_dp
        border[n, :n], border[n, n] = weight_u * tangent[:n], tangent[n]
        sign = factorise(system, linear, point, tangent, weight_u, 1.0)
        assert at.counts[BANDED] == 1
        assert sign == np.linalg.slogdet(border)[0]
        signs.add(sign)
        check(border, lambda x: step_back(system, point, x), rng)
    assert factorise(system, linear, point, np.zeros(n + 1), 0.0, 0.0) == np.linalg.slogdet(J)[0]
    check(J, lambda x: step_back(system, point, x), rng)
    check(J.T, lambda x: step_back_transposed(system, point, x), rng)
    assert signs == {-1.0, 1.0}


def check(matrix: Real, solve, rng: np.random.Generator) -> None:
    x = rng.normal(size=len(matrix))
    rhs = x.copy()
    solve(x)
    left = matrix @ x - rhs
    assert np.abs(left).max() <= 1e-9 * (np.abs(matrix) @ np.abs(x)).max()


def test_what_has_no_band_is_factorised_whole() -> None:
    """A contact at either end of the row is coupled with all others by one spring."""
    scene = masses(12, "elastic-normal")
    raw = scene.to_dict()
    raw["structure"]["springs"].append({"between": ["p1x", "p12x"], "k": 20.0, "c": 0.0})
    workspace = Workspace.of(build(type(scene).from_dict(raw), harmonics=11))
    found = workspace.solve(2.0 * math.pi * 1.2)
    assert found.converged
    assert evaluation_by_value(workspace.point).counts[BANDED] == -1
