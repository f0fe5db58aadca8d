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

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.separate import apart
from solver.marching.kernels.event_roots import NONE, first_fall, value_at
from solver.marching.kernels.history import (
    advance_history,
    agreed,
    any_history,
    begin_forces,
    fit_forces,
    reversal,
)
from solver.marching.kernels.march_circle import TURN_ROWS, circle_change, circle_series, close_circle, reach
from solver.marching.kernels.march_state import (
    CHATTER,
    CIRCLE,
    CIRCLE_SECOND,
    COULOMB,
    ELASTIC_NORMAL,
    GAP,
    HISTORY,
    NOT_FINITE,
    ORDER,
    POLYNOMIAL,
    RAN,
    SEPARATED,
    SETTLED,
    STICK,
    Real,
    Record,
    Series,
    State,
    System,
    finite,
    largest_change,
    load_rise,
    load_series,
    motion_size,
    new_record,
    new_series,
    new_state,
    new_system,
    normal_slip,
    power_series,
    product,
    pull_back,
    push_series,
    slip,
    turn_matrices,
)


@apart
def _contact_series(system: System, state: State, series: Series, k: int) -> None:
    """Coefficient k of the contact forces from the motion's and the given load's."""
    for c in range(system.kt.size):
        mode, law = state.mode[c], system.law[c]
        if law == HISTORY:
            series.force[k, c] = series.given[c, k]
        if law in (CIRCLE_SECOND, HISTORY):
            continue
        if law in (ELASTIC_NORMAL, CIRCLE):
            series.load[k, c] += system.kn[c] * normal_slip(system, series.x[k], c)
            if mode != SEPARATED:
                series.normal[k, c] += series.load[k, c]
        if law == CIRCLE:
            series.load[k, c + 1] = series.load[k, c]
            circle_series(system, state, series, c, k)
        elif mode == SEPARATED or (law == ELASTIC_NORMAL and system.mu[c] == 0.0):
            series.force[k, c] = 0.0
        elif law == POLYNOMIAL:
            series.force[k, c] = power_series(system, series, c, k)
        elif mode == STICK:
            series.force[k, c] = system.kt[c] * slip(system, series.x[k], c)
            if law == GAP and k == 0:
                series.force[k, c] -= system.kt[c] * system.gap[c]
            elif k == 0:
                series.force[k, c] = state.force[c]
        else:
            series.force[k, c] = mode * system.mu[c] * series.load[k, c]


@compiled
def _pull(system: System, k: int, series: Series) -> None:
    """Fill in coefficient k of what forces and contacts pull at each DOF."""
    f, pull = series.force[k], series.pull
    for i in range(pull.size):
        pull[i] = 0.0
    for e in range(system.force_dof.size):
        pull[system.force_dof[e]] += series.push[k, e]
    for c in range(system.kt.size):
        pull_back(system.L, c, f[c], pull)
        if system.law[c] in (ELASTIC_NORMAL, CIRCLE) and system.presses[c] > 0.0:
            pull_back(system.normal, c, series.normal[k, c], pull)


@apart
def _expand(system: System, state: State, tau: float, h: float, series: Series) -> None:
    """Fill the Taylor series of motion and contact forces from `tau` over a step `h`."""
    n = state.x.size
    for i in range(n):
        series.x[0, i] = state.x[i]
        series.v[0, i] = state.v[i]
    load_series(system, tau, h, series)
    push_series(system, tau, h, series)
    _contact_series(system, state, series, 0)
    for k in range(ORDER):
        x, v, rise, pull = series.x[k], series.v[k], series.v[k + 1], series.pull
        _pull(system, k, series)
        for i in range(n):
            rise[i] = product(system.W, pull, i)
            rise[i] -= product(system.A, x, i)
            rise[i] -= product(system.B, v, i)
            rise[i] *= h / (k + 1)
            series.x[k + 1, i] = h / (k + 1) * v[i]
        _contact_series(system, state, series, k + 1)


@apart
def _expand_all(system: System, state: State, tau: float, h: float, series: Series) -> None:
    """As `_expand`, the forces of laws given by functions too."""
    if not any_history(system):
        _expand(system, state, tau, h, series)
        return
    begin_forces(system, state, series)
    rounds, change = 0, np.inf
    while not agreed(change, rounds):
        _expand(system, state, tau, h, series)
        change = fit_forces(system, state, series, h)
        rounds += 1
    _expand(system, state, tau, h, series)


