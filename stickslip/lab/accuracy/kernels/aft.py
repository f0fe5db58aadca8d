"""Force of one elastic Coulomb contact by samples in time: what the closed form is compared with.

The classic alternating frequency/time scheme: motion and load are sampled at equal steps, a predictor step
``kt (u_j − u_{j−1})`` is cut back to the friction limit μ N_j (to 0 where N_j ≤ 0), periods are marched until
the state repeats, and the samples are transformed back. Sticking since sample a the force is
``kt (u_j − u_a) + f_a`` with f_a = ξ μ N_a after slip and 0 after separation, so that the derivatives of the
scheme itself are sums over its samples of the same form as those of `line_force`.

Cameron, Griffin, J. Appl. Mech. 56 (1989) 149, doi:10.1115/1.3176036; with a variable normal load: Yang, Chu,
Menq, J. Sound Vib. 210 (1998) 461, doi:10.1006/jsvi.1997.1305.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import KT, MU, OWN
from solver.contacts.kernels.coulomb.line_force import basis_at, moment_rows, products
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SEPARATION,
    AFTER_SLIP,
    FAILED,
    LIFTING,
    SEPARATED,
    SLIP,
    SLIPPING,
    STICK,
    STUCK,
    UNLOADED,
    piece_of,
)
from solver.contacts.kernels.coulomb.line_law import along_parameter
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count
from solver.jit.kernel_records import Records
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart

SAMPLES = OWN  # column of the contact table: samples a period
# What a contact does at a sample.
_OPEN, _STICKS, _SLIPS_UP, _SLIPS_DOWN = 0, 1, 2, 3
_MOST_PERIODS = 10


@apart
def _sample(q: Real, ks: Integer, wave: Real, out: Real) -> None:
    """Fill `out` with the values of a polynomial at its equally spaced instants; `wave` is cos τ at them."""
    n = out.size
    fill(out, 0.0)
    here = 0
    for i in range(ks.size):
        k = ks[i]
        cosine = q[here]
        if k == 0:
            here += 1
            for j in range(n):
                out[j] += cosine
            continue
        sine = q[here + 1]
        here += 2
        step, at, behind = k % n, 0, (3 * n) // 4
        for j in range(n):
            out[j] += cosine * wave[at] + sine * wave[behind]
            at += step
            behind += step
            if at >= n:
                at -= n
            if behind >= n:
                behind -= n


@apart
def _march(u: Real, load: Real, kt: float, mu: float, kind: Integer, onset: Integer) -> int:
    """Fill what happens at every sample of a period that repeats, and the onset of what sticks there.

    An onset is 4 times the sample plus what happened at it, −1 for the unloaded state.

    Returns
    -------
    1 if the state repeated, else 0.
    """
    n = u.size
    offset, since = 0.0, -1
    for _ in range(_MOST_PERIODS):
        before, since_before = offset, since
        for j in range(n):
            limit = mu * load[j]
            force = kt * u[j] + offset
            if load[j] <= 0.0:
                kind[j], offset, since = _OPEN, -kt * u[j], 4 * j + _OPEN
            elif force > limit:
                kind[j], offset, since = _SLIPS_UP, limit - kt * u[j], 4 * j + _SLIPS_UP
            elif force < -limit:
                kind[j], offset, since = _SLIPS_DOWN, -limit - kt * u[j], 4 * j + _SLIPS_DOWN
            else:
                kind[j] = _STICKS
            onset[j] = since
        if since == since_before and offset == before:
            return 1
    return 0


@apart
def _segments(kind: Integer, onset: Integer, segments: Records) -> int:
    """Fill the table of stick and slip segments; return their number, −1 if there are too many."""
    n = kind.size
    delta = 2.0 * math.pi / n
    first = 0
    for j in range(n):
        if kind[j] != kind[j - 1]:
            first = j
            break
    count, j = 0, first
    while j < first + n:
        here, begin = kind[j % n], j
        while j < first + n and kind[j % n] == here:
            j += 1
        if here == _OPEN:
            continue
        if count >= segments.shape[0]:
            return -1
        row = segments[count]
        row.begin, row.end = begin * delta, j * delta
        row.motion = STICK if here == _STICKS else SLIP
        row.onset, row.began, row.direction = begin * delta, AFTER_SLIP, 1.0
        if here == _SLIPS_DOWN:
            row.direction = -1.0
        elif here == _STICKS:
            since = onset[begin % n]
            row.onset = (since // 4) * delta
            if since < 0:
                row.began = UNLOADED
            elif since % 4 == _OPEN:
                row.began = AFTER_SEPARATION
            elif since % 4 == _SLIPS_DOWN:
                row.direction = -1.0
        count += 1
    return count


@compiled
def _state(kind: Integer) -> int:
    """Return what the contact does over the period, as `solver.contacts.kernels.stick_slip_events` numbers
    it."""
    n_open, n_stick = 0, 0
    for j in range(kind.size):
        if kind[j] == _OPEN:
            n_open += 1
        elif kind[j] == _STICKS:
            n_stick += 1
    if n_open == kind.size:
        return SEPARATED
    if n_open > 0:
        return LIFTING
    return STUCK if n_stick == kind.size else SLIPPING


@apart
def _add_sums(begin: int, end: int, delta: float, weight: float, cosines: Real, sines: Real) -> None:
    """Add weight·Σ cos qτ_j and weight·Σ sin qτ_j over the samples [begin, end) for q = 0 … len − 1.

    A geometric series: Σ cos qτ_j = cos(q·middle) sin(q·half)/sin(q·delta/2), whatever the number of samples.
    """
    half, middle = 0.5 * delta * (end - begin), 0.5 * delta * (begin + end - 1)
    cosines[0] += weight * (end - begin)
    for q in range(1, cosines.size):
        factor = weight * math.sin(q * half) / math.sin(0.5 * q * delta)
        cosines[q] += factor * math.cos(q * middle)
        sines[q] += factor * math.sin(q * middle)


@compiled
def _fill_wave(wave: Real) -> None:
    """Fill `wave` (its length a multiple of 4) with cos τ at the samples, from a quarter of them."""
    n = wave.size
    for j in range(n // 4 + 1):
        cosine = math.cos(2.0 * math.pi * j / n)
        wave[j] = cosine
        wave[n // 2 - j] = -cosine
        wave[n // 2 + j] = -cosine
        if j > 0:
            wave[n - j] = cosine


@apart
def _accumulate(
    segments: Records, count: int, delta: float, U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float,
    mu: float, dF_dU: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real,
) -> None:  # fmt: skip
    """Fill the derivatives from the sums over the samples of every segment."""
    n, m = U.size, N.size
    top = ks[-1] + max(ks[-1], load_ks[-1])
    stick_cos, stick_sin = np.zeros(top + 1), np.zeros(top + 1)
    slip_cos, slip_sin = np.zeros(top + 1), np.zeros(top + 1)
    own_cos, own_sin = np.empty(top + 1), np.empty(top + 1)
    onsets_dU, onsets_dN = np.zeros((n, n)), np.zeros((n, m))
    moment, e_u, e_n = np.empty(n), np.empty(n), np.empty(m)
    fill(dF_dkt, 0.0)
    fill(dF_dmu, 0.0)
    for index in range(count):
        row = segments[index]
        begin, end = round(row.begin / delta), round(row.end / delta)
        if row.motion == SLIP:
            _add_sums(begin, end, delta, delta * row.direction, slip_cos, slip_sin)
            continue
        fill(own_cos, 0.0)
        fill(own_sin, 0.0)
        _add_sums(begin, end, delta, delta, own_cos, own_sin)
        for q in range(top + 1):
            stick_cos[q] += own_cos[q]
            stick_sin[q] += own_sin[q]
        if row.began == UNLOADED:
            continue
        moment_rows(own_cos, own_sin, ks, moment)
        basis_at(row.onset, ks, e_u)
        basis_at(row.onset, load_ks, e_n)
        u_onset = dot(e_u, U)
        load_onset = dot(e_n, N) if row.began == AFTER_SLIP else 0.0
        turn = row.direction if row.began == AFTER_SLIP else 0.0
        for i in range(n):
            dF_dkt[i] -= u_onset * moment[i]
            dF_dmu[i] += turn * load_onset * moment[i]
            for j in range(n):
                onsets_dU[i, j] += moment[i] * e_u[j]
            for j in range(m):
                onsets_dN[i, j] += turn * moment[i] * e_n[j]
    products(slip_cos, slip_sin, ks, load_ks, 1.0, dF_dN)
    products(stick_cos, stick_sin, ks, ks, 1.0, dF_dU)
    for i in range(n):
        dF_dmu[i] += dot(dF_dN[i], N)
        dF_dkt[i] += dot(dF_dU[i], U)
        for j in range(n):
            dF_dU[i, j] = kt * (dF_dU[i, j] - onsets_dU[i, j])
        for j in range(m):
            dF_dN[i, j] = mu * (dF_dN[i, j] + onsets_dN[i, j])


@apart
def sampled_force(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, samples: int, segments: Records,
    dF_dU: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real, F: Real,
) -> tuple[int, int]:  # fmt: skip
    """Compute force coefficients and every derivative of one contact from equally spaced samples.

    Parameters
    ----------
    samples : instants in a period, a multiple of 4 and more than twice the highest harmonic.
    others : as `solver.contacts.kernels.coulomb.line_force.contact_force`, which it stands in for.

    Returns
    -------
    (state, number of segments); on FAILED the outputs are NaN.
    """
    n = coefficient_count(ks)
    wave, u, load = np.empty(samples), np.empty(samples), np.empty(samples)
    _fill_wave(wave)
    _sample(U, ks, wave, u)
    _sample(N, load_ks, wave, load)
    kind, onset = np.empty(samples, np.int64), np.empty(samples, np.int64)
    state, count = FAILED, -1
    if math.isfinite(dot(U, U) + dot(N, N)) and _march(u, load, kt, mu, kind, onset) == 1:
        state, count = _state(kind), _segments(kind, onset, segments)
    if state == SEPARATED or count < 0:
        state = SEPARATED if count >= 0 else FAILED
        value = 0.0 if state == SEPARATED else np.nan
        fill(F, value)
        fill(dF_dkt, value)
        fill(dF_dmu, value)
        fill_block(dF_dU, value)
        fill_block(dF_dN, value)
        return state, max(count, 0)
    delta = 2.0 * math.pi / samples
    _accumulate(segments, count, delta, U, ks, N, load_ks, kt, mu, dF_dU, dF_dkt, dF_dmu, dF_dN)
    for i in range(n):
        F[i] = kt * dF_dkt[i] + mu * dF_dmu[i]
    return state, count


@apart
def coulomb_sampled(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Records, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill the friction along one line under a given load by `row[SAMPLES]` samples of a period instead."""
    n = U.shape[1]
    by_kt, by_mu, by_N = np.empty(n), np.empty(n), np.empty((n, load.size))
    state, count = sampled_force(
        U[0], ks, load, load_ks, row[KT], row[MU], int(row[SAMPLES]), segments, dF_dU[0], by_kt, by_mu, by_N,
        F[0],
    )  # fmt: skip
    along_parameter(slope[KT], slope[MU], dload, by_kt, by_mu, by_N, dF_dp[0])
    return state, piece_of(segments, count)
