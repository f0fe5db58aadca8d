"""Newton's method on the balance: at fixed λ, along an arc, and from nothing (the start-up ladder).

The balance is piecewise smooth (contacts change state), so the fixed-λ iteration is a damped semismooth
Newton method: full steps, halved while the residual does not fall, and a full step after all where even a
short one does not help, because the way past a kink may lead uphill. Convergence is judged by the true
residual alone.
"""

from __future__ import annotations

import math

import numpy as np

from solver.fourier import Real, coefficient_count, cosine_position
from solver.kernels.compiled import compiled
from solver.kernels.linear import solve
from solver.kernels.system import (
    FREQUENCY,
    KT,
    MU,
    N0,
    N1,
    STRUCTURE,
    Evaluation,
    Receptance,
    System,
    contact_values,
    evaluate,
    receptance,
)

TARGET = 1e-11  # relative residual aimed at
ACCEPTED = 1e-9  # relative residual still a solution when rounding allows no better
_HALVINGS = 5
_UPHILL_STEPS = 4


@compiled
def newton(
    system: System, linear: Receptance, u: Real, p: float, added: float, point: Evaluation, most: int
) -> tuple[bool, int, float]:
    """Solve r(u, p) = 0 for u, in place, at a fixed λ = p (the receptance is filled already).

    Returns
    -------
    (converged, Newton iterations, relative residual); `point` belongs to the final u.
    """
    norm = evaluate(system, linear, u, p, added, point)
    best, kept = norm, u.copy()
    uphill = 0
    trial, matrix = np.empty_like(u), np.empty_like(point.jacobian)
    step = np.empty((1, u.size))
    for iteration in range(most):
        if not math.isfinite(norm):
            return False, iteration, norm
        if norm <= TARGET:
            return True, iteration, norm
        matrix[:, :] = point.jacobian
        step[0] = point.residual
        if solve(matrix, step) == 0.0:
            break
        length, fallen = 1.0, False
        for _ in range(_HALVINGS):
            trial[:] = u - length * step[0]
            fresh = evaluate(system, linear, trial, p, added, point)
            if fresh < (1.0 - 0.1 * length) * norm:
                fallen = True
                break
            if norm <= ACCEPTED:
                break
            length *= 0.5
        if not fallen:
            if best <= ACCEPTED:
                break
            uphill += 1
            if uphill > _UPHILL_STEPS:
                break
            trial[:] = u - step[0]
            fresh = evaluate(system, linear, trial, p, added, point)
        u[:] = trial
        norm = fresh
        if norm < best:
            best = norm
            kept[:] = u
    u[:] = kept
    norm = evaluate(system, linear, u, p, added, point)
    return norm <= ACCEPTED, most, norm


@compiled
def arc_newton(
    system: System, linear: Receptance, u: Real, p: float, guess_u: Real, guess_p: float, tangent: Real,
    weight_u: float, weight_p: float, point: Evaluation, most: int,
) -> tuple[bool, int, float, float]:  # fmt: skip
    """Solve r(u, p) = 0 on the plane through the guess that is orthogonal to the tangent; u in place.

    Parameters
    ----------
    tangent : (nt + 1,) last entry the λ part; the scalar product is weight_u Σ u·u + weight_p p·p.

    Returns
    -------
    (converged, iterations, p, relative residual).
    """
    n = u.size
    matrix, rhs = np.empty((n + 1, n + 1)), np.empty((1, n + 1))
    before = np.inf
    for iteration in range(most + 1):
        receptance(system, p, linear)
        norm = evaluate(system, linear, u, p, 0.0, point)
        if not math.isfinite(norm):
            return False, iteration, p, norm
        if norm <= TARGET or (norm <= ACCEPTED and norm > 0.5 * before):
            return True, iteration, p, norm
        if iteration == most or norm > 1e3 * max(before, 1e-3):
            return False, iteration, p, norm
        before = norm
        border(point, tangent, weight_u, weight_p, matrix)
        rhs[0, :n] = point.residual
        plane = weight_p * tangent[n] * (p - guess_p)
        for i in range(n):
            plane += weight_u * tangent[i] * (u[i] - guess_u[i])
        rhs[0, n] = plane
        if solve(matrix, rhs) == 0.0:
            return False, iteration, p, norm
        u -= rhs[0, :n]
        p -= rhs[0, n]
    return False, most, p, np.nan


