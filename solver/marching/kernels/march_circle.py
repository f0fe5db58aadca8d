"""The Taylor series of a friction force in two directions under one circular limit, and its changes of state.

A contact in space is two rows of the march: the first (CIRCLE) has the first tangential motion and the normal
one, the second (CIRCLE_SECOND) the other tangential motion. While it slips the force is L (cos θ, sin θ),
L = mu N, and the slider moves along it, t_i' = kt_i (u_i' − λ n_i). With λ eliminated,

    L G θ' = cos θ w' − sin θ u' − (f2 − f1) sin θ cos θ L',   G = f2 cos² θ + f1 sin² θ,   f_i = 1/kt_i,

and it slips on while kt_1 u' cos θ + kt_2 w' sin θ − L' is positive. The series follows coefficient by
coefficient (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, I.8).
Where L is 0 the equation has a pole: below FROZEN of the load's size the direction stands still.
"""

from __future__ import annotations

import math

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.separate import apart
from solver.marching.kernels.event_roots import first_fall
from solver.marching.kernels.march_state import (
    ORDER,
    SEPARATED,
    STICK,
    Real,
    Series,
    State,
    System,
    load_rise,
    normal_slip,
    slip,
)

SLIP = 1  # the mode of a contact in space that slips
FROZEN = 1e-6
LEAST_FORCE = 1e-100  # N
LOCAL_ERROR = 1e-12  # of a step, relative to the load's size
# Rows of `Series.turn`: direction, its cosine, sine, their product, G, L G, and θ' by the place in the step.
THETA, COSINE, SINE, BOTH, G, LG, RATE = 0, 1, 2, 3, 4, 5, 6
TURN_ROWS = 7


@compiled
def load_size(system: System, series: Series, c: int) -> float:
    """Return the size of the normal load of contact c: of its parts, where the step begins.

    Not from the whole series: near the pole its last terms are large where the step is cut.
    """
    moved = abs(normal_slip(system, series.x[0], c)) + abs(normal_slip(system, series.x[1], c))
    return abs(system.N0[c]) + system.swing[c] + system.kn[c] * moved


@compiled
def onset(system: System, v: Real, c: int, rise: float) -> tuple[float, float, float]:
    """Return the direction of the slip with which contact begins and the rate of slip, 0 if it sticks.

    With t' = L' n there, n_i = kt_i u_i'/(L' + kt_i λ) and λ > 0 follows from |n| = 1 by bisection.
    """
    x, y = system.kt[c] * slip(system, v, c), system.kt[c + 1] * slip(system, v, c + 1)
    pull = math.hypot(x, y)
    if pull <= rise or pull == 0.0:
        return 1.0, 0.0, 0.0
    low, high = 0.0, pull / min(system.kt[c], system.kt[c + 1])
    for _ in range(200):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if math.hypot(x / (rise + system.kt[c] * middle), y / (rise + system.kt[c + 1] * middle)) > 1.0:
            low = middle
        else:
            high = middle
    x, y = x / (rise + system.kt[c] * high), y / (rise + system.kt[c + 1] * high)
    return x / math.hypot(x, y), y / math.hypot(x, y), high


@compiled
def _product(a: Real, b: Real, k: int) -> float:
    """Return coefficient k of the product of two series."""
    total = 0.0
    for i in range(k + 1):
        total += a[i] * b[k - i]
    return total


@compiled
def _begin_turn(state: State, series: Series, c: int) -> None:
    """Fill in the coefficients 0 of the direction: that of the force."""
    turn, x, y = series.turn[c], state.force[c], state.force[c + 1]
    size = math.hypot(x, y)
    x, y = (x / size, y / size) if size > 0.0 else (1.0, 0.0)
    turn[THETA, 0], turn[COSINE, 0], turn[SINE, 0] = math.atan2(y, x), x, y


@apart
def circle_series(system: System, state: State, series: Series, c: int, k: int) -> None:
    """Fill in coefficient k of both friction forces of contact c from those of the motion and the load."""
    turn, mu = series.turn[c], system.mu[c]
    if state.mode[c] == SEPARATED or mu == 0.0:
        series.force[k, c], series.force[k, c + 1] = 0.0, 0.0
        return
    if state.mode[c] == STICK:
        for row in (c, c + 1):
            series.force[k, row] = system.kt[row] * slip(system, series.x[k], row)
            if k == 0:
                series.force[k, row] = state.force[row]
        return
    if k == 0:
        _begin_turn(state, series, c)
    else:
        turn[RATE, k - 1] = _rate(system, series, c, k - 1)
        turn[THETA, k] = turn[RATE, k - 1] / k
        turn[COSINE, k] = -_product(turn[RATE], turn[SINE], k - 1) / k
        turn[SINE, k] = _product(turn[RATE], turn[COSINE], k - 1) / k
    turn[BOTH, k] = _product(turn[COSINE], turn[SINE], k)
    turn[G, k] = _product(turn[COSINE], turn[COSINE], k) / system.kt[c + 1]
    turn[G, k] += _product(turn[SINE], turn[SINE], k) / system.kt[c]
    load = series.load[:, c]
    turn[LG, k] = mu * _product(load, turn[G], k)
    series.force[k, c] = mu * _product(load, turn[COSINE], k)
    series.force[k, c + 1] = mu * _product(load, turn[SINE], k)


