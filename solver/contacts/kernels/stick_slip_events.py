"""The event march of one elastic Coulomb contact: where it sticks, slips and separates over one period.

With ``w_ξ(τ) = ξ kt u(τ) − μ N(τ)`` for ξ = ±1 everything is a root or an extremum of two trigonometric
polynomials: a stuck contact with force kt u + c reaches the limit ξ where ``w_ξ + ξ c`` crosses 0 upward, and
a slipping one sticks again where ``w_ξ'`` crosses 0 downward, with ``c = −ξ w_ξ`` there.

Where the march starts. The offset c moves only when a limit pushes it: ``c ≥ w_−`` and ``c ≤ −w_+`` (a
catching-up process). If max w_− + max w_+ ≤ 0 nothing ever pushes once c lies between the two extremes: the
contact sticks for ever, and from the unloaded state c is 0 clipped to them (the shakedown of a one-sided
slip, with the extremum as its onset). Otherwise c equals max w_− at the place of that maximum whatever came
before, so the periodic state is found by one march over one period from there, with no transient. Where N
becomes negative, every contact interval starts from a known force, 0.

Reference for the law: Yang, Chu, Menq, J. Sound Vib. 210 (1998) 461, doi:10.1006/jsvi.1997.1305 (variable
normal load); Petrov, Ewins, J. Turbomach. 125 (2003) 364, doi:10.1115/1.1539868 (multi-harmonic form).
"""

from __future__ import annotations

import math

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.kernel_records import Records, record
from solver.jit.separate import apart
from solver.jit.trig_polynomial import FALLING, RISING, at_point, bracketed_root, cubic_root, cubic_turn

# What a contact does over the period.
SEPARATED, STUCK, SLIPPING, LIFTING, FAILED = 0, 1, 2, 3, 4
# A segment's motion and what its stick began after; columns of the segment table.
STICK, SLIP = 0.0, 1.0
UNLOADED, AFTER_SLIP, AFTER_SEPARATION = 0.0, 1.0, 2.0
# ξ of a slip, or of that before a stick; when it begins and ends; when the stick's offset was fixed.
SEGMENT = record(motion=float, direction=float, begin=float, end=float, onset=float, began=float)

NO_LENGTH = 1e-11  # rad
ROUNDING = 2e-14  # relative to kt max|u| + μ max|N|: below it a limit is not crossed
# A slope counts as 0 below ROUNDING times degree^2: even where its root is found to the last bit, a curvature
# of the order of degree^2 leaves that much.


@compiled
def segment_capacity(degree: int) -> int:
    """Return how many segments a period may have; each event is a root of a polynomial of this degree."""
    return 16 * degree + 64


@compiled
def new_segments(degree: int) -> Records:
    """Return an empty table of segments."""
    return np.zeros(segment_capacity(degree), SEGMENT)


@apart
def largest(c: Real, s: Real, degree: int, value: Real, slope: Real) -> tuple[float, float]:
    """Return the maximum of a polynomial over the period and its place, from its values on the grid.

    Every interval whose cubic through values and slopes comes near the best is refined.
    """
    n = value.size
    delta = 2.0 * math.pi / n
    top, bottom = value[0], value[0]
    for j in range(n):
        top = max(top, value[j])
        bottom = min(bottom, value[j])
    near = top - 2e-2 * (top - bottom)
    best, place = -np.inf, 0.0
    for j in range(n):
        after = j + 1 if j + 1 < n else 0
        if slope[j] > 0.0 and slope[after] <= 0.0:
            above = min(value[j] + delta * slope[j], value[after] - delta * slope[after])
            if max(above, max(value[j], value[after])) < near:
                continue
            guess = delta * j + cubic_turn(value[j], slope[j], value[after], slope[after], delta)
            tau = bracketed_root(c, s, degree, 1, 0.0, delta * j, delta * (j + 1), guess, FALLING)
            here = at_point(c, s, degree, tau)[0]
            if here > best:
                best, place = here, tau
    if best < top:
        for j in range(n):
            if value[j] == top:
                best, place = top, delta * j
    return best, place


