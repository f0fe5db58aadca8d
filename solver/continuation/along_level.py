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
from solver.continuation.kernels.pseudo_arclength import begin_walk, walk_on
from solver.continuation.kernels.state import FINISHED, ITERATIONS, RUNNING, Control, walk_by_value
from solver.continuation.segment import rows_of
from solver.continuation.settings import ContinuationSettings
from solver.jit.fourier import Real
from solver.scene.parameter_paths import AMPLITUDE

LOWEST = 1e-3  # level to begin with, relative to the one given
MOST_POINTS = 1024  # of the arc; a smooth one takes 70, that of a light wedge some hundred
_STRETCH = 64  # points between two looks


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
    workspace, settings = Workspace.of(balance), ContinuationSettings()
    level = balance.parameter.inside(balance.scene.value(AMPLITUDE))
    control = Control(
        start=LOWEST * level, stop=level, first_step=settings.first_step, largest_step=settings.largest_step,
        smallest_step=settings.smallest_step, wanted_iterations=settings.wanted_iterations,
        most_iterations=settings.most_iterations, predictor=int(settings.predictor),
        largest_turn=settings.largest_turn, range_weight=settings.range_length,
    )  # fmt: skip
    least = workspace.solve(control.start)
    if not least.converged:
        return None, least.iterations
    system, linear, point = workspace.system, workspace.linear, workspace.point
    code, state = begin_walk(system, linear, point, control, least.u)
    rows, points = (*rows_of(balance, _STRETCH), workspace.springs.rows(0)), 0
    while code == RUNNING and points < MOST_POINTS:
        code, count = walk_on(system, linear, point, control, state, _STRETCH, *rows)
        points += count
    walk = walk_by_value(state)
    spent = least.iterations + int(walk.numbers[ITERATIONS])
    return (walk.u.copy() if code == FINISHED else None), spent
