"""Elastic Coulomb friction in two tangential directions with one circular limit, |T| ≤ μ N.

Where the force turns while it slips there is no closed form for a periodic motion, so the law is sampled: T
goes from sample to sample, period after period from the unloaded state, until it repeats. Between two samples
motion and load are straight lines, for which the law is solved in closed form: contact begins where N crosses
0; the elastic force reaches the limit at a root of a quadratic; from there on Ṫ = kt u̇ − λT with |T| = L(τ)
turns T towards the motion by L θ̇ = −kt |u̇| sin θ, so

    tan θ/2 decays by the factor exp(−kt ∫ |u̇| dτ / L),

which is rational in T. The Jacobian is the derivative of exactly this map, carried along with it. What the
sampling leaves out is of second order in the distance of the samples.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.columns import KT, MU, SAMPLES
from solver.contacts.kernels.stick_slip_events import LIFTING, SEPARATED, SLIPPING, STUCK
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import fill_block
from solver.jit.separate import apart

MOST_PERIODS = 200
REPEATS = 1e-12  # change of T over a period, relative to the largest force, that counts as none


@compiled
def sampled(q: Real, ks: Integer, cosine: Real, sine: Real, out: Real) -> None:
    """Fill `out` with the values of coefficients `q` at the samples whose cosine and sine are given."""
    n = out.size
    for j in range(n):
        total = 0.0
        for i in range(ks.size):
            here, at = cosine_position(ks, i), (ks[i] * j) % n
            total += q[here] * cosine[at]
            if ks[i] > 0:
                total += q[here + 1] * sine[at]
        out[j] = total


@compiled
def _log_share(z: float) -> tuple[float, float]:
    """Return log(1 + z)/z and its derivative."""
    if abs(z) < 1e-3:
        return (
            1.0 - z * (0.5 - z * (1.0 / 3.0 - z * (0.25 - 0.2 * z))),
            -0.5 + z * (2.0 / 3.0 - z * (0.75 - z * (0.8 - z * 5.0 / 6.0))),
        )
    value = math.log1p(z) / z
    return value, (1.0 / (1.0 + z) - value) / z


@compiled
def plane_step(kt: float, du: float, dw: float, low: float, high: float, T: Real, d: Real, dT: Real) -> bool:
    """Move the force `T` (2,) over one interval; return whether it slips.

    Parameters
    ----------
    kt : stiffness; du, dw : change of the motion; low, high : μ N at both ends, not cut at 0.
    d : (7, m) derivatives of T (both), du, dw, low, high and kt by m variables (m may be 0).
    dT : (2, m) those of the new force, filled.
    """
    m = d.shape[1]
    if high <= 0.0:
        T[0], T[1] = 0.0, 0.0
        for j in range(m):
            dT[0, j], dT[1, j] = 0.0, 0.0
        return False
    opens = low <= 0.0
    share = high / (high - low) if opens else 1.0
    x, y, limit = kt * share * du, kt * share * dw, 0.0 if opens else low
    px, py = 0.0 if opens else T[0], 0.0 if opens else T[1]
    change = np.empty((6, m))
    for j in range(m):
        dshare = (share * d[4, j] - low / (high - low) * d[5, j]) / (high - low) if opens else 0.0
        stretch, kept = d[6, j] * share + kt * dshare, 0.0 if opens else 1.0
        change[0, j], change[1, j] = kept * d[0, j], kept * d[1, j]
        change[2, j] = kt * share * d[2, j] + stretch * du
        change[3, j] = kt * share * d[3, j] + stretch * dw
        change[4, j], change[5, j] = kept * d[4, j], d[5, j]
    if math.hypot(px + x, py + y) <= high:
        T[0], T[1] = px + x, py + y
        for j in range(m):
            dT[0, j], dT[1, j] = change[0, j] + change[2, j], change[1, j] + change[3, j]
        return False
    _reach_limit(px, py, x, y, limit, high, T, change, dT)
    return True


@compiled
def _reach_limit(
    px: float, py: float, x: float, y: float, limit: float, high: float, T: Real, change: Real, dT: Real
) -> None:
    """Follow the elastic force from (px, py) along (x, y) to the limit, and turn it from there.

    The limit rises from `limit` to `high`; `change` (6, m) has the derivatives of these six, overwritten.
    """
    rise = high - limit
    a, b = x * x + y * y - rise * rise, px * x + py * y - limit * rise
    c = min(px * px + py * py - limit * limit, 0.0)
    root = math.sqrt(max(b * b - a * c, 0.0))
    f = -c / (b + root) if b > 0.0 else (root - b) / a
    fx, fy, reached = px + f * x, py + f * y, limit + f * rise
    for j in range(change.shape[1]):
        dpx, dpy, dx, dy, dlimit = change[0, j], change[1, j], change[2, j], change[3, j], change[4, j]
        drise = change[5, j] - dlimit
        da = 2.0 * (x * dx + y * dy - rise * drise)
        db = dpx * x + px * dx + dpy * y + py * dy - dlimit * rise - limit * drise
        dc = 2.0 * (px * dpx + py * dpy - limit * dlimit)
        df = -(0.5 * f * f * da + f * db + 0.5 * dc) / root if root > 0.0 else 0.0
        change[0, j], change[1, j] = dpx + f * dx + df * x, dpy + f * dy + df * y
        change[2, j], change[3, j] = (1.0 - f) * dx - df * x, (1.0 - f) * dy - df * y
        change[4, j] = dlimit + f * drise + df * rise
    _turn(fx, fy, (1.0 - f) * x, (1.0 - f) * y, reached, high, T, change, dT)


@compiled
def _turn(
    fx: float, fy: float, x: float, y: float, low: float, high: float, T: Real, change: Real, dT: Real
) -> None:
    """Turn a force (fx, fy) at the limit `low` towards the slip (x, y) while the limit goes to `high`.

    With n and w the directions of both, q the decay and c = n·w, the new direction is
    ((1 + c − q² (1 − c) − 2 q c) w + 2 q n) / (1 + c + q² (1 − c)).
    """
    size, length = math.hypot(fx, fy), math.hypot(x, y)
    wx, wy = 1.0, 0.0
    if length > 0.0:
        wx, wy = x / length, y / length
    elif size > 0.0:
        wx, wy = fx / size, fy / size
    nx, ny = (fx / size, fy / size) if size > 0.0 else (wx, wy)
    mean, dmean = _log_share(high / low - 1.0 if low > 0.0 else 0.0)
    decay = math.exp(-length * mean / low) if low > 0.0 else 0.0
    cosine = nx * wx + ny * wy
    below = 1.0 + cosine + decay * decay * (1.0 - cosine)
    along = (1.0 + cosine - decay * decay * (1.0 - cosine) - 2.0 * decay * cosine) / below
    kept = 2.0 * decay / below
    tx, ty = along * wx + kept * nx, along * wy + kept * ny
    T[0], T[1] = high * tx, high * ty
    for j in range(change.shape[1]):
        dx, dy, dlow, dhigh = change[2, j], change[3, j], change[4, j], change[5, j]
        dlength, dwx, dwy = 0.0, 0.0, 0.0
        if length > 0.0:
            across = (wx * dy - wy * dx) / length
            dlength, dwx, dwy = wx * dx + wy * dy, -wy * across, wx * across
        dnx, dny = dwx, dwy
        if size > 0.0:
            across = (nx * change[1, j] - ny * change[0, j]) / size
            dnx, dny = -ny * across, nx * across
        ddecay = 0.0
        if low > 0.0:
            dz = (dhigh - high / low * dlow) / low
            ddecay = -decay * (dlength * mean + length * dmean * dz - length * mean * dlow / low) / low
        dcosine = dnx * wx + nx * dwx + dny * wy + ny * dwy
        square = 2.0 * decay * ddecay * (1.0 - cosine) - decay * decay * dcosine
        dbelow = dcosine + square
        dalong = (dcosine - square - 2.0 * (ddecay * cosine + decay * dcosine) - along * dbelow) / below
        dkept = (2.0 * ddecay - kept * dbelow) / below
        dT[0, j] = dhigh * tx + high * (dalong * wx + along * dwx + dkept * nx + kept * dnx)
        dT[1, j] = dhigh * ty + high * (dalong * wy + along * dwy + dkept * ny + kept * dny)


@apart
def periods_to_repeat(u: Real, limit: Real, kt: float) -> int:
    """Return how many periods pass until the force at τ = 0 repeats, at most MOST_PERIODS.

    Parameters
    ----------
    u : (2, samples) motion; limit : (samples,) μ N.
    """
    n, T = limit.size, np.zeros(2)
    no_seeds, nothing = np.empty((7, 0)), np.empty((2, 0))
    plane_step(kt, u[0, 0], u[1, 0], limit[0], limit[0], T, no_seeds, nothing)
    top = 0.0
    for period in range(1, MOST_PERIODS):
        x, y = T[0], T[1]
        for j in range(n):
            to = j + 1 if j + 1 < n else 0
            plane_step(kt, u[0, to] - u[0, j], u[1, to] - u[1, j], limit[j], limit[to], T, no_seeds, nothing)
            top = max(top, math.hypot(T[0], T[1]))
        if math.hypot(T[0] - x, T[1] - y) <= REPEATS * top:
            return period
    return MOST_PERIODS


@apart
def coulomb_plane(
    U: Real, ks: Integer, load: Real, load_ks: Integer, row: Real, slope: Real, dload: Real,
    cos_table: Real, sin_table: Real, segments: Real, F: Real, dF_dU: Real, dF_dp: Real,
) -> tuple[int, int]:  # fmt: skip
    """Fill both components of the force, their Jacobian and their derivative by λ (as in the contract)."""
    samples = int(row[SAMPLES])
    cosine, sine = np.empty(samples), np.empty(samples)
    for j in range(samples):
        cosine[j], sine[j] = math.cos(2.0 * math.pi * j / samples), math.sin(2.0 * math.pi * j / samples)
    u, limit, dlimit = np.empty((2, samples)), np.empty(samples), np.empty(samples)
    sampled(U[0], ks, cosine, sine, u[0])
    sampled(U[1], ks, cosine, sine, u[1])
    sampled(load, load_ks, cosine, sine, limit)
    sampled(dload, load_ks, cosine, sine, dlimit)
    opens, closes = False, False
    for j in range(samples):
        dlimit[j] = row[MU] * dlimit[j] + slope[MU] * limit[j]
        limit[j] *= row[MU]
        closes, opens = closes or limit[j] > 0.0, opens or limit[j] <= 0.0
    for block in range(4):
        fill_block(dF_dU[block], 0.0)
    fill_block(F, 0.0)
    fill_block(dF_dp, 0.0)
    if not closes:
        return SEPARATED, 0
    periods = periods_to_repeat(u, limit, row[KT])
    piece = _march(u, limit, dlimit, row[KT], slope[KT], ks, cosine, sine, periods, F, dF_dU, dF_dp)
    if opens:
        return LIFTING, piece
    return (SLIPPING, piece) if piece > 0 else (STUCK, piece)


@apart
def _march(
    u: Real, limit: Real, dlimit: Real, kt: float, dkt: float, ks: Integer, cosine: Real, sine: Real,
    periods: int, F: Real, dF_dU: Real, dF_dp: Real,
) -> int:  # fmt: skip
    """March `periods` periods with derivatives and project the last one.

    D (2, 2n + 1) is the derivative of T by the coefficients of both motions and, last, by λ.

    Returns
    -------
    A number for the samples at which it slips in the last period, 0 if at none.
    """
    samples, n, piece = limit.size, coefficient_count(ks), 0
    T, D, seeds, J = np.zeros(2), np.zeros((2, 2 * n + 1)), np.eye(7), np.empty((2, 7))
    step, project = np.zeros(n), np.empty(n)
    _basis_step(ks, cosine, sine, 0, -1, step)
    plane_step(kt, u[0, 0], u[1, 0], limit[0], limit[0], T, seeds, J)
    _carry(J, step, dlimit[0], dlimit[0], dkt, D)
    for period in range(periods):
        last = period == periods - 1
        piece = 0
        for j in range(samples):
            to = j + 1 if j + 1 < samples else 0
            _basis_step(ks, cosine, sine, to, j, step)
            slips = plane_step(kt, u[0, to] - u[0, j], u[1, to] - u[1, j], limit[j], limit[to], T, seeds, J)
            _carry(J, step, dlimit[j], dlimit[to], dkt, D)
            if slips:
                piece = (31 * piece + to + 1) & 0xFFFFFFFFFF
            if last:
                _basis_step(ks, cosine, sine, to, -1, project)
                _add_sample(ks, project, T, D, 1.0 / samples, F, dF_dU, dF_dp)
    return piece


@compiled
def _carry(J: Real, step: Real, dlow: float, dhigh: float, dkt: float, D: Real) -> None:
    """Move the derivatives of T over one interval, whose map has the derivatives J."""
    n = step.size
    for i in range(2 * n + 1):
        x, y = D[0, i], D[1, i]
        D[0, i], D[1, i] = J[0, 0] * x + J[0, 1] * y, J[1, 0] * x + J[1, 1] * y
    for a in range(2):
        for i in range(n):
            D[a, i] += J[a, 2] * step[i]
            D[a, n + i] += J[a, 3] * step[i]
        D[a, 2 * n] += J[a, 4] * dlow + J[a, 5] * dhigh + J[a, 6] * dkt


@compiled
def _basis_step(ks: Integer, cosine: Real, sine: Real, here: int, before: int, out: Real) -> None:
    """Fill `out` with the basis at sample `here`, less that at sample `before` (−1: nothing)."""
    samples = cosine.size
    for i in range(ks.size):
        at, a = cosine_position(ks, i), (ks[i] * here) % samples
        b = (ks[i] * before) % samples
        out[at] = cosine[a] - (cosine[b] if before >= 0 else 0.0)
        if ks[i] > 0:
            out[at + 1] = sine[a] - (sine[b] if before >= 0 else 0.0)


@compiled
def _add_sample(
    ks: Integer, project: Real, T: Real, D: Real, share: float, F: Real, dF_dU: Real, dF_dp: Real
) -> None:
    """Add one sample to the Fourier coefficients of force and derivatives."""
    n = project.size
    for i in range(n):
        weight = share * project[i] * (1.0 if ks[0] == 0 and i == 0 else 2.0)
        for a in range(2):
            F[a, i] += weight * T[a]
            dF_dp[a, i] += weight * D[a, 2 * n]
            for j in range(n):
                dF_dU[2 * a, i, j] += weight * D[a, j]
                dF_dU[2 * a + 1, i, j] += weight * D[a, n + j]
