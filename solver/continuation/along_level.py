"""A solution from nothing where Newton's method finds none: along the arc of the excitation's level.

From a level so small that the parts hardly move, under their constant loads, the response is followed to the
level given. Steps in the level alone end at the first fold, and contacts that begin to slip make folds; the
arc goes round them (Allgower, Georg, *Introduction to Numerical Continuation Methods*, SIAM 2003,
doi:10.1137/1.9780898719154).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance, build
from solver.balance.parameter import Kind
from solver.balance.workspace import PointSolution, Workspace
from solver.continuation.kernels import state as walk_states
from solver.continuation.kernels.pseudo_arclength import begin_walk, walk_on
from solver.continuation.kernels.state import Control, walk_by_value
from solver.continuation.segment import rows_of
from solver.continuation.settings import ContinuationSettings
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.scene.parameter_paths import AMPLITUDE

LOWEST = 1e-3  # level to begin with, relative to the one given
_STRETCH, _MOST_STRETCHES = 64, 16


def solve_from_nothing(workspace: Workspace, p: float, guess: Real | None = None) -> PointSolution:
    """Solve at λ = `p` as `Workspace.solve` does, and where that finds nothing along the level."""
    found = workspace.solve(p, guess)
    if found.converged or found.ratchets:
        return found
    balance = _over_level(workspace.balance, p)
    if balance is None:
        return found
    end, spent = _followed(balance)
    if end is not None:
        again = workspace.solve_from(p, end)
        spent += again.iterations
        found = replace(again if again.converged else found, iterations=found.iterations)
    return replace(found, iterations=found.iterations + spent)


def _over_level(balance: Balance, p: float) -> Balance | None:
    """Return the balance at λ = `p` with the excitation's level for λ; None where that is not its own scale.

    It is λ itself, or none, or some constant forces belong to the excitation and others do not.
    """
    scene, parameter = balance.scene, balance.parameter
    if parameter.kind is Kind.LEVEL:
        return None
    frequency_hz = balance.system.omega / (2.0 * math.pi)
    if parameter.kind is Kind.FREQUENCY:
        frequency_hz = float(parameter.outside(p))
    else:
        scene = scene.with_values({parameter.path: float(parameter.outside(p))})
    if scene.value(AMPLITUDE) <= 0.0:
        return None
    effects = replace(balance.effects, even_harmonics=int(balance.system.ks[0]) == 0)
    try:
        found = build(
            scene, AMPLITUDE, harmonics=balance.n_harmonics, frequency_hz=frequency_hz, effects=effects
        )
    except SettingError:  # constant forces that the level scales stand beside others that it does not
        return None
    return found if np.array_equal(found.system.ks, balance.system.ks) else None


def _followed(balance: Balance) -> tuple[Real | None, int]:
    """Return the motion at the level given, or None if the arc does not lead there, and the iterations."""
    workspace, settings = Workspace.of(balance), ContinuationSettings()
    full = balance.parameter.inside(balance.scene.value(AMPLITUDE))
    control = Control(
        start=LOWEST * full, stop=full, first_step=settings.first_step, largest_step=settings.largest_step,
        smallest_step=settings.smallest_step, wanted_iterations=settings.wanted_iterations,
        most_iterations=settings.most_iterations, predictor=int(settings.predictor),
        largest_turn=settings.largest_turn, range_weight=settings.range_length,
    )  # fmt: skip
    least = workspace.solve(control.start)
    spent = least.iterations
    if not least.converged:
        return None, spent
    system, linear, point = workspace.system, workspace.linear, workspace.point
    code, state = begin_walk(system, linear, point, control, least.u)
    rows = rows_of(balance, _STRETCH)
    for _ in range(_MOST_STRETCHES):
        if code != walk_states.RUNNING:
            break
        code, _ = walk_on(system, linear, point, control, state, _STRETCH, *rows)
    walk = walk_by_value(state)
    spent += int(walk.numbers[walk_states.ITERATIONS])
    return (walk.u.copy() if code == walk_states.FINISHED else None), spent
