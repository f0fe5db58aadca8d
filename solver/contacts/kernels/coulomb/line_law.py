"""Elastic Coulomb friction along one line, or two with limits of their own, under a load given or moving.

Ports: the tangential motions u, or u and w, and behind them, where the load moves, the normal motion v: the
load is then N = load + kn v. Each direction is the closed form of `line_force` for
that load; its derivative by v is kn ∂T/∂N. The normal force on the normal pair is max(N, 0); the friction
march has found the intervals of contact, so its coefficients are their moments: P = Σ ∫ N e. N is 0 where
they begin and end, so these places drop out of every derivative.

The arguments are those of `solver.contacts.kernels.laws`.

Reference: Yang, Chu, Menq, J. Sound Vib. 210 (1998) 461, doi:10.1006/jsvi.1997.1305; multi-harmonic form
Petrov, Ewins, J. Turbomach. 125 (2003) 364, doi:10.1115/1.1539868.

Where a dashpot stands beside the spring, both behind one slider, a stuck force is kt u + c u' + constant, and
nothing but the sum counts: it is the element without dashpot of the motion u + (c/kt) u', whose coefficients
are (1 + ikω c/kt) times those of u.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.columns import C_STICK, KN, KT, KT_SECOND, MU, OMEGA, PRESTRESSED
from solver.contacts.kernels.coulomb.line_force import add_moments, contact_force, products
from solver.contacts.kernels.stick_slip_events import FAILED, LIFTING, SEPARATED, piece_of
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position, merged, positions
from solver.jit.kernel_records import Records
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart

_PIECES = 1_000_003  # more than there are pieces of one direction that differ in practice


@compiled
def with_second(row: Real, slope: Real) -> tuple[Real, Real]:
    """Return copies of both in which the second stiffness is that of the first where it follows it (NaN)."""
    given, moved = row.copy(), slope.copy()
    if math.isnan(row[KT_SECOND]):
        given[KT_SECOND], moved[KT_SECOND] = row[KT], slope[KT]
    return given, moved


@compiled
def load_of(
    U: NDArray[Any], directions: int, load: NDArray[Any], kn: Any, of_motion: Integer, of_load: Integer,
    N: NDArray[Any],
) -> None:  # fmt: skip
    """Fill N with the given load and, where there is a normal port, kn times its motion.

    `of_motion` and `of_load` say where the coefficients of both stand among those of N.
    """
    fill(N, 0.0)
    for j in range(load.size):
        N[of_load[j]] += load[j]
    if U.shape[0] > directions:
        for i in range(U.shape[1]):
            N[of_motion[i]] += kn * U[directions, i]


@compiled
def contact_of(segments: Records, count: int, intervals: Real) -> int:
    """Fill `intervals` with [begin, end] of every interval of contact of a march; return their number."""
    found = 0
    for i in range(count):
        if found > 0 and segments[i].begin == intervals[found - 1, 1]:
            intervals[found - 1, 1] = segments[i].end
            continue
        intervals[found, 0], intervals[found, 1] = segments[i].begin, segments[i].end
        found += 1
    return found


@apart
def press(
    state: int, intervals: Real, ks: Integer, all_ks: Integer, of_motion: Integer, row: Real, N: Real,
    dN: Real, given: float, dgiven: float, P: Real, dP_dv: Real, dP_dp: Real,
) -> None:  # fmt: skip
    """Fill the normal force max(N, 0): nothing if separated, N if always closed, else from the intervals.

    Of a prestressed contact it counts from the state in which a positive mean load is in equilibrium.

    Parameters
    ----------
    N, dN : (size,) coefficients of the load for `all_ks` and their derivative by λ.
    given, dgiven : mean of the given load, and its derivative.
    P, dP_dp : (n,), filled; dP_dv : (1, n, n), filled, or of no block where no derivative is wanted.
    """
    n, size = P.size, N.size
    for block in dP_dv:
        fill_block(block, 0.0)
    if state == LIFTING:
        cosines, sines = np.zeros(ks[-1] + all_ks[-1] + 1), np.zeros(ks[-1] + all_ks[-1] + 1)
        dP_dN = np.empty((n, size))
        for i in range(intervals.shape[0]):
            add_moments(intervals[i, 0], intervals[i, 1], 1.0, cosines, sines)
        products(cosines, sines, ks, all_ks, 1.0, dP_dN)
        for i in range(n):
            P[i], dP_dp[i] = dot(dP_dN[i], N), dot(dP_dN[i], dN)
            for block in dP_dv:
                for j in range(n):
                    block[i, j] = row[KN] * dP_dN[i, of_motion[j]]
    else:
        closed = 0.0 if state == SEPARATED else 1.0
        for i in range(n):
            P[i], dP_dp[i] = closed * N[of_motion[i]], closed * dN[of_motion[i]]
            for block in dP_dv:
                block[i, i] = closed * row[KN]
    if row[PRESTRESSED] > 0.0 and given > 0.0 and ks[0] == 0:
        P[0] -= given
        dP_dp[0] -= dgiven


@compiled
def along_parameter(
    dkt: float, dmu: float, dN: Real, by_kt: Real, by_mu: Real, by_N: Real, dF_dp: Real
) -> None:
    """Fill the derivative of a force by λ from those by kt, μ and the load."""
    for i in range(dF_dp.size):
        total = dkt * by_kt[i] + dmu * by_mu[i]
        for j in range(dN.size):
            total += by_N[i, j] * dN[j]
        dF_dp[i] = total


@compiled
def _rub(
    directions: int, second: int, U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real,
    dload: Real, cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the forces of `directions` ports, and of the normal one if there is one more.

    `second` is the column of the stiffness of all directions but the first.
    """
    m, n = U.shape
    moves, all_ks, of_motion, N, dN = m > directions, load_ks, ks, load, dload
    if moves:
        all_ks = merged(ks, load_ks)
        of_motion, of_load = positions(ks, all_ks), positions(load_ks, all_ks)
        N, dN = np.empty(coefficient_count(all_ks)), np.empty(coefficient_count(all_ks))
        load_of(U, directions, load, row[KN], of_motion, of_load, N)
        load_of(U, directions, dload, slope[KN], of_motion, of_load, dN)
    size = N.size
    work = np.empty(n * (2 + size))  # one piece of memory: an element takes a few microseconds
    by_kt, by_mu, by_N = work[:n], work[n : 2 * n], work[2 * n :].reshape((n, size))
    together, piece, count = SEPARATED, 0, 0
    for a in range(directions):
        column = KT if a == 0 else second
        state, count = contact_force(
            U[a], ks, N, all_ks, row[column], row[MU], cos_table, sin_table, segments, dF_dU[a * m + a],
            by_kt, by_mu, by_N, F[a],
        )  # fmt: skip
        if state == FAILED:
            return FAILED, 0
        # Under one load: separated or lifting both, else slipping where one slips.
        together, piece = max(together, state), _PIECES * piece + piece_of(segments, count)
        along_parameter(slope[column], slope[MU], dN, by_kt, by_mu, by_N, dF_dp[a])
        for b in range(m):
            if b != a:
                fill_block(dF_dU[a * m + b], 0.0)
        if moves:
            for i in range(n):
                for j in range(n):
                    dF_dU[a * m + directions, i, j] = row[KN] * by_N[i, of_motion[j]]
            fill_block(dF_dU[directions * m + a], 0.0)
    if moves:
        intervals = np.empty((count, 2))
        press(
            together, intervals[: contact_of(segments, count, intervals)], ks, all_ks, of_motion, row, N, dN,
            load[0], dload[0], F[directions], dF_dU[m * m - 1 :], dF_dp[directions],
        )  # fmt: skip
    return together, piece


