"""Where the next point of a branch is expected: on the tangent, the secant, or the cubic of the last two."""

from __future__ import annotations

import math

from solver.contacts.kernels.system import System
from solver.continuation.kernels.state import COUNT, CUBIC, ROUGH, SECANT, Control, P, Walk, weights
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import set_to


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
    if control.predictor == CUBIC and walk.numbers[COUNT] > 0 and walk.numbers[ROUGH] == 0.0:
        return extrapolate(system, walk, control, step, guess)
    set_to(guess, walk.u, step, walk.tangent)
    return p + step * walk.tangent[n]


@compiled
def extrapolate(system: System, walk: Walk, control: Control, step: float, guess: Real) -> float:
    """Predict by the cubic through the last two points and their tangents; return the predicted λ."""
    n = walk.u.size
    p = walk.numbers[P]
    weight_u, weight_p = weights(system, walk, control)
    chord = weight_p * (p - walk.before[n]) ** 2
    here, there = weight_p * walk.tangent[n] ** 2, weight_p * walk.before_tangent[n] ** 2
    for i in range(n):
        chord += weight_u * (walk.u[i] - walk.before[i]) ** 2
        here += weight_u * walk.tangent[i] ** 2
        there += weight_u * walk.before_tangent[i] ** 2
    length = math.sqrt(chord)
    if not step < 3.0 * length:
        set_to(guess, walk.u, step, walk.tangent)
        return p + step * walk.tangent[n]
    t = 1.0 + step / length
    value0, value1 = (1.0 + 2.0 * t) * (1.0 - t) ** 2, t * t * (3.0 - 2.0 * t)
    slope0 = t * (1.0 - t) ** 2 * length / math.sqrt(there)
    slope1 = t * t * (t - 1.0) * length / math.sqrt(here)
    for i in range(n):
        guess[i] = (
            value0 * walk.before[i] + value1 * walk.u[i]
            + slope0 * walk.before_tangent[i] + slope1 * walk.tangent[i]
        )  # fmt: skip
    return value0 * walk.before[n] + value1 * p + slope0 * walk.before_tangent[n] + slope1 * walk.tangent[n]
