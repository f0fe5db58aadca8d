"""Force of one elastic Coulomb contact, its Jacobian and its parameter derivatives, in closed form.

On a segment the force is ``kt (u − u(τs)) + ξ μ N(τs)`` (stick after slip), ``kt (u − u(τs))`` (stick after
separation), ``kt u`` (stuck since the unloaded state) or ``ξ μ N`` (slip). All integrals against the basis
are moments of cosines and sines over the segments, so nothing is sampled and the Jacobian is the true
derivative of the force. Because the force is homogeneous, ``F = kt ∂F/∂kt + μ ∂F/∂μ``: the two parameter
derivatives are computed and the force is their sum.

Event times drop out of every derivative except where the slope of the force jumps, at separation → stick:
there the offset −kt u(τs) moves with dτs/dN_j = −e_j(τs)/Ṅ(τs).

Formulas: Petrov, Ewins, J. Turbomach. 125 (2003) 364, doi:10.1115/1.1539868; the paper this project starts
from, doi:10.1177/1461348419834759, equations 24–31; design derivation of ∂F/∂N by ourselves.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.state_durations import find_segments, is_symmetric
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SLIP,
    FAILED,
    SEPARATED,
    SLIP,
    STICK,
    STUCK,
    UNLOADED,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position
from solver.jit.kernel_records import Records
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.separate import apart


@apart
def add_moments(begin: Any, end: Any, weight: float, cosines: NDArray[Any], sines: NDArray[Any]) -> None:
    """Add weight·∫cos qτ and weight·∫sin qτ over [begin, end] for q = 0 … len − 1, real or complex.

    Written with half-length and middle, ∫cos qτ = (2/q) sin(q·half) cos(q·middle), which keeps full relative
    precision on the very short segments of stiff contacts.
    """
    half, middle = 0.5 * (end - begin), 0.5 * (end + begin)
    cm1, sm1 = np.cos(middle), np.sin(middle)
    ch1, sh1 = np.cos(half), np.sin(half)
    cm, sm, ch, sh = cm1, sm1, ch1, sh1
    cosines[0] += weight * (end - begin)
    for q in range(1, cosines.size):
        factor = weight * 2.0 * sh / q
        cosines[q] += factor * cm
        sines[q] += factor * sm
        cm, sm = cm * cm1 - sm * sm1, sm * cm1 + cm * sm1
        ch, sh = ch * ch1 - sh * sh1, sh * ch1 + ch * sh1


@compiled
def basis_at(tau: float, ks: Integer, out: Real) -> None:
    """Fill `out` with the basis for the harmonics `ks` at `tau`."""
    cos1, sin1 = math.cos(tau), math.sin(tau)
    cosine, sine, k, here = 1.0, 0.0, 0, 0
    for i in range(ks.size):
        while k < ks[i]:
            cosine, sine = cosine * cos1 - sine * sin1, sine * cos1 + cosine * sin1
            k += 1
        out[here] = cosine
        if k > 0:
            out[here + 1] = sine
            here += 1
        here += 1


@compiled
def moment_rows(cosines: Real, sines: Real, ks: Integer, out: Real) -> None:
    """Fill `out` with ∫e divided by π (2π for the mean row) from the moments q = 0 … ."""
    here = 0
    for i in range(ks.size):
        k = ks[i]
        if k == 0:
            out[here] = cosines[0] / (2.0 * math.pi)
            here += 1
        else:
            out[here] = cosines[k] / math.pi
            out[here + 1] = sines[k] / math.pi
            here += 2


@apart
def products(
    cosines: Real, sines: Real, row_ks: Integer, column_ks: Integer, scale: float, out: Real
) -> None:
    """Fill `out` with scale·∫e_row e_column/π (2π for the mean row): Toeplitz plus Hankel of the moments."""
    half = 0.5 * scale / math.pi
    row = 0
    for a in range(row_ks.size):
        i = row_ks[a]
        factor = half if i > 0 else 0.5 * half
        column = 0
        for b in range(column_ks.size):
            j = column_ks[b]
            plus, minus = i + j, abs(i - j)
            sign = 1.0 if i >= j else -1.0
            cc = factor * (cosines[minus] + cosines[plus])
            if i == 0:
                out[row, column] = cc
                if j > 0:
                    out[row, column + 1] = factor * 2.0 * sines[j]
            else:
                sc = factor * (sines[plus] + sign * sines[minus])
                out[row, column] = cc
                out[row + 1, column] = sc
                if j > 0:
                    out[row, column + 1] = factor * (sines[plus] - sign * sines[minus])
                    out[row + 1, column + 1] = factor * (cosines[minus] - cosines[plus])
            column += 2 if j > 0 else 1
        row += 2 if i > 0 else 1


@apart
def contact_force(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, cos_table: Real, sin_table: Real,
    segments: Records, dF_dU: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real, F: Real,
) -> tuple[int, int]:  # fmt: skip
    """Compute force coefficients and every derivative of one contact.

    Parameters
    ----------
    U : (n,) slip motion [m] for harmonics `ks`; N : (m,) normal load [N] for harmonics `load_ks`.
    segments : scratch table (capacity,); on return the segments found.
    dF_dU (n, n), dF_dkt (n,), dF_dmu (n,), dF_dN (n, m), F (n,) : filled.

    Returns
    -------
    (state, number of segments), see `find_segments`; on FAILED the outputs are NaN.
    """
    state, count = find_segments(U, ks, N, load_ks, kt, mu, cos_table, sin_table, segments)
    n = coefficient_count(ks)
    if state in (SEPARATED, FAILED):
        value = 0.0 if state == SEPARATED else np.nan
        fill(F, value)
        fill(dF_dkt, value)
        fill(dF_dmu, value)
        fill_block(dF_dU, value)
        fill_block(dF_dN, value)
        return state, count
    if state == STUCK and segments[0].began == UNLOADED:
        fill_block(dF_dU, 0.0)
        fill_block(dF_dN, 0.0)
        fill(dF_dmu, 0.0)
        for i in range(n):
            dF_dU[i, i], dF_dkt[i], F[i] = kt, U[i], kt * U[i]
        return state, count
    # Of a half-wave symmetric force the second half only doubles what the first one gives.
    symmetric = is_symmetric(ks, N)
    marched, weight = (count // 2, 2.0) if symmetric and count > 1 else (count, 1.0)
    _fill_moments(segments, marched, weight, U, ks, N, load_ks, kt, mu, dF_dU, dF_dkt, dF_dmu, dF_dN)
    _add_onsets(segments, marched, weight, U, ks, N, load_ks, kt, mu, dF_dU, dF_dkt, dF_dmu, dF_dN)
    if symmetric:
        # What a load of odd harmonics adds in one half it takes away in the other.
        for b in range(load_ks.size):
            if load_ks[b] % 2 == 1:
                here = cosine_position(load_ks, b)
                for i in range(n):
                    dF_dN[i, here], dF_dN[i, here + 1] = 0.0, 0.0
    for i in range(n):
        F[i] = kt * dF_dkt[i] + mu * dF_dmu[i]
    return state, count


@compiled
def _fill_moments(
    segments: Records, count: int, weight: float, U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float,
    mu: float, dF_dU: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real,
) -> None:  # fmt: skip
    """Fill the derivatives with what all segments give but for the offsets of sticks."""
    top = ks[-1] + max(ks[-1], load_ks[-1])
    moments = np.zeros((4, top + 1))
    for i in range(count):
        row = segments[i]
        if row.motion == STICK:
            add_moments(row.begin, row.end, weight, moments[0], moments[1])
        else:
            add_moments(row.begin, row.end, weight * row.direction, moments[2], moments[3])
    products(moments[2], moments[3], ks, load_ks, 1.0, dF_dN)
    products(moments[0], moments[1], ks, ks, 1.0, dF_dU)
    for i in range(U.size):
        total = 0.0
        for j in range(N.size):
            total += dF_dN[i, j] * N[j]
        dF_dmu[i] = total
        total = 0.0
        for j in range(U.size):
            total += dF_dU[i, j] * U[j]
        dF_dkt[i] = total
        for j in range(N.size):
            dF_dN[i, j] *= mu
        for j in range(U.size):
            dF_dU[i, j] *= kt


@compiled
def bases_at(tau: Any, ks: Integer, e: NDArray[Any], de: NDArray[Any]) -> None:
    """Fill `e` with the basis for the harmonics `ks` at `tau`, real or complex, and `de` with its slope."""
    bases_by(np.cos(tau), np.sin(tau), ks, e, de)


@compiled
def bases_by(cos1: Any, sin1: Any, ks: Integer, e: NDArray[Any], de: NDArray[Any]) -> None:
    """Fill in the same from cos τ and sin τ."""
    cosine, sine = 0.0 * cos1 + 1.0, 0.0 * cos1
    k, here = 0, 0
    for i in range(ks.size):
        while k < ks[i]:
            cosine, sine = cosine * cos1 - sine * sin1, sine * cos1 + cosine * sin1
            k += 1
        e[here], de[here] = cosine, -k * sine
        here += 1
        if k > 0:
            e[here], de[here] = sine, k * cosine
            here += 1


@apart
def _add_onsets(
    segments: Records, count: int, weight: float, U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float,
    mu: float, dF_dU: Real, dF_dkt: Real, dF_dmu: Real, dF_dN: Real,
) -> None:  # fmt: skip
    """Add the rank-one terms of every stick segment: its offset, fixed at its onset."""
    n, m = U.size, N.size
    waves, rows = np.empty((2, ks[-1] + 1)), np.empty(2 * n + m)
    cosines, sines, moment, e_u, e_n = waves[0], waves[1], rows[:n], rows[n : 2 * n], rows[2 * n :]
    for index in range(count):
        row = segments[index]
        if row.motion == SLIP or row.began == UNLOADED:
            continue
        fill(cosines, 0.0)
        fill(sines, 0.0)
        add_moments(row.begin, row.end, weight, cosines, sines)
        moment_rows(cosines, sines, ks, moment)
        tau = row.onset
        basis_at(tau, ks, e_u)
        basis_at(tau, load_ks, e_n)
        u_onset, load_onset = dot(e_u, U), dot(e_n, N)
        slipped = row.began == AFTER_SLIP
        rate = 0.0
        if not slipped:
            rate = kt * _slope_at(e_u, ks, U) / _slope_at(e_n, load_ks, N)
        for i in range(n):
            here = moment[i]
            dF_dkt[i] -= u_onset * here
            step = kt * here
            for j in range(n):
                dF_dU[i, j] -= step * e_u[j]
            if slipped:
                dF_dmu[i] += row.direction * load_onset * here
                step = row.direction * mu * here
            else:
                step = rate * here
            for j in range(m):
                dF_dN[i, j] += step * e_n[j]


@compiled
def _slope_at(e: Real, ks: Integer, q: Real) -> float:
    """Return dq/dτ of coefficients `q` where the basis is `e`."""
    total, here = 0.0, 0
    for i in range(ks.size):
        k = ks[i]
        if k > 0:
            total += k * (q[here + 1] * e[here] - q[here] * e[here + 1])
            here += 1
        here += 1
    return total
