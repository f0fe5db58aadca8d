"""Second derivatives of friction along lines under one load, which may move with the contact.

Each direction is the closed form of `line_hessian`. Its force depends on X = kt U
and Y = μN alone: a change of kt is one of U by U dkt/kt, a change of μ one of N by N dμ/μ. A load that moves
is N = load + kn v, with dN = dload + dkn v + kn dv, so that of ℓ = w·F

    ∂ℓ/∂v = kn ∂ℓ/∂N,   d(∂ℓ/∂v) = kn d(∂ℓ/∂N) + dkn ∂ℓ/∂N,   d(∂ℓ/∂kn) = v d(∂ℓ/∂N) + dv ∂ℓ/∂N.

The normal force max(N, 0) has ∂ℓ/∂N = ∫W e over the intervals of contact, W = w·e, whose ends move by
−dN/N'.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.line_force import add_moments, bases_at, contact_force, products
from solver.contacts.kernels.coulomb.line_hessian import second_along
from solver.contacts.kernels.coulomb.line_law import contact_of, load_of, with_second
from solver.contacts.kernels.stick_slip_events import (
    FAILED,
    LIFTING,
    SEPARATED,
    new_segments,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, merged, positions
from solver.jit.kernel_records import Records
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart


@compiled
def weight_at(ks: Integer, w: Real, e: Real) -> float:
    """Return W = w·e where the basis is `e`, as it stands under the integral of a force coefficient."""
    total = dot(w, e) / math.pi
    return total - 0.5 * w[0] * e[0] / math.pi if ks[0] == 0 else total


@apart
def _along_line(
    u: Real, ks: Integer, N: Real, all_ks: Integer, kt: float, mu: float, cos_table: Real, sin_table: Real,
    w: Real, du: Real, dN: Real, dkt: float, dmu: float, segments: Records, out_u: Real, by_N: Real,
    g_N: Real, rates: Real,
) -> tuple[int, int]:  # fmt: skip
    """Differentiate the gradient of w·T of one direction; return its state and how many segments it has.

    `out_u` is filled, `rates` too (by kt and by μ); added to `by_N` is the derivative by the load along the
    direction, to `g_N` the gradient by the load.
    """
    n, size = u.size, N.size
    F, by_kt, by_mu = np.empty(n), np.empty(n), np.empty(n)
    by_u, by_load, along_N = np.empty((n, n)), np.empty((n, size)), np.empty(size)
    state, count = contact_force(
        u, ks, N, all_ks, kt, mu, cos_table, sin_table, segments, by_u, by_kt, by_mu, by_load, F
    )
    if state == FAILED:
        return FAILED, 0
    along_u, pressed = np.empty(n), np.empty(size)
    stretch, swell = dkt / kt, 0.0
    if dmu != 0.0:
        swell = dmu / mu if mu != 0.0 else np.nan
    for i in range(n):
        along_u[i] = du[i] + stretch * u[i]
    for j in range(size):
        pressed[j] = dN[j] + swell * N[j]
    rates[0], rates[1] = second_along(
        u, ks, N, all_ks, kt, mu, state, segments, count, by_u, by_load, w, along_u, pressed, out_u, along_N
    )
    for j in range(size):
        pull = 0.0
        for i in range(n):
            pull += w[i] * by_load[i, j]
        g_N[j] += pull
        by_N[j] += along_N[j] + (swell * pull if dmu != 0.0 else 0.0)
    if dkt != 0.0:
        rates[0] -= stretch * dot(w, by_kt)
        for j in range(n):
            for i in range(n):
                out_u[j] += stretch * w[i] * by_u[i, j]
    if dmu != 0.0:
        rates[1] -= swell * dot(w, by_mu)
    return state, count


@apart
def _pressing(
    N: Real, all_ks: Integer, ks: Integer, state: int, intervals: Real, w: Real, dN: Real,
    of_motion: Integer, by_N: Real, g_N: Real,
) -> None:  # fmt: skip
    """Add the same of w·P, P the coefficients of max(N, 0), from the intervals of contact."""
    n, size = w.size, N.size
    if state == SEPARATED:
        return
    if state != LIFTING:
        for i in range(n):
            g_N[of_motion[i]] += w[i]
        return
    top = ks[-1] + all_ks[-1]
    cosines, sines, block = np.zeros(top + 1), np.zeros(top + 1), np.empty((n, size))
    over, slopes, e, de = np.empty(size), np.empty(size), np.empty(n), np.empty(n)
    for index in range(intervals.shape[0]):
        add_moments(intervals[index, 0], intervals[index, 1], 1.0, cosines, sines)
        for side in range(2):
            bases_at(intervals[index, side], all_ks, over, slopes)
            bases_at(intervals[index, side], ks, e, de)
            # The begin of contact moves by −dN/N' and leaves out what it passes, the end takes it in.
            factor = weight_at(ks, w, e) * dot(over, dN) / abs(dot(slopes, N))
            for j in range(size):
                by_N[j] += factor * over[j]
    products(cosines, sines, ks, all_ks, 1.0, block)
    for i in range(n):
        for j in range(size):
            g_N[j] += w[i] * block[i, j]


@compiled
def through_load(
    directions: int, U: Real, dU: Real, ks: Integer, all_ks: Integer, of_motion: Integer, of_load: Integer,
    row: Real, drow: Real, w: Real, state: int, intervals: Real, N: Real, dN: Real, by_N: Real, g_N: Real,
    out_U: Real, out_row: Real, out_load: Real,
) -> None:  # fmt: skip
    """Fill what a change of the load does: to the given one, and where it moves to the normal port and kn."""
    if U.shape[0] > directions:
        _pressing(N, all_ks, ks, state, intervals, w[directions], dN, of_motion, by_N, g_N)
        for i in range(U.shape[1]):
            j = of_motion[i]
            out_U[directions, i] = row[KN] * by_N[j] + drow[KN] * g_N[j]
            out_row[KN] += U[directions, i] * by_N[j] + dU[directions, i] * g_N[j]
    for j in range(of_load.size):
        out_load[j] = by_N[of_load[j]]


@apart
def _rubbing(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, directions: int, second: int, out_U: Real, out_row: Real,
    out_load: Real,
) -> int:  # fmt: skip
    """Differentiate along lines: `directions` ports, then perhaps the normal one; see the contract.

    `second` is the column of the stiffness of all directions but the first.
    """
    m, n = U.shape
    all_ks = merged(ks, load_ks) if m > directions else load_ks.copy()
    size, of_load = coefficient_count(all_ks), positions(load_ks, all_ks)
    of_motion = positions(ks, all_ks) if m > directions else np.empty(0, np.int64)
    N, dN, by_N, g_N = np.empty(size), np.empty(size), np.zeros(size), np.zeros(size)
    load_of(U, directions, load, row[KN], of_motion, of_load, N)
    load_of(U, directions, dload, drow[KN], of_motion, of_load, dN)
    if m > directions:
        for i in range(n):
            dN[of_motion[i]] += row[KN] * dU[directions, i]
    fill_block(out_U, 0.0)
    fill(out_row, 0.0)
    segments = new_segments(max(ks[-1], all_ks[-1]))
    rates, state, count = np.zeros(2), 0, 0
    for a in range(directions):
        column = KT if a == 0 else second
        state, count = _along_line(
            U[a], ks, N, all_ks, row[column], row[MU], cos_table, sin_table, w[a], dU[a], dN, drow[column],
            drow[MU], segments, out_U[a], by_N, g_N, rates,
        )  # fmt: skip
        if state == FAILED:
            return FAILED
        out_row[column] += rates[0]
        out_row[MU] += rates[1]
    intervals = np.empty((count, 2))
    through_load(
        directions, U, dU, ks, all_ks, of_motion, of_load, row, drow, w, state,
        intervals[: contact_of(segments, count, intervals)], N, dN, by_N, g_N, out_U, out_row, out_load,
    )  # fmt: skip
    return state


@apart
def line_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate the laws along one line, under a load that is given or moves (as in the contract)."""
    return _rubbing(
        U, ks, load, load_ks, row, cos_table, sin_table, w, dU, drow, dload, 1, KT, out_U, out_row, out_load
    )


@apart
def box_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate `solver.contacts.kernels.coulomb.line_law.coulomb_box` (as in the contract)."""
    given, moved = with_second(row, drow)
    state = _rubbing(
        U, ks, load, load_ks, given, cos_table, sin_table, w, dU, moved, dload, 2, KT_SECOND, out_U, out_row,
        out_load,
    )  # fmt: skip
    tie_second(row, out_row)
    return state


@compiled
def tie_second(row: Real, out_row: Real) -> None:
    """Count a second stiffness that follows the first with the first."""
    if math.isnan(row[KT_SECOND]):
        out_row[KT] += out_row[KT_SECOND]
        out_row[KT_SECOND] = 0.0