@compiled
def _crosses(
    c: Real, s: Real, degree: int, shift: float, tol: float,
    lo: float, hi: float, g_lo: float, slope_lo: float, g_hi: float, slope_hi: float,
) -> float:  # fmt: skip
    """Return the first place in (lo, hi] where (polynomial + shift) exceeds 0, or infinity.

    A value at `lo` of 0 (the limit just left) is not a crossing: the function first has to become negative.
    """
    end = hi
    if g_hi <= tol:
        width = hi - lo
        # A stick begins where the function is highest: a slope left there by rounding leads nowhere.
        if slope_lo <= tol * degree * degree or slope_hi >= 0.0:
            return np.inf
        # The cubic is no higher than this, and off by no more than |w⁗| ≤ degree⁴ max|w| allows (Bernstein).
        top = max(g_lo, g_hi) + 4.0 / 27.0 * width * (slope_lo - slope_hi)
        if top + (degree * width) ** 4 / 384.0 * tol / ROUNDING <= tol:
            return np.inf
        guess = lo + cubic_turn(g_lo, slope_lo, g_hi, slope_hi, width)
        end = bracketed_root(c, s, degree, 1, 0.0, lo, hi, guess, FALLING)
        g_hi = at_point(c, s, degree, end)[0] + shift
        if g_hi <= tol:
            return np.inf
    begin = lo
    if g_lo >= -tol:
        begin = -1.0
        for part in range(1, 16):
            tau = lo + (end - lo) * part / 16.0
            if at_point(c, s, degree, tau)[0] + shift < -tol:
                begin = tau
                break
        if begin < 0.0:
            # Below 0 for less than the first part: the lowest point is there, or the rise begins at once.
            end = lo + (end - lo) / 16.0
            begin = bracketed_root(c, s, degree, 1, 0.0, lo, end, 0.5 * (lo + end), RISING)
            if at_point(c, s, degree, begin)[0] + shift >= -tol:
                return begin
            g_hi = at_point(c, s, degree, end)[0] + shift
    rise = g_hi - g_lo
    guess = begin + (end - begin) * (-g_lo / rise if rise > 0.0 else 0.5)
    if begin == lo and end == hi:
        guess = lo + cubic_root(g_lo, slope_lo, g_hi, slope_hi, hi - lo)
    return bracketed_root(c, s, degree, 0, shift, begin, end, guess, RISING)


@compiled
def _begin_stick(
    c: Real, s: Real, degree: int, shift: float, start: float, until: float, tol: float
) -> tuple[float, float, float, float]:
    """Begin to follow a stuck contact towards one limit.

    Where the function dips first, a rise and fall that follow before `until` would not show at the ends of
    this interval: it is followed from where it rises. A parabola is back at its level after −2 w'/w''; what
    falls again afterwards is lower there, and still rises.

    Returns
    -------
    (where the stick ends at once, or infinity; value, slope and place from which it is followed).
    """
    q, dq, curve, _ = at_point(c, s, degree, start)
    flat, at_limit = tol * degree * degree, q + shift > -tol
    if at_limit and (dq > flat or (dq > -flat and curve > 0.0)):
        return start, q + shift, dq, start
    back = -2.0 * dq / curve if dq <= 0.0 < curve else np.inf
    if start + back < until:
        rise = 0.0
        for share in (1.0, 0.75):
            tau = start + share * back
            there, rise, _, _ = at_point(c, s, degree, tau)
            if rise > 0.0 and there + shift < -tol:
                return np.inf, there + shift, rise, tau
        if at_limit and rise > 0.0:  # a dip as deep as rounding
            return start + back, q + shift, dq, start
    return np.inf, q + shift, dq, start


@apart
def leave_stick(
    c: Real,
    s: Real,
    degree: int,
    value: Real,
    slope: Real,
    offset: float,
    start: float,
    end: float,
    tol: float,
) -> tuple[float, int]:
    """Return when a stuck contact reaches a limit, and which (0: ξ = +1, 1: ξ = −1), or (end, −1)."""
    n = value.shape[1]
    delta = 2.0 * math.pi / n
    j = math.floor(start / delta) + 1
    lo = start
    from_here = np.empty((3, 2))
    g_lo, slope_lo, begin = from_here[0], from_here[1], from_here[2]
    for x in range(2):
        shift = offset if x == 0 else -offset
        ends, g_lo[x], slope_lo[x], begin[x] = _begin_stick(
            c[x], s[x], degree, shift, start, min(j * delta, end), tol
        )
        if ends < np.inf:
            return ends, x
    at = j % n
    while lo < end:
        hi = j * delta
        last = hi >= end
        if last:
            hi = end
        first, which = np.inf, -1
        for x in range(2):
            shift = offset if x == 0 else -offset
            if last:
                q, dq, _, _ = at_point(c[x], s[x], degree, end)
            else:
                q, dq = value[x, at], slope[x, at]
            g_hi = q + shift
            # Nearly every interval ends below the limit without a maximum inside: nothing to look for there.
            if g_hi > tol or (slope_lo[x] > 0.0 and dq < 0.0):
                tau = _crosses(c[x], s[x], degree, shift, tol, begin[x], hi, g_lo[x], slope_lo[x], g_hi, dq)
                if tau < first:
                    first, which = tau, x
            g_lo[x], slope_lo[x], begin[x] = g_hi, dq, hi
        if which >= 0:
            return first, which
        lo = hi
        j += 1
        at = at + 1 if at + 1 < n else 0
    return end, -1


