"""Second derivatives of the force of one elastic Coulomb contact, contracted with weights, in closed form.

With W(τ) the weights times the basis, S = w·F is a sum of ∫ f W over the segments, and its gradient needs no
event times (`line_force`). Differentiated once more, an event at τ_e where the
gradient's integrand jumps by J contributes J W(τ_e) dτ_e, and an onset τ_s that fixes a later stick moves
that stick:

- stick → slip ξ: the excess force kt u + c − ξμN is 0 there, so dτ_e = −J/D with D its slope: −J J' W/D;
- slip ξ → stick: q = ξ kt u' − μN' is 0 there, so dτ_s = −dq/q': ξ dq dq' M/q' with M = ∫W of the stick;
- N = 0 at separation and contact: dτ = −dN/N', alike for the force that ends or begins there.

Each is an outer product of the event's two functionals, so one direction costs a few vectors an event.
Design derivation by ourselves from the law of `solver.contacts.kernels.stick_slip_events`.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.coulomb.line_force import bases_at
from solver.contacts.kernels.stick_slip_events import (
    AFTER_SLIP,
    LIFTING,
    NO_LENGTH,
    SEPARATED,
    SLIP,
    STUCK,
    UNLOADED,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.kernel_records import Records, Row
from solver.jit.lapack import dot, fill
from solver.jit.separate import apart

# Derivatives by the two numbers of the law, and wᵀ ∂F/∂N dN without the sticks after separation, which is the
# share of ∂F/∂μ that a change of the load brings, times μ.
_KT, _MU, _LOAD = 0, 1, 2


@compiled
def curvature_at(e: Real, ks: Integer, q: Real) -> float:
    """Return d²q/dτ² of coefficients `q` where the basis is `e`."""
    total, here = 0.0, 0
    for i in range(ks.size):
        k = ks[i]
        if k > 0:
            total -= k * k * (q[here] * e[here] + q[here + 1] * e[here + 1])
            here += 1
        here += 1
    return total


@compiled
def _weight_of(begin: float, end: float, weights: Real, ks: Integer) -> float:
    """Return ∫W over [begin, end], from half-length and middle; see
    `solver.contacts.kernels.coulomb.line_force.add_moments`."""
    half, middle = 0.5 * (end - begin), 0.5 * (end + begin)
    total, here = 0.0, 0
    for i in range(ks.size):
        k = ks[i]
        if k == 0:
            total += weights[here] * (end - begin)
        else:
            factor = 2.0 * math.sin(k * half) / k
            total += factor * (
                weights[here] * math.cos(k * middle) + weights[here + 1] * math.sin(k * middle)
            )
            here += 1
        here += 1
    return total


@apart
def second_along(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, state: int, segments: Records,
    count: int, dF_dU: Real, dF_dN: Real, w: Real, dU: Real, dN: Real, out_U: Real, out_N: Real,
) -> tuple[float, float]:  # fmt: skip
    """Differentiate the gradient of w·F by (U, N, kt, μ) along a direction (dU, dN).

    Parameters
    ----------
    U, ks, N, load_ks, kt, mu : the contact, as for `contact_force`.
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
    n, m = U.size, N.size
    if state == STUCK and segments[0].began == UNLOADED:
        return dot(w, dU), 0.0
    weights = np.empty(n)
    for i in range(n):
        weights[i] = w[i] / math.pi
    if ks[0] == 0:
        weights[0] *= 0.5
    rates = np.zeros(3)
    rates[_KT], rates[_LOAD] = _weighed(w, dF_dU, dU) / kt, _weighed(w, dF_dN, dN)
    at, over = np.empty((4, n)), np.empty((4, m))
    for index in range(count):
        row = segments[index]
        if row.end - row.begin <= NO_LENGTH or row.began == UNLOADED:
            continue
        follows = index > 0 and segments[index - 1].end == row.begin
        followed = index + 1 < count and segments[index + 1].begin == row.end
        bases_at(row.onset, ks, at[0], at[1])
        bases_at(row.onset, load_ks, over[0], over[1])
        bases_at(row.end, ks, at[2], at[3])
        bases_at(row.end, load_ks, over[2], over[3])
        if row.motion == SLIP:
            if state == LIFTING:
                _ends_of_slip(N, mu * row.direction, follows, followed, weights, at, over, dN, out_N)
            continue
        held = _weight_of(row.begin, row.end, weights, ks)
        if row.began == AFTER_SLIP:
            _onset_after_slip(
                U, ks, N, load_ks, kt, mu, row.direction, held, at, over, dU, dN, out_U, out_N, rates
            )
        else:
            _onset_after_separation(
                U, ks, N, load_ks, kt, held, dot(weights, at[0]), at, over, dU, dN, out_U, out_N, rates
            )
        if followed and segments[index + 1].motion == SLIP:
            way = segments[index + 1].direction
            _end_of_stick(U, N, kt, mu, row, way, dot(weights, at[2]), at, over, dU, dN, out_U, out_N, rates)
    if rates[_LOAD] != 0.0:
        rates[_MU] += rates[_LOAD] / mu
    return rates[_KT], rates[_MU]


