"""Places on a branch between two of its points: a peak, the edge of a band, any share of the way."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.newton import arc_newton
from solver.balance.kernels.output import HIGH_SLOPE, LOW_SLOPE, MAX_ABS, RESIDUAL, measure
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.fourier import Real
from solver.jit.lapack import copy_to, largest_entry, set_to
from solver.jit.separate import apart

_AT_A_FOLD = 1e-9  # weight of λ there
HIGH_PEAK, LOW_PEAK, EDGE = 0, 1, 2


@apart
def slope_by_parameter(
    system: System, linear: Receptance, u: Real, point: Evaluation, x: Real, out: Real
) -> bool:
    """Measure a solution with its slopes by λ, du/dλ = −(dr/du)⁻¹ dr/dλ; False where dr/du is singular."""
    n = u.size
    slope = np.empty(n)
    if factorise(system, linear, point, slope, 0.0, 0.0) == 0.0:
        return False
    for i in range(n):
        slope[i] = -point.dr_dp[i]
    step_back(system, point, slope)
    measure(system, linear, u, point, slope, 1.0, x, out)
    return True


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
    (converged, Newton iterations). The guess is the cubic through both points and tangents.
    """
    n = left.size - 1
    chord, plane, guess, u = np.empty(n + 1), np.empty(n), np.empty(n), np.empty(n)
    set_to(chord, right, -1.0, left)
    size, span = max(largest_entry(left[:n]), system.least_size), abs(chord[n])
    weight_u = 1.0 / (size * size) if size > 0.0 else 1.0
    weight_p = 1.0 / (span * span) if span > 0.0 else 1.0
    if left_slope[n] * right_slope[n] < 0.0:
        # A fold between the points: λ goes there and back, and only u tells the places on the arc apart.
        weight_p *= _AT_A_FOLD
    set_to(plane, left, share, chord)
    t, r = share, 1.0 - share
    for i in range(n + 1):
        tangent[i] = (
            (1.0 + 2.0 * t) * r * r * left[i] + t * r * r * left_slope[i]
            + t * t * (3.0 - 2.0 * t) * right[i] - t * t * r * right_slope[i]
        )  # fmt: skip
    copy_to(guess, tangent)
    copy_to(u, guess)
    good, iterations, p, norm = arc_newton(
        system, linear, u, tangent[n], plane, left[n] + share * chord[n], chord, weight_u, weight_p, point,
        most,
    )  # fmt: skip
    if not good:
        return False, iterations
    if factorise(system, linear, point, chord, weight_u, weight_p) == 0.0:
        return False, iterations
    for i in range(n):
        tangent[i] = 0.0
    tangent[n] = weight_p * chord[n] * chord[n]
    for i in range(n):
        tangent[n] += weight_u * chord[i] * chord[i]
    step_back(system, point, tangent)
    copy_to(found[:n], u)
    found[n] = p
    measure(system, linear, u, point, tangent[:n], tangent[n], x, out)
    out[RESIDUAL] = norm
    return True, iterations


@apart
def refine(
    system: System, linear: Receptance, point: Evaluation, left: Real, left_slope: Real, right: Real,
    right_slope: Real, what: int, level: float, g_left: float, g_right: float, close: float, most: int,
    found: Real, tangent: Real, x: Real, out: Real,
) -> tuple[bool, int]:  # fmt: skip
    """Find a peak (slope 0) or an edge (amplitude = level) between two points of a branch.

    Parameters
    ----------
    left, left_slope, right, right_slope, most, found, tangent, x, out : as in `between`.
    what : HIGH_PEAK of max x, LOW_PEAK of −min x, or EDGE.
    g_left, g_right : the function at both ends, of opposite sign: slope by the share, or amplitude − level.
    close : how near to 0 it has to come, relative to the larger of them.

    Returns
    -------
    (found, Newton iterations). A bracketed secant (Illinois) on the arc, every trial a converged solution.
    """
    lo, hi, g_lo, g_hi = 0.0, 1.0, g_left, g_right
    scale = max(abs(g_left), abs(g_right))
    total, side = 0, 0
    for iteration in range(40):
        share = lo + (hi - lo) * g_lo / (g_lo - g_hi) if g_lo != g_hi else 0.5 * (lo + hi)
        if not (lo < share < hi) or iteration % 8 == 7:
            share = 0.5 * (lo + hi)
        good, iterations = between(
            system, linear, point, left, left_slope, right, right_slope, share, most, found, tangent, x, out
        )
        total += iterations
        if not good:
            return False, total
        g = out[MAX_ABS] - level
        if what != EDGE:
            g = out[HIGH_SLOPE] if what == HIGH_PEAK else out[LOW_SLOPE]
        if abs(g) <= close * scale or hi - lo <= 1e-11:
            break
        now = -1 if (g > 0.0) == (g_lo > 0.0) else 1
        if now < 0:
            lo, g_lo = share, g
            g_hi = 0.5 * g_hi if side == now else g_hi
        else:
            hi, g_hi = share, g
            g_lo = 0.5 * g_lo if side == now else g_lo
        side = now
    return math.isfinite(out[MAX_ABS]), total
