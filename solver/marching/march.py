"""Time marching: the independent referee of the harmonic balance.

It shares nothing with the balance but the scene: matrices are assembled here, the whole annulus is marched
instead of one sector, and the friction law is followed in time. See `solver.marching.kernels.taylor` for the
scheme.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from numbers import Integral, Real

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from solver.errors import SettingError
from solver.jit.timer import clock
from solver.lab import from_lab
from solver.marching.kernels import march_state as kernel
from solver.marching.kernels import taylor as stepping
from solver.marching.march_equations import MarchEquations, as_sparse, equations_of_motion, limit_of, rows
from solver.marching.march_result import MarchResult, MarchStatus, describe, of_harmonic
from solver.results.watch import shows_progress
from solver.scene.cyclic.annulus import annulus
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Excitation, Scene
from solver.wording import listing

_FRICTION = (kernel.COULOMB, kernel.ELASTIC_NORMAL, kernel.CIRCLE, kernel.CIRCLE_SECOND)
_INSIDE = 1e-13  # share of the limit that a force stays below it: from there it slips by its rates


@dataclass(frozen=True, slots=True, kw_only=True)
class MarchStart:
    """A motion at the angle 0; what is not named is 0.

    Attributes
    ----------
    displacements, velocities : mapping
        Of degrees of freedom, by their names [m], [m/s].
    tractions : mapping
        Friction forces by the names in `MarchResult.contacts` [N]; one beyond the limit there is cut to it.
    """

    displacements: Mapping[str, float] = field(default_factory=dict)
    velocities: Mapping[str, float] = field(default_factory=dict)
    tractions: Mapping[str, float] = field(default_factory=dict)


def state_at(
    equations: MarchEquations,
    start: MarchStart,
    names: tuple[str, ...],
    omega: float,
    base: tuple[kernel.Real, kernel.Real] | None = None,
) -> kernel.State:
    """Return the state of a march.

    Parameters
    ----------
    equations : of the scene, at `omega` [rad/s]; names : of the rows of the contacts.
    base : displacements and velocities (n,) of a base and of what it drives, where they are prescribed.

    Raises
    ------
    SettingError
        An unknown name, a number that is not finite, or a traction of a contact without friction.
    """
    system, index = equations.system, equations.index
    n, rows = system.A.start.size - 1, system.kt.size
    x = _vector("displacements", start.displacements, index, n)
    v = _vector("velocities", start.velocities, index, n) / omega
    for vector, given in zip((x, v), base or (), strict=False):
        vector[:] = np.where(np.isnan(given), vector, given)
    if equations.observed not in index.values():
        for vector in (x, v):
            vector[equations.observed] = sum(factor * vector[at] for at, factor in equations.seen)
    load = system.N0 + (system.waves * np.cos(system.wave_phases)).sum(axis=1)
    moving = np.isin(system.law, (kernel.ELASTIC_NORMAL, kernel.CIRCLE))
    for c in np.flatnonzero(np.isin(system.law, _FRICTION)):
        if np.isfinite(system.kn[c]):
            load[c] += system.kn[c] * kernel.normal_slip(system, x, int(c))
    for c in np.flatnonzero(system.law == kernel.CIRCLE_SECOND):
        load[c] = load[c - 1]
    closed = np.where(moving, load, limit_of(system, load)) > 0.0
    slips = np.array([kernel.slip(system, x, c) for c in range(rows)])
    closed = np.where(system.law == kernel.GAP, slips > system.gap, closed) | (
        system.law == kernel.POLYNOMIAL
    )
    closed |= system.law == kernel.HISTORY
    mode = np.where(closed, kernel.STICK, kernel.SEPARATED).astype(np.int64)
    force = _forces(system, start.tractions, names, np.maximum(load, 0.0))
    own = np.zeros((rows, max(int(np.max(system.states, initial=0)), 1)))
    return kernel.State(x, v, force, mode, own)


def _vector(key: str, given: Mapping[str, float], index: Mapping[str, int], n: int) -> kernel.Real:
    vector = np.zeros(n)
    for dof, value in given.items():
        if dof not in index:
            raise SettingError(key, dof, f"must be of degrees of freedom: {listing(tuple(index))}")
        if not math.isfinite(value):
            raise SettingError(key, value, f"must be a number, of {dof!r}")
        vector[index[dof]] = value
    return vector


def _forces(
    system: kernel.System, tractions: Mapping[str, float], names: tuple[str, ...], load: kernel.Real
) -> kernel.Real:
    """Return the friction forces of the rows, none beyond its limit."""
    force, limits = np.zeros(system.kt.size), (1.0 - _INSIDE) * limit_of(system, load)
    for name, traction in tractions.items():
        if name not in names:
            raise SettingError("tractions", name, f"must be of contacts with friction: {listing(names)}")
        at = names.index(name)
        if system.law[at] not in _FRICTION or not math.isfinite(traction):
            raise SettingError("tractions", traction, f"must be a friction force in newtons, of {name!r}")
        force[at] = float(traction)
    for c in np.flatnonzero(np.isin(system.law, _FRICTION)):
        if system.law[c] == kernel.CIRCLE_SECOND:
            continue
        both = force[c : c + (2 if system.law[c] == kernel.CIRCLE else 1)]
        size, limit = float(np.hypot.reduce(both)), float(limits[c])
        if size > limit:
            both *= limit / size
    return force


FloatArray = NDArray[np.float64]
LEAST_STEPS = 64
RESOLVED = 0.375  # rad, turn of the fastest motion in a step of the finer of two runs
FINER = 8  # times the least steps, where steps are of a lower order
MOST_STEPS = 1_000_000
PERIODS = 20_000  # at most, for each step size
SAMPLES_PER_PERIOD = 2048
REPEATS = 1e-7  # relative change of velocities, forces and of the drift at which a part is said to drift
BALANCING = 30  # products with full matrices, of mixed units, in the bound of the fastest motion
MOST_PERIODS, WORK = 50, 2e6  # between two looks at progress and stop: periods, and their rough work
_STATUS = {
    kernel.SETTLED: MarchStatus.CONVERGED,
    kernel.CHATTER: MarchStatus.CHATTER,
    kernel.NOT_FINITE: MarchStatus.NOT_FINITE,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Plan:
    """What stays the same during a march."""

    system: kernel.System
    dof: int
    tolerance: float
    max_periods: int
    on_progress: Callable[[float, int], None] | None
    should_stop: Callable[[], bool] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """One march with one step size."""

    state: kernel.State
    record: kernel.Record
    status: MarchStatus
    steps: int
    changes: FloatArray
    drift: float

    @property
    def settled(self) -> bool:
        """The motion repeats."""
        return self.status is MarchStatus.CONVERGED


@shows_progress("march")
def march(
    scene: Scene,
    *,
    frequency_hz: float,
    steps_per_period: int | None = None,
    tolerance: float = 1e-10,
    max_periods: int = PERIODS,
    tractions: Mapping[str, float] | None = None,
    start: MarchStart | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> MarchResult:
    """March a scene in time from rest, contacts without force, until the motion repeats.

    A cyclic scene is marched as its whole annulus. The march is made twice, the second time with half the
    step and from where the first one ended; the difference gives the error estimate. A contact that sticks
    all the time keeps a force that depends on the history: `mean` and `max_abs` are then those of this start.
    Under given loads `half_peak_to_peak` is a property of the scene all the same; a load that moves, a gap or
    a nonlinear spring makes it depend on the history too (`solver.response.history_dependence`).

    Parameters
    ----------
    scene : Scene
        What to march.
    frequency_hz : float
        Excitation frequency [Hz].
    steps_per_period : int, optional
        Steps of the finer run; chosen from the fastest motion of the structure when left out.
    tolerance : float
        Largest change of displacements, velocities and contact forces over a period, relative to their
        largest values.
    max_periods : int
        Limit of the periods for each step size.
    tractions : mapping, optional
        Friction forces at the start by the names in `MarchResult.contacts` [N], what assembly may have left;
        a force beyond the limit there is cut to it. None of a contact that is not named.
    start : MarchStart, optional
        A motion to begin with instead of rest, such as `solver.start_of` reads from a
        response; tractions are then a part of it.
    on_progress : callable, optional
        Called with the fraction done (0 to 1, on the scale of the logarithm of the change) and the periods.
    should_stop : callable, optional
        Asked now and then; True ends the march with the status STOPPED.

    Raises
    ------
    SettingError
        An argument is out of its range, a degree of freedom or contact of the start is unknown, or has no
        friction, or the scene has a contact with a sampled circular limit.
    """
    begin = clock()
    _check(frequency_hz, tolerance, max_periods)
    if start is not None and tractions is not None:
        raise SettingError("tractions", dict(tractions), "must be those of `start` where that is given")
    scene, equations, steps = marched(scene, frequency_hz, steps_per_period)
    plan = _Plan(
        system=equations.system, dof=equations.observed, tolerance=tolerance, max_periods=max_periods,
        on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    names = row_names(scene)
    first = start or MarchStart(tractions=tractions or {})
    begins = state_at(equations, first, names, equations.system.omega)
    if scene.rigid_contact is not None:
        found = _twice_rigid(plan, equations, begins, steps, names, frequency_hz)
    else:
        found = _twice(plan, begins, steps, names, frequency_hz)
    if scene.observe.harmonic is not None:
        found = of_harmonic(found, scene.observe.harmonic)
    return replace(found, seconds=clock() - begin)


def marched(
    scene: Scene, frequency_hz: float, steps_per_period: int | None
) -> tuple[Scene, MarchEquations, int]:
    """Return a scene as it is marched at a frequency [Hz], its equations, and the steps of a period.

    Raises
    ------
    SettingError
        A scene that cannot be marched; a frequency, or steps, at which it cannot.
    """
    scene = whole(scene.at_frequency(frequency_hz))
    equations = equations_of_motion(scene, 2.0 * math.pi * frequency_hz)
    system, rigid = equations.system, scene.rigid_contact is not None
    if rigid:
        system = system._replace(kt=_finite(system.kt), kn=_finite(system.kn))
    steps = steps_for(system, scene.forces, steps_per_period, from_lab("proofs.moreau:STEPS") if rigid else 0)
    return scene, equations, steps


def whole(scene: Scene) -> Scene:
    """Return a scene as it is marched: a cyclic one as its annulus."""
    return annulus(scene) if scene.structure.has_sectors else scene


def row_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of what contacts are marched as."""
    return tuple(row.name for row in rows(scene.contacts))


