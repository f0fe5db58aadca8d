"""Slopes of the contact forces in the balance: G = ∂F/∂U less the shift, and products with it."""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.system import PINNED, UNHELD, Evaluation, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real, coefficient_count
from solver.jit.lapack import copy_block, fill
from solver.jit.separate import apart


@compiled
def springs_of(blocks: Real, slopes: Real) -> None:
    """Fill slopes (m,) with the stiffness of each port where the blocks of ∂F/∂U are a spring's, else NaN.

    Its force feels no other port's motion then, and no harmonic of it another one.
    """
    m = slopes.size
    for a in range(m):
        slopes[a] = blocks[a * m + a, 0, 0]
        for b in range(m):
            if not _is_diagonal(blocks[a * m + b], slopes[a] if a == b else 0.0):
                slopes[a] = np.nan
                break


@compiled
def _is_diagonal(block: Real, value: float) -> bool:
    """Return whether a block is `value` times the identity."""
    for i in range(block.shape[0]):
        for j in range(block.shape[1]):
            if block[i, j] != (value if i == j else 0.0):
                return False
    return True


@compiled
def take_slopes(system: System, point: Evaluation) -> None:
    """Fill G with dF/dU less the shift, with the slopes of `elastic` in it, and what `gauge` pins."""
    n = coefficient_count(system.ks)
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                block = system.first_block[e] + a * m + b
                G = point.G[block]
                copy_block(G, point.dF_dU[block])
                if a == b:
                    stiffness = system.shift[first + a]
                    for i in range(n):
                        G[i, i] -= stiffness
                    G[0, 0] += point.elastic[first + a]
    point.counts[PINNED] = point.counts[UNHELD]
    for k in range(point.counts[UNHELD]):
        for c in range(system.owner.size):
            point.pinned[k, c] = system.shift[c] * point.gauge[k, c]


@apart
def slopes_times(system: System, point: Evaluation, transposed: bool, x: Real, y: Real) -> None:
    """Fill y = G x over all ports, or Gᵀ x, with the stiffness that stands in for what holds loose parts.

    That is (kt l)(kt l)ᵀ on the means along the motions l of `gauge`, see
    `solver.balance.kernels.gauge.keep_means`: A₀ kt l = l.
    """
    n = coefficient_count(system.ks)
    fill(y, 0.0)
    for e in range(system.laws.size):
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for a in range(m):
            for b in range(m):
                G = point.G[system.first_block[e] + a * m + b]
                row, column = (first + a) * n, (first + b) * n
                for i in range(n):
                    if transposed:
                        value = x[row + i]
                        for j in range(n):
                            y[column + j] += G[i, j] * value
                    else:
                        total = 0.0
                        for j in range(n):
                            total += G[i, j] * x[column + j]
                        y[row + i] += total
    for k in range(point.counts[PINNED]):
        along = 0.0
        for c in range(system.owner.size):
            along += point.pinned[k, c] * x[c * n]
        for c in range(system.owner.size):
            y[c * n] += point.pinned[k, c] * along
