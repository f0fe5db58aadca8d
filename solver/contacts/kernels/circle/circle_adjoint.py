"""One panel of a slip in the derivatives of the force: the transpose of its collocation.

See `circle_gradient`; real or complex as `solver.contacts.kernels.circle.panels`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.panels import (
    LIMIT,
    NODES,
    SLOPES,
    STAGES,
    WEIGHTS,
    Array,
    Curves,
    Number,
    X,
    Y,
    solve_columns,
    turning_by,
)
from solver.contacts.kernels.coulomb.line_force import bases_by
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer
from solver.jit.kernel_records import Row
from solver.jit.separate import apart
from solver.jit.trig_polynomial import cosines_and_sines

# Sums over sticks (1), and over slips weighted by cos θ and sin θ, of cos qτ and sin qτ.
STUCK_COS, STUCK_SIN, ALONG_COS, ALONG_SIN, ACROSS_COS, ACROSS_SIN = 0, 1, 2, 3, 4, 5


@compiled
def _slip_moments(cosines: Array, sines: Array, along: Array, across: Array, sums: Array) -> None:
    """Add along·(cos qτ, sin qτ) and across·(…) at the nodes to the sums over slips, two nodes at once.

    `cosines` and `sines` are those of τ.
    """
    for i in range(0, STAGES, 2):
        j = i + 1
        a1, b1, c1, d1 = cosines[i], sines[i], cosines[j], sines[j]
        a, b = 0.0 * a1 + 1.0, 0.0 * a1
        c, d = a, b
        for q in range(sums.shape[1]):
            sums[ALONG_COS, q] += along[i] * a + along[j] * c
            sums[ALONG_SIN, q] += along[i] * b + along[j] * d
            sums[ACROSS_COS, q] += across[i] * a + across[j] * c
            sums[ACROSS_SIN, q] += across[i] * b + across[j] * d
            a, b = a * a1 - b * b1, b * a1 + a * b1
            c, d = c * c1 - d * d1, d * c1 + c * d1


@compiled
def _curves_of_basis(packed: Array, e: Array, de: Array) -> Curves:
    """Return L and the slopes of X, Y and L from the basis at a point; the rest is 0."""
    x, y, load, rise = 0.0 * packed[0, 0], 0.0 * packed[0, 0], 0.0 * packed[0, 0], 0.0 * packed[0, 0]
    for j in range(e.size):
        x += packed[X, j] * de[j]
        y += packed[Y, j] * de[j]
        load += packed[LIMIT, j] * e[j]
        rise += packed[LIMIT, j] * de[j]
    none = 0.0 * packed[0, 0]
    return Curves(none, none, load, x, y, rise, none, none, none)


@compiled
def _table_row(e: Array, de: Array, c: Number, s: Number, turn: Number, more: Number, row: Array) -> None:
    """Fill −∂R/∂(X, Y, L) at a node; `turn` is gθ' and `more` (κ − 1) sin θ cos θ."""
    size = e.size
    for j in range(size):
        row[j] = -s * de[j]
    for j in range(size):
        row[size + j] = c * de[j]
    for j in range(size):
        row[2 * size + j] = -turn * e[j] - more * de[j]


@compiled
def _weigh(kept: Array, c: Number, s: Number, weights: Array, F: Array, line: Array) -> None:
    """Add a node's part of the force to F, and fill its derivative by θ there for every integral."""
    n = kept.size
    for j in range(n):
        F[0, j] += c * kept[j]
        F[1, j] += s * kept[j]
    if weights.shape[0] == 0:
        for j in range(n):
            line[j] = -s * kept[j]
        for j in range(n):
            line[n + j] = c * kept[j]
        return
    for r in range(weights.shape[0]):
        for j in range(n):
            line[r] += (c * weights[r, 1, j] - s * weights[r, 0, j]) * kept[j]


@apart
def panel_back(
    packed: Array, kappa: Number, all_ks: Integer, panel: Row, weights: Array, of_motion: Integer,
    active: bool, eta: Array, sums: Array, F: Array, table: Array, adjoint: Array,
) -> None:  # fmt: skip
    """Go back over a panel of a slip: η (of θ) at its begin from that at its end.

    What the panel adds to the gradient is adjointᵀ · table, with `table` (STAGES, 3·size + 1) of
    −∂R/∂(X, Y, L, κ) and `adjoint` (STAGES, m), filled.
    """
    dtype, m, n = packed.dtype, eta.size, of_motion.size
    size = packed.shape[1]
    basis = np.empty((3, size), dtype)
    e, de, kept = basis[0], basis[1], basis[2, :n]
    matrix, first = np.empty((STAGES, STAGES), dtype), np.empty(STAGES, dtype)
    begin, h = panel.begin, panel.end - panel.begin
    times, waves = np.empty((3, STAGES), dtype), np.empty((4, STAGES), dtype)
    for i in range(STAGES):
        times[0, i] = begin + h * NODES[i]
    cosines_and_sines(times[0], times[1], times[2])
    cosines_and_sines(panel.theta, waves[0], waves[1])
    for i in range(STAGES):
        c, s = waves[0, i], waves[1, i]
        bases_by(times[1, i], times[2, i], all_ks, e, de)
        at = _curves_of_basis(packed, e, de)
        _, slope, g, dg = turning_by(at, kappa, c, s)
        rate = SLOPES[i, 0] * panel.start
        for j in range(STAGES):
            rate += SLOPES[i, j + 1] * panel.theta[j]
        rate /= h
        factor = at.limit * g / h
        for j in range(STAGES):
            matrix[j, i] = factor * SLOPES[i, j + 1]
        matrix[i, i] += at.limit * dg * rate - slope
        first[i] = factor * SLOPES[i, 0]
        _table_row(e, de, c, s, g * rate, (kappa - 1.0) * s * c, table[i])
        table[i, 3 * size] = -at.limit * c * c * rate - s * c * at.dlimit
        line = adjoint[i]
        for r in range(m):
            line[r] = 0.0 * eta[r]
        if not active:
            continue
        share = h * WEIGHTS[i]
        waves[2, i], waves[3, i] = share * c, share * s
        norm = share * at.limit / math.pi
        for j in range(n):
            kept[j] = norm * e[of_motion[j]]
        if all_ks[0] == 0 and of_motion[0] == 0:
            kept[0] *= 0.5
        _weigh(kept, c, s, weights, F, line)
    if active:
        _slip_moments(times[1], times[2], waves[2], waves[3], sums)
    for r in range(m):
        adjoint[STAGES - 1, r] += eta[r]
    solve_columns(matrix, adjoint)
    for r in range(m):
        eta[r] = -first[0] * adjoint[0, r]
    for i in range(1, STAGES):
        for r in range(m):
            eta[r] -= first[i] * adjoint[i, r]
