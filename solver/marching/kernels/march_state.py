"""What a time march works on: the equations, the state, the series of a step, and what it records."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled
from solver.jit.kernel_records import referenced

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

ORDER = 8  # of the Taylor series; stable on the imaginary axis for h |lambda| < 3.4
# Laws of the contacts.
COULOMB, ELASTIC_NORMAL, GAP, POLYNOMIAL = 0, 1, 2, 3
CIRCLE, CIRCLE_SECOND = 4, 5  # two rows, one after the other, of a contact with a circular limit
HISTORY = 6  # given by functions, see `solver.marching.kernels.history`
# What a contact does; a slipping one has its direction, +1 or -1. A gap is closed (STICK) or open.
STICK, SEPARATED = 0, 2
_INVERSE = 1.0 / np.maximum(np.arange(ORDER + 1), 1)
# How a run of periods ended.
RAN, SETTLED, CHATTER, NOT_FINITE = 0, 1, 2, 3


class SparseRows(NamedTuple):
    """A matrix in compressed sparse rows."""

    start: Whole
    column: Whole
    value: Real


class System(NamedTuple):
    """The equations in tau: x'' = W (force - L^T F) - A x - B x', with A, B and W sparse.

    W is the inverse of the mass matrix times omega^-2. L is that of the motions along which contacts pull,
    `kt` is also the stiffness of a gap spring. Of the laws elastic-normal and circle: the normal motions,
    their stiffness, and the part of the normal force that is in equilibrium at rest; `presses` is 0 where
    another row has that force already. `waves` and `wave_phases` (n_contacts, K) are of the given loads'
    harmonics 1 … K. `powers` (n_contacts, degree) are the coefficients of polynomial
    springs. Of laws given by functions: their numbers, whether they go from sample to sample, how many states
    they have, their parameters (n_contacts, MOST_OWN), their damping at rest [N s/m], and the frequency
    [rad/s].

    In a run through a range of frequencies the excitation is at the angle φ = turn[0] + turn[1] τ +
    turn[2] τ². `N0_course` and `rest_course` (2, n_contacts), `waves_course` (2, n_contacts, K) and
    `force_course` (2, n_forces) are what loads and forces gain by τ and τ²; `A_course` and `B_course`
    (3, entries) are the coefficients of the matrices by 1, τ and τ², which have their values of the middle of
    a step. What does not change is empty. `swing` (n_contacts,) bounds how far a given load goes from N0.
    """

    A: SparseRows
    B: SparseRows
    W: SparseRows
    force_dof: Whole
    force_amplitude: Real
    force_phase: Real
    force_harmonic: Whole
    L: SparseRows
    kt: Real
    mu: Real
    N0: Real
    waves: Real
    wave_phases: Real
    law: Whole
    normal: SparseRows
    kn: Real
    rest: Real
    presses: Real
    gap: Real
    powers: Real
    history: Whole
    in_steps: Whole
    states: Whole
    numbers: Real
    damping: Real
    omega: float
    turn: Real
    N0_course: Real
    rest_course: Real
    waves_course: Real
    force_course: Real
    A_course: Real
    B_course: Real
    swing: Real


class State(NamedTuple):
    """Motion and contacts at one instant; changed in place. `mode`: STICK, SEPARATED, +1 or -1.

    `own` (n_contacts, most) are the states of laws given by functions.
    """

    x: Real
    v: Real
    force: Real
    mode: Whole
    own: Real


class Series(NamedTuple):
    """Taylor coefficients over a step, row k belongs to s^k, s = 0..1; of u^j at [contact, j - 1, k].

    `push` [k, force] are the forces of the excitation. `pull` is scratch, a force a DOF, and so is `wave`,
    cosine and sine of an angle; `turn` that of slips in space, see `march_circle`, and
    `given` (n_contacts, k) the force of laws given by functions.
    """

    x: Real
    v: Real
    force: Real
    load: Real
    push: Real
    wave: Real
    pull: Real
    normal: Real
    power: Real
    turn: Real
    given: Real


class Record(NamedTuple):
    """Samples of one period, evenly spaced; empty arrays record nothing."""

    x: Real
    v: Real
    slip: Real
    force: Real
    load: Real


# Inside the compiled loops each of them is one pointer, as in `solver.contacts.kernels.system`.


new_system: Callable[..., System] = referenced("MarchSystem", __name__, System._fields)
new_state: Callable[..., State] = referenced("MarchState", __name__, State._fields)
new_series: Callable[..., Series] = referenced("MarchSeries", __name__, Series._fields)
new_record: Callable[..., Record] = referenced("MarchRecord", __name__, Record._fields)


@compiled
def product(rows: SparseRows, x: Real, row: int) -> float:
    """Return row `row` of a matrix times x."""
    total = 0.0
    for j in range(rows.start[row], rows.start[row + 1]):
        total += rows.value[j] * x[rows.column[j]]
    return total


@compiled
def slip(system: System, x: Real, c: int) -> float:
    """Return the relative motion of contact c."""
    return product(system.L, x, c)


@compiled
def pull_back(rows: SparseRows, row: int, force: float, pull: Real) -> None:
    """Subtract a force along a relative motion from what pulls at each DOF."""
    for j in range(rows.start[row], rows.start[row + 1]):
        pull[rows.column[j]] -= rows.value[j] * force


def steady(waves: Real) -> dict[str, Real]:
    """Return the fields of a system that say how a run goes, at one frequency, where nothing changes."""
    names = ("N0_course", "rest_course", "force_course", "A_course", "B_course")
    return {
        "turn": np.array([0.0, 1.0, 0.0]), "swing": np.abs(waves).sum(axis=1),
        "waves_course": np.empty((2, 0, 0)), **{name: np.empty((2, 0)) for name in names},
    }  # fmt: skip


@compiled
def _wave_series(
    turn: Real, order: float, lead: float, tau: float, h: float, cosine: Real, sine: Real
) -> None:  # fmt: skip
    """Fill in the Taylor coefficients of cosine and sine of order · φ + lead from τ on, over a step h."""
    at, rate, bend = turn[0], turn[1], turn[2]
    first, second = order * (rate + 2.0 * bend * tau) * h, 2.0 * order * bend * h * h
    angle = order * (at + (rate + bend * tau) * tau) + lead
    cosine[0], sine[0] = math.cos(angle), math.sin(angle)
    cosine[1], sine[1] = -first * sine[0], first * cosine[0]
    for k in range(2, ORDER + 1):
        cosine[k] = -(first * sine[k - 1] + second * sine[k - 2]) * _INVERSE[k]
        sine[k] = (first * cosine[k - 1] + second * cosine[k - 2]) * _INVERSE[k]


@compiled
def _add_wave(size: float, rise: float, bend: float, tau: float, h: float, wave: Real, to: Real) -> None:
    """Add (size + rise τ + bend τ²) times a cosine, from τ on."""
    here, first, second = size + (rise + bend * tau) * tau, (rise + 2.0 * bend * tau) * h, bend * h * h
    for k in range(to.size):
        to[k] += here * wave[k]
    if first != 0.0 or second != 0.0:
        for k in range(1, to.size):
            to[k] += first * wave[k - 1]
        for k in range(2, to.size):
            to[k] += second * wave[k - 2]


@compiled
def _add_course(course: Real, sign: float, tau: float, h: float, to: Real) -> None:
    """Add course[0] τ + course[1] τ² from τ on, with a sign."""
    to[0] += sign * (course[0] + course[1] * tau) * tau
    to[1] += sign * (course[0] + 2.0 * course[1] * tau) * h
    to[2] += sign * course[1] * h * h


@compiled
def load_series(system: System, tau: float, h: float, series: Series) -> None:
    """Fill in the Taylor coefficients of the given normal loads from τ on, over a step h.

    `series.normal` begins with what is in equilibrium at rest, taken away.
    """
    turn, cosine, sine, own = system.turn, series.wave[0], series.wave[1], system.waves_course
    for c in range(system.kt.size):
        load, normal = series.load[:, c], series.normal[:, c]
        load[:] = 0.0
        normal[:] = 0.0
        load[0], normal[0] = system.N0[c], -system.rest[c]
        if system.N0_course.size > 0:
            _add_course(system.N0_course[:, c], 1.0, tau, h, load)
            _add_course(system.rest_course[:, c], -1.0, tau, h, normal)
        for j in range(system.waves.shape[1]):
            rise, bend = (own[0, c, j], own[1, c, j]) if own.size > 0 else (0.0, 0.0)
            size = system.waves[c, j]
            if size != 0.0 or rise != 0.0 or bend != 0.0:
                _wave_series(turn, j + 1.0, system.wave_phases[c, j], tau, h, cosine, sine)
                _add_wave(size, rise, bend, tau, h, cosine, load)


@compiled
def push_series(system: System, tau: float, h: float, series: Series) -> None:
    """Fill in the Taylor coefficients of the forces of the excitation from τ on, over a step h."""
    turn, cosine, sine, own = system.turn, series.wave[0], series.wave[1], system.force_course
    for e in range(system.force_dof.size):
        _wave_series(turn, system.force_harmonic[e], system.force_phase[e], tau, h, cosine, sine)
        push = series.push[:, e]
        push[:] = 0.0
        rise, bend = (own[0, e], own[1, e]) if own.size > 0 else (0.0, 0.0)
        _add_wave(system.force_amplitude[e], rise, bend, tau, h, cosine, push)


@compiled
def load_rise(system: System, tau: float, c: int) -> float:
    """Return the derivative of the given load of contact c by tau."""
    turn, total, own = system.turn, 0.0, system.waves_course
    angle = turn[0] + (turn[1] + turn[2] * tau) * tau
    rate = turn[1] + 2.0 * turn[2] * tau
    if system.N0_course.size > 0:
        total += system.N0_course[0, c] + 2.0 * system.N0_course[1, c] * tau
    for j in range(system.waves.shape[1]):
        order, size = j + 1, system.waves[c, j]
        place = order * angle + system.wave_phases[c, j]
        if own.size > 0:
            size += (own[0, c, j] + own[1, c, j] * tau) * tau
            total += (own[0, c, j] + 2.0 * own[1, c, j] * tau) * math.cos(place)
        total -= order * rate * size * math.sin(place)
    return total


@compiled
def turn_matrices(system: System, tau: float) -> None:
    """Give the matrices their values at tau, where they change in the course of the run."""
    for course, values in ((system.A_course, system.A.value), (system.B_course, system.B.value)):
        for i in range(course.shape[1]):
            values[i] = course[0, i] + (course[1, i] + course[2, i] * tau) * tau


@compiled
def normal_slip(system: System, x: Real, c: int) -> float:
    """Return the normal motion of contact c."""
    return product(system.normal, x, c)


@compiled
def power_series(system: System, series: Series, c: int, k: int) -> float:
    """Fill in coefficient k of every power of the motion of contact c; return that of its force."""
    power = series.power[c]
    power[0, k] = slip(system, series.x[k], c)
    total = system.powers[c, 0] * power[0, k]
    for j in range(1, power.shape[0]):
        value = 0.0
        for i in range(k + 1):
            value += power[j - 1, i] * power[0, k - i]
        power[j, k] = value
        total += system.powers[c, j] * value
    return total


@compiled
def motion_size(system: System, series: Series, c: int, normal: bool) -> float:
    """Return a bound of a relative motion of contact c in the step."""
    total = 0.0
    for k in range(series.x.shape[0]):
        x = series.x[k]
        total += abs(normal_slip(system, x, c) if normal else slip(system, x, c))
    return total


@compiled
def largest_change(now: Real, before: Real, scale: float) -> float:
    """Return the largest change of a number, relative to `scale` if that is above 0."""
    change = 0.0
    for i in range(now.size):
        change = max(change, abs(now[i] - before[i]))
    return change / scale if scale > 0.0 else change


@compiled
def finite(state: State) -> bool:
    """Return whether motion and velocity are finite numbers."""
    total = 0.0
    for i in range(state.x.size):
        total += state.x[i] + state.v[i]
    return math.isfinite(total)
