"""Elastic Coulomb friction in two tangential directions, |t| ≤ μN, under a load that may move.

Ports: the tangential motions u and w and, if there is a third, the normal motion v, with
a normal force max(N, 0) of the given load and kn v. The arguments are those of
`solver.contacts.kernels.laws`.

Circle: `solver.contacts.kernels.circle.panels` has the law, `state` and `path` beside it find the motion
of the force, `gradient` the coefficients and all derivatives. Box: each direction on its own, by
`solver.contacts.kernels.coulomb.line_force`.

Reference for a moving load: Yang, Menq, J. Sound Vib. 217 (1998) 909, doi:10.1006/jsvi.1998.1740.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.circle.circle_gradient import circle_force, circle_gradient
from solver.contacts.kernels.circle.circle_state import CLOSES, FOUND, SETTLES, TURN, find_path, new_tables
from solver.contacts.kernels.circle.panels import LIMIT, Array, Number, X, Y
from solver.contacts.kernels.circle.path import TABLE_FULL
from solver.contacts.kernels.columns import KN, KT, KT_SECOND, MU
from solver.contacts.kernels.coulomb.line_law import load_of, press, with_second
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SEPARATION,
    FAILED,
    NO_LENGTH,
    SEPARATED,
    SLIP,
    SLIPPING,
    STICK,
    STUCK,
    UNLOADED,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, merged, positions
from solver.jit.kernel_records import Records
from solver.jit.lapack import fill_block
from solver.jit.separate import apart
from solver.jit.trig_polynomial import unpack

MOST_TABLES = 64  # times the usual size of the tables of a path, at most


@compiled
def curves_of(U: Array, ks: Integer, N: Array, all_ks: Integer, kt: Number, mu: Number, waves: Array) -> None:
    """Fill `waves` with X = kt u, Y = kt w and L = μN."""
    for x in range(3):
        q = N if x == LIMIT else U[x]
        unpack(q, all_ks if x == LIMIT else ks, waves[x, 0], waves[x, 1])
        factor = mu if x == LIMIT else kt
        for k in range(waves.shape[2]):
            waves[x, 0, k] *= factor
            waves[x, 1, k] *= factor


@compiled
def _reach(wave: Real) -> float:
    """Return the sum of the amplitudes of a curve, its mean left out."""
    total = 0.0
    for k in range(1, wave.shape[1]):
        total += math.hypot(wave[0, k], wave[1, k])
    return total


@compiled
def plainly_stuck(waves: Real, kappa: float) -> bool:
    """Return whether the amplitudes alone show that the unloaded slider never reaches the limit."""
    x = abs(waves[X, 0, 0]) + _reach(waves[X])
    y = (abs(waves[Y, 0, 0]) + _reach(waves[Y])) / kappa
    return math.hypot(x, y) <= waves[LIMIT, 0, 0] - _reach(waves[LIMIT])


@apart
def circle_path(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real,
    pieces: Records, panels: Records, found: Records, intervals: Real,
) -> int:  # fmt: skip
    """Find what the contact does over a period; see `find_path`."""
    all_ks = merged(ks, load_ks)
    N = np.empty(coefficient_count(all_ks))
    load_of(U, 2, load, row[KN], positions(ks, all_ks), positions(load_ks, all_ks), N)
    waves = np.empty((3, 2, all_ks[-1] + 1))
    curves_of(U, ks, N, all_ks, row[KT], row[MU], waves)
    kappa = row[KT] / row[KT_SECOND]
    if plainly_stuck(waves, kappa):
        found[0].how, found[0].pieces, found[0].panels, found[0].intervals = SETTLES, 1, 0, 0
        first = pieces[0]
        first.motion, first.begin, first.end = STICK, 0.0, TURN
        first.began, first.first, first.count = UNLOADED, 0, 0
        first.tx, first.ty = 0.0, 0.0
        for k in range(waves.shape[2]):
            first.tx += waves[X, 0, k]
            first.ty += waves[Y, 0, k] / kappa
        return STUCK
    return find_path(waves, kappa, cos_table, sin_table, pieces, panels, found, intervals)


@compiled
def whole_path(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real,
    found: Records, intervals: Real,
) -> tuple[int, Records, Records]:  # fmt: skip
    """Return the state of `circle_path` with its pieces and panels, in tables as long as it takes."""
    top, times = merged(ks, load_ks)[-1], 1
    pieces, panels = new_tables(top, times)
    while True:
        state = circle_path(U, ks, load, load_ks, row, cos_table, sin_table, pieces, panels, found, intervals)
        if state != TABLE_FULL or times >= MOST_TABLES:
            return state, pieces, panels
        times *= 4
        pieces, panels = new_tables(top, times)


@apart
def coulomb_circle(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force of two or three ports, its Jacobian and its derivative by λ; circular limit.

    Without blocks in `dF_dU` the force alone is found, for two thirds of the time; `dF_dp` is left 0 then.
    """
    row, slope = with_second(row, slope)
    m = U.shape[0]
    all_ks = merged(ks, load_ks)
    N, dN = np.empty(coefficient_count(all_ks)), np.empty(coefficient_count(all_ks))
    of_motion, of_load = positions(ks, all_ks), positions(load_ks, all_ks)
    load_of(U, 2, load, row[KN], of_motion, of_load, N)
    load_of(U, 2, dload, slope[KN], of_motion, of_load, dN)
    for block in range(dF_dU.shape[0]):
        fill_block(dF_dU[block], 0.0)
    fill_block(F, 0.0)
    fill_block(dF_dp, 0.0)
    intervals, found = np.empty((all_ks[-1] + 2, 2)), np.zeros(1, FOUND)
    rubs = row[MU] > 0.0 and row[KT] > 0.0 and row[KT_SECOND] > 0.0
    motion, given = U, row
    if not rubs:
        # Without friction only the normal force is left: that of a contact that does not move.
        motion, given = U.copy(), row.copy()
        fill_block(motion[:2], 0.0)
        given[MU], given[KT], given[KT_SECOND] = 1.0, 1.0, 1.0
    state, pieces, panels = whole_path(
        motion, ks, load, load_ks, given, cos_table, sin_table, found, intervals
    )
    if state < 0 or state == FAILED:
        fill_block(F, np.nan)
        return FAILED, 0
    if not rubs and state == STUCK:
        state = SLIPPING
    elif rubs and state == STUCK and pieces[0].began == UNLOADED and found[0].pieces == 1:
        _stuck(U, row[KT], row[KT_SECOND], slope, F, dF_dU, dF_dp)
    elif rubs and state != SEPARATED:
        _friction(U, ks, all_ks, of_motion, row, slope, N, dN, found, pieces, panels, F, dF_dU, dF_dp)
    if m > 2:
        press(
            state, intervals[: found[0].intervals], ks, all_ks, of_motion, row, N, dN, load[0], dload[0],
            F[2], dF_dU[8:], dF_dp[2],
        )  # fmt: skip
    return state, _write_segments(state, found, pieces, segments)


