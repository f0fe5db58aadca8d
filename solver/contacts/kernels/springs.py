"""Nonlinear springs: a gap that closes on one side, F = k max(u − gap, 0), and a polynomial, F = Σ a_j u^j.

The gap spring is closed form: with the intervals where u > gap, F = k Σ ∫ (u − gap) e and
∂F/∂U = k Σ ∫ e ⊗ e; at their ends u − gap is 0, so they drop out of every derivative.

A polynomial of degree d in a motion with harmonics to H has harmonics to dH; projected on harmonics to H it
is exact from (d + 1) H + 1 samples on, and so is its derivative.

Second derivatives, with W = w·e: of the gap spring the gradient by the motion is k ∫W e over the intervals of
contact, whose ends move by −(du − dgap)/u'; of a polynomial f it is ∫W f'(u) e, and its derivative along du
and df is ∫W (f''(u) du + df'(u)) e. The arguments are those of `solver.contacts.kernels.laws`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import A_1, CLOSED, DEFORMING, GAP, K_GAP, MOST_DEGREE, TOUCHING
from solver.contacts.kernels.coulomb.line_force import add_moments, bases_at, basis_at, moment_rows, products
from solver.contacts.kernels.coulomb.second_law import weight_at
from solver.contacts.kernels.state_durations import contact_intervals, one_wave
from solver.contacts.kernels.stick_slip_events import SEPARATED, largest
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart
from solver.jit.trig_polynomial import on_grid, unpack


@apart
def positive_intervals(c: Real, s: Real, degree: int, cos_table: Real, sin_table: Real, out: Real) -> int:
    """Fill `out` (degree + 1, 2) with [begin, end] of every interval where a polynomial is positive.

    Returns
    -------
    Their number; −1 if it never becomes negative (then `out` is not filled).
    """
    if degree <= 1:
        return one_wave(c[0], c[1], s[1], out)
    n_grid = 2 * (cos_table.shape[1] - 1)
    value, slope = np.empty(n_grid), np.empty(n_grid)
    on_grid(c, s, degree, cos_table, sin_table, value, slope)
    top = value[0]
    for j in range(n_grid):
        top = max(top, value[j])
    if top <= 0.0 and largest(c, s, degree, value, slope)[0] <= 0.0:
        return 0
    return contact_intervals(c, s, degree, value, slope, out)


@apart
def gap_spring(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force of a gap spring, its Jacobian and its derivative by λ (arguments as in the contract)."""
    n, top = coefficient_count(ks), max(ks[-1], 1)
    c, s = np.empty(top + 1), np.empty(top + 1)
    unpack(U[0], ks, c, s)
    c[0] -= row[GAP]
    intervals = np.empty((top + 1, 2))
    count = positive_intervals(c, s, top, cos_table, sin_table, intervals)
    cosines, sines = np.zeros(2 * top + 1), np.zeros(2 * top + 1)
    if count < 0:
        cosines[0] = 2.0 * math.pi
    for i in range(count):
        add_moments(intervals[i, 0], intervals[i, 1], 1.0, cosines, sines)
    products(cosines, sines, ks, ks, 1.0, dF_dU[0])
    constant = np.empty(n)
    moment_rows(cosines, sines, ks, constant)
    k, dk = row[K_GAP], slope[K_GAP]
    for i in range(n):
        closing = -row[GAP] * constant[i]
        for j in range(n):
            closing += dF_dU[0, i, j] * U[0, j]
            dF_dU[0, i, j] *= k
        F[0, i] = k * closing
        dF_dp[0, i] = dk * closing - k * slope[GAP] * constant[i]
    if count == 0:
        return SEPARATED, 0
    return (CLOSED, 1) if count < 0 else (TOUCHING, 1 + count)


@apart
def polynomial_spring(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the force of a polynomial spring, its Jacobian and its derivative by λ (as in the contract)."""
    top, degree = max(ks[-1], 1), 1
    for j in range(MOST_DEGREE):
        if row[A_1 + j] != 0.0 or slope[A_1 + j] != 0.0:
            degree = j + 1
    samples = (degree + 1) * top + 1
    cosine, sine = np.empty(samples), np.empty(samples)
    for j in range(samples):
        cosine[j], sine[j] = math.cos(2.0 * math.pi * j / samples), math.sin(2.0 * math.pi * j / samples)
    cosines, sines = np.zeros(2 * top + 1), np.zeros(2 * top + 1)
    force_c, force_s = np.zeros(top + 1), np.zeros(top + 1)
    dforce_c, dforce_s = np.zeros(top + 1), np.zeros(top + 1)
    c, s = np.empty(top + 1), np.empty(top + 1)
    unpack(U[0], ks, c, s)
    share = 2.0 * math.pi / samples
    for j in range(samples):
        u = c[0]
        for k in range(1, top + 1):
            at = (k * j) % samples
            u += c[k] * cosine[at] + s[k] * sine[at]
        force, dforce, stiffness = 0.0, 0.0, 0.0
        for d in range(degree, 0, -1):
            stiffness = stiffness * u + d * row[A_1 + d - 1]
            force = force * u + row[A_1 + d - 1]
            dforce = dforce * u + slope[A_1 + d - 1]
        force, dforce, stiffness = share * force * u, share * dforce * u, share * stiffness
        for k in range(2 * top + 1):
            at = (k * j) % samples
            cosines[k] += stiffness * cosine[at]
            sines[k] += stiffness * sine[at]
        for k in range(top + 1):
            at = (k * j) % samples
            force_c[k] += force * cosine[at]
            force_s[k] += force * sine[at]
            dforce_c[k] += dforce * cosine[at]
            dforce_s[k] += dforce * sine[at]
    products(cosines, sines, ks, ks, 1.0, dF_dU[0])
    moment_rows(force_c, force_s, ks, F[0])
    moment_rows(dforce_c, dforce_s, ks, dF_dp[0])
    # Of literals alone the type of the result would be those literals.
    return int(np.int64(DEFORMING)), int(np.int64(1))


@apart
def gap_second(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, cos_table: Real, sin_table: Real, w: Real,
    dU: Real, drow: Real, dload: Real, out_U: Real, out_row: Real, out_load: Real,
) -> int:  # fmt: skip
    """Differentiate `gap_spring` (as in the contract)."""
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
    """Differentiate `polynomial_spring` (as in the contract).

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
