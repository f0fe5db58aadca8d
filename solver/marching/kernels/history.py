"""A law given by functions of the motion and its history, within the Taylor steps of the march.

The march integrates the rate of its state itself, by the classical Runge–Kutta method along the polynomial of
the motion, or calls its step from sample to sample. The force at even places of the step is fitted by a
polynomial, the motion expanded anew with it, until both agree (Picard). A step is cut where the motion
reverses, so that the corners a law of friction has there are none of the polynomials'. Fourth order; second
where a law in samples has corners of its own.
"""

from __future__ import annotations

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.law_functions import call_force, call_rate, call_step
from solver.jit.separate import apart
from solver.marching.kernels.event_roots import first_fall, value_at
from solver.marching.kernels.march_state import HISTORY, ORDER, Real, Series, State, System, slip

PLACES = 6  # intervals of a step at whose ends the force is fitted
_SAMPLES = 4  # samples an interval, of a law in samples
_AGREES, _MOST_ROUNDS = 1e-14, 60
_FIT = np.linalg.inv(np.vander(np.linspace(0.0, 1.0, PLACES + 1), increasing=True))


@compiled
def any_history(system: System) -> bool:
    """Return whether a contact has such a law."""
    return bool(np.any(system.law == HISTORY))


@compiled
def _motion(system: System, series: Series, c: int, u: Real, v: Real) -> None:
    """Fill the polynomials of the motion [m] and its velocity [m/s] of contact c."""
    for k in range(u.size):
        u[k] = slip(system, series.x[k], c)
        v[k] = system.omega * slip(system, series.v[k], c)


@apart
def _follow(
    system: System, c: int, u: Real, v: Real, h: float, end: float, state: Real, force: Real
) -> None:  # fmt: skip
    """Follow the law of contact c from the beginning of a step `h` to its place `end`, `state` in place.

    `force` (PLACES + 1,) is filled with the force at even places, but the first of a law in samples.
    """
    number, p, ns = system.history[c], system.numbers[c], state.size
    k, trial = np.empty((4, ns)), np.empty(ns)
    parts = PLACES * (_SAMPLES if system.in_steps[c] == 1 else 1)
    dt = end * h / (parts * system.omega)
    if system.in_steps[c] == 0:
        force[0] = call_force(number, u[0], v[0], state, p)
    for j in range(parts):
        s = end * (j + 1) / parts
        if system.in_steps[c] == 1:
            du = value_at(u, s) - value_at(u, end * j / parts)
            f = call_step(number, value_at(u, s), value_at(v, s), du, dt, state, trial, p)
            for i in range(ns):
                state[i] = trial[i]
            if (j + 1) % _SAMPLES == 0:
                force[(j + 1) // _SAMPLES] = f
            continue
        if ns > 0:
            for stage in range(4):
                share = 0.0 if stage == 0 else 1.0 if stage == 3 else 0.5
                at = end * (j + share) / parts
                for i in range(ns):
                    trial[i] = state[i] + (share * dt * k[stage - 1, i] if stage > 0 else 0.0)
                call_rate(number, value_at(u, at), value_at(v, at), trial, p, k[stage])
            for i in range(ns):
                state[i] += dt / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])
        force[j + 1] = call_force(number, value_at(u, s), value_at(v, s), state, p)


@apart
def fit_forces(system: System, state: State, series: Series, h: float) -> float:
    """Fit the forces of all such laws over a step to the motion expanded; return their relative change."""
    change, size = 0.0, 0.0
    u, v, force = np.empty(ORDER + 1), np.empty(ORDER + 1), np.empty(PLACES + 1)
    for c in range(system.law.size):
        if system.law[c] != HISTORY:
            continue
        _motion(system, series, c, u, v)
        force[0] = state.force[c]
        _follow(system, c, u, v, h, 1.0, state.own[c, : system.states[c]].copy(), force)
        for k in range(PLACES + 1):
            found = 0.0
            for j in range(PLACES + 1):
                found += _FIT[k, j] * force[j]
            size, change = max(size, abs(found)), max(change, abs(found - series.given[c, k]))
            series.given[c, k] = found
    return change / size if size > 0.0 else change


@compiled
def begin_forces(system: System, state: State, series: Series) -> None:
    """Guess the forces over a step: those where it begins."""
    for c in range(system.law.size):
        for k in range(series.given.shape[1]):
            series.given[c, k] = 0.0
        series.given[c, 0] = state.force[c]


@compiled
def agreed(change: float, rounds: int) -> bool:
    """Return whether motion and forces of a step agree, or will not."""
    return not change > _AGREES or rounds >= _MOST_ROUNDS


@apart
def advance_history(system: System, state: State, series: Series, h: float, end: float) -> None:
    """Move the states of such laws to the place `end` of a step."""
    u, v, force = np.empty(ORDER + 1), np.empty(ORDER + 1), np.empty(PLACES + 1)
    for c in range(system.law.size):
        if system.law[c] == HISTORY:
            _motion(system, series, c, u, v)
            _follow(system, c, u, v, h, end, state.own[c, : system.states[c]], force)


@compiled
def reversal(system: System, state: State, series: Series, c: int, q: Real) -> tuple[float, int]:
    """Return where in the step the motion of contact c reverses, and the sign of its velocity after that."""
    size = 0.0
    for k in range(q.size):
        q[k] = slip(system, series.v[k], c)
        size += abs(q[k])
    mode = state.mode[c]
    if mode == 0:
        mode = 1 if value_at(q, 0.5) >= 0.0 else -1
        state.mode[c] = mode
    for k in range(q.size):
        q[k] *= mode
    q[0] += 1e-12 * size
    return first_fall(q), -mode
