"""Elastic Coulomb friction in two tangential directions, each limited by itself, under a load that may move.

Ports and columns are those of `solver.contacts.kernels.circle.law`. Each direction is the closed form of
`solver.contacts.kernels.coulomb.force` for a load with the harmonics of the motion; the normal force comes
from the intervals of contact, which both directions share.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.circle.law import load_of, press, with_second
from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.elastic_normal import merged, positions
from solver.contacts.kernels.coulomb.force import contact_force
from solver.contacts.kernels.stick_slip_events import (
    BEGIN,
    END,
    FAILED,
    LIFTING,
    SEPARATED,
    SLIPPING,
    STUCK,
    piece_of,
)
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.lapack import fill_block
from solver.jit.separate import apart


@apart
def coulomb_box(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force of two or three ports, its Jacobian and its derivative by λ; box limit."""
    row, slope = with_second(row, slope)
    m, n = U.shape
    all_ks = merged(ks, load_ks)
    size, of_motion = coefficient_count(all_ks), positions(ks, all_ks)
    N, dN, by_load = np.empty(size), np.empty(size), np.empty((n, size))
    by_kt, by_mu = np.empty(n), np.empty(n)
    load_of(U, ks, load, load_ks, row[KN], all_ks, N)
    load_of(U, ks, dload, load_ks, slope[KN], all_ks, dN)
    for block in range(m * m):
        fill_block(dF_dU[block], 0.0)
    fill_block(F, 0.0)
    fill_block(dF_dp, 0.0)
    stuck, lifting, separated, piece, count = True, False, True, 0, 0
    for a in range(2):
        column = KT if a == 0 else KT_SECOND
        state, count = contact_force(
            U[a], ks, N, all_ks, row[column], row[MU], cos_table, sin_table, segments, dF_dU[a * m + a],
            by_kt, by_mu, by_load, F[a],
        )  # fmt: skip
        if state == FAILED:
            return FAILED, piece
        stuck = stuck and state == STUCK
        lifting = lifting or state == LIFTING
        separated = separated and state == SEPARATED
        piece = 1_000_003 * piece + piece_of(segments, count)
        for i in range(n):
            total = slope[column] * by_kt[i] + slope[MU] * by_mu[i]
            for j in range(size):
                total += by_load[i, j] * dN[j]
            dF_dp[a, i] = total
            if m > 2:
                for j in range(n):
                    dF_dU[a * m + 2, i, j] = row[KN] * by_load[i, of_motion[j]]
    together = SEPARATED if separated else (STUCK if stuck else (LIFTING if lifting else SLIPPING))
    if m > 2:
        intervals = np.empty((count, 2))
        for i in range(count):
            intervals[i, 0], intervals[i, 1] = segments[i, BEGIN], segments[i, END]
        press(U, ks, load, load_ks, row, slope, dload, together, intervals, F[2], dF_dU[8:], dF_dp[2])
    return together, piece