@compiled
def _stuck(U: Real, kt: float, second: float, slope: Real, F: Real, dF_dU: Real, dF_dp: Real) -> None:
    """Fill the force of a slider that never moved."""
    m, n = U.shape
    for i in range(n):
        F[0, i], F[1, i] = kt * U[0, i], second * U[1, i]
        dF_dp[0, i], dF_dp[1, i] = slope[KT] * U[0, i], slope[KT_SECOND] * U[1, i]
        if dF_dU.shape[0] > 0:
            dF_dU[0, i, i], dF_dU[m + 1, i, i] = kt, second


@apart
def _friction(
    U: Real, ks: Integer, all_ks: Integer, of_motion: Integer, row: Real, slope: Real, N: Real, dN: Real,
    found: Records, pieces: Records, panels: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> None:  # fmt: skip
    """Fill the two friction forces from the path."""
    m, n = U.shape
    kt, second, mu, kn = row[KT], row[KT_SECOND], row[MU], row[KN]
    size = N.size
    waves = np.empty((3, 2, all_ks[-1] + 1))
    curves_of(U, ks, N, all_ks, kt, mu, waves)
    if dF_dU.shape[0] == 0:
        circle_force(waves, kt / second, ks, all_ks, found, pieces, panels, F[:2])
        return
    G, weights = np.empty((2 * n + 2, 3 * size + 1)), np.empty((0, 2, n))
    circle_gradient(waves, kt / second, ks, all_ks, of_motion, found, pieces, panels, weights, F[:2], G)
    dkappa = slope[KT] / second - slope[KT_SECOND] * kt / (second * second)
    for a in range(2):
        for i in range(n):
            line = G[a * n + i]
            total = line[3 * size] * dkappa
            for j in range(n):
                by_u, by_w = line[of_motion[j]], line[size + of_motion[j]]
                dF_dU[a * m, i, j], dF_dU[a * m + 1, i, j] = kt * by_u, kt * by_w
                if m > 2:
                    dF_dU[a * m + 2, i, j] = mu * kn * line[2 * size + of_motion[j]]
                total += slope[KT] * (by_u * U[0, j] + by_w * U[1, j])
            for j in range(size):
                total += line[2 * size + j] * (slope[MU] * N[j] + mu * dN[j])
            dF_dp[a, i] = total


@compiled
def _write_segments(state: int, found: Records, pieces: Records, segments: Records) -> int:
    """Copy the pieces of the period to the table of segments; return the number of the smooth piece.

    It counts the sticks and slips that have a length. One that the begin of the period cuts is one.
    """
    count, first = found[0].pieces, 0
    if state == SEPARATED:
        return 0
    onset = pieces[count - 1].begin
    if found[0].how == SETTLES:
        first = count - 1
        while count > 1 and onset > 0.0 and pieces[first - 1].motion == STICK:
            first -= 1
            onset = pieces[first].begin
        first = count - 1
    piece, written = 0, 0
    for i in range(first, count):
        begin, end = pieces[i].begin, pieces[i].end
        if written < segments.shape[0]:
            row = segments[written]
            row.motion, row.direction, row.begin, row.end = pieces[i].motion, 1.0, begin, end
            row.onset, row.began = begin, pieces[i].began
            if found[0].how == SETTLES:
                row.begin, row.end, row.onset = 0.0, TURN, onset % TURN
            written += 1
        if end - begin <= NO_LENGTH:
            continue
        kind = 3
        if pieces[i].motion == STICK:
            kind = 0 if pieces[i].began == UNLOADED else 1
            kind = 2 if pieces[i].began == AFTER_SEPARATION else kind
        piece += 1 << (8 * kind)
    if found[0].how == CLOSES and count > 1 and pieces[0].motion == pieces[count - 1].motion:
        piece -= 1 << (8 * (3 if pieces[0].motion == SLIP else 1))
    return piece
