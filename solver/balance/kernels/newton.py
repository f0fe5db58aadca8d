"""Newton's method on the balance: at fixed λ, along an arc, and from nothing (stuck response, then ladder).

The balance is piecewise smooth (contacts change state), so the fixed-λ iteration is a damped semismooth
Newton method: full steps, halved while the residual does not fall, and the least bad of them where none
helps, because the way past a kink may lead uphill. Convergence is judged by the true
residual alone.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.coordinates import on_springs
from solver.balance.kernels.gauge import rebase
from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.residual import contact_values, evaluate, largest_load, least_load
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.system import SIZE, Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real, coefficient_count, cosine_position
from solver.jit.lapack import copy_to, set_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

TARGET = 1e-11  # relative residual aimed at
ACCEPTED = 1e-9  # relative residual still a solution when rounding allows no better
# Factors serve another step where they are at least this large and the last one left this share at most; the
# second share where forces cost more than factors, which is below so many unknowns.
_KEPT_FROM, _KEPT, _KEPT_BY_DEAR_FORCES = 100, 0.02, 0.005
DEAR_FORCES_BELOW = 400
# An arc is given up where from this iteration on more than this share of the first residual is left, with so
# many unknowns: where points cost little a shorter step may lose a small maximum on the way.
_HOPELESS_FROM, _HOPELESS = 2, 0.5
MANY_UNKNOWNS = 400
# Steps in a row that leave more than this share of the least residual, after which one along an arc is given
# up: between pieces that contacts change to and fro it would go round in circles.
_IN_VAIN, _NO_NEARER = 3, 0.7
_HALVINGS = 5
_UPHILL_STEPS = 8
_MOST = 25


@apart
def newton(
    system: System, linear: Receptance, u: Real, p: float, added: float, point: Evaluation
) -> tuple[bool, int, float]:
    """Solve r(u, p) = 0 for u, in place, at a fixed λ = p (the receptance is filled already).

    Returns
    -------
    (converged, Newton iterations, relative residual); `point` belongs to the final u.
    """
    n = u.size
    trial, kept, step = np.empty(n), np.empty(n), np.empty(n)
    copy_to(trial, u)
    norm, best, length, least, least_length = np.inf, np.inf, 0.0, np.inf, 1.0
    iteration, halvings, uphill, must_take = 0, 0, 0, True
    while True:
        fresh = evaluate(system, linear, trial, p, added, point)
        if not must_take and not fresh < (1.0 - 0.1 * length) * norm:
            if best <= ACCEPTED:
                break
            if fresh < least:
                least, least_length = fresh, length
            halvings += 1
            length *= 0.5
            if halvings > _HALVINGS:
                uphill += 1
                if uphill > _UPHILL_STEPS:
                    break
                length, must_take = least_length, True
            set_to(trial, u, -length, step)
            continue
        if not math.isfinite(fresh):
            break
        copy_to(u, trial)
        norm = fresh
        if norm < best:
            best = norm
            copy_to(kept, u)
        if norm <= TARGET:
            return True, iteration, norm
        if iteration >= _MOST:
            break
        if factorise(system, linear, point, step, 0.0, 0.0) == 0.0:
            break
        copy_to(step, point.residual)
        rebase(system, linear, u, point, step)
        step_back(system, point, step)
        iteration += 1
        length, halvings, must_take = 1.0, 0, False
        least, least_length = np.inf, 1.0
        set_to(trial, u, -length, step)
    if not math.isfinite(best):
        return False, iteration, best
    copy_to(u, kept)
    norm = evaluate(system, linear, u, p, added, point)
    return norm <= ACCEPTED, iteration, norm


@compiled
def _is_close(norm: float, before: float) -> bool:
    """Return whether another step with the factors of the last one will do.

    A step of Newton's method from a distance e leaves C e², one more with its factors C e times that.
    """
    return norm * norm <= 1e-3 * TARGET * before


@apart
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
    rhs, best = np.empty(n + 1), np.empty(n)
    before, norm, stalls, vain, kept = np.inf, np.inf, 0, 0, False
    best_p, best_norm, nearer = p, np.inf, np.inf
    first, iteration, dear = np.inf, 0, system.alone.sum() > 0
    for iteration in range(most + 1):
        receptance(system, p, linear)
        norm = evaluate(system, linear, u, p, 0.0, point)
        if not math.isfinite(norm):
            break
        vain, first = vain + 1, norm if iteration == 0 else first
        if norm <= _NO_NEARER * nearer:
            nearer, vain = norm, 0
        if norm < best_norm:
            copy_to(best, u)
            best_p, best_norm = p, norm
        # A first stall far above the target may be a kink on the way; a second one is rounding.
        stalls = stalls + 1 if norm > 0.5 * before else 0
        settled = norm <= 0.1 * ACCEPTED or stalls > 1
        if norm <= TARGET or (norm <= ACCEPTED and stalls > 0 and settled):
            return True, iteration, p, norm
        hopeless = n >= MANY_UNKNOWNS and iteration >= _HOPELESS_FROM and norm > _HOPELESS * first
        if iteration == most or hopeless or vain >= _IN_VAIN or norm > 1e3 * max(before, 1e-3):
            break
        size = point.counts[SIZE]
        share = _KEPT_BY_DEAR_FORCES if dear and size < DEAR_FORCES_BELOW else _KEPT
        serves = _is_close(norm, before) or (norm <= share * before and size >= _KEPT_FROM)
        if not (kept and serves):
            if factorise(system, linear, point, tangent, weight_u, weight_p) == 0.0:
                break
            kept = True
        before = norm
        plane = weight_p * tangent[n] * (p - guess_p)
        for i in range(n):
            rhs[i] = point.residual[i]
            plane += weight_u * tangent[i] * (u[i] - guess_u[i])
        rhs[n] = plane
        rebase(system, linear, u, point, rhs)
        step_back(system, point, rhs)
        set_to(u, u, -1.0, rhs)
        p -= rhs[n]
    if best_norm <= ACCEPTED:
        copy_to(u, best)
        receptance(system, best_p, linear)
        return True, iteration, best_p, evaluate(system, linear, u, best_p, 0.0, point)
    return False, iteration, p, norm


@apart
def stuck_start(system: System, linear: Receptance, p: float, u: Real) -> float:
    """Fill `u` with the response of fully stuck contacts; return the load that must be added to keep it so.

    Contacts that open and close begin closed where loads press the parts together.

    (I + A kt) u = ū harmonic by harmonic; a contact stays stuck while max|kt u| ≤ μ (min N + added).
    """
    nc, n = system.owner.size, coefficient_count(system.ks)
    table, _, _, _ = contact_values(system, p, 0.0)
    stiffness, motions = np.empty(nc), np.empty(nc, np.complex128)
    for c in range(nc):
        held = _held_stiffness(table[system.owner[c]], system.held[c], system.constant_mean)
        stiffness[c] = held - system.shift[c]
    for i in range(system.ks.size):
        good = on_springs(system, linear, i, stiffness, linear.u_linear[0, i], motions)
        here = cosine_position(system.ks, i)
        for c in range(nc):
            u[c * n + here] = motions[c].real if good else 0.0
            if system.ks[i] > 0:
                u[c * n + here + 1] = -motions[c].imag if good else 0.0
    added = 0.0
    for c in range(nc):
        e = system.owner[c]
        row, normal = table[e], system.normal_port[e]
        if row[MU] <= 0.0 or system.rubs[c] == 0:
            continue
        needed = 1.05 * row[KT] * _reach(system, u, c) / row[MU] - least_load(row)
        if normal >= 0:
            needed += 1.05 * row[system.held[normal, 0]] * _reach(system, u, normal)
        added = max(added, needed)
    return added


@compiled
def _held_stiffness(row: Real, held: Integer, pressed: int) -> float:
    """Return the stiffness [N/m] a port begins with: closed and stuck if it presses at rest, else open.

    Where loads press the parts together (`pressed`) contacts begin closed.
    """
    if pressed == 0 and held[2] != 0 and held[2] * row[held[1]] <= 0.0:
        return 0.0
    return float(row[held[0]])


@compiled
def _reach(system: System, u: Real, c: int) -> float:
    """Return a bound of the motion at port c: the sum of its amplitudes [m]."""
    n, reach = coefficient_count(system.ks), 0.0
    for i in range(system.ks.size):
        here = c * n + cosine_position(system.ks, i)
        reach += abs(u[here]) if system.ks[i] == 0 else math.hypot(u[here], u[here + 1])
    return reach


@compiled
def load_scale(system: System, p: float) -> float:
    """Return the largest normal load any contact sees at λ = p [N]."""
    table, _, _, _ = contact_values(system, p, 0.0)
    scale = 0.0
    for c in range(table.shape[0]):
        scale = max(scale, largest_load(table[c]))
    return scale


@compiled
def from_stuck(
    system: System, linear: Receptance, u: Real, p: float, point: Evaluation
) -> tuple[bool, int, float]:
    """Try Newton's method from the response of fully stuck contacts, in place in `u`; as `newton`."""
    receptance(system, p, linear)
    stuck_start(system, linear, p, u)
    return newton(system, linear, u, p, 0.0, point)


