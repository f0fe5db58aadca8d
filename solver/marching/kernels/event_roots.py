"""The first place in a step where a polynomial falls below zero: how time marching finds a change of state.

Nothing here is shared with the root finder of the harmonic balance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled

Real = NDArray[np.float64]

PARTS = 4  # of the step, each looked through by its ends and its lowest point
NONE = 2.0  # no place in the step, which is 0..1


@compiled
def value_at(q: Real, s: float) -> float:
    """Return the polynomial sum q_k s^k."""
    total = 0.0
    for k in range(q.size - 1, -1, -1):
        total = total * s + q[k]
    return total


@compiled
def _slope(q: Real, s: float) -> float:
    """Return its derivative."""
    total = 0.0
    for k in range(q.size - 1, 0, -1):
        total = total * s + k * q[k]
    return total


@compiled
def _fall(q: Real, of_slope: bool, a: float, b: float) -> float:
    """Return where q falls (or its slope rises) through 0 between a and b, on the far side of it.

    Regula falsi with the Illinois rule (Dowell and Jarratt, BIT 11 (1971) 168), every third step a bisection.
    """
    fa = -_slope(q, a) if of_slope else value_at(q, a)
    fb = -_slope(q, b) if of_slope else value_at(q, b)
    if fa <= 0.0:
        return a
    side = 0
    for i in range(200):
        middle = a + (b - a) * fa / (fa - fb)
        if i % 3 == 2 or not a < middle < b:
            middle = 0.5 * (a + b)
        if b - a <= 1e-16 or not a < middle < b:
            break
        f = -_slope(q, middle) if of_slope else value_at(q, middle)
        if f > 0.0:
            a, fa = middle, f
            fb = 0.5 * fb if side > 0 else fb
            side = 1
        else:
            b, fb = middle, f
            fa = 0.5 * fa if side < 0 else fa
            side = -1
        if f == 0.0:
            break
    return b


@compiled
def first_fall(q: Real) -> float:
    """Return the first s in [0, 1] where the polynomial q falls below 0, or NONE."""
    rest = 0.0
    for k in range(1, q.size):
        rest += abs(q[k])
    if q[0] > rest:
        return NONE
    if q[0] <= 0.0 and q[1] < 0.0:
        return 0.0
    a, slope_a = 0.0, q[1]
    for part in range(1, PARTS + 1):
        b = part / PARTS
        slope_b = _slope(q, b)
        if value_at(q, b) < 0.0:
            return _fall(q, False, a, b)
        if slope_a < 0.0 < slope_b:
            lowest = _fall(q, True, a, b)
            if value_at(q, lowest) < 0.0:
                return _fall(q, False, a, lowest)
        a, slope_a = b, slope_b
    return NONE
