"""Elastic Coulomb friction along a line with a given load behind the contract of the laws: in closed form, or
by samples.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.columns import KT, MU, SAMPLES
from solver.contacts.kernels.coulomb.aft import sampled_force
from solver.contacts.kernels.coulomb.force import contact_force
from solver.contacts.kernels.stick_slip_events import FAILED, piece_of
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.separate import apart


@compiled
def _along_parameter(
    slope: Real, dload: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real, dF_dp: Real
) -> None:  # fmt: skip
    """Fill the derivative of a force by λ from those by kt, mu and the load."""
    for i in range(dF_dp.size):
        total = slope[KT] * dF_dkt[i] + slope[MU] * dF_dmu[i]
        for j in range(dload.size):
            total += dF_dN[i, j] * dload[j]
        dF_dp[i] = total


@apart
def coulomb_line(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force, its Jacobian and its derivative by λ in closed form (as in the contract)."""
    n = U.shape[1]
    work = np.empty(n * (2 + load.size))  # one piece of memory: an element takes a few microseconds
    dF_dkt, dF_dmu, dF_dN = work[:n], work[n : 2 * n], work[2 * n :].reshape((n, load.size))
    state, count = contact_force(
        U[0], ks, load, load_ks, row[KT], row[MU], cos_table, sin_table, segments, dF_dU[0], dF_dkt, dF_dmu,
        dF_dN, F[0],
    )  # fmt: skip
    if state == FAILED:
        return FAILED, 0
    _along_parameter(slope, dload, dF_dkt, dF_dmu, dF_dN, dF_dp[0])
    return state, piece_of(segments, count)


@apart
def coulomb_sampled(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the same by `row[SAMPLES]` samples of a period instead (as in the contract)."""
    n = U.shape[1]
    dF_dkt, dF_dmu, dF_dN = np.empty(n), np.empty(n), np.empty((n, load.size))
    state, count = sampled_force(
        U[0], ks, load, load_ks, row[KT], row[MU], int(row[SAMPLES]), segments, dF_dU[0], dF_dkt, dF_dmu,
        dF_dN, F[0],
    )  # fmt: skip
    _along_parameter(slope, dload, dF_dkt, dF_dmu, dF_dN, dF_dp[0])
    return state, piece_of(segments, count)
