"""The nodes of a period at which a law follows its motion, and the motion there.

Nodes are even, with equal weights, which is exact to all orders for a smooth force; or they begin anew at
every reversal of the motion, where the force of friction has its corners: even ones between two reversals
with the weights of Simpson's rule, of fourth order.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.springs import positive_intervals
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, cosine_position
from solver.jit.separate import apart
from solver.jit.trig_polynomial import unpack

_TURN = 2.0 * math.pi
_LONGEST = 1.4  # half periods that have the steps of one
_SHORTEST = 1e-9  # rad; two reversals closer than that are none


@compiled
def most_nodes(count: int, top: int) -> int:
    """Return how many nodes there may be, with the one that ends the period."""
    return 2 * count + 16 * (2 * top + 4) + 1


@compiled
def even_nodes(count: int, tau: Real, weight: Real) -> int:
    """Fill `tau` and `weight` of `count` even nodes and of the end of the period; return `count`."""
    for j in range(count + 1):
        tau[j] = _TURN * j / count
        weight[j] = _TURN / count
    weight[0] = 0.0
    return count


@apart
def reversals(U: Real, ks: Integer, cos_table: Real, sin_table: Real, out: Real) -> int:
    """Fill `out` with the angles at which a motion reverses, ascending; return their number."""
    top = max(ks[-1], 1)
    c, s = np.empty(top + 1), np.empty(top + 1)
    unpack(U, ks, c, s)
    for k in range(top + 1):
        c[k], s[k] = k * s[k], -k * c[k]
    intervals = np.empty((top + 1, 2))
    count = positive_intervals(c, s, top, cos_table, sin_table, intervals)
    if count <= 0:
        return 0
    ends = np.sort(intervals[:count].copy().reshape(2 * count) % _TURN)
    kept = 0
    for end in ends:
        if kept == 0 or end - out[kept - 1] > _SHORTEST:
            out[kept] = end
            kept += 1
    return kept


@compiled
def _steps_between(halves: float, count: int) -> int:
    """Return the steps between two reversals, `halves` half periods apart: about count/2 for each of these.

    They change by factors of two, at lengths of 0.7 half periods times such factors: if they followed every
    length, an answer would jump wherever they change, and Newton's method never end on it.
    """
    steps = 16 * max(math.ceil(count / 32), 1)
    while halves > _LONGEST:
        halves *= 0.5
        steps *= 2
    while halves <= 0.5 * _LONGEST and steps % 4 == 0:
        halves *= 2.0
        steps //= 2
    return steps


@apart
def nodes_between(turns: Real, found: int, count: int, tau: Real, weight: Real) -> int:
    """Fill nodes between reversals, about `count` in a period; return their number.

    The first is the first reversal, the last the same a period later; its weight is that of both.
    """
    at = 0
    tau[0], weight[0] = turns[0], 0.0
    for i in range(found):
        begin = turns[i]
        end = turns[i + 1] if i + 1 < found else turns[0] + _TURN
        steps = _steps_between((end - begin) / math.pi, count)
        h = (end - begin) / steps
        weight[at] += h / 3.0
        for j in range(1, steps + 1):
            tau[at + j] = begin + j * h
            weight[at + j] = h / 3.0 * (1.0 if j == steps else 4.0 if j % 2 == 1 else 2.0)
        at += steps
    weight[at] += weight[0]
    weight[0] = 0.0
    return at


@apart
def fill_basis(ks: Integer, tau: Real, count: int, halves: int, basis: Real) -> None:
    """Fill `basis` (halves·count + 1, n) with the Fourier basis at the nodes and, with 2, midway too."""
    for j in range(halves * count + 1):
        i = j // halves
        angle = tau[i] if j % halves == 0 else 0.5 * (tau[i] + tau[i + 1])
        cosine, sine = math.cos(angle), math.sin(angle)
        x, y, k = 1.0, 0.0, 0
        for h in range(ks.size):
            while k < ks[h]:
                x, y = x * cosine - y * sine, x * sine + y * cosine
                k += 1
            here = cosine_position(ks, h)
            basis[j, here] = x
            if ks[h] > 0:
                basis[j, here + 1] = y


@compiled
def fill_velocity(ks: Integer, omega: float, basis: Real, out: Real) -> None:
    """Fill `out` (n + more,) with the derivative by time [1/s] of the basis at one node."""
    for h in range(ks.size):
        here = cosine_position(ks, h)
        if ks[h] == 0:
            out[here] = 0.0
        else:
            out[here], out[here + 1] = -ks[h] * omega * basis[here + 1], ks[h] * omega * basis[here]


@compiled
def motion_at(U: Real, ks: Integer, omega: float, basis: Real) -> tuple[float, float]:
    """Return the motion [m] and its velocity [m/s] at one node."""
    u, v = 0.0, 0.0
    for h in range(ks.size):
        here = cosine_position(ks, h)
        u += U[here] * basis[here]
        if ks[h] > 0:
            u += U[here + 1] * basis[here + 1]
            v += ks[h] * (U[here + 1] * basis[here] - U[here] * basis[here + 1])
    return u, omega * v