@compiled
def _dip(c: Real, s: Real, degree: int, lo: float, hi: float, tol: float) -> float:
    """Return where the slope is least inside (lo, hi), if it has a minimum below 0 there, else −1."""
    if at_point(c, s, degree, hi)[2] <= 0.0:
        return -1.0
    dip = bracketed_root(c, s, degree, 2, 0.0, lo, hi, 0.5 * (lo + hi), RISING)
    return dip if at_point(c, s, degree, dip)[1] < -tol * degree * degree else -1.0


@apart
def leave_slip(
    c: Real, s: Real, degree: int, value: Real, slope: Real, start: float, end: float, tol: float
) -> float:
    """Return when a slipping contact sticks (w' crosses 0 downward), or `end`.

    Between grid points a dip of w' below 0 is looked for where the grid has a local minimum.
    """
    n = slope.size
    delta = 2.0 * math.pi / n
    j = math.floor(start / delta) + 1
    at = j % n
    lo = start
    _, rate, curve, _ = at_point(c, s, degree, start)
    flat = tol * degree * degree
    if rate < -flat or (rate < flat and curve < 0.0):
        return start
    if rate < flat and 4.0 * flat < (min(j * delta, end) - start) * curve:
        # It starts at its lowest point, which is no end of the slip: the search begins where w' has risen.
        start += 4.0 * flat / curve
        lo = start
        _, rate, curve, _ = at_point(c, s, degree, lo)
    while lo < end:
        hi = j * delta
        last = hi >= end
        if last:
            hi = end
            rate_hi = at_point(c, s, degree, end)[1]
        else:
            rate_hi = slope[at]
        if rate_hi < -flat:
            fall = rate - rate_hi
            guess = lo + (hi - lo) * (rate / fall if fall > 0.0 else 0.5)
            if not last and lo > start:
                guess = lo + cubic_turn(value[at - 1], rate, value[at], rate_hi, hi - lo)
            return bracketed_root(c, s, degree, 1, 0.0, lo, hi, guess, FALLING)
        if lo == start and curve < 0.0:
            dip = _dip(c, s, degree, lo, hi, tol)
            if dip > 0.0:
                return bracketed_root(c, s, degree, 1, 0.0, lo, dip, 0.5 * (lo + dip), FALLING)
        if not last and j * delta - start > delta:
            before, after = slope[at - 1], slope[at + 1 if at + 1 < n else 0]
            if rate_hi <= before and rate_hi <= after:
                bend = before + after - 2.0 * rate_hi
                drop = (before - after) ** 2 / (8.0 * bend) if bend > 0.0 else 0.0
                if rate_hi < 4.0 * drop + 0.05 * bend:
                    dip = bracketed_root(c, s, degree, 2, 0.0, hi - delta, hi + delta, hi, RISING)
                    if dip < end and at_point(c, s, degree, dip)[1] < 0.0:
                        return bracketed_root(c, s, degree, 1, 0.0, lo, dip, 0.5 * (lo + dip), FALLING)
        rate = rate_hi
        lo = hi
        j += 1
        at = at + 1 if at + 1 < n else 0
    return end


@apart
def march(
    c: Real, s: Real, degree: int, value: Real, slope: Real, begin: float, end: float,
    motion: float, direction: float, offset: float, began: float, tol: float, segments: Records, count: int,
) -> int:  # fmt: skip
    """Append the segments of the contact interval [begin, end] to the table; return their number or −1.

    Parameters
    ----------
    c, s : (2, degree + 1) the polynomials w_+ and w_−.
    value, slope : (2, n) their values and slopes on the grid.
    motion, direction, offset, began : the state at `begin`: STICK or SLIP, ξ, offset of the stick force, and
        what the stick began after.
    """
    tau = begin
    while tau < end:
        if count >= segments.shape[0]:
            return -1
        row = segments[count]
        row.begin = tau
        row.onset = tau
        row.motion, row.direction = motion, direction
        if motion == STICK:
            row.began = began
            tau, hit = leave_stick(c, s, degree, value, slope, offset, tau, end, tol)
            if hit >= 0:
                motion, direction = SLIP, 1.0 - 2.0 * hit
        else:
            row.began = AFTER_SLIP
            x = 0 if direction > 0.0 else 1
            tau = leave_slip(c[x], s[x], degree, value[x], slope[x], tau, end, tol)
            offset = -direction * at_point(c[x], s[x], degree, tau)[0]
            motion, began = STICK, AFTER_SLIP
        row.end = tau
        count += 1
    return count


@compiled
def piece_of(segments: Records, count: int) -> int:
    """Return a number for what happens over the period: how many segments there are of each kind.

    The law is smooth where it stays the same. A segment as short as rounding does not count: the period need
    not close on itself to the last bit.
    """
    piece = 0
    for i in range(count):
        row = segments[i]
        if row.end - row.begin <= NO_LENGTH:
            continue
        kind = 2 if row.direction > 0.0 else 3
        if row.motion == STICK and row.began != AFTER_SLIP:
            kind = 0 if row.began == UNLOADED else 1
        elif row.motion == SLIP:
            kind += 2
        piece += 1 << (8 * kind)
    return piece
