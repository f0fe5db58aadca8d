"""From a solution to what a user looks at: the motion of the observed DOF, its amplitude and its slopes."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.mechanics import unaccounted
from solver.contacts.kernels.stick_slip_events import largest
from solver.contacts.kernels.system import FROM_REST, UTILISED, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.jit.trig_polynomial import on_grid, unpack

# Columns of the measures of a point. HIGH is max x and LOW is −min x: each is smooth along a branch, while
# max|x|, the larger of the two, has a kink where they cross.
MAX_ABS, HALF_RANGE, MEAN, SLOPE, RANGE_SLOPE, RESIDUAL, HIGH, LOW, HIGH_SLOPE, LOW_SLOPE = range(10)
PIECE = 10  # a number for the smooth pieces of their laws that all contacts are on, see `piece`
LOST = 11  # share of powers and mean forces that the point loses, see `solver.balance.kernels.mechanics`
MEASURES = 12
SAME_HEIGHT = 1e-12  # relative distance within which max x and −min x are the same but for rounding


@compiled
def piece(point: Evaluation) -> float:
    """Return one number for the smooth pieces all contacts are on."""
    mixed = 0
    for c in range(point.pieces.size):
        mixed = (31 * mixed + point.pieces[c]) & 0xFFFFFFFFFFFF
    return float(mixed)


@apart
def observed_motion(system: System, linear: Receptance, u: Real, point: Evaluation, x: Real) -> None:
    """Fill `x` (n,) with the coefficients of the observed DOF [m]: x̂ = x̂_linear − B (F̂ − shift û)."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        value = linear.x_linear[0, i]
        for c in range(nc):
            at = c * n + here
            fc = point.F[c, here] - system.shift[c] * u[at]
            fs = point.F[c, here + 1] - system.shift[c] * u[at + 1] if system.ks[i] > 0 else 0.0
            value -= linear.B[0, i, c] * complex(fc, -fs)
        x[here] = value.real
        if system.ks[i] > 0:
            x[here + 1] = -value.imag


@apart
def force_slope(system: System, point: Evaluation, du: Real, dp: float, dF: Real) -> None:
    """Fill `dF` (nc, n) with the change of the contact forces, less that of the shift, for (du, dλ)."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    for c in range(nc):
        e = system.owner[c]
        first, m = system.first_port[e], system.first_port[e + 1] - system.first_port[e]
        for i in range(n):
            total = dp * point.dF_dp[c, i] - system.shift[c] * du[c * n + i]
            for q in range(m):
                block = system.first_block[e] + (c - first) * m + q
                for j in range(n):
                    total += point.dF_dU[block, i, j] * du[(first + q) * n + j]
            dF[c, i] = total


@apart
def observed_slope(
    system: System, linear: Receptance, u: Real, point: Evaluation, du: Real, dp: float, dx: Real
) -> None:
    """Fill `dx` with the change of the observed coefficients for a change (du, dλ) of the solution."""
    nc, n = system.owner.size, coefficient_count(system.ks)
    dF = np.empty((nc, n))
    force_slope(system, point, du, dp, dF)
    for i in range(system.ks.size):
        here = cosine_position(system.ks, i)
        has_sine = system.ks[i] > 0
        value = dp * linear.x_linear[1, i]
        for c in range(nc):
            at = c * n + here
            fc, dfc = point.F[c, here] - system.shift[c] * u[at], dF[c, here]
            fs, dfs = 0.0, 0.0
            if has_sine:
                fs, dfs = point.F[c, here + 1] - system.shift[c] * u[at + 1], dF[c, here + 1]
            value -= linear.B[0, i, c] * complex(dfc, -dfs) + dp * linear.B[1, i, c] * complex(fc, -fs)
        dx[here] = value.real
        if has_sine:
            dx[here + 1] = -value.imag


@apart
def extremes(system: System, x: Real) -> tuple[float, float, float, float]:
    """Return max x and its place, min x and its place, over the period."""
    degree = system.ks[-1]
    n_grid = 2 * (system.cos_table.shape[1] - 1)
    c, s = np.empty(degree + 1), np.empty(degree + 1)
    value, slope = np.empty(n_grid), np.empty(n_grid)
    unpack(x, system.ks, c, s)
    on_grid(c, s, degree, system.cos_table, system.sin_table, value, slope)
    high, at_high = largest(c, s, degree, value, slope)
    for k in range(degree + 1):
        c[k], s[k] = -c[k], -s[k]
    for j in range(n_grid):
        value[j], slope[j] = -value[j], -slope[j]
    low, at_low = largest(c, s, degree, value, slope)
    return high, at_high, -low, at_low


@compiled
def _along(system: System, x: Real, tau: float) -> float:
    """Return the value at `tau` of the motion with coefficients `x`."""
    total = 0.0
    for i in range(system.ks.size):
        k, here = system.ks[i], cosine_position(system.ks, i)
        if k == 0:
            total += x[here]
        else:
            total += x[here] * math.cos(k * tau) + x[here + 1] * math.sin(k * tau)
    return total


@apart
def measure(
    system: System, linear: Receptance, u: Real, point: Evaluation, du: Real, dp: float, x: Real, out: Real
) -> None:
    """Fill `x` with the observed coefficients and `out` with the measures and their slopes along (du, dλ)."""
    observed_motion(system, linear, u, point, x)
    dx = np.empty(x.size)
    observed_slope(system, linear, u, point, du, dp, dx)
    measure_motion(system, point, x, dx, out)
    out[LOST] = unaccounted(system, linear, u, point)


@apart
def measure_motion(system: System, point: Evaluation, x: Real, dx: Real, out: Real) -> None:
    """Fill `out` with the measures of the observed coefficients `x` and their slopes where x changes by dx.

    The place of an extremum is stationary, so a slope is the change of the motion at that place. Counted from
    the middle of its range the motion is as far up as down; so is a utilisation.
    """
    high, at_high, low, at_low = extremes(system, x)
    rise, sink = _along(system, dx, at_high), _along(system, dx, at_low)
    out[HALF_RANGE], out[RANGE_SLOPE] = 0.5 * (high - low), 0.5 * (rise - sink)
    if system.centred != FROM_REST:
        value, by_half, by_mean = out[HALF_RANGE], 1.0, 0.0
        if system.centred == UTILISED:
            value, by_half, by_mean, _, _, _ = utilisation(system.haigh, high, low)
        rise = by_half * out[RANGE_SLOPE] + by_mean * 0.5 * (rise + sink)
        high, low, sink = value, -value, -rise
    out[HIGH], out[LOW], out[HIGH_SLOPE], out[LOW_SLOPE] = high, -low, rise, -sink
    out[MEAN] = x[0] if system.ks[0] == 0 else 0.0
    out[MAX_ABS] = max(high, -low)
    out[PIECE] = piece(point)
    if abs(high + low) <= SAME_HEIGHT * out[MAX_ABS]:
        # A symmetric motion: onward along (du, dλ) the larger slope leads.
        out[SLOPE] = max(rise, -sink)
    else:
        out[SLOPE] = rise if high > -low else -sink
