"""Time marching of a structure with friction contacts: Taylor steps, every change of state located.

Time is the angle tau = omega t [rad], so a period is 2 pi. Between two changes of state (a contact begins to
slip, sticks, separates or closes) the equations are linear, and the Taylor series of the motion follows from
its recursion (J. C. Butcher, Numerical Methods for Ordinary Differential Equations, 2008, section 25): with
x = sum x_k s^k and x' = v,

    x_{k+1} = h v_k / (k + 1),   v_{k+1} = h (f_k - A x_k - B v_k - W L^T F_k) / (k + 1).

A change of state is the first root of a polynomial inside the step; the step is cut there and the next one
starts in the new state, so the order of the series is kept across every change.

Nothing here is shared with the harmonic balance: this is its referee.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.kernels.compiled import compiled
from solver.kernels.falls import NONE, first_fall, value_at

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

ORDER = 8  # of the Taylor series; stable on the imaginary axis for h |lambda| < 3.4
# What a contact does; a slipping one has its direction, +1 or -1.
STICK, SEPARATED = 0, 2
# How a run of periods ended.
RAN, SETTLED, CHATTER, NOT_FINITE = 0, 1, 2, 3


class System(NamedTuple):
    """The equations in tau: x'' = W (force - L^T F) - A x - B x', with A, B and W as compressed sparse rows.

    W is the inverse of the mass matrix times omega^-2.
    """

    A_start: Whole
    A_column: Whole
    A_value: Real
    B_start: Whole
    B_column: Whole
    B_value: Real
    W_start: Whole
    W_column: Whole
    W_value: Real
    force_dof: Whole
    force_amplitude: Real
    force_phase: Real
    force_harmonic: Whole
    first: Whole
    second: Whole
    kt: Real
    mu: Real
    N0: Real
    N1: Real
    N1_phase: Real


class State(NamedTuple):
    """Motion and contacts at one instant; changed in place. `mode`: STICK, SEPARATED, +1 or -1."""

    x: Real
    v: Real
    force: Real
    mode: Whole


class Series(NamedTuple):
    """Taylor coefficients over a step, row k belongs to s^k, s = 0..1; `pull` is scratch, a force a DOF."""

    x: Real
    v: Real
    force: Real
    load: Real
    pull: Real


class Record(NamedTuple):
    """Samples of one period, evenly spaced; empty arrays record nothing."""

    x: Real
    v: Real
    slip: Real
    force: Real
    load: Real


@compiled
def _product(start: Whole, column: Whole, value: Real, x: Real, row: int) -> float:
    total = 0.0
    for j in range(start[row], start[row + 1]):
        total += value[j] * x[column[j]]
    return total


@compiled
def _slip(system: System, x: Real, c: int) -> float:
    """Return x(first end) - x(second end) of contact c; an end of -1 is the ground."""
    first, second = system.first[c], system.second[c]
    return (x[first] if first >= 0 else 0.0) - (x[second] if second >= 0 else 0.0)


@compiled
def _wave(k: int, angle: float) -> float:
    """Return the k-th derivative of the cosine."""
    turn = k % 4
    value = math.cos(angle) if turn % 2 == 0 else math.sin(angle)
    return value if turn in (0, 3) else -value


@compiled
def _load_series(system: System, tau: float, h: float, series: Series) -> None:
    for c in range(system.kt.size):
        factor = system.N1[c]
        for k in range(ORDER + 1):
            series.load[k, c] = factor * _wave(k, tau + system.N1_phase[c])
            factor *= h / (k + 1)
        series.load[0, c] += system.N0[c]


@compiled
def _contact_series(system: System, state: State, series: Series, k: int) -> None:
    """Coefficient k of the contact forces from the motion's and the load's."""
    for c in range(system.kt.size):
        mode = state.mode[c]
        if mode == SEPARATED:
            series.force[k, c] = 0.0
        elif mode == STICK:
            series.force[k, c] = state.force[c] if k == 0 else system.kt[c] * _slip(system, series.x[k], c)
        else:
            series.force[k, c] = mode * system.mu[c] * series.load[k, c]


@compiled
def _pull(system: System, tau: float, k: int, scale: float, series: Series) -> None:
    """Fill in coefficient k of what forces and contacts pull at each DOF."""
    f, pull = series.force[k], series.pull
    for i in range(pull.size):
        pull[i] = 0.0
    for e in range(system.force_dof.size):
        harmonic = system.force_harmonic[e]
        wave = _wave(k, harmonic * tau + system.force_phase[e])
        pull[system.force_dof[e]] += system.force_amplitude[e] * wave * scale * float(harmonic) ** k
    for c in range(system.kt.size):
        first, second = system.first[c], system.second[c]
        if first >= 0:
            pull[first] -= f[c]
        if second >= 0:
            pull[second] += f[c]


@compiled
def _expand(system: System, state: State, tau: float, h: float, series: Series) -> None:
    """Fill the Taylor series of motion and contact forces from `tau` over a step `h`."""
    n = state.x.size
    for i in range(n):
        series.x[0, i] = state.x[i]
        series.v[0, i] = state.v[i]
    _load_series(system, tau, h, series)
    _contact_series(system, state, series, 0)
    scale = 1.0  # h^k / k!
    for k in range(ORDER):
        x, v, rise, pull = series.x[k], series.v[k], series.v[k + 1], series.pull
        _pull(system, tau, k, scale, series)
        for i in range(n):
            rise[i] = _product(system.W_start, system.W_column, system.W_value, pull, i)
            rise[i] -= _product(system.A_start, system.A_column, system.A_value, x, i)
            rise[i] -= _product(system.B_start, system.B_column, system.B_value, v, i)
            rise[i] *= h / (k + 1)
            series.x[k + 1, i] = h / (k + 1) * v[i]
        scale *= h / (k + 1)
        _contact_series(system, state, series, k + 1)


@compiled
def _limit(system: System, series: Series, c: int, direction: int, q: Real) -> None:
    """Put the distance mu N - direction * f of contact c to its limit into q."""
    for k in range(q.size):
        q[k] = system.mu[c] * series.load[k, c] - direction * series.force[k, c]


@compiled
def _drive(system: System, series: Series, h: float, c: int, direction: int, q: Real) -> None:
    """Put direction * kt u' - mu N' of contact c into q: while positive, it goes on slipping."""
    first, second = system.first[c], system.second[c]
    for k in range(q.size - 1):
        speed = series.v[k, first] if first >= 0 else 0.0
        speed -= series.v[k, second] if second >= 0 else 0.0
        rise = (k + 1) * series.load[k + 1, c] / h
        q[k] = direction * system.kt[c] * speed - system.mu[c] * rise
    q[q.size - 1] = 0.0


@compiled
def _load(series: Series, c: int, sign: int, q: Real) -> None:
    """Put the normal load of contact c, or its negative, into q."""
    for k in range(q.size):
        q[k] = sign * series.load[k, c]


@compiled
def _next_change(
    system: System, state: State, series: Series, h: float, c: int, q: Real
) -> tuple[float, int]:
    """Return where in the step contact c leaves its state, and the state it goes to.

    A margin far below the accuracy (1e-13 of the limit) keeps rounding from undoing a change just made.
    """
    mode, mu = state.mode[c], system.mu[c]
    margin = 1e-13 * (system.N0[c] + abs(system.N1[c]))
    when, target = NONE, mode
    if mode == SEPARATED:
        _load(series, c, -1, q)
        q[0] += margin
        return first_fall(q), STICK
    if mode == STICK:
        for direction in (1, -1):
            _limit(system, series, c, direction, q)
            q[0] += mu * margin
            s = first_fall(q)
            if s < when:
                when, target = s, direction
        return when, target
    _drive(system, series, h, c, mode, q)
    q[0] += mu * margin
    when, target = first_fall(q), STICK
    _load(series, c, 1, q)
    q[0] += margin
    s = first_fall(q)
    return (s, SEPARATED) if s < when else (when, target)


@compiled
def _advance(system: System, state: State, series: Series, s: float) -> None:
    """Move the state to the place s of the step."""
    for i in range(state.x.size):
        state.x[i] = value_at(series.x[:, i], s)
        state.v[i] = value_at(series.v[:, i], s)
    for c in range(system.kt.size):
        state.force[c] = value_at(series.force[:, c], s)


@compiled
def _change(system: System, state: State, tau: float, c: int, target: int) -> None:
    """Put contact c into its next state at `tau`; one that closes sticks or slips by its rates."""
    before = state.mode[c]
    state.mode[c] = target
    if target == SEPARATED:
        state.force[c] = 0.0
    elif before == SEPARATED:
        state.force[c] = 0.0
        pull = system.kt[c] * _slip(system, state.v, c)
        push = -system.mu[c] * system.N1[c] * math.sin(tau + system.N1_phase[c])
        if abs(pull) > push:
            state.mode[c] = 1 if pull > 0.0 else -1


@compiled
def _sample(system: System, series: Series, place: float, index: int, dof: int, record: Record) -> None:
    record.x[index] = value_at(series.x[:, dof], place)
    record.v[index] = value_at(series.v[:, dof], place)
    for c in range(system.kt.size):
        first, second = system.first[c], system.second[c]
        slip = value_at(series.x[:, first], place) if first >= 0 else 0.0
        record.slip[c, index] = slip - (value_at(series.x[:, second], place) if second >= 0 else 0.0)
        record.force[c, index] = value_at(series.force[:, c], place)
        record.load[c, index] = max(value_at(series.load[:, c], place), 0.0)


@compiled
def _step(
    system: System, state: State, step: int, steps: int, dof: int, record: Record, series: Series, q: Real
) -> bool:
    """Go over one step of the grid, cut at every change of state; False if the changes do not end."""
    h = 2.0 * math.pi / steps
    start = step * h
    gone, small, per_step = 0.0, 0, record.x.size // steps
    sample = 0
    while True:
        rest = h - gone
        _expand(system, state, start + gone, rest, series)
        when, target, which = NONE, STICK, -1
        for c in range(system.kt.size):
            if system.mu[c] * (system.N0[c] + abs(system.N1[c])) > 0.0:
                s, mode = _next_change(system, state, series, rest, c, q)
                if s < when:
                    when, target, which = s, mode, c
        end = min(when, 1.0)
        while sample < per_step and sample / per_step * h <= gone + end * rest:
            place = max((sample / per_step * h - gone) / rest, 0.0)
            _sample(system, series, place, step * per_step + sample, dof, record)
            sample += 1
        _advance(system, state, series, end)
        if which < 0:
            return True
        gone += end * rest
        _change(system, state, start + gone, which, target)
        small = small + 1 if end * rest < 1e-12 else 0
        if small > 20 + 8 * system.kt.size:
            return False
        if h - gone <= 0.0:
            return True


@compiled
def _largest_change(now: Real, before: Real, scale: float) -> float:
    change = 0.0
    for i in range(now.size):
        change = max(change, abs(now[i] - before[i]))
    return change / scale if scale > 0.0 else change


@compiled
def _finite(state: State) -> bool:
    total = 0.0
    for i in range(state.x.size):
        total += state.x[i] + state.v[i]
    return math.isfinite(total)


@compiled
def run_periods(
    system: System, state: State, steps: int, tolerance: float, dof: int, record: Record, change: Real
) -> tuple[int, int]:
    """March up to `change.size` periods, fewer once the state repeats within `tolerance`.

    Parameters
    ----------
    system, state
        The equations, and the state at tau = 0, which is moved on.
    steps : int
        Steps per period.
    tolerance : float
        Largest change of the state over a period: displacements and contact forces relative to their
        largest in the period, velocities (by tau) to the larger of theirs and the displacements'.
    dof : int
        The DOF to record.
    record : Record
        Takes samples of the last period run; their number is a multiple of `steps` or 0.
    change : (n_periods,) array
        Takes the change of every period.

    Returns
    -------
    int, int
        RAN, SETTLED, CHATTER or NOT_FINITE, and the periods run.
    """
    n, n_contacts, rows = state.x.size, system.kt.size, ORDER + 1
    series = Series(
        np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n_contacts)), np.empty((rows, n_contacts)),
        np.empty(n),
    )  # fmt: skip
    q = np.empty(rows)
    for period in range(change.size):
        x, v, force = state.x.copy(), state.v.copy(), state.force.copy()
        top_x, top_v, top_force = 0.0, 0.0, 0.0
        for step in range(steps):
            if not _step(system, state, step, steps, dof, record, series, q):
                return CHATTER, period
            for i in range(n):
                top_x = max(top_x, abs(state.x[i]))
                top_v = max(top_v, abs(state.v[i]))
            for c in range(n_contacts):
                top_force = max(top_force, abs(state.force[c]))
        change[period] = max(
            _largest_change(state.x, x, top_x),
            max(
                _largest_change(state.v, v, max(top_x, top_v)), _largest_change(state.force, force, top_force)
            ),
        )
        if not _finite(state):
            return NOT_FINITE, period + 1
        if change[period] < tolerance:
            return SETTLED, period + 1
    return RAN, change.size