@compiled
def _rate(system: System, series: Series, c: int, k: int) -> float:
    """Return coefficient k of θ' by the place in the step."""
    if series.load[0, c] <= FROZEN * load_size(system, series, c):
        return 0.0
    turn, total = series.turn[c], 0.0
    apart_by = 1.0 / system.kt[c + 1] - 1.0 / system.kt[c]
    for i in range(k + 1):
        j = k - i + 1
        total += j * turn[COSINE, i] * slip(system, series.x[j], c + 1)
        total -= j * turn[SINE, i] * slip(system, series.x[j], c)
        total -= j * apart_by * turn[BOTH, i] * system.mu[c] * series.load[j, c]
    for i in range(1, k + 1):
        total -= turn[LG, i] * turn[RATE, k - i]
    return total / turn[LG, 0]


@compiled
def reach(system: System, state: State, series: Series, c: int) -> float:
    """Return how far into the step the series of a slip in space may be trusted, at most 1."""
    if state.mode[c] != SLIP or system.mu[c] == 0.0:
        return 1.0
    size, here = load_size(system, series, c), series.load[0, c]
    if here <= FROZEN * size:
        rise = series.load[1, c]
        return min(1.0, FROZEN * size / rise) if rise > 0.0 else 1.0
    far = 1.0
    for k in (ORDER - 1, ORDER):
        term = abs(series.turn[c, THETA, k]) * here
        if term > LOCAL_ERROR * size:
            far = min(far, (LOCAL_ERROR * size / term) ** (1.0 / k))
    return far


@apart
def circle_change(system: System, state: State, series: Series, c: int, q: Real) -> tuple[float, int]:
    """Return where in the step contact c leaves its state, and the state it goes to."""
    mode, mu = state.mode[c], system.mu[c]
    margin = 1e-13 * load_size(system, series, c)
    sign = -1.0 if mode == SEPARATED else 1.0
    if mode == STICK and mu > 0.0:
        return _leaves_stick(system, series, c, mu * margin), SLIP
    for k in range(q.size):
        q[k] = sign * series.load[k, c]
    q[0] += margin
    when, target = first_fall(q), STICK if mode == SEPARATED else SEPARATED
    if mode != SLIP or mu == 0.0:
        return when, target
    turn = series.turn[c]
    for k in range(ORDER):
        total = -(k + 1) * mu * series.load[k + 1, c]
        for i in range(k + 1):
            j = k - i + 1
            total += j * turn[COSINE, i] * system.kt[c] * slip(system, series.x[j], c)
            total += j * turn[SINE, i] * system.kt[c + 1] * slip(system, series.x[j], c + 1)
        q[k] = total
    q[ORDER] = 0.0
    q[0] += mu * margin
    s = first_fall(q)
    return (s, STICK) if s < when else (when, target)


@compiled
def _leaves_stick(system: System, series: Series, c: int, margin: float) -> float:
    """Return where L² − |t|² falls below 0: the whole product of the series."""
    q = np.zeros(2 * ORDER + 1)
    for i in range(ORDER + 1):
        for j in range(ORDER + 1):
            q[i + j] += system.mu[c] ** 2 * series.load[i, c] * series.load[j, c]
            q[i + j] -= series.force[i, c] * series.force[j, c]
            q[i + j] -= series.force[i, c + 1] * series.force[j, c + 1]
    q[0] += margin * (2.0 * system.mu[c] * abs(series.load[0, c]) + margin)
    return first_fall(q)


@compiled
def close_circle(system: System, state: State, tau: float, c: int) -> None:
    """Put a contact in space whose contact begins into its state: it sticks or slips by its rates."""
    state.force[c], state.force[c + 1] = 0.0, 0.0
    push = system.mu[c] * load_rise(system, tau, c)
    push += system.mu[c] * system.kn[c] * normal_slip(system, state.v, c)
    x, y, rate = onset(system, state.v, c, push)
    if rate > 0.0 and system.mu[c] > 0.0:
        # A force without size has a direction: by far the smallest that keeps it.
        state.mode[c], state.force[c], state.force[c + 1] = SLIP, LEAST_FORCE * x, LEAST_FORCE * y
