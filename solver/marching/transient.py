"""A run through a range of frequencies: run-up, run-down, a sine sweep, a ring-down.

What happens between two changes of state is followed by the Taylor steps of the march, every change located;
the frequency, and along an engine-order line what follows the speed, change within the steps.

Time is the angle τ = ω₁ t of the highest frequency f₁ of the run, ω₁ = 2π f₁. From f₀ on at the rate a [Hz/s]
the excitation turns by φ = 2π (f₀ t + a t²/2). Along an engine-order line loads, forces and matrices are
polynomials of the second degree of the frequency, and so of τ: three scenes on the line give them.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.arrays import Real
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.marching.kernels import march_state as kernel
from solver.marching.kernels import taylor as stepping
from solver.marching.march import (
    RESOLVED,
    MarchStart,
    copied,
    order_of,
    row_names,
    settled_state,
    state_at,
    steps_for,
    whole,
)
from solver.marching.march_equations import (
    MarchEquations,
    as_sparse,
    base_begins,
    base_over,
    equations_of_motion,
    in_modes,
    moved_to,
)
from solver.marching.march_result import MarchStatus, TransientResult, TransientStatus, turning_points
from solver.results.watch import OnProgress, ShouldStop, part_of, shows_progress
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

_POWERS = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [2.0, -4.0, 2.0]])
"""Coefficients of a polynomial of the second degree from its values at 0, 1/2 and 1."""
_BETWEEN = 2.0  # more than such a polynomial is between them, over the largest of the three


@dataclass(frozen=True, slots=True)
class Ramp:
    """A part of a run in which the frequency changes linearly."""

    begin_hz: Annotated[float, "Frequency where it begins [Hz]."]
    end_hz: Annotated[float, "Frequency where it ends [Hz]."]
    seconds: Annotated[float, "How long it takes [s]."]
    driven: Annotated[bool, "Whether forces of harmonics from 1 on act."] = True

    def cycles(self, seconds: NDArray[Any]) -> Real:
        """Turns of the excitation since it began, at times since then [s]."""
        rate = (self.end_hz - self.begin_hz) / self.seconds
        return np.asarray((self.begin_hz + 0.5 * rate * seconds) * seconds)

    def frequency(self, seconds: NDArray[Any]) -> Real:
        """Frequency [Hz] at times since it began [s]."""
        return np.asarray(self.begin_hz + (self.end_hz - self.begin_hz) / self.seconds * seconds)


def check(scene: Scene) -> None:
    """Raise SettingError where a scene cannot be followed while its frequency changes."""
    scene.observe.check_whole("a run through a range of frequencies")
    if scene.rigid_contact is not None:
        wanted = "must have a finite stiffness in a run through a range of frequencies"
        raise SettingError("scene", f"contact {scene.rigid_contact}", wanted)


def equations_over(scene: Scene, ramp: Ramp, omega: float, turned: float) -> MarchEquations:
    """Return the equations of a ramp.

    Parameters
    ----------
    omega : of the unit of time, τ = omega t [rad/s].
    turned : cycles of the excitation before.

    Raises
    ------
    SettingError
        The scene cannot be marched.
    """
    end = ramp.seconds * omega
    hertz = np.linspace(ramp.begin_hz, ramp.end_hz, 3)
    first = equations_of_motion(whole(scene.at_frequency(float(hertz[0]))), omega, swept=ramp.driven)
    system = first.system
    rate = 0.5 * (ramp.end_hz - ramp.begin_hz) / ramp.seconds * 2.0 * math.pi / omega**2
    turn = np.array([2.0 * math.pi * math.fmod(turned, 1.0), 2.0 * math.pi * ramp.begin_hz / omega, rate])
    system = system._replace(turn=turn)
    if scene.speed_order is not None and ramp.begin_hz != ramp.end_hz:
        rest = (
            equations_of_motion(whole(scene.at_frequency(float(f))), omega, swept=ramp.driven).system
            for f in hertz[1:]
        )
        system = _following([system, *rest], end)
    if ramp.driven and any(force.base for force in scene.excitation):
        ends = [[e.amplitude for e in scene.at_frequency(f).excitation if e.base] for f in hertz[[0, 2]]]
        if ends[0] != ends[1]:
            wanted = "must not follow the speed in a run through a range of frequencies"
            raise SettingError("excitation", "amplitude of a base", wanted)
        system = base_over(whole(scene), system, float(turn[1]), 2.0 * rate)
    if not ramp.driven:
        off = np.where(system.force_harmonic == 0, system.force_amplitude, 0.0)
        system = system._replace(force_amplitude=off)
    return replace(first, system=system)


def _following(systems: list[kernel.System], end: float) -> kernel.System:
    """Return the first of three systems, evenly from τ = 0 to `end`, with what changes from there on."""
    scale = end ** -np.arange(3.0)

    def polynomial(values: Sequence[Real]) -> Real:
        found = np.tensordot(_POWERS, np.array(values), axes=1)
        return np.asarray(found * scale.reshape(-1, *[1] * (found.ndim - 1)))

    def gained(name: str) -> Real:
        return polynomial([getattr(each, name) for each in systems])[1:]

    first = systems[0]
    A, A_course = _matrices([each.A for each in systems], polynomial)
    B, B_course = _matrices([each.B for each in systems], polynomial)
    swing = np.max([each.swing + np.abs(each.N0 - first.N0) for each in systems], axis=0)
    return first._replace(
        A=A, B=B, A_course=A_course, B_course=B_course, N0_course=gained("N0"), rest_course=gained("rest"),
        waves_course=gained("waves"), force_course=gained("force_amplitude"), swing=_BETWEEN * swing,
    )  # fmt: skip


def _matrices(
    given: list[kernel.SparseRows], polynomial: Callable[[Sequence[Real]], Real]
) -> tuple[kernel.SparseRows, Real]:
    """The first of three matrices on the pattern of all, and its coefficients; none if all are equal."""
    n = given[0].start.size - 1
    found = [as_sparse(each, n) for each in given]
    if all(abs(each - found[0]).nnz == 0 or abs(each - found[0]).max() == 0.0 for each in found[1:]):
        return given[0], np.empty((2, 0))
    pattern = csr_array(sum(abs(each) for each in found))
    pattern.sort_indices()
    row, column = pattern.nonzero()
    values = [each.toarray()[row, column] for each in found]
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    return kernel.SparseRows(start.astype(np.int64), column.astype(np.int64), values[0].copy()), polynomial(
        values
    )


MOST_WINDOWS = 2000  # of the envelope, over the whole run
MOST_STEPS = 2**28  # of a run
MOST = 1e9  # Hz and s
FINEST = 5  # times that steps are halved to meet the tolerance
SETTLED = 1e-10  # relative change over a period at the first frequency
_CHUNK = 16_384  # steps between two looks at progress and stop
_BETWEEN_SAMPLES = 4  # order of the cubics between samples
# rad, turn of the fastest motion in the finer of the first two runs, the series being stable up to 3.4: what
# motions as fast as that do to the largest amplitude is for the runs with finer steps to say.
_STABLE = 1.5
_SHARE = 0.5  # of what is left, that one more run with finer steps counts as
_STATUS = {kernel.CHATTER: TransientStatus.CHATTER, kernel.NOT_FINITE: TransientStatus.NOT_FINITE}


@shows_progress("transient")
def transient(
    scene: Scene,
    *,
    begin_hz: float | None = None,
    end_hz: float | None = None,
    rate_hz_per_s: float | None = None,
    ramp_seconds: float | None = None,
    rates: Sequence[float] = (),
    ring_down_seconds: float = 0.0,
    from_rest: bool = False,
    start: MarchStart | None = None,
    tolerance: float = 1e-6,
    steps_per_period: int | None = None,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> TransientResult:
    """Run through a range of frequencies at a constant rate, then perhaps let the motion ring down.

    Along an engine-order line (`speed_order`) loads, forces and matrices follow the speed as it changes. The
    run is made with steps and with half of them until the largest amplitude changes by less than the
    tolerance.

    Parameters
    ----------
    scene : what is run through; a cyclic scene as its whole annulus.
    begin_hz, end_hz : frequency at the beginning and at the end [Hz], the scene's band if left out; a
        run-down begins at the higher one.
    rate_hz_per_s, ramp_seconds : how fast the frequency changes [Hz/s], or how long that takes [s]; one of
        them, the latter where both frequencies are equal.
    rates : several of them [Hz/s] in place of both: a run at each, of which the slowest is told in full.
    ring_down_seconds : how long the motion is followed after that, with no force but constant ones [s].
    from_rest : begin at rest, contacts without force; else in the motion that repeats at `begin_hz`. A base
        moves from the beginning as prescribed, and what is counted from it rests relative to it.
    start : a motion to begin with instead of both.
    tolerance : of the largest amplitude, relative.
    steps_per_period : steps in a period of the highest frequency; chosen by the tolerance when left out.
    on_progress : called with the fraction done and the turns of the excitation.
    should_stop : asked now and then; True ends the run with the status STOPPED.

    Raises
    ------
    SettingError
        An argument out of its range, a rigid contact.
    """
    began = clock()
    if len(rates):
        single = partial(
            transient, scene, begin_hz=begin_hz, end_hz=end_hz, ramp_seconds=ramp_seconds, start=start,
            ring_down_seconds=ring_down_seconds, from_rest=from_rest, tolerance=tolerance,
            steps_per_period=steps_per_period, should_stop=should_stop,
        )  # fmt: skip
        given = {} if rate_hz_per_s is None else {"rate_hz_per_s": rate_hz_per_s}
        return _at_rates(single, given, rates, on_progress, began)
    ramps = ramps_of(
        scene, begin_hz=begin_hz, end_hz=end_hz, rate_hz_per_s=rate_hz_per_s, ramp_seconds=ramp_seconds,
        ring_down_seconds=ring_down_seconds,
    )  # fmt: skip
    run = _Passage(scene, ramps, modal=start is None)
    if not (isinstance(tolerance, numbers.Real) and 1e-12 <= tolerance <= 0.1):
        raise SettingError("tolerance", tolerance, "must be a number from 1e-12 to 0.1")
    if start is not None and from_rest:
        raise SettingError("from_rest", from_rest, "must not be given beside `start`")
    state, status = _start(run, start, from_rest=from_rest, should_stop=should_stop)
    if state is None:
        return _result(run, _Envelope(run, 0), status, math.nan, began)
    watch = _Watch(on_progress, should_stop)
    found, status, error = _refined(run, state, steps_per_period, tolerance, watch)
    if on_progress is not None and found.complete:
        on_progress(1.0, int(run.cycles))
    return _result(run, found, status, error, began)


def _at_rates(
    single: Callable[..., TransientResult], given: Mapping[str, float], rates: Sequence[float],
    on_progress: OnProgress, began: float,
) -> TransientResult:  # fmt: skip
    """Run at each rate, the fastest first; return the slowest run with the largest amplitudes of all."""
    for key, value in given.items():
        raise SettingError(key, value, "must not be given beside `rates`")
    found: list[TransientResult] = []
    order = sorted(rates, reverse=True)
    costs = np.cumsum([0.0, *(1.0 / max(float(rate), 1e-300) for rate in order)])
    for i, rate in enumerate(order):
        watch = part_of(on_progress, costs[i] / costs[-1], costs[i + 1] / costs[-1])
        found.append(single(rate_hz_per_s=rate, on_progress=watch))
        if found[-1].status is TransientStatus.STOPPED:
            break
    worst = next((one.status for one in found if not one.reached), TransientStatus.FINISHED)
    return replace(
        found[-1], rates=np.array(order[: len(found)]), status=worst,
        rates_max_abs=np.array([one.max_abs for one in found]), seconds=clock() - began,
    )  # fmt: skip


def _refined(
    run: _Passage, state: kernel.State, wanted: int | None, tolerance: float, watch: _Watch
) -> tuple[_Envelope, TransientStatus, float]:
    """Follow a run with steps and half of them until its largest amplitude is known; return its error too."""
    steps = run.steps(wanted)
    found, status = _followed(run, state, steps // 2, watch)
    error = math.nan
    for _ in range(FINEST if wanted is None else 1):
        if status is not TransientStatus.FINISHED:
            break
        coarse = found.largest
        found, status = _followed(run, state, steps, watch)
        error = abs(found.largest - coarse) / (2.0**run.order - 1.0)
        error /= found.largest if found.largest > 0.0 else 1.0
        if error <= tolerance or 2 * steps * run.periods > MOST_STEPS:
            break
        steps *= 2
    if status is TransientStatus.FINISHED and error > tolerance:
        status = TransientStatus.INACCURATE
    return found, status, error


class _Passage:
    """A scene and its ramps, time τ = omega t of the highest frequency."""

    def __init__(self, scene: Scene, ramps: tuple[Ramp, ...], *, modal: bool) -> None:
        self.scene, self.ramps = scene, ramps
        self.omega = 2.0 * math.pi * max(ramps[0].begin_hz, ramps[0].end_hz)
        self.turned, self.passed = [0.0], [0.0]  # turns of the excitation, and time [s], before each and all
        self.equations: list[MarchEquations] = []
        for ramp in ramps:
            own = equations_over(scene, ramp, self.omega, self.turned[-1])
            self.equations.append(in_modes(own) if modal and scene.speed_order is None else own)
            self.turned.append(self.turned[-1] + float(ramp.cycles(np.array(ramp.seconds))))
            self.passed.append(self.passed[-1] + ramp.seconds)

    @property
    def cycles(self) -> float:
        """Turns of the excitation in the whole run."""
        return self.turned[-1]

    @property
    def periods(self) -> float:
        """Periods of the highest frequency in the whole run."""
        return self.passed[-1] * self.omega / (2.0 * math.pi)

    @property
    def order(self) -> int:
        """Order of the largest amplitude in the step."""
        system = self.equations[0].system
        return 2 if system.A_course.size else min(order_of(system), _BETWEEN_SAMPLES)

    @property
    def turn(self) -> float:
        """Turn of the fastest motion in a step of the finer of the first two runs [rad]."""
        return _STABLE if self.order == _BETWEEN_SAMPLES else RESOLVED

    def steps(self, wanted: int | None) -> int:
        """Steps in a period of the highest frequency, of the finer of the first two runs."""
        first, systems = self.ramps[0], [self.equations[0].system]
        if self.scene.speed_order is not None and first.end_hz != first.begin_hz:
            there = whole(self.scene.at_frequency(first.end_hz))
            systems.append(equations_of_motion(there, self.omega).system)
        steps = max(steps_for(system, self.scene.forces, wanted, turn=self.turn) for system in systems)
        if steps * self.periods > MOST_STEPS:
            most = MOST_STEPS / steps / self.periods
            wanted_seconds = (
                f"must be so that at most {MOST_STEPS:.0e} steps are made: {most:.2g} of the time"
            )
            raise SettingError("ramp_seconds", first.seconds, wanted_seconds)
        return steps


class _Envelope:
    """The extremes of the observed motion in windows of at least one turn of the excitation."""

    def __init__(self, run: _Passage, steps: int) -> None:
        self._run, self.steps = run, steps
        count = max(1, min(int(run.cycles), MOST_WINDOWS))
        self._turns = run.cycles / count  # in a window
        self.high, self.low = np.full(count, -np.inf), np.full(count, np.inf)
        self.time, self.frequency_hz = np.full(count, np.nan), np.full(count, np.nan)
        self.largest, self.at_seconds, self.at_hz = 0.0, math.nan, math.nan
        self.complete = False

    def add(self, number: int, begin: float, step: float, x: Real, slopes: Real) -> None:
        """Take samples of a ramp, (n + 1,), the first at `begin` [s], with their slopes a step [m]."""
        ramp = self._run.ramps[number]
        before = self._run.passed[number]
        at, place, between = turning_points(x, slopes)
        seconds = begin + step * np.arange(x.size)
        turned = self._run.turned[number] + ramp.cycles(seconds[:-1])
        window = np.minimum((turned / self._turns).astype(np.int64), self.high.size - 1)
        for where, when, values in (
            (window, seconds[:-1], x[:-1]), (window, seconds[1:], x[1:]),
            (window[at], begin + step * (at + place), between),
        ):  # fmt: skip
            np.maximum.at(self.high, where, values)
            np.minimum.at(self.low, where, values)
            top = int(np.argmax(np.abs(values))) if values.size else 0
            if values.size and abs(values[top]) > self.largest:
                self.largest, self.at_seconds = float(abs(values[top])), before + float(when[top])
                self.at_hz = float(ramp.frequency(when[top : top + 1])[0])
        first = np.flatnonzero(np.isnan(self.time[window]))[::-1]  # the earliest of a window is written last
        self.time[window[first]] = before + seconds[first]
        self.frequency_hz[window[first]] = ramp.frequency(seconds[first])


@dataclass(slots=True)
class _Watch:
    """Who watches a run that is made several times: the share done rises in steps that become smaller."""

    on_progress: OnProgress
    should_stop: ShouldStop
    done: float = 0.0

    def part(self, share: float, cycles: float) -> bool:
        """Tell the share done of one more run; return whether to stop."""
        if self.on_progress is not None:
            self.on_progress(self.done + share * (1.0 - self.done) * _SHARE, int(cycles))
        return self.should_stop is not None and self.should_stop()

    def end(self) -> None:
        """One more run is complete."""
        self.done += (1.0 - self.done) * _SHARE


def _followed(
    run: _Passage, start: kernel.State, steps: int, watch: _Watch
) -> tuple[_Envelope, TransientStatus]:
    """Follow a run with so many steps in a period of the highest frequency."""
    state, envelope = copied(start), _Envelope(run, steps)
    for number, (ramp, equations) in enumerate(zip(run.ramps, run.equations, strict=True)):
        system, dof = equations.system, equations.observed
        system = system._replace(
            A=system.A._replace(value=system.A.value.copy()), B=system.B._replace(value=system.B.value.copy())
        )
        whole_steps = math.ceil(ramp.seconds * run.omega / (2.0 * math.pi) * steps)
        h = ramp.seconds * run.omega / whole_steps
        for first in range(0, whole_steps, _CHUNK):
            count = min(_CHUNK, whole_steps - first)
            rows = np.empty((system.kt.size, count))
            record = kernel.Record(np.empty(count), np.empty(count), rows, rows.copy(), rows.copy())
            code = stepping.run_steps(system, state, first, count, h, dof, record)
            if code != kernel.RAN:
                return envelope, _STATUS[code]
            x, v = np.append(record.x, state.x[dof]), np.append(record.v, state.v[dof])
            envelope.add(number, first * h / run.omega, h / run.omega, x, h * v)
            seconds = (first + count) * h / run.omega
            cycles = run.turned[number] + float(ramp.cycles(np.array(seconds)))
            if watch.part((run.passed[number] + seconds) / run.passed[-1], cycles):
                return envelope, TransientStatus.STOPPED
    envelope.complete = True
    watch.end()
    return envelope, TransientStatus.FINISHED


def ramps_of(
    scene: Scene, *, begin_hz: float | None, end_hz: float | None, rate_hz_per_s: float | None,
    ramp_seconds: float | None, ring_down_seconds: float,
) -> tuple[Ramp, ...]:  # fmt: skip
    """Return what is to be run through, by the arguments of `transient`.

    Raises
    ------
    SettingError
        An argument out of its range, a scene that cannot be run through.
    """
    check(scene)
    low, high = scene.observe.band
    begin = _number("begin_hz", low if begin_hz is None else begin_hz)
    end = _number("end_hz", high if end_hz is None else end_hz)
    if max(begin, end) == 0.0:
        raise SettingError("end_hz", end, "must be > 0, or `begin_hz`")
    rate, seconds = rate_hz_per_s, ramp_seconds
    if rate is not None and seconds is not None:
        raise SettingError("rate_hz_per_s", rate, "must not be given beside `ramp_seconds`")
    if seconds is None:
        if begin == end:
            raise SettingError("ramp_seconds", None, "must be given where both frequencies are equal")
        if rate is None:
            raise SettingError("rate_hz_per_s", None, "must be given, or `ramp_seconds`")
        seconds = abs(end - begin) / _number("rate_hz_per_s", rate, above=True)
    ramps = [Ramp(begin, end, _number("ramp_seconds", seconds, above=True))]
    if _number("ring_down_seconds", ring_down_seconds) > 0.0:
        ramps.append(Ramp(end, end, ring_down_seconds, driven=False))
    return tuple(ramps)


def _number(key: str, value: object, *, above: bool = False) -> float:
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        number = float(value)
        if 0.0 <= number < MOST and (number > 0.0 or not above):
            return number
    raise SettingError(key, value, f"must be a number {'>' if above else '>='} 0 and < {MOST:g}")


def _start(
    run: _Passage, start: MarchStart | None, *, from_rest: bool, should_stop: ShouldStop
) -> tuple[kernel.State | None, TransientStatus]:
    """Return the state a run begins with; None where the motion at the first frequency does not repeat."""
    if start is not None or from_rest:
        scene, first = whole(run.scene), run.equations[0]
        turning = 2.0 * math.pi * run.ramps[0].begin_hz / run.omega
        moves = any(force.base for force in scene.excitation)
        base = base_begins(scene, first.index, first.system, turning) if moves else None
        begins = state_at(first, start or MarchStart(), row_names(scene), run.omega, base)
        return begins, TransientStatus.FINISHED
    hertz = run.ramps[0].begin_hz
    scene, equations = _at_first(run)
    state, status = settled_state(scene, equations, hertz, SETTLED, should_stop, turn=run.turn)
    if status is MarchStatus.STOPPED:
        return None, TransientStatus.STOPPED
    if status is not MarchStatus.CONVERGED:
        return None, TransientStatus.NOT_SETTLED
    state.v[:] *= 2.0 * math.pi * hertz / run.omega
    moved_to(state, equations, run.equations[0])
    return state, TransientStatus.FINISHED


def _at_first(run: _Passage) -> tuple[Scene, MarchEquations]:
    """Return the scene at the first frequency and its equations, where it can be marched there."""
    hertz = run.ramps[0].begin_hz
    rest = "or the run begin from rest (`from_rest`)"
    if hertz == 0.0:
        raise SettingError("begin_hz", hertz, f"must be > 0, {rest}")
    check_frequency("begin_hz", hertz)
    scene = whole(run.scene.at_frequency(hertz))
    equations = in_modes(equations_of_motion(scene, 2.0 * math.pi * hertz))
    try:
        steps_for(equations.system, scene.forces, None, turn=run.turn)
    except SettingError as error:
        wanted = f"must need fewer steps than {error.value} a period, {rest}"
        raise SettingError("begin_hz", hertz, wanted) from error
    return scene, equations


def check_passage(
    scene: Scene, ramps: tuple[Ramp, ...], steps_per_period: int | None, *, from_rest: bool
) -> None:
    """Raise SettingError where `transient` would for the steps of a run."""
    run = _Passage(scene, ramps, modal=True)
    run.steps(steps_per_period)
    if not from_rest:
        _at_first(run)


def _result(
    run: _Passage, found: _Envelope, status: TransientStatus, error: float, began: float
) -> TransientResult:
    """Read the result; of a run that did not end, as far as it went."""
    seen = np.isfinite(found.time)
    first, *rest = run.ramps
    some = bool(np.any(seen))
    return TransientResult(
        scene=run.scene.name, dof=run.scene.observe.dof, status=status,
        max_abs=found.largest if some else math.nan, at_hz=found.at_hz, at_seconds=found.at_seconds,
        time=found.time[seen], frequency_hz=found.frequency_hz[seen], high=found.high[seen],
        low=found.low[seen], begin_hz=first.begin_hz, end_hz=first.end_hz, ramp_seconds=first.seconds,
        ring_down_seconds=sum(each.seconds for each in rest), steps_per_period=found.steps,
        error_estimate=error, seconds=clock() - began,
    )  # fmt: skip
