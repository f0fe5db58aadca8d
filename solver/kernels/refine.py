"""Polish a place on a branch between two of its points: a peak, or the edge of a resonance band."""

from __future__ import annotations

import math

import numpy as np

from solver.fourier import Real
from solver.kernels.compiled import compiled, out_of_line
from solver.kernels.linear import copy_block, copy_to, largest_entry, set_to, solve
from solver.kernels.newton import arc_newton, border
from solver.kernels.observe import MAX_ABS, RESIDUAL, SLOPE, measure
from solver.kernels.system import Evaluation, Receptance, System

PEAK, EDGE = 0, 1


@compiled
def slope_by_parameter(
    system: System, linear: Receptance, u: Real, point: Evaluation, x: Real, out: Real
) -> bool:
    """Measure a solution with its slopes by λ, du/dλ = −(dr/du)⁻¹ dr/dλ; False where dr/du is singular."""
    out_of_line()
    n = u.size
    matrix, rhs = np.empty((n, n)), np.empty((1, n))
    copy_block(matrix, point.jacobian)
    for i in range(n):
        rhs[0, i] = -point.dr_dp[i]
    if n > 0 and solve(matrix, rhs) == 0.0:
        return False
    measure(system, linear, u, point, rhs[0], 1.0, x, out)
    return True


@compiled
def _correct(
    system: System, linear: Receptance, point: Evaluation, left: Real, chord: Real, share: float,
    guess: Real, most: int, out_u: Real, x: Real, out: Real,
) -> tuple[bool, float, int]:  # fmt: skip
    """Solve on the plane across the chord at `share` of it, and measure there; slope along the chord."""
    out_of_line()
    n = out_u.size
    size, span = largest_entry(left[:n]), abs(chord[n])
    weight_u = 1.0 / (size * size) if size > 0.0 else 1.0
    weight_p = 1.0 / (span * span) if span > 0.0 else 1.0
    plane_u, plane_p = np.empty(n), left[n] + share * chord[n]
    set_to(plane_u, left, share, chord)
    copy_to(out_u, guess)
    good, iterations, p, norm = arc_newton(
        system, linear, out_u, guess[n], plane_u, plane_p, chord, weight_u, weight_p, point, most
    )
    if not good:
        return False, p, iterations
    matrix, rhs = np.empty((n + 1, n + 1)), np.zeros((1, n + 1))
    border(point, chord, weight_u, weight_p, matrix)
    total = weight_p * chord[n] * chord[n]
    for i in range(n):
        total += weight_u * chord[i] * chord[i]
    rhs[0, n] = total
    if solve(matrix, rhs) == 0.0:
        return False, p, iterations
    measure(system, linear, out_u, point, rhs[0, :n], rhs[0, n], x, out)
    out[RESIDUAL] = norm
    return True, p, iterations


@compiled
def refine(
    system: System, linear: Receptance, point: Evaluation, left: Real, left_slope: Real, right: Real,
    right_slope: Real, what: int, level: float, g_left: float, g_right: float, most: int, x: Real, out: Real,
) -> tuple[bool, Real, int]:  # fmt: skip
    """Find the peak (slope 0) or the edge (amplitude = level) between two points of a branch.

    Parameters
    ----------
    left, right : (nt + 1,) points, λ last; left_slope, right_slope : their tangents times the chord length.
    g_left, g_right : the function at both ends, of opposite sign: slope along the chord, amplitude − level.
    most : Newton iterations of a trial.
    x (n,), out (MEASURES,) : filled at the place found.

    Returns
    -------
    (found, point (nt + 1,), Newton iterations). A bracketed secant (Illinois) on the arc, every trial a
    converged solution.
    """
    out_of_line()
    n = left.size - 1
    u, guess, found, chord = np.empty(n), np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    copy_to(found, left)
    set_to(chord, right, -1.0, left)
    lo, hi, g_lo, g_hi = 0.0, 1.0, g_left, g_right
    total, side, share, good = 0, 0, 0.5, False
    for iteration in range(40):
        share = lo + (hi - lo) * g_lo / (g_lo - g_hi) if g_lo != g_hi else 0.5 * (lo + hi)
        if not (lo < share < hi) or iteration % 8 == 7:
            share = 0.5 * (lo + hi)
        t, r = share, 1.0 - share
        for i in range(n + 1):
            guess[i] = (
                (1.0 + 2.0 * t) * r * r * left[i] + t * r * r * left_slope[i]
                + t * t * (3.0 - 2.0 * t) * right[i] - t * t * r * right_slope[i]
            )  # fmt: skip
        good, p, iterations = _correct(system, linear, point, left, chord, share, guess, most, u, x, out)
        total += iterations
        if not good:
            return False, found, total
        copy_to(found[:n], u)
        found[n] = p
        g = out[SLOPE] if what == PEAK else out[MAX_ABS] - level
        scale = max(abs(g_left), abs(g_right))
        if abs(g) <= 1e-10 * scale or hi - lo <= 1e-11:
            break
        now = -1 if (g > 0.0) == (g_lo > 0.0) else 1
        if now < 0:
            lo, g_lo = share, g
            g_hi = 0.5 * g_hi if side == now else g_hi
        else:
            hi, g_hi = share, g
            g_lo = 0.5 * g_lo if side == now else g_lo
        side = now
    good = math.isfinite(out[MAX_ABS]) and slope_by_parameter(system, linear, u, point, x, out)
    return good, found, total
