"""A solution from nothing: Newton's method, and where it finds none the arc of the excitation's level.

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

from solver.balance.balance import Balance, Kind, build, level_scales_all, with_harmonics
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.branch import BranchStatus
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.scene.parameter_paths import AMPLITUDE

LOWEST = 1e-3  # level to begin with, relative to the one given
MOST_POINTS = 1024  # of the arc; a smooth one takes 70, that of a light wedge some hundred


def solve_from_nothing(workspace: Workspace, p: float, guess: Real | None = None) -> PointSolution:
    """Solve at λ = `p` (inside unit) as `Workspace.solve` does, from `guess` if given, the level's arc among
    its ways."""
    return workspace.solve(p, guess, by_level)


def by_level(workspace: Workspace, p: float) -> tuple[Real | None, int]:
    """Follow the response at λ = `p` (inside unit) from a small level; see `solver.balance.workspace.Arc`.

    Where a contact has no force at the stuck response the arc would creep towards the level from which on it
    has none.
    """
    balance = None if workspace.law_fails(p) else _over_level(workspace.balance, p)
    return (None, 0) if balance is None else _followed(balance)


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
    other = build(scene, AMPLITUDE, harmonics=balance.n_harmonics, frequency_hz=frequency_hz, effects=effects)
    if not np.all(np.isin(balance.system.ks, other.system.ks)):
        return None
    other = with_harmonics(other, balance.system.ks)
    return replace(other, system=other.system._replace(hold=balance.system.hold))


def _followed(balance: Balance) -> tuple[Real | None, int]:
    """Follow the response from the small level to the one of the scene.

    Returns
    -------
    (slip motions there [m], or None if the arc does not lead there, Newton iterations).
    """
    # Loaded here: hardly any point needs the kernels of the arc, and a command starts sooner without them.
    from solver.continuation.kernels.pseudo_arclength import begin_walk
    from solver.continuation.stretches import BranchStretches, control_of
    from solver.continuation.walk import ContinuationSettings, walk

    workspace = Workspace.of(balance)
    level = balance.parameter.inside(balance.scene.value(AMPLITUDE))
    settings = ContinuationSettings()
    control = control_of(settings, LOWEST * level, level, settings.pace)
    least = workspace.solve(control.start)
    if not least.converged:
        return None, least.iterations
    code, state = begin_walk(workspace.system, workspace.linear, workspace.point, control, least.u)
    arc = BranchStretches(workspace, control, code, state, least.iterations, clock())
    points, last = 0, None
    for last in walk(arc, arc.pace):
        points += len(last.solutions)
        if points >= MOST_POINTS:
            break
    if last is None:
        return None, least.iterations
    there = last.solutions[-1, :-1].copy() if last.status is BranchStatus.COMPLETED else None
    return there, last.newton_iterations
