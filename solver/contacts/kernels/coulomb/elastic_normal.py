"""Elastic Coulomb friction under a load that moves with the contact: N is the given load and kn v.

Two relative motions, the tangential u and the normal v. The friction force is the closed form of
`solver.contacts.kernels.coulomb.force` for a load with the harmonics of v, its derivative by v is kn ∂T/∂N.
The normal force on the normal pair is max(N, 0); the friction march has found the intervals of contact, so
its coefficients are their moments: P = Σ ∫ N e. N is 0 where they begin and end, so these places drop out of
every derivative.

Reference: Yang, Chu, Menq, J. Sound Vib. 210 (1998) 461, doi:10.1006/jsvi.1997.1305; multi-harmonic form
Petrov, Ewins, J. Turbomach. 125 (2003) 364, doi:10.1115/1.1539868.
"""

from __future__ import annotations

import numpy as np

from solver.contacts.kernels.columns import KN, KT, MU, PRESTRESSED
from solver.contacts.kernels.coulomb.force import add_moments, contact_force, products
from solver.contacts.kernels.stick_slip_events import BEGIN, END, FAILED, LIFTING, SEPARATED, piece_of
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import fill_block
from solver.jit.separate import apart


@compiled
def merged(a: Integer, b: Integer) -> Integer:
    """Return the ascending harmonics that are in `a` or in `b`."""
    out = np.empty(a.size + b.size, np.int64)
    i, j, count = 0, 0, 0
    while i < a.size or j < b.size:
        take = a[i] if j >= b.size or (i < a.size and a[i] <= b[j]) else b[j]
        if i < a.size and a[i] == take:
            i += 1
        if j < b.size and b[j] == take:
            j += 1
        out[count] = take
        count += 1
    return out[:count].copy()


@compiled
def positions(ks: Integer, inside: Integer) -> Integer:
    """Return where the coefficients of the harmonics `ks` stand among those of `inside`, a larger set."""
    out = np.empty(coefficient_count(ks), np.int64)
    at = 0
    for i in range(ks.size):
        while inside[at] < ks[i]:
            at += 1
        here, there = cosine_position(ks, i), cosine_position(inside, at)
        out[here] = there
        if ks[i] > 0:
            out[here + 1] = there + 1
    return out


@apart
def elastic_normal(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill friction (port 0) and normal force (port 1), their Jacobian and their derivative by λ.

    The arguments are those of `solver.contacts.kernels.laws`. With `row[PRESTRESSED]` the normal force is
    counted from the state in which the mean load (if positive) is in equilibrium already: P less that.
    """
    n, kn = U.shape[1], row[KN]
    all_ks = merged(ks, load_ks)
    of_motion, of_load = positions(ks, all_ks), positions(load_ks, all_ks)
    most = coefficient_count(all_ks)
    N, dN = np.zeros(most), np.zeros(most)
    for i in range(n):
        N[of_motion[i]] += kn * U[1, i]
        dN[of_motion[i]] += slope[KN] * U[1, i]
    for j in range(load.size):
        N[of_load[j]] += load[j]
        dN[of_load[j]] += dload[j]
    dT_dkt, dT_dmu, dT_dN = np.empty(n), np.empty(n), np.empty((n, most))
    state, count = contact_force(
        U[0], ks, N, all_ks, row[KT], row[MU], cos_table, sin_table, segments, dF_dU[0], dT_dkt, dT_dmu,
        dT_dN, F[0],
    )  # fmt: skip
    if state == FAILED:
        return FAILED, 0
    dP_dN = np.empty((n, most))
    _normal_by_load(state, segments, count, ks, all_ks, of_motion, dP_dN)
    fill_block(dF_dU[2], 0.0)
    for i in range(n):
        friction = slope[KT] * dT_dkt[i] + slope[MU] * dT_dmu[i]
        normal, dnormal = 0.0, 0.0
        for j in range(most):
            friction += dT_dN[i, j] * dN[j]
            normal += dP_dN[i, j] * N[j]
            dnormal += dP_dN[i, j] * dN[j]
        F[1, i], dF_dp[0, i], dF_dp[1, i] = normal, friction, dnormal
        for j in range(n):
            dF_dU[1, i, j] = kn * dT_dN[i, of_motion[j]]
            dF_dU[3, i, j] = kn * dP_dN[i, of_motion[j]]
    if row[PRESTRESSED] > 0.0 and load[0] > 0.0 and ks[0] == 0:
        F[1, 0] -= load[0]
        dF_dp[1, 0] -= dload[0]
    return state, piece_of(segments, count)


@apart
def _normal_by_load(
    state: int, segments: Real, count: int, ks: Integer, all_ks: Integer, of_motion: Integer, dP_dN: Real
) -> None:
    """Fill ∂P/∂N: nothing if separated, the identity if always closed, else from the intervals of contact."""
    if state == LIFTING:
        top = ks[-1] + all_ks[-1]
        cosines, sines = np.zeros(top + 1), np.zeros(top + 1)
        for i in range(count):
            add_moments(segments[i, BEGIN], segments[i, END], 1.0, cosines, sines)
        products(cosines, sines, ks, all_ks, 1.0, dP_dN)
        return
    fill_block(dP_dN, 0.0)
    if state != SEPARATED:
        for i in range(of_motion.size):
            dP_dN[i, of_motion[i]] = 1.0