@compiled
def _weighed(w: Real, matrix: Real, v: Real) -> float:
    """Return w · matrix v."""
    total = 0.0
    for i in range(w.size):
        total += w[i] * dot(matrix[i], v)
    return total


@compiled
def _add(target: Real, factor: float, vector: Real) -> None:
    """Add factor · vector."""
    for i in range(target.size):
        target[i] += factor * vector[i]


@compiled
def _ends_of_slip(
    N: Real, limit: float, follows: bool, followed: bool, weights: Real, at: Real, over: Real, dN: Real,
    out_N: Real,
) -> None:  # fmt: skip
    """Add what moves with N = 0 where a slip, force `limit` · N, begins at contact or ends at separation."""
    if not follows:
        factor = limit * dot(weights, at[0]) / dot(over[1], N)
        _add(out_N, factor * dot(over[0], dN), over[0])
    if not followed:
        factor = -limit * dot(weights, at[2]) / dot(over[3], N)
        _add(out_N, factor * dot(over[2], dN), over[2])


@compiled
def _onset_after_slip(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, xi: float, held: float,
    at: Real, over: Real, dU: Real, dN: Real, out_U: Real, out_N: Real, rates: Real,
) -> None:  # fmt: skip
    """Add ξ dq dq' M/q': the onset moves, where the rate of the limit, q = ξ kt u' − μN', is 0."""
    e, de, en, den = at[0], at[1], over[0], over[1]
    bend = xi * kt * curvature_at(e, ks, U) - mu * curvature_at(en, load_ks, N)
    along = xi * kt * dot(de, dU) - mu * dot(den, dN)
    factor = xi * along * held / bend
    _add(out_U, factor * xi * kt, de)
    _add(out_N, -factor * mu, den)
    rates[_KT] += factor * xi * dot(de, U)
    rates[_MU] -= factor * dot(den, N)


@compiled
def _onset_after_separation(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, held: float, weight: float,
    at: Real, over: Real, dU: Real, dN: Real, out_U: Real, out_N: Real, rates: Real,
) -> None:  # fmt: skip
    """Add what moves with the onset where N = 0: the offset c = −kt u(τs) and the beginning of the force."""
    e, de, en, den = at[0], at[1], over[0], over[1]
    speed, rise = dot(de, U), dot(den, N)
    moved = -dot(en, dN) / rise  # dτs
    turn = dot(den, dN)
    _add(out_U, -held * kt * moved, de)
    rates[_KT] -= held * speed * moved
    factor = held * kt * (dot(de, dU) + curvature_at(e, ks, U) * moved) / rise
    factor -= held * kt * speed * (turn + curvature_at(en, load_ks, N) * moved) / (rise * rise)
    factor -= kt * speed * weight * moved / rise
    _add(out_N, factor, en)
    _add(out_N, held * kt * speed * moved / rise, den)
    rates[_LOAD] -= held * kt * speed * dot(en, dN) / rise


@compiled
def _end_of_stick(
    U: Real, N: Real, kt: float, mu: float, row: Row, way: float, weight: float,
    at: Real, over: Real, dU: Real, dN: Real, out_U: Real, out_N: Real, rates: Real,
) -> None:  # fmt: skip
    """Add −J J' W/D where the force of a stick reaches the limit ξ = `way`."""
    e, de, eb, deb = at[0], at[1], at[2], at[3]
    en, den, enb, denb = over[0], over[1], over[2], over[3]
    slope = kt * dot(deb, U) - way * mu * dot(denb, N)
    along = kt * (dot(eb, dU) - dot(e, dU)) - way * mu * dot(enb, dN)
    at_onset, by_friction = 0.0, -way * dot(enb, N)
    if row.began == AFTER_SLIP:
        at_onset = row.direction * mu
        by_friction += row.direction * dot(en, N)
    else:
        at_onset = kt * dot(de, U) / dot(den, N)
    along += at_onset * dot(en, dN)
    factor = -along * weight / slope
    for i in range(e.size):
        out_U[i] += factor * kt * (eb[i] - e[i])
    for j in range(en.size):
        out_N[j] += factor * (at_onset * en[j] - way * mu * enb[j])
    rates[_KT] += factor * (dot(eb, U) - dot(e, U))
    rates[_MU] += factor * by_friction
