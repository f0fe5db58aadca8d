"""From a solution to what a user looks at: the motion of the observed DOF, its amplitude and its slopes."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.haigh import utilisation
from solver.balance.kernels.mechanics import unaccounted
from solver.balance.kernels.residual import evaluate_contacts
from solver.contacts.kernels.stick_slip_events import largest
from solver.contacts.kernels.system import FREQUENCY, FROM_REST, UTILISED, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Real, coefficient_count, cosine_position
from solver.jit.separate import apart
from solver.jit.trig_polynomial import on_grid, unpack
from solver.linear.kernels.dynamic_stiffness import fill_terms
from solver.linear.kernels.receptance import excitation

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


@apart
def modal_motion(
    system: System, u: Real, p: float, point: Evaluation, du: Real, dp: float, amplitudes: Complex
) -> None:
    """Fill in the modal coordinates q̂ = (f̂ − Yᴴ (F̂ − shift û)) / d and their change for (du, dλ).

    Parameters
    ----------
    point : the balance evaluated at (u, λ = p), with derivatives.
    amplitudes : (2, nk, nm) value and change.
    """
    omega = p if system.kind == FREQUENCY else system.omega
    by_omega = 1.0 if system.kind == FREQUENCY else 0.0
    nc, n, nm = system.owner.size, coefficient_count(system.ks), system.eigenvalues.shape[1]
    dF, terms, force = np.empty((nc, n)), np.empty((4, nm)), np.empty((2, nm), np.complex128)
    force_slope(system, point, du, dp, dF)
    for i in range(system.ks.size):
        s, here, has_sine = system.which[i], cosine_position(system.ks, i), system.ks[i] > 0
        fill_terms(system, s, 0, nm, float(system.ks[i]), omega, by_omega, terms)
        f, df = excitation(system, p, system.ks[i])
        for m in range(nm):
            force[0, m], force[1, m] = f * system.modal_forces[i, m], dp * df * system.modal_forces[i, m]
        for c in range(nc):
            at = c * n + here
            fc, dfc = point.F[c, here] - system.shift[c] * u[at], dF[c, here]
            fs, dfs = 0.0, 0.0
            if has_sine:
                fs, dfs = point.F[c, here + 1] - system.shift[c] * u[at + 1], dF[c, here + 1]
            here_force, change = complex(fc, -fs), complex(dfc, -dfs)
            row = system.contact_duals[s, c]
            for m in range(nm):
                force[0, m] -= row[m] * here_force
                force[1, m] -= row[m] * change
        for m in range(nm):
            term, slope = complex(terms[0, m], terms[1, m]), complex(terms[2, m], terms[3, m])
            amplitudes[0, i, m] = term * force[0, m]
            amplitudes[1, i, m] = term * force[1, m] + dp * slope * force[0, m]


@apart
def measure_through_modes(
    system: System, point: Evaluation, seen: Complex, solutions: Real, tangents: Real, x: Real, out: Real
) -> None:
    """Fill what `solver.balance.kernels.output.measure` does of several DOFs at points of a branch.

    Parameters
    ----------
    seen : (d, ns, nm) of each DOF, as `System.observe_modes`.
    solutions, tangents : (P, nt + 1) the points, λ last.
    x, out : (d, P, n) and (d, P, MEASURES), of which residual and what is lost are left as they are.
    """
    last, amplitudes = solutions.shape[1] - 1, np.empty((2, *system.modal_forces.shape), np.complex128)
    dx = np.empty(x.shape[2])
    for row in range(solutions.shape[0]):
        u, p = solutions[row, :last], solutions[row, last]
        evaluate_contacts(system, u, p, 0.0, False, point)  # at a solution no contact fails
        modal_motion(system, u, p, point, tangents[row, :last], tangents[row, last], amplitudes)
        for j in range(seen.shape[0]):
            for i in range(system.ks.size):
                here, s = cosine_position(system.ks, i), system.which[i]
                value, change = complex(0.0), complex(0.0)
                for m in range(seen.shape[2] if system.only in (-1, system.ks[i]) else 0):
                    value += seen[j, s, m] * amplitudes[0, i, m]
                    change += seen[j, s, m] * amplitudes[1, i, m]
                x[j, row, here], dx[here] = value.real, change.real
                if system.ks[i] > 0:
                    x[j, row, here + 1], dx[here + 1] = -value.imag, -change.imag
            measure_motion(system, point, x[j, row], dx, out[j, row])
