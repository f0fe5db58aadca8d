"""Where the next point of a branch is expected: on the tangent, the secant, or a polynomial of the last."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.newton import MANY_UNKNOWNS
from solver.contacts.kernels.system import System
from solver.continuation.kernels.walk_state import (
    COUNT,
    CUBIC,
    ROUGH,
    SECANT,
    SMOOTH,
    Control,
    P,
    Walk,
    distance,
    weights,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import copy_to, set_to
from solver.jit.separate import apart

# A quintic and a cubic that are farther apart than this share of the step do not lead to a solution.
_AGREE = 0.2
_SHORTENED = 6  # times at most
# By what a step is shortened at most, and a little more than both need.
_LEAST, _MARGIN = 0.5, 0.95


@compiled
def foreseen_step(system: System, walk: Walk, control: Control, step: float) -> float:
    """Return the step, or a shorter one that is foreseen to lead to a solution.

    The distance of the predictions by two and by three points is an estimate of how far off they are.
    """
    smooth = walk.numbers[SMOOTH] >= 2.0 and walk.numbers[ROUGH] == 0.0
    # With fewer unknowns two more predictions cost more than the steps that fail.
    if control.predictor != CUBIC or not smooth or walk.u.size < MANY_UNKNOWNS:
        return step
    weight_u, weight_p = weights(system, walk, control)
    cubic, quintic = np.empty(walk.u.size), np.empty(walk.u.size)
    for _ in range(_SHORTENED):
        p = _extrapolate(system, walk, control, step, 2, cubic)
        q = _extrapolate(system, walk, control, step, 3, quintic)
        off = distance(cubic, p, quintic, q, weight_u, weight_p) / step
        if not off > _AGREE:
            break
        step *= max(_LEAST, _MARGIN * (_AGREE / off) ** (1.0 / 3.0))
    return step


@compiled
def predict(system: System, walk: Walk, control: Control, step: float, guess: Real) -> float:
    """Fill `guess` with the predicted u at arc length `step`; return the predicted λ."""
    n = walk.u.size
    p = walk.numbers[P]
    if control.predictor == SECANT and walk.numbers[COUNT] > 0:
        weight_u, weight_p = weights(system, walk, control)
        length = weight_p * (p - walk.before[n]) ** 2
        for i in range(n):
            length += weight_u * (walk.u[i] - walk.before[i]) ** 2
        if length > 0.0:
            scale = step / math.sqrt(length)
            for i in range(n):
                guess[i] = walk.u[i] + scale * (walk.u[i] - walk.before[i])
            return p + scale * (p - walk.before[n])
    if control.predictor == CUBIC and walk.numbers[SMOOTH] > 0.0 and walk.numbers[ROUGH] == 0.0:
        return _extrapolate(system, walk, control, step, 3 if walk.numbers[SMOOTH] >= 2.0 else 2, guess)
    set_to(guess, walk.u, step, walk.tangent)
    return p + step * walk.tangent[n]


@apart
def _extrapolate(system: System, walk: Walk, control: Control, step: float, count: int, guess: Real) -> float:
    """Predict by the polynomial through the last 2 or 3 points and their tangents; return the predicted λ.

    It is a cubic through two points, a quintic through three that are on one smooth piece. They stand at
    their arc lengths: with chords in their place the quintic would be no better than the cubic.
    """
    n = walk.u.size
    weight_u, weight_p = weights(system, walk, control)
    here = np.empty(n + 1)
    copy_to(here[:n], walk.u)
    here[n] = walk.numbers[P]
    at, sizes = np.zeros(3), np.ones(3)
    sizes[0], sizes[1] = (
        _size(walk.tangent, weight_u, weight_p),
        _size(walk.before_tangent, weight_u, weight_p),
    )
    at[1] = -_arc(here, walk.tangent, walk.before, walk.before_tangent, sizes, weight_u, weight_p)
    if not step < -3.0 * at[1]:
        set_to(guess, walk.u, step, walk.tangent)
        return walk.numbers[P] + step * walk.tangent[n]
    if count == 3:
        sizes[2] = _size(walk.earlier_tangent, weight_u, weight_p)
        at[2] = at[1] - _arc(
            walk.before,
            walk.before_tangent,
            walk.earlier,
            walk.earlier_tangent,
            sizes[1:],
            weight_u,
            weight_p,
        )
    ahead = np.zeros(n + 1)
    for k in range(count):
        point, way = here, walk.tangent
        if k > 0:
            point, way = (
                (walk.before, walk.before_tangent) if k == 1 else (walk.earlier, walk.earlier_tangent)
            )
        rest, slope = 1.0, 0.0
        for j in range(count):
            if j != k:
                rest *= (step - at[j]) / (at[k] - at[j])
                slope += 1.0 / (at[k] - at[j])
        value = (1.0 - 2.0 * (step - at[k]) * slope) * rest * rest
        rise = (step - at[k]) * rest * rest / sizes[k]
        for i in range(n + 1):
            ahead[i] += value * point[i] + rise * way[i]
    copy_to(guess, ahead[:n])
    return ahead[n]


@compiled
def _size(way: Real, weight_u: float, weight_p: float) -> float:
    """Return the weighted length of a tangent."""
    n = way.size - 1
    total = weight_p * way[n] ** 2
    for i in range(n):
        total += weight_u * way[i] ** 2
    return math.sqrt(total)


@compiled
def _arc(
    here: Real, way: Real, there: Real, other: Real, sizes: Real, weight_u: float, weight_p: float
) -> float:
    """Return the arc length between two points: c (1 + κ²/24) where the tangents at a chord c differ by κ."""
    n = here.size - 1
    chord = weight_p * (here[n] - there[n]) ** 2
    turn = weight_p * (way[n] / sizes[0] - other[n] / sizes[1]) ** 2
    for i in range(n):
        chord += weight_u * (here[i] - there[i]) ** 2
        turn += weight_u * (way[i] / sizes[0] - other[i] / sizes[1]) ** 2
    return math.sqrt(chord) * (1.0 + turn / 24.0)
