"""Second derivatives of the force of one elastic Coulomb contact, contracted with weights, along a direction.

With W(τ) the weights times the basis, S = w·F is a sum of ∫ f W over the segments, and its gradient a formula
of their times (`solver.contacts.kernels.coulomb.force`). Motion, load and times are carried into the complex
plane, the direction as a tiny imaginary part: that of the gradient is its derivative (W. Squire, G. Trapp,
SIAM Rev. 40 (1998) 110). An integral follows by what its ends take in. Times move so that what they are zeros
of stays 0: the limit less the force at the end of a stick, the rate of that at an onset after slip, the load
where a contact opens or closes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.coulomb.force import add_moments, bases_at, moment_rows
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SLIP,
    LIFTING,
    NO_LENGTH,
    SEPARATED,
    SLIP,
    STICK,
    STUCK,
    UNLOADED,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real
from solver.jit.lapack import dot, fill, fill_block
from solver.jit.records import Records
from solver.jit.separate import apart

TINY = 1e-30  # of the direction
_BEGIN, _END, _ONSET = 0, 1, 2  # times of a segment


@apart
def second_along(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, state: int, segments: Records,
    count: int, dF_dU: Real, dF_dN: Real, w: Real, dU: Real, dN: Real, out_U: Real, out_N: Real,
) -> tuple[float, float]:  # fmt: skip
    """Differentiate the gradient of w·F by (U, N, kt, μ) along a direction (dU, dN).

    Parameters
    ----------
    U, ks, N, load_ks, kt, mu : the contact, as for `solver.contacts.kernels.coulomb.force.contact_force`.
    state, segments, count, dF_dU, dF_dN : what that returned.
    w : (n,) weights of the force coefficients.
    dU : (n,) direction of the motion; dN : (m,) direction of the normal load.
    out_U : (n,) wᵀ ∂²F/∂U∂(U, N)·(dU, dN); out_N : (m,) wᵀ ∂²F/∂N∂(U, N)·(dU, dN); filled.

    Returns
    -------
    The same of ∂F/∂kt and ∂F/∂μ (NaN where kt or μ is 0 and it takes part).
    """
    fill(out_U, 0.0)
    fill(out_N, 0.0)
    if state == SEPARATED:
        return 0.0, 0.0
    if state == STUCK and segments[0].began == UNLOADED:
        return dot(w, dU), 0.0
    n, m = U.size, N.size
    times, waves = np.empty((3, count), np.complex128), np.empty((2, ks[-1] + 1))
    rows: NDArray[Any] = np.empty((3, n), np.complex128)
    over: NDArray[Any] = np.empty((3, m), np.complex128)
    at, beside, u, load = np.empty((4, n)), np.empty((4, m)), rows[2], over[2]
    for i in range(n):
        u[i] = complex(U[i], TINY * dU[i])
    for j in range(m):
        load[j] = complex(N[j], TINY * dN[j])
    _carry(u, ks, load, load_ks, kt, mu, state, segments, count, at, beside, times)
    by_kt, by_mu, by_load = 0.0, 0.0, _weighed(w, dF_dN, dN)
    for index in range(count):
        row, sticks = segments[index], segments[index].motion == STICK
        if row.end - row.begin <= NO_LENGTH or (sticks and row.began == UNLOADED):
            continue
        gained = 0.0  # by ∫W at its ends
        for side in range(2):
            moved = times[side, index].imag / TINY
            if moved == 0.0:
                continue
            bases_at(times[side, index].real, ks, at[0], at[1])
            passed = (moved if side == _END else -moved) * _weight(w, at[0], ks)
            gained += passed
            if sticks:
                _add(out_U, kt * passed, at[0])
                by_kt += passed * dot(at[0], U)
            else:
                bases_at(times[side, index].real, load_ks, beside[0], beside[1])
                _add(out_N, row.direction * mu * passed, beside[0])
                by_mu += row.direction * passed * dot(beside[0], N)
        if not sticks:
            continue
        fill_block(waves, 0.0)
        add_moments(row.begin, row.end, 1.0, waves[0], waves[1])
        moment_rows(waves[0], waves[1], ks, at[2])
        held = complex(dot(at[2], w), TINY * gained)
        bases_at(times[_ONSET, index], ks, rows[0], rows[1])
        bases_at(times[_ONSET, index], load_ks, over[0], over[1])
        by_kt -= (held * dot(rows[0], U)).imag / TINY
        if row.began == AFTER_SLIP:
            rate = row.direction * mu * held
            by_mu += row.direction * (held * dot(over[0], N)).imag / TINY
        else:
            rate = held * kt * dot(rows[1], u) / dot(over[1], load)
            by_load -= rate.real * dot(over[0], dN).real
        for i in range(n):
            out_U[i] -= kt / TINY * (held * rows[0, i]).imag
        for j in range(m):
            out_N[j] += (rate * over[0, j]).imag / TINY
    if by_load != 0.0:
        by_mu += by_load / mu
    return by_kt + _weighed(w, dF_dU, dU) / kt, by_mu


@compiled
def _weighed(w: Real, matrix: Real, v: Real) -> float:
    """Return w · matrix v."""
    total = 0.0
    for i in range(w.size):
        total += w[i] * dot(v, matrix[i])
    return total


@compiled
def _weight(w: Real, e: Real, ks: Integer) -> float:
    """Return W where the basis is `e`."""
    mean = 0.5 * w[0] * e[0] if ks[0] == 0 else 0.0
    return (dot(w, e) - mean) / math.pi


@compiled
def _add(target: Real, factor: float, vector: Real) -> None:
    """Add factor · vector."""
    for i in range(target.size):
        target[i] += factor * vector[i]


@apart
def _carry(
    u: NDArray[Any], ks: Integer, load: NDArray[Any], load_ks: Integer, kt: float, mu: float, state: int,
    segments: Records, count: int, at: Real, over: Real, times: Complex,
) -> None:  # fmt: skip
    """Fill `times` (3, count) with begin, end and onset of segments under a carried motion and load.

    Of `at` (4, n) and `over` (4, m) nothing is known before or after.
    """
    e, de, eb, deb = at[0], at[1], at[2], at[3]
    en, den, enb, denb = over[0], over[1], over[2], over[3]
    for index in range(count):
        row = segments[index]
        times[_BEGIN, index], times[_END, index], times[_ONSET, index] = row.begin, row.end, row.onset
    for index in range(count):
        row = segments[index]
        if row.end - row.begin <= NO_LENGTH or (row.motion == STICK and row.began == UNLOADED):
            continue
        follows = index > 0 and segments[index - 1].end == row.begin
        followed = index + 1 < count and segments[index + 1].begin == row.end
        if row.motion == SLIP:
            for side in range(2):
                if state == LIFTING and not (followed if side == _END else follows):
                    bases_at(times[side, index].real, load_ks, en, den)
                    times[side, index] += _moved(dot(en, load), dot(den, load))
            continue
        bases_at(row.onset, ks, e, de)
        bases_at(row.onset, load_ks, en, den)
        if row.began == AFTER_SLIP:
            way = row.direction * kt
            bend = way * _curvature_at(e, ks, u) - mu * _curvature_at(en, load_ks, load)
            moved = _moved(way * dot(de, u) - mu * dot(den, load), bend)
        else:
            moved = _moved(dot(en, load), dot(den, load))
        times[_ONSET, index] += moved
        if state != STUCK:
            times[_BEGIN, index] += moved
            if follows:
                times[_END, index - 1] += moved
            elif state != LIFTING:  # the period ends as it begins
                times[_END, count - 1] += moved
        if followed and segments[index + 1].motion == SLIP:
            xi = mu * segments[index + 1].direction
            bases_at(row.end, ks, eb, deb)
            bases_at(row.end, load_ks, enb, denb)
            excess = kt * (dot(eb, u) - dot(e, u) - moved * dot(de, u)) - xi * dot(enb, load)
            if row.began == AFTER_SLIP:
                excess += row.direction * mu * (dot(en, load) + moved * dot(den, load))
            moved = _moved(excess, kt * dot(deb, u) - xi * dot(denb, load))
            times[_END, index] += moved
            times[_BEGIN, index + 1] += moved


@compiled
def _moved(excess: complex, rise: complex) -> complex:
    """Return how a time moves that is a zero of a function with the slope `rise`; infinite by 0."""
    return complex(0.0, -excess.imag / rise.real)


@compiled
def _curvature_at(e: Real, ks: Integer, q: Complex) -> complex:
    """Return d²q/dτ² of coefficients `q` where the basis is `e`."""
    total, here = 0.0j, 0
    for i in range(ks.size):
        k = ks[i]
        if k > 0:
            total -= k * k * (q[here] * e[here] + q[here + 1] * e[here + 1])
            here += 1
        here += 1
    return total
