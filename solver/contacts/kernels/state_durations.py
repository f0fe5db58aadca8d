"""What one contact does over a period: from motion and load to the table of its stick and slip segments.

The march itself is in `solver.contacts.kernels.stick_slip_events`; here its polynomials are built, the
intervals of contact found and the state classified.
"""

from __future__ import annotations

import math

import numpy as np

from solver.contacts.kernels.stick_slip_events import (
    AFTER_SEPARATION,
    AFTER_SLIP,
    FAILED,
    LIFTING,
    ROUNDING,
    SEPARATED,
    SLIP,
    SLIPPING,
    STICK,
    STUCK,
    UNLOADED,
    largest,
    march,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.kernel_records import Records
from solver.jit.separate import apart
from solver.jit.trig_polynomial import FALLING, RISING, at_point, bracketed_root, on_grid, unpack


@apart
def contact_intervals(c: Real, s: Real, degree: int, value: Real, slope: Real, out: Real) -> int:
    """Fill `out` with [begin, end] of every interval with N > 0, when N < 0 somewhere; return their number.

    The intervals are unwrapped: an end may exceed 2π. −1 means N never becomes negative, but for rounding.
    """
    n = value.size
    delta = 2.0 * math.pi / n
    low, touches = 0.0, 0.0
    for k in range(degree + 1):
        touches -= ROUNDING * math.hypot(c[k], s[k])
    negative = -1
    for j in range(n):
        if value[j] < touches:
            negative = j
            break
    if negative < 0:
        above, low = _smallest(c, s, degree, value, slope)
        if above >= touches:
            return -1
    else:
        low = negative * delta
    count = 0
    before, at = -1.0, low
    j = math.floor(low / delta) + 1
    end = low + 2.0 * math.pi
    rising_at = 0.0
    in_contact = False
    while at < end:
        hi = min(j * delta, end)
        now = value[j % n] if hi < end else -1.0
        if before < 0.0 <= now or before >= 0.0 > now:
            span = now - before
            way = RISING if now >= 0.0 else FALLING
            tau = bracketed_root(c, s, degree, 0, 0.0, at, hi, at - (hi - at) * before / span, way)
            if now >= 0.0:
                rising_at, in_contact = tau, True
            elif in_contact:
                if count < out.shape[0]:
                    out[count, 0], out[count, 1] = rising_at, tau
                    count += 1
                in_contact = False
        elif before < 0.0 and now < 0.0:
            tau, top = _turning(c, s, degree, at, hi, FALLING)
            if top > 0.0 and count < out.shape[0]:
                out[count, 0] = bracketed_root(c, s, degree, 0, 0.0, at, tau, 0.5 * (at + tau), RISING)
                out[count, 1] = bracketed_root(c, s, degree, 0, 0.0, tau, hi, 0.5 * (hi + tau), FALLING)
                count += 1
        elif in_contact:
            tau, bottom = _turning(c, s, degree, at, hi, RISING)
            if bottom < 0.0 and count < out.shape[0]:
                out[count, 0] = rising_at
                out[count, 1] = bracketed_root(c, s, degree, 0, 0.0, at, tau, 0.5 * (at + tau), FALLING)
                rising_at = bracketed_root(c, s, degree, 0, 0.0, tau, hi, 0.5 * (hi + tau), RISING)
                count += 1
        before = now
        at = hi
        j += 1
    return count


@compiled
def one_wave(mean: float, cosine: float, sine: float, out: Real) -> int:
    """Fill `out` with the interval where mean + cosine cos τ + sine sin τ > 0; as `contact_intervals`.

    With ψ its phase and R its amplitude it is |τ − ψ| < h, tan²(h/2) = (R + mean)/(R − mean). Where both are
    equal it touches 0 and does not open, whichever of them rounding makes larger.
    """
    amplitude = math.hypot(cosine, sine)
    if mean >= amplitude * (1.0 - ROUNDING):
        return -1 if mean > 0.0 else 0
    if mean <= -amplitude:
        return 0
    half = 2.0 * math.atan2(math.sqrt(amplitude + mean), math.sqrt(amplitude - mean))
    begin = math.atan2(sine, cosine) - half
    if begin < 0.0:
        begin += 2.0 * math.pi
    out[0, 0], out[0, 1] = begin, begin + 2.0 * half
    return 1


@compiled
def _smallest(c: Real, s: Real, degree: int, value: Real, slope: Real) -> tuple[float, float]:
    """Return the minimum of a polynomial over the period and its place, from its values on the grid."""
    n = value.size
    minus_c, minus_s = np.empty(degree + 1), np.empty(degree + 1)
    minus_value, minus_slope = np.empty(n), np.empty(n)
    for k in range(degree + 1):
        minus_c[k], minus_s[k] = -c[k], -s[k]
    for j in range(n):
        minus_value[j], minus_slope[j] = -value[j], -slope[j]
    high, place = largest(minus_c, minus_s, degree, minus_value, minus_slope)
    return -high, place


@compiled
def _turning(c: Real, s: Real, degree: int, lo: float, hi: float, way: float) -> tuple[float, float]:
    """Return place and value of an extremum inside [lo, hi], (lo, 0) if there is none.

    A minimum is looked for if the slope is to be RISING, a maximum if it is to be FALLING.
    """
    if way * at_point(c, s, degree, lo)[1] >= 0.0 or way * at_point(c, s, degree, hi)[1] <= 0.0:
        return lo, 0.0
    tau = bracketed_root(c, s, degree, 1, 0.0, lo, hi, 0.5 * (lo + hi), way)
    return tau, at_point(c, s, degree, tau)[0]


@apart
def find_segments(
    U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, cos_table: Real, sin_table: Real,
    segments: Records,
) -> tuple[int, int]:  # fmt: skip
    """March one period and fill the segment table.

    Parameters
    ----------
    U : coefficients of the slip motion u [m] for harmonics `ks`; N : of the normal load [N] for `load_ks`.
    cos_table, sin_table : of `solver.jit.trig_polynomial.grid_tables`.
    segments : (capacity,), overwritten.

    Returns
    -------
    (state, number of segments); the state is SEPARATED, STUCK, SLIPPING, LIFTING or FAILED.
    """
    at_once = _plain(U, ks, N, load_ks, kt, mu, segments)
    if at_once >= 0:
        return at_once, 1 if at_once == STUCK else 0
    degree = max(ks[-1], load_ks[-1])
    n_grid = 2 * (cos_table.shape[1] - 1)
    curves, waves = np.empty((8, n_grid)), np.empty((8, degree + 1))
    uc, us, nc, ns = waves[0], waves[1], waves[2], waves[3]
    unpack(U, ks, uc, us)
    unpack(N, load_ks, nc, ns)
    u, du, load, dload = curves[0], curves[1], curves[2], curves[3]
    on_grid(uc, us, ks[-1], cos_table, sin_table, u, du)
    on_grid(nc, ns, load_ks[-1], cos_table, sin_table, load, dload)
    value, slope = curves[4:6], curves[6:8]
    u_max, load_max = 0.0, 0.0
    for j in range(n_grid):
        a, b = kt * u[j], mu * load[j]
        value[0, j], value[1, j] = a - b, -a - b
        a, b = kt * du[j], mu * dload[j]
        slope[0, j], slope[1, j] = a - b, -a - b
        u_max, load_max = max(u_max, abs(u[j])), max(load_max, load[j])
    if not (math.isfinite(u_max) and math.isfinite(load_max)):
        return FAILED, 0
    tol = ROUNDING * (kt * u_max + mu * load_max)
    c, s = waves[4:6], waves[6:8]
    for k in range(degree + 1):
        c[0, k], c[1, k] = kt * uc[k] - mu * nc[k], -kt * uc[k] - mu * nc[k]
        s[0, k], s[1, k] = kt * us[k] - mu * ns[k], -kt * us[k] - mu * ns[k]
    if is_symmetric(ks, N):
        return _march_half(c, s, degree, value, slope, tol, segments)
    intervals = np.empty((load_ks[-1] + 1, 2))
    n_intervals = 0 if load_max <= 0.0 else -1
    if load_ks[-1] == 1:
        n_intervals = one_wave(nc[0], nc[1], ns[1], intervals)
    elif load_ks[-1] > 1:
        n_intervals = contact_intervals(nc, ns, load_ks[-1], load, dload, intervals)
    if n_intervals == 0 or load_max <= 0.0:
        return SEPARATED, 0
    if n_intervals < 0:
        return _march_circle(c, s, degree, value, slope, tol, segments)
    return _march_intervals(c, s, degree, value, slope, tol, intervals, n_intervals, segments)


@compiled
def is_symmetric(ks: Integer, N: Real) -> bool:
    """Return whether the force is half-wave symmetric: odd harmonics under a constant load."""
    for i in range(ks.size):
        if ks[i] % 2 == 0:
            return False
    for j in range(1, N.size):
        if N[j] != 0.0:
            return False
    return N[0] > 0.0


@compiled
def _plain(U: Real, ks: Integer, N: Real, load_ks: Integer, kt: float, mu: float, segments: Records) -> int:
    """Return STUCK or SEPARATED where the sums of the amplitudes alone show it, else −1."""
    reach, swing, mean, here = 0.0, 0.0, 0.0, 0
    for i in range(ks.size):
        if ks[i] == 0:
            reach += abs(U[0])
            here += 1
        else:
            reach += math.hypot(U[here], U[here + 1])
            here += 2
    here = 0
    for i in range(load_ks.size):
        if load_ks[i] == 0:
            mean = N[0]
            here += 1
        else:
            swing += math.hypot(N[here], N[here + 1])
            here += 2
    if mean + swing <= 0.0 and math.isfinite(reach):
        return SEPARATED
    if swing <= mean and kt * reach <= mu * (mean - swing):
        row = segments[0]
        row.motion, row.begin, row.end = STICK, 0.0, 2.0 * math.pi
        row.direction, row.onset, row.began = 1.0, 0.0, UNLOADED
        return STUCK
    return -1


@compiled
def _march_half(
    c: Real, s: Real, degree: int, value: Real, slope: Real, tol: float, segments: Records
) -> tuple[int, int]:
    """March half a period of a half-wave symmetric contact: the other half mirrors it, limits exchanged."""
    high, begin = largest(c[1], s[1], degree, value[1], slope[1])
    if 2.0 * high <= tol:
        row = segments[0]
        row.motion, row.begin, row.end = STICK, 0.0, 2.0 * math.pi
        row.direction, row.onset, row.began = 1.0, 0.0, UNLOADED
        return STUCK, 1
    none = int(np.int64(0))
    end = begin + math.pi
    count = march(c, s, degree, value, slope, begin, end, STICK, -1.0, high, AFTER_SLIP, tol, segments, none)
    if count < 0 or 2 * count > segments.shape[0]:
        return FAILED, 0
    for i in range(count):
        row, mirrored = segments[i], segments[count + i]
        mirrored.motion, mirrored.began, mirrored.direction = row.motion, row.began, -row.direction
        mirrored.begin, mirrored.end = row.begin + math.pi, row.end + math.pi
        mirrored.onset = row.onset + math.pi
    return SLIPPING, 2 * count


@apart
def _march_intervals(
    c: Real, s: Real, degree: int, value: Real, slope: Real, tol: float, intervals: Real, n_intervals: int,
    segments: Records,
) -> tuple[int, int]:  # fmt: skip
    """March every interval of contact from its beginning, where the force is 0."""
    count = 0
    for i in range(n_intervals):
        begin, end = intervals[i, 0], intervals[i, 1]
        plus, rate_plus, _, _ = at_point(c[0], s[0], degree, begin)
        minus, rate_minus, _, _ = at_point(c[1], s[1], degree, begin)
        motion = STICK if rate_plus < 0.0 and rate_minus < 0.0 else SLIP
        direction = 1.0 if rate_plus >= rate_minus else -1.0
        offset = 0.5 * (minus - plus)  # −kt u
        count = march(
            c, s, degree, value, slope, begin, end, motion, direction, offset, AFTER_SEPARATION, tol,
            segments, count,
        )  # fmt: skip
        if count < 0:
            return FAILED, 0
    return LIFTING, count


@compiled
def _march_circle(
    c: Real, s: Real, degree: int, value: Real, slope: Real, tol: float, segments: Records
) -> tuple[int, int]:
    """March a contact that never separates: stuck for ever, or one period from the largest w_−."""
    high_minus, at_minus = largest(c[1], s[1], degree, value[1], slope[1])
    high_plus, at_plus = largest(c[0], s[0], degree, value[0], slope[0])
    if high_minus + high_plus <= tol:
        row = segments[0]
        row.motion, row.begin, row.end = STICK, 0.0, 2.0 * math.pi
        if high_minus > tol:
            row.direction, row.onset, row.began = -1.0, at_minus, AFTER_SLIP
        elif high_plus > tol:
            row.direction, row.onset, row.began = 1.0, at_plus, AFTER_SLIP
        else:
            row.direction, row.onset, row.began = 1.0, 0.0, UNLOADED
        return STUCK, 1
    begin, end = at_minus, at_minus + 2.0 * math.pi
    none = int(np.int64(0))  # a literal 0 would compile the march a second time
    count = march(
        c, s, degree, value, slope, begin, end, STICK, -1.0, high_minus, AFTER_SLIP, tol, segments, none
    )
    return (SLIPPING, count) if count >= 0 else (FAILED, 0)