@compiled
def _limit(system: System, series: Series, c: int, direction: int, q: Real) -> None:
    """Put the distance mu N - direction * f of contact c to its limit into q."""
    for k in range(q.size):
        q[k] = system.mu[c] * series.load[k, c] - direction * series.force[k, c]


@compiled
def _drive(system: System, series: Series, h: float, c: int, direction: int, q: Real) -> None:
    """Put direction * kt u' - mu N' of contact c into q: while positive, it goes on slipping."""
    for k in range(q.size - 1):
        speed = slip(system, series.v[k], c)
        rise = (k + 1) * series.load[k + 1, c] / h
        q[k] = direction * system.kt[c] * speed - system.mu[c] * rise
    q[q.size - 1] = 0.0


@compiled
def _load(series: Series, c: int, sign: int, q: Real) -> None:
    """Put the normal load of contact c, or its negative, into q."""
    for k in range(q.size):
        q[k] = sign * series.load[k, c]


@apart
def _next_change(
    system: System, state: State, series: Series, h: float, c: int, q: Real
) -> tuple[float, int]:
    """Return where in the step contact c leaves its state, and the state it goes to.

    A margin far below the accuracy (1e-13 of the limit) keeps rounding from undoing a change just made.
    """
    mode, mu, law = state.mode[c], system.mu[c], system.law[c]
    when, target = NONE, mode
    if law in (POLYNOMIAL, CIRCLE_SECOND):
        return when, target
    if law == HISTORY:
        return reversal(system, state, series, c, q)
    if law == CIRCLE:
        return circle_change(system, state, series, c, q)
    if law == GAP:
        return _gap_change(system, series, c, mode, q)
    margin = abs(system.N0[c]) + system.swing[c]
    if law == ELASTIC_NORMAL:
        margin += system.kn[c] * motion_size(system, series, c, True)
    margin *= 1e-13
    if mode == SEPARATED:
        _load(series, c, -1, q)
        q[0] += margin
        return first_fall(q), STICK
    if mu == 0.0:
        _load(series, c, 1, q)
        q[0] += margin
        return first_fall(q), SEPARATED
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
def _gap_change(system: System, series: Series, c: int, mode: int, q: Real) -> tuple[float, int]:
    """Return where in the step a gap closes or opens, and the state it goes to."""
    sign = -1.0 if mode == SEPARATED else 1.0
    for k in range(q.size):
        q[k] = sign * slip(system, series.x[k], c)
    margin = 1e-13 * (abs(system.gap[c]) + motion_size(system, series, c, False))
    q[0] += margin - sign * system.gap[c]
    return first_fall(q), STICK if mode == SEPARATED else SEPARATED


@apart
def _advance(system: System, state: State, series: Series, s: float) -> None:
    """Move the state to the place s of the step."""
    for i in range(state.x.size):
        state.x[i] = value_at(series.x[:, i], s)
        state.v[i] = value_at(series.v[:, i], s)
    for c in range(system.kt.size):
        state.force[c] = value_at(series.force[:, c], s)


@apart
def _change(system: System, state: State, tau: float, c: int, target: int) -> None:
    """Put contact c into its next state at `tau`; one that closes sticks or slips by its rates."""
    before = state.mode[c]
    state.mode[c] = target
    if system.law[c] == CIRCLE:
        if target == SEPARATED:
            state.force[c], state.force[c + 1] = 0.0, 0.0
        elif before == SEPARATED:
            close_circle(system, state, tau, c)
    elif target == SEPARATED:
        state.force[c] = 0.0
    elif before == SEPARATED:
        state.force[c] = 0.0
        if system.mu[c] == 0.0:
            return
        pull = system.kt[c] * slip(system, state.v, c)
        push = system.mu[c] * load_rise(system, tau, c)
        if system.law[c] == ELASTIC_NORMAL:
            push += system.mu[c] * system.kn[c] * normal_slip(system, state.v, c)
        if abs(pull) > push:
            state.mode[c] = 1 if pull > 0.0 else -1


@apart
def _sample(system: System, series: Series, place: float, index: int, dof: int, record: Record) -> None:
    record.x[index] = value_at(series.x[:, dof], place)
    record.v[index] = value_at(series.v[:, dof], place)
    for c in range(system.kt.size):
        motion = 0.0
        for j in range(system.L.start[c], system.L.start[c + 1]):
            motion += system.L.value[j] * value_at(series.x[:, system.L.column[j]], place)
        record.slip[c, index] = motion
        record.force[c, index] = value_at(series.force[:, c], place)
        record.load[c, index] = max(value_at(series.load[:, c], place), 0.0)


