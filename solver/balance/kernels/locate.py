"""Places on a branch between two of its points: a peak, the edge of a band, any share of the way."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.gauge import rebase
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.mechanics import ALLOWED
from solver.balance.kernels.newton import arc_newton
from solver.balance.kernels.output import (
    HIGH,
    HIGH_SLOPE,
    LOST,
    LOW,
    LOW_SLOPE,
    MAX_ABS,
    RESIDUAL,
    SLOPE,
    measure,
)
from solver.balance.kernels.residual import evaluate
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real
from solver.jit.lapack import are_finite, copy_to, largest_entry, set_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

_AT_A_FOLD = 1e-9  # weight of λ there
HIGH_PEAK, LOW_PEAK, EDGE = 0, 1, 2
_BY_CUBIC, _BY_SECANT = 2, 7  # trials up to which a cubic tells where to look, then a secant or a slope
# A slope that stays above this share of that at the end it replaces is one side of a corner, where it jumps.
_JUMPS = 0.5
_MET = 1e-11  # of a peak, to which both tangents have foretold it
_PAST, _FARTHER = 0.02, 10.0  # share of the nearer side a trial goes past a corner; times that if in vain
# Up to this share of a peak that is polished to the last digits, and of another, one trial may be too low.
_TOO_LOW, MAY_BE_LOW = 1e-16, 1e-9
_ASTRAY = 0.4  # share of the chord: a cubic that strays further from it is no guess
_ROUNDED = 1e-14  # relative residual that no further step makes smaller


@apart
def tangent_at(system: System, linear: Receptance, point: Evaluation, tangent: Real) -> bool:
    """Fill `tangent` (nt + 1,) with du/dλ = −(dr/du)⁻¹ dr/dλ where last evaluated and 1; False: singular."""
    n = tangent.size - 1
    if factorise(system, linear, point, tangent, 0.0, 0.0) == 0.0:
        return False
    for i in range(n):
        tangent[i] = -point.dr_dp[i]
    tangent[n] = 1.0
    step_back(system, point, tangent[:n])
    return are_finite(tangent)


@apart
def slope_by_parameter(
    system: System, linear: Receptance, u: Real, point: Evaluation, x: Real, out: Real
) -> bool:
    """Measure a solution with its slopes by λ; False where dr/du is singular, or mechanics is not obeyed."""
    tangent = np.empty(u.size + 1)
    if not tangent_at(system, linear, point, tangent):
        return False
    measure(system, linear, u, point, tangent[: u.size], 1.0, x, out)
    return bool(out[LOST] <= ALLOWED)


@compiled
def cubic_between(
    left: Real, left_slope: Real, right: Real, right_slope: Real, width: float, share: float, out: Real
) -> None:
    """Fill `out` with the cubic at a share of the way; slopes are by what both are `width` apart in."""
    t, r = share, 1.0 - share
    a, b = (1.0 + 2.0 * t) * r * r, t * t * (3.0 - 2.0 * t)
    da, db = t * r * r * width, -t * t * r * width
    for i in range(out.size):
        out[i] = a * left[i] + da * left_slope[i] + b * right[i] + db * right_slope[i]


@apart
def between(
    system: System, linear: Receptance, point: Evaluation, left: Real, left_slope: Real, right: Real,
    right_slope: Real, share: float, most: int, found: Real, tangent: Real, x: Real, out: Real,
) -> tuple[bool, int]:  # fmt: skip
    """Solve between two points of a branch, on the plane across their chord at `share` of it.

    Parameters
    ----------
    left, right : (nt + 1,) points, λ last; left_slope, right_slope : their tangents, by the share.
    most : Newton iterations allowed.
    found, tangent : (nt + 1,) the point and its tangent by the share; x (n,), out (MEASURES,) : what is
        observed there, slopes along that tangent; filled.

    Returns
    -------
    (converged, Newton iterations). The guess is the cubic through both points and tangents, or where that
    strays far from the chord, as beside a corner, the place on the chord.
    """
    cubic_between(left, left_slope, right, right_slope, 1.0, share, found)
    folds = left_slope[left.size - 1] * right_slope[left.size - 1] < 0.0
    strayed, length = 0.0, 0.0
    for i in range(left.size - 1):
        step = right[i] - left[i]
        strayed += (found[i] - left[i] - share * step) ** 2
        length += step * step
    if not folds and strayed > _ASTRAY * _ASTRAY * length:
        for i in range(left.size):
            found[i] = left[i] + share * (right[i] - left[i])
    return _on_plane(system, linear, point, left, right, folds, share, most, False, found, tangent, x, out)


@apart
def _on_plane(
    system: System, linear: Receptance, point: Evaluation, left: Real, right: Real, folds: bool, share: float,
    most: int, sharp: bool, found: Real, tangent: Real, x: Real, out: Real,
) -> tuple[bool, int]:  # fmt: skip
    """Solve as `between` from the guess in `found`; `folds`: whether the branch turns between the points."""
    n = left.size - 1
    chord, plane = np.empty(n + 1), np.empty(n + 1)
    set_to(chord, right, -1.0, left)
    size, span = max(largest_entry(left[:n]), system.least_size), abs(chord[n])
    weight_u = 1.0 / (size * size) if size > 0.0 else 1.0
    weight_p = 1.0 / (span * span) if span > 0.0 else 1.0
    if folds:
        # λ goes there and back, and only u tells the places on the arc apart.
        weight_p *= _AT_A_FOLD
    set_to(plane, left, share, chord)
    good, iterations, found[n], norm = arc_newton(
        system, linear, found[:n], found[n], plane, plane[n], chord, weight_u, weight_p, point, most
    )
    if good:
        good = measured_on_plane(
            system, linear, point, chord, weight_u, weight_p, sharp, norm, found, tangent, x, out
        )
    return good, iterations


@apart
def measured_on_plane(
    system: System, linear: Receptance, point: Evaluation, chord: Real, weight_u: float, weight_p: float,
    sharp: bool, norm: float, found: Real, tangent: Real, x: Real, out: Real,
) -> bool:  # fmt: skip
    """Measure the solution in `found`, which was evaluated last, with its tangent by the share of a chord.

    Parameters
    ----------
    chord : (nt + 1,), λ last, as are the weights of the scalar product; with weight_u = 0 slopes are by λ.
    sharp : with one step more, by the factors of the tangent.
    norm : the residual left.
    found, tangent, x, out : as in `between`.

    Returns
    -------
    False where the Jacobian with the chord as its border is singular, or mechanics is not obeyed.
    """
    n, p = found.size - 1, found[-1]
    if factorise(system, linear, point, chord, weight_u, weight_p) == 0.0:
        return False
    for i in range(n):
        tangent[i] = 0.0
    tangent[n] = weight_p * chord[n] * chord[n]
    for i in range(n):
        tangent[n] += weight_u * chord[i] * chord[i]
    step_back(system, point, tangent)
    if sharp and norm > _ROUNDED:
        u, step = found[:n].copy(), np.zeros(n + 1)
        copy_to(step[:n], point.residual)
        rebase(system, linear, u, point, step)
        step_back(system, point, step)
        set_to(found, found, -1.0, step)
        receptance(system, found[n], linear)
        again = evaluate(system, linear, found[:n], found[n], 0.0, point)
        if again < norm:
            norm = again
        else:
            copy_to(found[:n], u)
            found[n] = p
            receptance(system, p, linear)
            norm = evaluate(system, linear, u, p, 0.0, point)
    measure(system, linear, found[:n], point, tangent[:n], tangent[n], x, out)
    out[RESIDUAL] = norm
    return bool(out[LOST] <= ALLOWED)


@compiled
def _top_of_cubic(a: float, da: float, b: float, db: float) -> float:
    """Return where the cubic through values and slopes by the share has its maximum, −1 without one."""
    c1, c2 = 3.0 * (b - a) - 2.0 * da - db, da + db - 2.0 * (b - a)
    root = c1 * c1 - 3.0 * c2 * da
    # The form of the root that does not cancel.
    below = -c1 + math.sqrt(root) if root >= 0.0 else 0.0
    return da / below if below > 0.0 and da < below else -1.0


@apart
def refine(
    system: System, linear: Receptance, point: Evaluation, left: Real, left_slope: Real, right: Real,
    right_slope: Real, what: int, level: float, g_left: float, g_right: float, v_left: float, v_right: float,
    close: float, most: int, found: Real, tangent: Real, x: Real, out: Real,
) -> tuple[bool, int]:  # fmt: skip
    """Find a peak (slope 0) or an edge (amplitude = level) between two points of a branch.

    Parameters
    ----------
    left, left_slope, right, right_slope, most, found, tangent, x, out : as in `between`.
    what : HIGH_PEAK of max x, LOW_PEAK of −min x, or EDGE.
    g_left, g_right : the function at both ends, of opposite sign: slope by the share, or amplitude − level.
    v_left, v_right : the curve there that a peak is one of.
    close : how near to 0 it has to come, relative to the larger of them.

    Returns
    -------
    (found, Newton iterations). Every trial is a converged solution on the arc: where the cubic has its peak,
    then by secants, an edge by its slope; by bracketed secants (Illinois) where these lead out of the
    bracket. At a corner, where a contact changes its state, the tangents of both sides meet: trials go a
    little past that place, towards the side that is farther from it, and where two were in vain the next one
    halves what is left.
    """
    n = left.size
    folds = left_slope[n - 1] * right_slope[n - 1] < 0.0
    value, slope = (LOW, LOW_SLOPE) if what == LOW_PEAK else (HIGH, HIGH_SLOPE)
    ends, ways = np.empty((2, n)), np.empty((2, n))
    copy_to(ends[0], left)
    copy_to(ends[1], right)
    copy_to(ways[0], left_slope)
    copy_to(ways[1], right_slope)
    lo, hi, g_lo, g_hi, sharp = 0.0, 1.0, g_left, g_right, close < MAY_BE_LOW
    scale, low = max(abs(g_left), abs(g_right)), _TOO_LOW if sharp else MAY_BE_LOW
    total, side, corner, past, top = 0, 0, False, _PAST, math.inf
    last, g_last, share, g = 0.0, g_left, 1.0, g_right
    for trial in range(40):
        ahead, width, aim = -1.0, hi - lo, 0
        if what != EDGE and corner:
            met = (v_right - v_left - g_right * width) / (g_left - g_right)
            aim, top = 1 if met < 0.5 * width else -1, v_left + g_left * met
            ahead = lo + met + aim * past * min(met, width - met)
        elif what != EDGE and trial < _BY_CUBIC:
            place = _top_of_cubic(v_left, g_left * width, v_right, g_right * width)
            ahead = lo + place * width if place > 0.0 else -1.0
        elif what != EDGE and trial < _BY_SECANT and g != g_last:
            ahead = share - g * (share - last) / (g - g_last)
        elif what == EDGE and 0 < trial < _BY_SECANT and out[SLOPE] != 0.0:
            ahead = share - g / out[SLOPE]
        if not lo < ahead < hi:
            ahead = lo + width * g_lo / (g_lo - g_hi) if g_lo != g_hi else 0.5 * (lo + hi)
        if not lo < ahead < hi or trial % 8 == 7 or past > 1.0:
            ahead = 0.5 * (lo + hi)
        last, g_last, share = share, g, ahead
        cubic_between(ends[0], ways[0], ends[1], ways[1], width, (share - lo) / width, found)
        good, iterations = _on_plane(
            system, linear, point, left, right, folds, share, most, sharp, found, tangent, x, out
        )
        total += iterations
        if not good:
            return False, total
        g = out[MAX_ABS] - level if what == EDGE else out[slope]
        if abs(g) <= close * scale or hi - lo <= 1e-11:
            break
        left_over = (hi - share) * g if g > 0.0 else (lo - share) * g
        if what != EDGE and left_over <= low * abs(out[value]):
            break
        if aim != 0 and abs(top - out[value]) <= _MET * abs(out[value]):
            break
        now = -1 if (g > 0.0) == (g_lo > 0.0) else 1
        corner = abs(g) > _JUMPS * abs(g_left if now < 0 else g_right)
        past = _FARTHER * past if now * aim < 0 else _PAST
        if now < 0:
            lo, g_lo, g_left, v_left = share, g, g, out[value]
            g_hi = 0.5 * g_hi if side == now else g_hi
        else:
            hi, g_hi, g_right, v_right = share, g, g, out[value]
            g_lo = 0.5 * g_lo if side == now else g_lo
        copy_to(ends[0 if now < 0 else 1], found)
        copy_to(ways[0 if now < 0 else 1], tangent)
        side = now
    return math.isfinite(out[MAX_ABS]), total
