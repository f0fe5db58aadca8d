"""The state of a continuation between two steps, and what is done to it: scalar product, accept, undo."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from solver.balance.kernels.residual import least_size
from solver.contacts.kernels.system import System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.kernel_records import referenced
from solver.jit.lapack import copy_to, largest_entry

# How a stretch of continuation ended, and how the next point may be predicted.
RUNNING, FINISHED, NO_START, STALLED, LEFT_RANGE = 0, 1, 2, 3, 4
TANGENT, SECANT, CUBIC = 0, 1, 2


class Control(NamedTuple):
    """Settings of a continuation; lengths are relative: to the range of λ and to the size of u."""

    start: float
    stop: float
    first_step: float
    largest_step: float
    smallest_step: float
    wanted_iterations: int
    most_iterations: int
    predictor: int
    largest_turn: float  # relative distance corrector/predictor beyond which a step is halved
    range_weight: float  # the range of λ counts as this many units of arc length


class Walk(NamedTuple):
    """The state between two steps; `numbers` is indexed by the names below (P, STEP, …).

    Whenever a point is accepted, the evaluation and the receptance the steps share belong to that point.
    """

    u: Real  # (nt,)
    before: Real  # (nt + 1,) the point before, λ last
    tangent: Real  # (nt + 1,)
    before_tangent: Real  # (nt + 1,) at the point before
    earlier: Real  # (nt + 1,) the point before that one
    earlier_tangent: Real  # (nt + 1,)
    numbers: Real  # (NUMBERS,)


new_walk: Callable[..., Walk] = referenced("Walk", __name__, Walk._fields)


@compiled
def walk_by_value(walk: Walk) -> Walk:
    """Return the arrays of a walk as a tuple that Python can read (views, not copies)."""
    return Walk(
        walk.u, walk.before, walk.tangent, walk.before_tangent, walk.earlier, walk.earlier_tangent,
        walk.numbers,
    )  # fmt: skip


# SMOOTH: how many of the points before the last one follow each other on the same piece as it.
P, STEP, ORIENTATION, ITERATIONS, REJECTED, STEPPED_OVER, COUNT, NORM, FRESH, ROUGH, PIECE, FROZEN = range(12)
SMOOTH, NUMBERS = 12, 13


@compiled
def weights(system: System, walk: Walk, control: Control) -> tuple[float, float]:
    """Return the weights of the scalar product: u relative to its size, λ relative to its range."""
    size = max(largest_entry(walk.u), least_size(system, walk.numbers[P]))
    span = abs(control.stop - control.start) / control.range_weight
    weight_u = 1.0 / (size * size) if size > 0.0 else 1.0
    return weight_u, 1.0 / (span * span) if span > 0.0 else 1.0


@compiled
def distance(u: Real, p: float, v: Real, q: float, weight_u: float, weight_p: float) -> float:
    """Return the weighted distance of two points."""
    total = weight_p * (p - q) ** 2
    for i in range(u.size):
        total += weight_u * (u[i] - v[i]) ** 2
    return math.sqrt(total)


@compiled
def accept(walk: Walk, trial: Real, p: float, norm: float) -> None:
    """Move the walk to a converged point."""
    n = trial.size
    copy_to(walk.earlier, walk.before)
    copy_to(walk.earlier_tangent, walk.before_tangent)
    copy_to(walk.before[:n], walk.u)
    walk.before[n] = walk.numbers[P]
    copy_to(walk.before_tangent, walk.tangent)
    copy_to(walk.u, trial)
    walk.numbers[P] = p
    walk.numbers[ROUGH] = 0.0
    walk.numbers[COUNT] += 1
    walk.numbers[NORM], walk.numbers[FRESH] = norm, 1.0


@compiled
def turned_back(system: System, control: Control, walk: Walk) -> bool:
    """Return whether the last step led back on another piece: near a cusp both meet the corrector's plane."""
    n = walk.u.size
    weight_u, weight_p = weights(system, walk, control)
    along = weight_p * walk.tangent[n] * (walk.numbers[P] - walk.before[n])
    for i in range(n):
        along += weight_u * walk.tangent[i] * (walk.u[i] - walk.before[i])
    return along < 0.0


@compiled
def undo(walk: Walk, orientation: float, piece: float) -> None:
    """Take the last step back."""
    n = walk.u.size
    copy_to(walk.u, walk.before[:n])
    copy_to(walk.tangent, walk.before_tangent)
    walk.numbers[P] = walk.before[n]
    walk.numbers[ORIENTATION], walk.numbers[PIECE] = orientation, piece
    walk.numbers[ROUGH], walk.numbers[FRESH], walk.numbers[SMOOTH] = 1.0, 0.0, 0.0
    walk.numbers[COUNT] -= 1
    walk.numbers[REJECTED] += 1