@apart
def _step(
    system: System, state: State, start: float, h: float, dof: int, record: Record, at: int, per_step: int,
    series: Series, q: Real,
) -> bool:  # fmt: skip
    """Go over one step of the grid, cut at every change of state; False if the changes do not end.

    `at`: place in the record of the first of `per_step` samples.
    """
    gone, small, sample = 0.0, 0, 0
    while True:
        rest = h - gone
        _expand_all(system, state, start + gone, rest, series)
        when, target, which = NONE, STICK, -1
        far = 1.0
        for c in range(system.kt.size):
            if system.law[c] != COULOMB or system.mu[c] * (system.N0[c] + system.swing[c]) > 0.0:
                s, mode = _next_change(system, state, series, rest, c, q)
                if s < when:
                    when, target, which = s, mode, c
                if system.law[c] == CIRCLE:
                    far = min(far, reach(system, state, series, c))
        end = min(when, far)
        while sample < per_step and sample / per_step * h <= gone + end * rest:
            place = max((sample / per_step * h - gone) / rest, 0.0)
            _sample(system, series, place, at + sample, dof, record)
            sample += 1
        if any_history(system):
            advance_history(system, state, series, rest, end)
        _advance(system, state, series, end)
        if which < 0 and end == 1.0:
            return True
        gone += end * rest
        if end == when:
            _change(system, state, start + gone, which, target)
        small = small + 1 if end * rest < 1e-12 else 0
        if small > 20 + 8 * system.kt.size:
            return False
        if h - gone <= 0.0:
            return True


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
    held, here, kept = new_system(*system), new_state(*state), new_record(*record)
    return _run_periods(held, here, steps, tolerance, dof, kept, change)


@compiled
def _scratch(system: System, state: State) -> Series:
    """Return the series of a step, to be filled."""
    n, n_contacts, rows = state.x.size, system.kt.size, ORDER + 1
    return new_series(
        np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n_contacts)), np.empty((rows, n_contacts)),
        np.empty((rows, system.force_dof.size)), np.empty((2, rows)), np.empty(n),
        np.empty((rows, n_contacts)), np.empty((n_contacts, system.powers.shape[1], rows)),
        np.zeros((n_contacts, TURN_ROWS, rows)), np.zeros((n_contacts, rows)),
    )  # fmt: skip


@apart
def _run_periods(
    system: System, state: State, steps: int, tolerance: float, dof: int, record: Record, change: Real
) -> tuple[int, int]:
    """As `run_periods`, all of it by reference."""
    n, n_contacts = state.x.size, system.kt.size
    series, q = _scratch(system, state), np.empty(ORDER + 1)
    h, per_step = 2.0 * math.pi / steps, record.x.size // steps
    for period in range(change.size):
        x, v, force = state.x.copy(), state.v.copy(), state.force.copy()
        top_x, top_v, top_force = 0.0, 0.0, 0.0
        for step in range(steps):
            if not _step(system, state, step * h, h, dof, record, step * per_step, per_step, series, q):
                return CHATTER, period
            for i in range(n):
                top_x = max(top_x, abs(state.x[i]))
                top_v = max(top_v, abs(state.v[i]))
            for c in range(n_contacts):
                top_force = max(top_force, abs(state.force[c]))
        change[period] = max(
            largest_change(state.x, x, top_x),
            max(largest_change(state.v, v, max(top_x, top_v)), largest_change(state.force, force, top_force)),
        )
        if not finite(state):
            return NOT_FINITE, period + 1
        if change[period] < tolerance:
            return SETTLED, period + 1
    return RAN, change.size


@compiled
def run_steps(
    system: System, state: State, first: int, count: int, h: float, dof: int, record: Record
) -> int:
    """March `count` steps h from τ = first · h on; return RAN, CHATTER or NOT_FINITE.

    `record` takes a sample where each step begins, (count,).
    """
    held, here, kept = new_system(*system), new_state(*state), new_record(*record)
    return _run_steps(held, here, first, count, h, dof, kept)


@apart
def _run_steps(
    system: System, state: State, first: int, count: int, h: float, dof: int, record: Record
) -> int:
    """As `run_steps`, all of it by reference."""
    series, q = _scratch(system, state), np.empty(ORDER + 1)
    for step in range(count):
        start = (first + step) * h
        turn_matrices(system, start + 0.5 * h)
        if not _step(system, state, start, h, dof, record, step, 1, series, q):
            return CHATTER
    return RAN if finite(state) else NOT_FINITE
