"""A law over one period, from node to node: its state, and the derivatives of its state carried along.

A law in rate form goes from node to node by the classical Runge–Kutta method of fourth order, with the motion
midway; one in samples by its own step. The derivative D (states, columns) of the state is that of exactly
this map: its columns are the motion's coefficients, λ, and where they are asked for the states the turn began
with.

Nodes are even, with equal weights, which is exact to all orders for a smooth force; or they begin anew at
every reversal of the motion, where the force of friction has its corners: even ones between two reversals
with the weights of Simpson's rule, of fourth order.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from solver.contacts.kernels.history.partials import BY_DIFFERENCES, inputs_of, partials
from solver.contacts.kernels.springs import positive_intervals
from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Integer, Real, cosine_position
from solver.jit.law_functions import call_force, call_rate, call_step
from solver.jit.separate import apart
from solver.jit.trig_polynomial import unpack

_TURN = 2.0 * math.pi
_LONGEST = 1.4  # half periods that have the steps of one
_SHORTEST = 1e-9  # rad; two reversals closer than that are none


@compiled
def most_nodes(count: int, top: int) -> int:
    """Return how many nodes there may be, with the one that ends the period."""
    return 2 * count + 16 * (2 * top + 4) + 1


@compiled
def even_nodes(count: int, tau: Real, weight: Real) -> int:
    """Fill `tau` and `weight` of `count` even nodes and of the end of the period; return `count`."""
    for j in range(count + 1):
        tau[j] = _TURN * j / count
        weight[j] = _TURN / count
    weight[0] = 0.0
    return count


@apart
def reversals(U: Real, ks: Integer, cos_table: Real, sin_table: Real, out: Real) -> int:
    """Fill `out` with the angles at which a motion reverses, ascending; return their number."""
    top = max(ks[-1], 1)
    c, s = np.empty(top + 1), np.empty(top + 1)
    unpack(U, ks, c, s)
    for k in range(top + 1):
        c[k], s[k] = k * s[k], -k * c[k]
    intervals = np.empty((top + 1, 2))
    count = positive_intervals(c, s, top, cos_table, sin_table, intervals)
    if count <= 0:
        return 0
    ends = np.sort(intervals[:count].copy().reshape(2 * count) % _TURN)
    kept = 0
    for end in ends:
        if kept == 0 or end - out[kept - 1] > _SHORTEST:
            out[kept] = end
            kept += 1
    return kept


@compiled
def _steps_between(halves: float, count: int) -> int:
    """Return the steps between two reversals, `halves` half periods apart: about count/2 for each of these.

    They change by factors of two, at lengths of 0.7 half periods times such factors: if they followed every
    length, an answer would jump wherever they change, and Newton's method never end on it.
    """
    steps = 16 * max(math.ceil(count / 32), 1)
    while halves > _LONGEST:
        halves *= 0.5
        steps *= 2
    while halves <= 0.5 * _LONGEST and steps % 4 == 0:
        halves *= 2.0
        steps //= 2
    return steps


@apart
def nodes_between(turns: Real, found: int, count: int, tau: Real, weight: Real) -> int:
    """Fill nodes between reversals, about `count` in a period; return their number.

    The first is the first reversal, the last the same a period later; its weight is that of both.
    """
    at = 0
    tau[0], weight[0] = turns[0], 0.0
    for i in range(found):
        begin = turns[i]
        end = turns[i + 1] if i + 1 < found else turns[0] + _TURN
        steps = _steps_between((end - begin) / math.pi, count)
        h = (end - begin) / steps
        weight[at] += h / 3.0
        for j in range(1, steps + 1):
            tau[at + j] = begin + j * h
            weight[at + j] = h / 3.0 * (1.0 if j == steps else 4.0 if j % 2 == 1 else 2.0)
        at += steps
    weight[at] += weight[0]
    weight[0] = 0.0
    return at


@apart
def fill_basis(ks: Integer, tau: Real, count: int, halves: int, basis: Real) -> None:
    """Fill `basis` (halves·count + 1, n) with the Fourier basis at the nodes and, with 2, midway too."""
    for j in range(halves * count + 1):
        i = j // halves
        angle = tau[i] if j % halves == 0 else 0.5 * (tau[i] + tau[i + 1])
        cosine, sine = math.cos(angle), math.sin(angle)
        x, y, k = 1.0, 0.0, 0
        for h in range(ks.size):
            while k < ks[h]:
                x, y = x * cosine - y * sine, x * sine + y * cosine
                k += 1
            here = cosine_position(ks, h)
            basis[j, here] = x
            if ks[h] > 0:
                basis[j, here + 1] = y


@compiled
def fill_velocity(ks: Integer, omega: float, basis: Real, out: Real) -> None:
    """Fill `out` (n + more,) with the derivative by time [1/s] of the basis at one node."""
    for h in range(ks.size):
        here = cosine_position(ks, h)
        if ks[h] == 0:
            out[here] = 0.0
        else:
            out[here], out[here + 1] = -ks[h] * omega * basis[here + 1], ks[h] * omega * basis[here]


@compiled
def motion_at(U: Real, ks: Integer, omega: float, basis: Real) -> tuple[float, float]:
    """Return the motion [m] and its velocity [m/s] at one node."""
    u, v = 0.0, 0.0
    for h in range(ks.size):
        here = cosine_position(ks, h)
        u += U[here] * basis[here]
        if ks[h] > 0:
            u += U[here + 1] * basis[here + 1]
            v += ks[h] * (U[here + 1] * basis[here] - U[here] * basis[here + 1])
    return u, omega * v


_RAMP = 48  # steps at least from no motion to that of the first node, in an eighth of a period
_AT_REST, _NEAR_REST = 1e-9, 2e-5  # of the largest velocity: what is a reversal, and the same for differences
_RAMP_SHARE = 0.125


class Course(NamedTuple):
    """What a law follows: its numbers, and the motion at the nodes of a period."""

    number: int
    way: int  # of its derivatives, see `partials`
    steps: bool  # in samples, not in rate form
    alone: bool  # each state follows by itself
    p: Real  # (parameters,)
    slope: Real  # derivatives of the parameters by λ
    omega: float  # rad/s
    domega: float  # its derivative by λ
    ks: Integer
    tau: Real  # (count + 1,)
    weight: Real  # (count + 1,) of the integrals over a period
    nodes: int
    basis: Real  # (halves·count + 1, n)
    u: Real  # (halves·count + 1,) m
    v: Real  # m/s
    sizes: Real  # of inputs and states, for differences


@compiled
def halves_of(steps: bool) -> int:
    """Return how many points there are a node: a law in rate form asks for the motion midway too."""
    return 1 if steps else 2


@compiled
def fill_motion(U: Real, ks: Integer, omega: float, basis: Real, u: Real, v: Real) -> None:
    """Fill motion and velocity at all points."""
    for j in range(u.size):
        u[j], v[j] = motion_at(U, ks, omega, basis[j])


@compiled
def _rate_step(course: Course, a: int, dt: float, k: Real, trial: Real, state: Real) -> None:
    """Move the state over the points a, a + 1, a + 2; k (4, states) and trial are scratch."""
    number, p, ns = course.number, course.p, state.size
    call_rate(number, course.u[a], course.v[a], state, p, k[0])
    for stage in range(1, 4):
        share = dt if stage == 3 else 0.5 * dt
        for i in range(ns):
            trial[i] = state[i] + share * k[stage - 1, i]
        at = a + 2 if stage == 3 else a + 1
        call_rate(number, course.u[at], course.v[at], trial, p, k[stage])
    for i in range(ns):
        state[i] += dt / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])


@apart
def go_round(course: Course, state: Real, force: Real, tops: Real) -> bool:
    """Follow the law over a period, `state` in place; False if it does not stay finite.

    Parameters
    ----------
    force : (count + 1,) filled with the force at the nodes but the first, or empty.
    tops : (states,) raised to the largest size of every state.
    """
    ns, k, trial = state.size, np.empty((4, state.size)), np.empty(state.size)
    for j in range(1, course.nodes + 1):
        dt = (course.tau[j] - course.tau[j - 1]) / course.omega
        if course.steps:
            du = course.u[j] - course.u[j - 1]
            f = call_step(course.number, course.u[j], course.v[j], du, dt, state, trial, course.p)
            for i in range(ns):
                state[i] = trial[i]
        else:
            f = 0.0
            if ns > 0:
                _rate_step(course, 2 * (j - 1), dt, k, trial, state)
            if force.size > 0:
                f = call_force(course.number, course.u[2 * j], course.v[2 * j], state, course.p)
        if force.size > 0:
            force[j] = f
        total = f
        for i in range(ns):
            total += state[i]
            tops[i] = max(tops[i], abs(state[i]))
        if not math.isfinite(total):
            return False
    return True


@compiled
def _ramp_steps(course: Course) -> int:
    """Return the steps to the first node: about as long as those of the period, and no more than it has."""
    travel, steps = 0.0, _RAMP
    for j in range(1, course.u.size):
        travel += abs(course.u[j] - course.u[j - 1])
    while 2 * steps <= course.nodes and 2.0 * steps * travel <= course.nodes * abs(course.u[0]):
        steps *= 2
    return steps


@compiled
def ramp_of(course: Course) -> Course:
    """Return the course from no motion to that of the first node."""
    u, v = course.u[0], course.v[0]
    time = _RAMP_SHARE * 2.0 * math.pi / course.omega
    count = 1 if course.steps else _ramp_steps(course)
    points = halves_of(course.steps) * count + 1
    tau, weight = np.empty(count + 1), np.zeros(count + 1)
    basis = np.zeros((points, course.basis.shape[1]))
    us, vs = np.empty(points), np.empty(points)
    for j in range(count + 1):
        tau[j] = 2.0 * math.pi * _RAMP_SHARE * j / count
    for j in range(points):
        share = j / (points - 1)
        us[j], vs[j] = share * u, v if course.steps else u / time
        for i in range(basis.shape[1]):
            basis[j, i] = share * course.basis[0, i]
    return Course(
        course.number, course.way, course.steps, course.alone, course.p, course.slope, course.omega,
        course.domega, course.ks, tau, weight, count, basis, us, vs, course.sizes,
    )  # fmt: skip


@apart
def carry(course: Course, ramp: bool, state: Real, D: Real, F: Real, dF: Real) -> float:
    """Follow the law over a period with the derivatives `D` of its state, both in place.

    Parameters
    ----------
    ramp : the course is the way to the first node, not a period.
    D : (states, n + 1 or more) by the coefficients, λ, and perhaps the states at the beginning.
    F, dF : (n,), (n, columns of D) integrals of force times basis are added to them, unless empty.

    Returns
    -------
    The largest rate of a state by itself times the step, NaN if something is not finite.
    """
    ns, n, inputs = state.size, course.basis.shape[1], inputs_of(course.steps)
    wide, fastest = max(D.shape[1], n + 1), 0.0
    L, hand = np.zeros((ns + 1, inputs + 1 + ns)), np.zeros((ns + 1, inputs + ns + course.p.size))
    work = np.empty(inputs + 2 * ns + course.p.size, np.complex128)
    E, new = np.zeros((inputs, wide)), np.empty((ns, wide))
    Ks, moved = np.empty((4, ns, wide)), np.empty((ns, wide))
    k, trial, by, x = np.empty((4, ns)), np.empty(ns), np.empty(wide), np.empty(inputs)
    for j in range(1, course.nodes + 1):
        dt = (course.tau[j] - course.tau[j - 1]) / course.omega
        ddt = -dt / course.omega * course.domega
        if course.steps:
            x[0], x[1], x[2], x[3] = course.u[j], course.v[j], course.u[j] - course.u[j - 1], dt
            _seed(course, ramp, j, n, E)
            for i in range(n):
                E[2, i] = course.basis[j, i] - course.basis[j - 1, i]
            E[3, n] = ddt
            f = call_step(course.number, x[0], x[1], x[2], x[3], state, trial, course.p)
            _linearise(course, True, x, state, trial, L, hand, work)
            _times(course.alone, L, D, E, n, new, by)
            for i in range(ns):
                state[i] = trial[i]
                for q in range(wide):
                    D[i, q] = new[i, q]
        else:
            if ns > 0:
                rate = _carry_rates(course, ramp, j, dt, ddt, state, D, L, hand, work, E, Ks, moved, k, trial)
                fastest = max(fastest, rate)
            if F.size == 0:
                continue
            x[0], x[1] = course.u[2 * j], course.v[2 * j]
            f = call_force(course.number, x[0], x[1], state, course.p)
            _seed(course, ramp, 2 * j, n, E)
            _linearise(course, True, x, state, trial, L, hand, work)
            _times(course.alone, L, D, E, n, new, by)
        if F.size > 0:
            node, w = course.basis[halves_of(course.steps) * j], course.weight[j]
            for a in range(n):
                share = w * node[a]
                F[a] += share * f
                for b in range(wide):
                    dF[a, b] += share * by[b]
    check = fastest
    for i in range(ns):
        check += state[i]
        for q in range(n + 1):
            check += D[i, q]
    return fastest if math.isfinite(check) else np.nan


@compiled
def _seed(course: Course, ramp: bool, at: int, n: int, E: Real) -> None:
    """Fill the derivatives of u and v at a point."""
    for i in range(n):
        E[0, i] = course.basis[at, i]
    if ramp and not course.steps:
        # Along the way to the first node the velocity is that motion over an eighth of a period.
        rate = course.omega / (2.0 * math.pi * _RAMP_SHARE)
        for i in range(n):
            E[1, i] = rate * course.basis[course.basis.shape[0] - 1, i]
    else:
        fill_velocity(course.ks, course.omega, course.basis[at], E[1])
    E[1, n] = course.v[at] / course.omega * course.domega


@compiled
def _linearise(
    course: Course, forces: bool, x: Real, last: Real, state: Real, L: Real, hand: Real, work: Complex
) -> None:
    partials(
        course.number, course.way, course.steps, course.alone, forces, x, last, state, course.p, course.slope,
        course.sizes, L, hand, work,
    )  # fmt: skip


@compiled
def _times(alone: bool, L: Real, D: Real, E: Real, n: int, new: Real, by: Real) -> None:
    """Fill what the law makes of the derivatives: of its states or rates in `new`, of its force in `by`."""
    ns, inputs, wide = D.shape[0], E.shape[0], by.size
    for i in range(ns + 1):
        out = new[i] if i < ns else by
        for q in range(wide):
            out[q] = 0.0
        for m in range(inputs):
            slope = L[i, m]
            if slope != 0.0:
                for q in range(n + 1):
                    out[q] += slope * E[m, q]
        out[n] += L[i, inputs]
        first, end = (i, i + 1) if alone and i < ns else (0, ns)
        for m in range(first, end):
            slope = L[i, inputs + 1 + m]
            if slope != 0.0:
                for q in range(wide):
                    out[q] += slope * D[m, q]


@compiled
def _moving(course: Course, at: int, middle: int) -> float:
    """Return the velocity at a point; where it reverses, a small one of the sign it has amid the step.

    A rate has another slope on either side of a reversal, and a step belongs to one of them.
    """
    least = course.sizes[1] * (_NEAR_REST if course.way == BY_DIFFERENCES else _AT_REST)
    if abs(course.v[at]) >= least:
        return float(course.v[at])
    return math.copysign(least, course.v[middle])


@apart
def _carry_rates(
    course: Course, ramp: bool, j: int, dt: float, ddt: float, state: Real, D: Real, L: Real, hand: Real,
    work: Complex, E: Real, Ks: Real, moved: Real, k: Real, trial: Real,
) -> float:  # fmt: skip
    """Move state and derivatives from node j − 1 to node j; return the largest own rate times the step."""
    ns, wide, n, fastest = state.size, D.shape[1], course.basis.shape[1], 0.0
    by, x = np.empty(wide), np.empty(2)
    for stage in range(4):
        at = 2 * (j - 1) + (0 if stage == 0 else 2 if stage == 3 else 1)
        share = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
        for i in range(ns):
            trial[i] = state[i]
            for q in range(wide):
                moved[i, q] = D[i, q]
            if stage > 0:
                trial[i] += share * dt * k[stage - 1, i]
                for q in range(wide):
                    moved[i, q] += share * dt * Ks[stage - 1, i, q]
                moved[i, n] += share * ddt * k[stage - 1, i]
        x[0], x[1] = course.u[at], _moving(course, at, 2 * j - 1)
        call_rate(course.number, course.u[at], course.v[at], trial, course.p, k[stage])
        _seed(course, ramp, at, n, E)
        _linearise(course, False, x, trial, trial, L, hand, work)
        _times(course.alone, L, moved, E, n, Ks[stage], by)
        if stage == 0:
            for i in range(ns):
                fastest = max(fastest, abs(L[i, 3 + i]) * dt)
    for i in range(ns):
        rate = (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i]) / 6.0
        state[i] += dt * rate
        for q in range(wide):
            D[i, q] += dt / 6.0 * (Ks[0, i, q] + 2.0 * (Ks[1, i, q] + Ks[2, i, q]) + Ks[3, i, q])
        D[i, n] += ddt * rate
    return fastest