@apart
def ladder(
    system: System, linear: Receptance, u: Real, p: float, point: Evaluation
) -> tuple[bool, int, float]:
    """Find a solution at λ = p from nothing, in place in `u`, whatever it takes.

    The fully stuck response is exact under a large enough added load, which is walked down to 0, each rung
    predicted from the two before and the steps shortened where Newton fails.

    Returns
    -------
    (converged, Newton iterations in all, relative residual).
    """
    n = u.size
    stuck, last_u, trial, best = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    receptance(system, p, linear)
    here = stuck_start(system, linear, p, stuck)
    copy_to(best, stuck)
    copy_to(last_u, stuck)
    last, factor, total = here, 0.7, 0
    floor = 0.02 * load_scale(system, p)
    for _ in range(400):
        ahead = here * factor if here * factor > floor else 0.0
        copy_to(trial, best)
        if last != here:
            step = (ahead - here) / (here - last)
            for i in range(n):
                trial[i] += step * (best[i] - last_u[i])
        good, iterations, norm = newton(system, linear, trial, p, ahead, point)
        total += iterations
        if good:
            copy_to(last_u, best)
            copy_to(best, trial)
            last, here = here, ahead
            if here == 0.0:
                copy_to(u, best)
                return True, total, norm
            factor = max(0.1, factor * factor) if iterations <= 6 else factor
        else:
            factor = math.sqrt(factor)
            if factor > 0.9999:
                break
            if here <= floor or ahead == 0.0:
                floor *= 0.1
    copy_to(u, best)
    norm = evaluate(system, linear, u, p, 0.0, point)
    return False, total, norm
