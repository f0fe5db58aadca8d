"""Contacts as springs at solutions of a walk: kept as they were there, and what a change in time leaves."""

from __future__ import annotations

import numpy as np
import pytest

import solver
from solver.balance.balance import build
from solver.balance.workspace import MOST_ENTRIES, Workspace
from solver.continuation.branches.sweep import walk_branch
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.stretches import joined
from solver.jit.fourier import Real


def shifted(k: int, angle: float) -> Real:
    """Turn the cosine and sine of harmonic k as a shift in time turns them."""
    c, s = np.cos(k * angle), np.sin(k * angle)
    return np.array([[c, s], [-s, c]])


def test_springs_of_a_walk_are_those_worked_out_anew() -> None:
    balance = build(solver.load_scene("shroud-3d"), harmonics=5)
    low, high = balance.scene.observe.band
    workspace, again = Workspace.of(balance), Workspace.of(balance)
    middle = 0.5 * (low + high)
    stop = middle + 0.1 * (high - low)
    points = joined(list(walk_branch(workspace, middle, stop, solver.ContinuationSettings())))
    assert all(springs is not None for springs in workspace.springs.of(points.solutions))
    assert again.springs.of(points.solutions)[0] is None
    found = []
    for each in (workspace, again):
        nodes = NodeSolver(each, points)
        rows = nodes.model.rows(nodes.order)
        found.append(nodes.model.stiffness(rows, np.full(rows.size, 3)))
    assert found[0] == pytest.approx(found[1], rel=1e-11, abs=1e-9 * np.abs(found[1]).max())
    # The mean of R⁻¹ (dF/dU) R over all shifts R in time is what commutes with them.
    solution = points.solutions[-1]
    _, at = again.evaluate(solution[:-1].copy(), float(solution[-1]))
    here, m = 2 * 3 - 1, 3
    shifts = [shifted(3, angle) for angle in 2.0 * np.pi * np.arange(6) / 18.0]
    for a in range(m):
        for b in range(m):
            block = at.dF_dU[a * m + b][here : here + 2, here : here + 2]
            mean = sum(R.T @ block @ R for R in shifts) / len(shifts)
            spring = mean[0, 0] + 1j * mean[0, 1]
            assert found[0][-1, a, b] == pytest.approx(spring, rel=1e-9, abs=1e-9 * np.abs(at.dF_dU).max())


def test_springs_are_not_kept_without_end() -> None:
    balance = build(solver.load_scene("shroud-3d"), harmonics=5)
    springs = Workspace.of(balance).springs
    one = springs.rows(1)
    assert len(springs.rows(MOST_ENTRIES // one.size)) == MOST_ENTRIES // one.size
    assert len(springs.rows(MOST_ENTRIES // one.size + 1)) == 0
