"""A solution from nothing where Newton's method finds none: along the arc of the excitation's level.

At a thousandth of its level the excitation hardly moves the parts, contacts stick under their constant loads,
and Newton's method finds that response. From there it is followed to the level given. Steps in the level
alone end at the first fold, and contacts that begin to slip make folds; the arc goes round them (E. L.
Allgower, K. Georg, *Introduction to Numerical Continuation Methods*, SIAM 2003, doi:10.1137/1.9780898719154).

The arc may turn back to the small level, lead to ever larger motions or stop: then there is still no solution
by this way, which says nothing about whether there is one. It has at most `MOST_POINTS` points.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, build, level_scales_all
from solver.balance.parameter import Kind
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import BranchStatus
from solver.continuation.continuation_settings import ContinuationSettings
from solver.continuation.kernels.pseudo_arclength import begin_walk
from solver.continuation.stretches import STRETCH, BranchStretches, control_of
from solver.continuation.walk import walk
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.scene.parameter_paths import AMPLITUDE

LOWEST = 1e-3  # level to begin with, relative to the one given
MOST_POINTS = 1024  # of the arc; a smooth one takes 70, that of a light wedge some hundred


def solve_along_level(workspace: Workspace, p: float) -> tuple[PointSolution | None, int]:
    """Solve at λ = `p` (inside unit) from the end of the arc of the level.

    Returns
    -------
    (the converged solution or None, Newton iterations).
    """
    balance = _over_level(workspace.balance, p)
    if balance is None:
        return None, 0
    end, spent = _followed(balance)
    if end is None:
        return None, spent
    again = workspace.solve_from(p, end)
    return (again if again.converged else None), spent + again.iterations


def _over_level(balance: Balance, p: float) -> Balance | None:
    """Return the balance at λ = `p` (inside unit) with the level of the excitation for its λ.

    It is None where that level is λ itself or zero, where it would scale constant forces beside others that
    it does not scale, and where such a balance has other harmonics.
    """
    scene, parameter = balance.scene, balance.parameter
    if parameter.kind is Kind.LEVEL or scene.value(AMPLITUDE) <= 0.0 or not level_scales_all(scene):
        return None
    frequency_hz = balance.system.omega / (2.0 * math.pi)
    if parameter.kind is Kind.FREQUENCY:
        frequency_hz = float(parameter.outside(p))
    else:
        scene = scene.with_values({parameter.path: float(parameter.outside(p))})
    effects = replace(balance.effects, even_harmonics=int(balance.system.ks[0]) == 0)
    other = build(
        scene, AMPLITUDE, harmonics=balance.n_harmonics, frequency_hz=frequency_hz, effects=effects
    )  # fmt: skip
    return other if np.array_equal(other.system.ks, balance.system.ks) else None


def _followed(balance: Balance) -> tuple[Real | None, int]:
    """Follow the response from the small level to the one of the scene.

    Returns
    -------
    (slip motions there [m], or None if the arc does not lead there, Newton iterations).
    """
    workspace = Workspace.of(balance)
    level = balance.parameter.inside(balance.scene.value(AMPLITUDE))
    control = control_of(ContinuationSettings(), LOWEST * level, level)
    least = workspace.solve(control.start)
    if not least.converged:
        return None, least.iterations
    code, state = begin_walk(workspace.system, workspace.linear, workspace.point, control, least.u)
    arc = BranchStretches(workspace, control, code, state, least.iterations, clock())
    points, last = 0, None
    for last in walk(arc, STRETCH, 1.0):
        points += len(last.solutions)
        if points >= MOST_POINTS:
            break
    if last is None:
        return None, least.iterations
    there = last.solutions[-1, :-1].copy() if last.status is BranchStatus.COMPLETED else None
    return there, last.newton_iterations
