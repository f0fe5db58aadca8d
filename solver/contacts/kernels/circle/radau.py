"""Collocation at Radau's points: nodes, weights and derivatives on the unit interval.

With the right end among the nodes the method is L-stable, and of order 2·STAGES − 1 at the end of a step and
for integrals over it. E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.5.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from solver.jit.decorators import compiled
from solver.jit.fourier import Real

STAGES = 10


def _nodes() -> Real:
    """Return the zeros of P_s − P_(s−1), moved from [−1, 1] to [0, 1]; the last one is 1."""
    series = np.zeros(STAGES + 1)
    series[-2:] = -1.0, 1.0
    roots = np.sort(legendre.legroots(series).real)
    slope = legendre.legder(series)
    for _ in range(3):
        roots = roots - legendre.legval(roots, series) / legendre.legval(roots, slope)
    roots[-1] = 1.0
    return np.asarray(0.5 * (1.0 + roots))


def _weights(nodes: Real) -> Real:
    """Return the weights with which the nodes integrate polynomials over [0, 1]."""
    moments = np.zeros(STAGES)
    moments[0] = 1.0
    return np.asarray(np.linalg.solve(legendre.legvander(2.0 * nodes - 1.0, STAGES - 1).T, moments))


def _barycentric(points: Real) -> Real:
    gaps = points[:, None] - points[None, :]
    np.fill_diagonal(gaps, 1.0)
    return np.asarray(1.0 / gaps.prod(axis=1))


def _derivatives(points: Real, share: Real) -> Real:
    """Return the matrix from values at `points` to the slopes of their polynomial at all but the first."""
    gaps = points[:, None] - points[None, :]
    np.fill_diagonal(gaps, 1.0)
    matrix = share[None, :] / share[:, None] / gaps
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return np.ascontiguousarray(matrix[1:])


def _last_terms(points: Real) -> Real:
    """Return the rows that give the last two Legendre coefficients of the polynomial through `points`."""
    return np.ascontiguousarray(np.linalg.inv(legendre.legvander(2.0 * points - 1.0, STAGES))[-2:])


NODES = _nodes()
WEIGHTS = _weights(NODES)
POINTS = np.concatenate([[0.0], NODES])  # the begin of a step and its nodes
SHARES = _barycentric(POINTS)
SLOPES = _derivatives(POINTS, SHARES)  # (STAGES, STAGES + 1)
TAIL = _last_terms(POINTS)  # (2, STAGES + 1)


@compiled
def between(start: float, stages: Real, place: float) -> float:
    """Return the polynomial through `start` and the values at the nodes at a place in [0, 1]."""
    above, below = 0.0, 0.0
    for i in range(STAGES + 1):
        value = start if i == 0 else stages[i - 1]
        gap = place - POINTS[i]
        if gap == 0.0:
            return value
        share = SHARES[i] / gap
        above += share * value
        below += share
    return above / below


@compiled
def tail(start: float, stages: Real) -> float:
    """Return the size of the last two Legendre coefficients of the polynomial through them."""
    last, before = TAIL[1, 0] * start, TAIL[0, 0] * start
    for i in range(STAGES):
        last += TAIL[1, i + 1] * stages[i]
        before += TAIL[0, i + 1] * stages[i]
    return max(abs(last), abs(before))