@apart
def coulomb_line(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the friction along one line, and the normal force where the load moves."""
    return _rub(
        1, KT, U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
    )


@apart
def coulomb_box(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the friction along two lines with a limit each, and the normal force where the load moves."""
    row, slope = with_second(row, slope)
    return _rub(
        2, KT_SECOND, U, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
    )


@apart
def damped_line(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the friction, and its derivatives by the motion, the parameters and the frequency."""
    lead = row[OMEGA] * row[C_STICK] / row[KT]
    d_lead = (slope[OMEGA] * row[C_STICK] + row[OMEGA] * slope[C_STICK] - lead * slope[KT]) / row[KT]
    felt = U.copy()
    for h in range(ks.size):
        if ks[h] > 0:
            i, k = cosine_position(ks, h), ks[h]
            felt[0, i] += lead * k * U[0, i + 1]
            felt[0, i + 1] -= lead * k * U[0, i]
    found = coulomb_line(
        felt, ks, load, load_ks, row, slope, dload, cos_table, sin_table, segments, F, dF_dU, dF_dp
    )
    for h in range(ks.size):
        if ks[h] > 0:
            i, k = cosine_position(ks, h), ks[h]
            for a in range(U.shape[1]):
                by_cosine, by_sine = dF_dU[0, a, i], dF_dU[0, a, i + 1]
                dF_dp[0, a] += d_lead * k * (by_cosine * U[0, i + 1] - by_sine * U[0, i])
                dF_dU[0, a, i] = by_cosine - lead * k * by_sine
                dF_dU[0, a, i + 1] = by_sine + lead * k * by_cosine
    return found
