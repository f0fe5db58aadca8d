"""Second derivatives of the springs of `solver.contacts.kernels.springs.force`, behind the contract.

The arguments are those of `solver.contacts.kernels.laws`. With W = w·e: of the gap spring the gradient
by the motion is k ∫W e over the intervals of contact, whose ends move by −(du − dgap)/u'; of a polynomial f
it is ∫W f'(u) e, and its derivative along du and df is ∫W (f''(u) du + df'(u)) e.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import A_1, CLOSED, DEFORMING, GAP, K_GAP, MOST_DEGREE, TOUCHING
from solver.contacts.kernels.coulomb.force import add_moments, bases_at, basis_at, moment_rows, products
from solver.contacts.kernels.coulomb.second_law import weight_at
from solver.contacts.kernels.springs.force import positive_intervals
from solver.contacts.kernels.stick_slip_events import SEPARATED
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart
from solver.jit.trig_polynomial import unpack


@apart
def gap_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate `solver.contacts.kernels.springs.force.gap_spring` (as in the contract)."""
    n, top = coefficient_count(ks), max(ks[-1], 1)
    fill_block(out_U, 0.0)
    fill(out_row, 0.0)
    fill(out_load, 0.0)
    c, s, intervals = np.empty(top + 1), np.empty(top + 1), np.empty((top + 1, 2))
    unpack(U[0], ks, c, s)
    c[0] -= row[GAP]
    count = positive_intervals(c, s, top, cos_table, sin_table, intervals)
    cosines, sines = np.zeros(2 * top + 1), np.zeros(2 * top + 1)
    if count < 0:
        cosines[0] = 2.0 * math.pi
    k, dk, dgap = row[K_GAP], drow[K_GAP], drow[GAP]
    e, de = np.empty(n), np.empty(n)
    for i in range(count):
        add_moments(intervals[i, 0], intervals[i, 1], 1.0, cosines, sines)
        for side in range(2):
            bases_at(intervals[i, side], ks, e, de)
            factor = k * weight_at(ks, w[0], e) * (dot(e, dU[0]) - dgap) / abs(dot(de, U[0]))
            for j in range(n):
                out_U[0, j] += factor * e[j]
            out_row[GAP] -= factor
    block, constant = np.empty((n, n)), np.empty(n)
    products(cosines, sines, ks, ks, 1.0, block)
    moment_rows(cosines, sines, ks, constant)
    held = dot(w[0], constant)
    for j in range(n):
        pull = 0.0
        for i in range(n):
            pull += w[0, i] * block[i, j]
        out_U[0, j] += dk * pull
        out_row[K_GAP] += pull * dU[0, j]
    out_row[K_GAP] -= held * dgap
    out_row[GAP] -= held * dk
    if count == 0:
        return SEPARATED
    # Of literals alone the type of the result would be those literals.
    return int(np.int64(CLOSED if count < 0 else TOUCHING))


@apart
def polynomial_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate `solver.contacts.kernels.springs.force.polynomial_spring` (as in the contract).

    Every power has a derivative, also one whose coefficient is 0, so that samples are enough for the highest.
    """
    n, top = coefficient_count(ks), max(ks[-1], 1)
    fill_block(out_U, 0.0)
    fill(out_row, 0.0)
    fill(out_load, 0.0)
    samples = (MOST_DEGREE + 1) * top + 1
    share, e = 2.0 * math.pi / samples, np.empty(n)
    for j in range(samples):
        basis_at(share * j, ks, e)
        u, du = dot(U[0], e), dot(dU[0], e)
        weight, bend, turn = share * weight_at(ks, w[0], e), 0.0, 0.0
        for d in range(MOST_DEGREE, 0, -1):
            turn = turn * u + d * drow[A_1 + d - 1]
            if d > 1:
                bend = bend * u + d * (d - 1) * row[A_1 + d - 1]
        for i in range(n):
            out_U[0, i] += weight * (bend * du + turn) * e[i]
        power = weight * du
        for d in range(1, MOST_DEGREE + 1):
            out_row[A_1 + d - 1] += d * power
            power *= u
    return int(np.int64(DEFORMING))