@compiled
def border(point: Evaluation, tangent: Real, weight_u: float, weight_p: float, matrix: Real) -> None:
    """Fill `matrix` with [dr/du, dr/dλ; weighted tangentᵀ]."""
    n = point.residual.size
    matrix[:n, :n] = point.jacobian
    matrix[:n, n] = point.dr_dp
    for i in range(n):
        matrix[n, i] = weight_u * tangent[i]
    matrix[n, n] = weight_p * tangent[n]


@compiled
def stuck_start(system: System, linear: Receptance, p: float) -> tuple[Real, float]:
    """Return the response with every contact fully stuck, and the load that has to be added to keep it so.

    (I + A kt) u = ū harmonic by harmonic; a contact stays stuck while max|kt u| ≤ μ (N0 − |N1| + added).
    """
    nc, n = system.contacts.shape[0], coefficient_count(system.ks)
    table, load, _, _ = contact_values(system, p, 0.0)
    u = np.zeros(nc * n)
    for i in range(system.ks.size):
        matrix = np.zeros((nc, nc), np.complex128)
        rhs = np.empty(nc, np.complex128)
        for c in range(nc):
            rhs[c] = linear.u_linear[0, i, c]
            for d in range(nc):
                matrix[c, d] = linear.A[0, i, c, d] * (table[d, KT] - system.shift[d])
            matrix[c, c] += 1.0
        motion = np.linalg.solve(matrix, rhs)
        here = cosine_position(system.ks, i)
        for c in range(nc):
            u[c * n + here] = motion[c].real
            if system.ks[i] > 0:
                u[c * n + here + 1] = -motion[c].imag
    added = 0.0
    for c in range(nc):
        if table[c, MU] <= 0.0:
            continue
        reach = 0.0
        for i in range(system.ks.size):
            here = c * n + cosine_position(system.ks, i)
            size = abs(u[here]) if system.ks[i] == 0 else math.hypot(u[here], u[here + 1])
            reach += size
        needed = 1.05 * table[c, KT] * reach / table[c, MU] - (table[c, N0] - abs(table[c, N1]))
        added = max(added, needed)
    return u, added


@compiled
def start(system: System, linear: Receptance, u: Real, p: float, point: Evaluation) -> tuple[bool, int, float]:
    """Find a first solution at λ = p from nothing, in place in `u`.

    The fully stuck response is exact under a large enough added load; that load is then walked down to 0,
    each rung predicted from the two before, the steps shortened where Newton fails.

    Returns
    -------
    (converged, Newton iterations in all, relative residual).
    """
    receptance(system, p, linear)
    stuck, added = stuck_start(system, linear, p)
    u[:] = stuck
    good, total, norm = newton(system, linear, u, p, 0.0, point, 25)
    if good:
        return True, total, norm
    u[:] = stuck
    here, factor = added, 0.5
    last_u, last = stuck.copy(), added
    floor = 1e-6 * added
    for _ in range(400):
        ahead = here * factor if here * factor > floor else 0.0
        trial = u.copy()
        if last != here:
            trial += (u - last_u) * ((ahead - here) / (here - last))
        good, iterations, norm = newton(system, linear, trial, p, ahead, point, 15)
        total += iterations
        if not good:
            trial[:] = u
            good, iterations, norm = newton(system, linear, trial, p, ahead, point, 30)
            total += iterations
        if good:
            last_u[:], last = u, here
            u[:], here = trial, ahead
            if here == 0.0:
                return True, total, norm
            factor = max(0.1, factor * factor) if iterations <= 6 else factor
        else:
            factor = math.sqrt(factor)
            if factor > 0.9999:
                break
            if here <= floor:
                floor *= 0.1
    norm = evaluate(system, linear, u, p, 0.0, point)
    return False, total, norm


@compiled
def moves_receptance(kind: int) -> bool:
    """Return whether λ of this kind changes the linear part (otherwise it can be computed once)."""
    return kind == FREQUENCY or kind == STRUCTURE
