"""What a time march works on: the equations, the state, the series of a step, and what it records."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.jit.decorators import compiled
from solver.jit.reference import referenced

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

ORDER = 8  # of the Taylor series; stable on the imaginary axis for h |lambda| < 3.4
# Laws of the contacts.
COULOMB, ELASTIC_NORMAL, GAP, POLYNOMIAL = 0, 1, 2, 3
CIRCLE, CIRCLE_SECOND = 4, 5  # two rows, one after the other, of a contact with a circular limit
HISTORY = 6  # given by functions, see `solver.marching.kernels.history`
# What a contact does; a slipping one has its direction, +1 or -1. A gap is closed (STICK) or open.
STICK, SEPARATED = 0, 2
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

    `pull` is scratch, a force a DOF; `turn` that of slips in space, see `solver.marching.kernels.circle`, and
    `given` (n_contacts, k) the force of laws given by functions.
    """

    x: Real
    v: Real
    force: Real
    load: Real
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


@compiled
def wave(k: int, angle: float) -> float:
    """Return the k-th derivative of the cosine."""
    turn = k % 4
    value = math.cos(angle) if turn % 2 == 0 else math.sin(angle)
    return value if turn in (0, 3) else -value


@compiled
def load_series(system: System, tau: float, h: float, series: Series) -> None:
    """Fill in the Taylor coefficients of the given normal loads from τ on, over a step h."""
    for c in range(system.kt.size):
        series.load[:, c] = 0.0
        series.load[0, c] = system.N0[c]
        for j in range(system.waves.shape[1]):
            factor, angle = system.waves[c, j], (j + 1) * tau + system.wave_phases[c, j]
            for k in range(ORDER + 1):
                series.load[k, c] += factor * wave(k, angle)
                factor *= (j + 1) * h / (k + 1)


@compiled
def load_rise(system: System, tau: float, c: int) -> float:
    """Return the derivative of the given load of contact c by tau."""
    rise = 0.0
    for j in range(system.waves.shape[1]):
        order = j + 1
        rise -= order * system.waves[c, j] * math.sin(order * tau + system.wave_phases[c, j])
    return rise


@compiled
def swing(system: System, c: int) -> float:
    """Return a bound of how far the given load of contact c goes from its mean."""
    size = 0.0
    for j in range(system.waves.shape[1]):
        size += abs(system.waves[c, j])
    return size


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