def settled_state(
    scene: Scene, equations: MarchEquations, frequency_hz: float, tolerance: float,
    should_stop: Callable[[], bool] | None, turn: float = RESOLVED,
) -> tuple[kernel.State, MarchStatus]:  # fmt: skip
    """March a scene as its annulus, without rigid contacts, from rest until it repeats.

    `turn` is that of the fastest motion in a step [rad].

    Returns
    -------
    The state at the angle 0, velocities by that angle, and how the march ended.
    """
    omega = 2.0 * math.pi * frequency_hz
    plan = _Plan(
        system=equations.system, dof=equations.observed, tolerance=tolerance, max_periods=PERIODS,
        on_progress=None, should_stop=should_stop,
    )  # fmt: skip
    begins = state_at(equations, MarchStart(), row_names(scene), omega)
    run = _run(plan, begins, steps_for(equations.system, scene.forces, None, turn=turn), done=0)
    return run.state, run.status


def _twice(
    plan: _Plan, start: kernel.State, steps: int, names: tuple[str, ...], frequency_hz: float
) -> MarchResult:
    """March with double the step, then from its end with `steps` a period if it settled."""
    coarse = _run(plan, start, steps // 2, done=0)
    fine = _run(plan, coarse.state, steps, done=coarse.changes.size) if coarse.settled else coarse
    periods = coarse.changes.size + (fine.changes.size if coarse.settled else 0)
    if plan.on_progress is not None and fine.settled:
        plan.on_progress(1.0, periods)
    return describe(
        record=fine.record, coarse=coarse.record, order=order_of(plan.system),
        transient=_left_to_decay(coarse.changes, fine.changes), periods=periods, contacts=names,
        frequency_hz=frequency_hz, steps_per_period=fine.steps, status=fine.status, drift=fine.drift,
    )  # fmt: skip


def _twice_rigid(
    plan: _Plan, equations: MarchEquations, start: kernel.State, steps: int, names: tuple[str, ...],
    frequency_hz: float,
) -> MarchResult:  # fmt: skip
    """The same by Moreau's steps."""
    moreau = from_lab("proofs.moreau")
    x, v, runs, done = start.x.copy(), start.v.copy(), [], 0
    for each in (steps // 2, steps):

        def told(change: float, done: int = done) -> None:
            if plan.on_progress is not None:
                plan.on_progress(_fraction(change, moreau.REPEATS), done)

        x, v, record, status, changes = moreau.run(
            equations, x, v, each, plan.tolerance, plan.max_periods, plan.should_stop, told
        )
        runs.append((record, changes))
        done += changes.size
        if status is not MarchStatus.CONVERGED:
            break
    order = moreau.ORDER if np.all(np.isfinite(equations.system.kn)) else 1
    return describe(
        record=runs[-1][0], coarse=runs[0][0], order=order,
        transient=_left_to_decay(runs[0][1], runs[-1][1]), periods=done, contacts=names,
        frequency_hz=frequency_hz, steps_per_period=each, status=status, drift=0.0,
    )  # fmt: skip


def _finite(stiffnesses: FloatArray) -> FloatArray:
    """The stiffnesses with 0 for those that are infinite: they set no rate."""
    return np.where(np.isfinite(stiffnesses), stiffnesses, 0.0)


def _check(frequency_hz: float, tolerance: float, max_periods: int) -> None:
    check_frequency("frequency_hz", frequency_hz)
    if not (isinstance(tolerance, Real) and 1e-13 <= tolerance <= 1e-2):
        raise SettingError("tolerance", tolerance, "must be a number from 1e-13 to 1e-2")
    if not (isinstance(max_periods, Integral) and 1 <= max_periods <= 100_000_000):
        raise SettingError("max_periods", max_periods, "must be a whole number from 1 to 1e8")


def steps_for(
    system: kernel.System, forces: tuple[Excitation, ...], wanted: int | None, least: int = 0,
    turn: float = RESOLVED,
) -> int:  # fmt: skip
    """Steps of the finer run: the fastest motion turns less than `turn` in one of them [rad]."""
    full = system.W.value.size > system.W.start.size - 1 or bool(np.any(np.abs(system.L.value) != 1.0))
    # Bound of the largest rate of the motion with every contact stuck, per omega: vibration or decay.
    products = BALANCING if full else 1
    n = system.A.start.size - 1
    A, B, W, L, normal = (
        abs(as_sparse(each, n)) for each in (system.A, system.B, system.W, system.L, system.normal)
    )
    stuck = csr_array((n, n))
    for motions, k in ((L, system.kt), (normal, system.kn)):
        # Against the ground as if against another part.
        k = np.where(np.diff(motions.indptr) == 1, 2.0, 1.0) * k
        stuck = stuck + motions.T @ diags_array(k) @ motions
    stiffness = _largest(A + W @ stuck, products)
    damped = B + system.omega * (W @ (L.T @ diags_array(2.0 * system.damping) @ L))
    turns = 2.0 * math.pi * float(max(math.sqrt(stiffness), _largest(damped, products)))
    load = int(np.max(np.nonzero(system.waves)[1], initial=0)) + 1
    harmonic = max(load, *(force.harmonic for force in forces))
    least = max(least, LEAST_STEPS, 2 * math.ceil(0.25 * turns / turn), 16 * harmonic)
    finer = 2 if order_of(system) == kernel.ORDER else FINER
    chosen = max(2 * LEAST_STEPS, finer * least) if wanted is None else wanted
    if isinstance(chosen, Integral) and chosen % 2 == 0 and least <= chosen <= MOST_STEPS:
        return int(chosen)
    needs = f"structure, forces and loads need at least {least} steps per period at this frequency"
    raise SettingError("steps_per_period", chosen, f"must be an even number up to {MOST_STEPS}; {needs}")


def order_of(system: kernel.System) -> int:
    """Order of the steps: less than that of the series with laws given by functions."""
    given = system.law == kernel.HISTORY
    if np.any(given & (system.in_steps == 1)):
        return 2
    return 4 if np.any(given) else kernel.ORDER


def _largest(matrix: csr_array, products: int) -> float:
    """Bound of the spectral radius of a matrix that is not negative: its largest row sum, units balanced.

    Collatz: min max (P d)_i / d_i over d > 0 is the radius (Math. Z. 48 (1942) 221); powers of P give d.
    """
    scale = np.ones(matrix.shape[0])
    least = float("inf")
    for _ in range(products):
        grown = matrix @ scale
        rates = np.divide(grown, scale, out=np.zeros_like(grown), where=scale > 0.0)
        least = min(least, float(np.max(rates, initial=0.0)))
        if least == 0.0:
            break
        scale = grown / grown.max() + 1e-12 * scale
    return least


def _run(plan: _Plan, start: kernel.State, steps: int, *, done: int) -> _Run:
    """March until the motion repeats, then one period more with a record."""
    state = copied(start)
    nothing = _record(plan, 0)
    status, changes, fraction = MarchStatus.MAX_PERIODS, np.empty(0), 0.9 if done else 0.0
    drift, places = 0.0, [copied(state)]
    many = max(1, min(MOST_PERIODS, int(WORK / (steps * (state.x.size + 8 * state.force.size)))))
    while changes.size < plan.max_periods:
        chunk = np.empty(min(many, plan.max_periods - changes.size))
        code, periods = stepping.run_periods(
            plan.system, state, steps, plan.tolerance, plan.dof, nothing, chunk
        )
        changes = np.append(changes, chunk[:periods])
        if code != kernel.RAN:
            status = _STATUS[code]
            break
        places = [*places[-2:], copied(state)]
        drift = _drift(places) / chunk.size
        if drift > 0.0:
            status = MarchStatus.RATCHETS
            break
        if plan.on_progress is not None:
            fraction = max(fraction, _fraction(changes[-1], plan.tolerance))
            plan.on_progress(fraction, done + changes.size)
        if plan.should_stop is not None and plan.should_stop():
            status = MarchStatus.STOPPED
            break
    record = _record(plan, steps * math.ceil(SAMPLES_PER_PERIOD / steps))
    if status not in (MarchStatus.CHATTER, MarchStatus.NOT_FINITE):
        code, _ = stepping.run_periods(plan.system, state, steps, 0.0, plan.dof, record, np.empty(1))
        status = _STATUS.get(code, status) if code in (kernel.CHATTER, kernel.NOT_FINITE) else status
    drift = drift if status is MarchStatus.RATCHETS else 0.0
    return _Run(state=state, record=record, status=status, steps=steps, changes=changes, drift=drift)


def copied(state: kernel.State) -> kernel.State:
    """Return a state that is moved on without the other."""
    x, v, force, mode, own = (each.copy() for each in state)
    return kernel.State(x, v, force, mode, own)  # type: ignore[arg-type]


def _drift(places: list[kernel.State]) -> float:
    """How far a part has drifted between the last two of three states as far apart [m]; 0 if none has.

    All but the displacements is the same in all three, and these have moved on by the same twice.
    """
    if len(places) < 3:
        return 0.0
    first, second, third = places
    moved = third.x - second.x
    far = float(np.abs(moved).max(initial=0.0))
    if not far > REPEATS * float(np.abs(third.v).max(initial=0.0)):
        return 0.0
    same = (
        (third.v, second.v, third.v), (third.v, first.v, third.v),
        (third.force, second.force, third.force), (third.force, first.force, third.force),
        (moved, second.x - first.x, moved),
    )  # fmt: skip
    repeats = all(np.abs(a - b).max(initial=0.0) <= REPEATS * np.abs(c).max(initial=0.0) for a, b, c in same)
    return far if repeats else 0.0


def _record(plan: _Plan, n: int) -> kernel.Record:
    rows = plan.system.kt.size
    one, many = (n,), (rows, n)
    shapes = (one, one, many, many, many)
    return kernel.Record(*(np.full(shape, np.nan) for shape in shapes))


def _fraction(change: float, tolerance: float) -> float:
    """Progress of the first run on the scale of the logarithm of the change; it counts as nine tenths."""
    return 0.9 * min(max(math.log(max(change, tolerance)) / math.log(tolerance), 0.0), 1.0)


def _left_to_decay(coarse: FloatArray, fine: FloatArray) -> float:
    """What decay as fast as at the end of the coarse run leaves after the last change; at most 1."""
    if coarse.size == 0 or fine.size == 0:
        return 1.0
    tail = coarse[-20:]
    decay = float(tail[-1] / tail[0]) ** (1.0 / max(tail.size - 1, 1)) if tail[0] > 0.0 else 0.0
    return min(float(fine[-1]) * decay / (1.0 - decay), 1.0) if decay < 1.0 else 1.0
