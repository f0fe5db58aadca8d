"""The kinds `mode`, a nonlinear mode over its amplitude, and `decay`, the amplitude of a ring-down over time.

Curves of a mode come of tests in phase resonance or of decaying vibrations. Their model is the nonlinear mode
of the scene (`solver.modes`), whose frequency and damping ratio have exact derivatives by an adjoint at each
amplitude.

Of a ring-down the motion stays on the mode as it decays, and its energy E falls by what is dissipated. With s
= ln a and the mode's damping ratio that is ω³ζa² a second, so that

    ds/dt = −ζ(a) ω(a) / g,     g = (dE/ds) / (ω a)².

Of springs that store what they take, E is an integral of ω dJ with the action J = ½ ω a² (N. N. Bogoliubov,
Y. A. Mitropolsky, Asymptotic Methods in the Theory of Non-Linear Oscillations, 1961, chapter 1), and g = 1 +
½ d ln ω/ds. Friction under loads that stand stores less. Unloading follows the backbone f(x) doubled (G.
Masing, 1926), so that a cycle whose amplitude falls by Δa is not closed, and takes a f'(a) Δa besides the
area of the loop: at the reversal dE = a (k + f'(a)) da. The losses tell f': of a closed loop W = 8∫f da −
4 a f, so that f'' = −W''/(4a), and with η = W/a²

    ω² g = ω₀² − ¼ dη/ds − ¾ η − ½ ∫η ds,      η = 2π (ζω² − ζ₀ω₀ω),

from the smallest amplitude up, where what dissipates is viscous. The frequency of what decays is ω √(1 − ζ²).
So t + c = τ(s), the integral from the largest amplitude down. ln(ζω), ln ω and g at evenly spaced s go
through cubic splines, which are linear in their values: derivatives by parameters are those of the same.

When the decay began nobody knows as well as the rest of it: the shift c of each run is fitted to its
amplitudes for every value of the parameters, and what is left is a function of these alone, with its exact
derivatives (variable projection: G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from scipy.interpolate import CubicSpline

from optim.identification.data.measured import (
    Column,
    CurveRun,
    DataKind,
    MeasuredRows,
    Predicted,
    RunModel,
    columns_of,
    whole_word,
)
from optim.identification.data.measured_table import Dimension, Table, check_monotone, check_sign
from optim.problem.variables import Real
from solver.errors import SettingError
from solver.modes.at_amplitudes import ModePoints, mode_at_amplitudes
from solver.modes.mode_curve import ModeState
from solver.modes.nonlinear_mode import at_nodal_diameter, check_mode
from solver.scene.scene import Scene
from solver.scene.scene_harmonics import even_harmonics_reason

SHARPER = 0.02  # noise of a frequency relative to it, where that of a damping ratio is 1
_MOST_DAMPING = 1.0
WORDS = {
    "mode": "Number of the mode, 1 the slowest, contacts as they are at rest; 1.",
    "nodal_diameter": "Of a disk, negative for a backward wave; that of the engine order.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeRun(CurveRun):
    """Frequency and damping ratio over the amplitude."""

    mode: Annotated[int, "Its number."]
    nodal_diameter: Annotated[int | None, "Of a cyclic structure."]

    KIND_NAME: ClassVar = "mode"
    UNIT_WORDS: ClassVar = "frequencies [Hz] and damping ratios"
    TOLD: ClassVar = {
        "modal_amplitude": "modal amplitude a [√kg m]",
        "frequency": "frequency [Hz]",
        "damping_ratio": "damping ratio",
    }
    SHARES: ClassVar = {"frequency": SHARPER}  # frequencies are measured much better

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _ModeModel(self, scene, paths, harmonics)

    def to_json(self, fitted: Real, sd: Real) -> dict[str, object]:
        """As the base says, with the number of the mode."""
        return {**CurveRun.to_json(self, fitted, sd), "mode": self.mode}


class FollowedMode(RunModel):
    """A nonlinear mode, followed from one set of values to the next.

    Parameters
    ----------
    scene, mode, nodal_diameter : whose, and which one.
    paths, harmonics : of the derivatives, and kept.
    """

    def __init__(
        self, scene: Scene, mode: int, nodal_diameter: int | None, paths: Sequence[str], harmonics: int
    ) -> None:
        self._scene, self._mode, self._nodal_diameter = scene, mode, nodal_diameter
        self._paths, self._harmonics = tuple(paths), max(harmonics, 1)
        self._points: list[ModeState | None] = []

    def forget(self) -> None:
        """As the base says."""
        self._points = []

    def looked_at(self, values: Mapping[str, float], amplitudes: Real) -> tuple[list[str], ModePoints]:
        """Return the names of the contacts, and the mode at amplitudes."""
        here = self._scene.with_values(values)
        found = mode_at_amplitudes(
            here, amplitudes, self._paths, mode=self._mode, nodal_diameter=self._nodal_diameter,
            harmonics=self._harmonics, guesses=self._points,
        )  # fmt: skip
        self._points = found.points
        return [contact.name for contact in here.contacts], found


class _ModeModel(FollowedMode):
    """The nonlinear mode of the scene at the amplitudes measured."""

    def __init__(self, run: ModeRun, scene: Scene, paths: Sequence[str], harmonics: int) -> None:
        super().__init__(scene, run.mode, run.nodal_diameter, paths, harmonics)
        self._run = run

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        names, found = self.looked_at({**values, **self._run.conditions}, self._run.x)
        both = {
            "frequency": (found.frequency_hz, found.by_frequency),
            "damping_ratio": (found.damping_ratio, found.by_damping),
        }
        states = {name: found.states[:, c] for c, name in enumerate(names)}
        return Predicted.of([both[name] for name in self._run.data], states)


def read_mode(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(2, "points")
    check_sign(table, "modal_amplitude", positive=True)
    check_monotone(table, "modal_amplitude")
    at, data, sd = columns_of(table, _AT, _OF_A_MODE)
    large = np.flatnonzero(data.get("damping_ratio", np.zeros(0)) >= _MOST_DAMPING)
    if large.size:
        raise table.error(int(large[0]), "damping_ratio", "must be a ratio below 1, 0.02 for 2 %")
    mode, diameter = checked_mode(scene, table)
    return ModeRun(
        source=table.source, conditions=dict(table.conditions), at=at, data=data, sd=sd, mode=mode,
        nodal_diameter=diameter,
    )  # fmt: skip


def checked_mode(scene: Scene, table: Table) -> tuple[int, int | None]:
    """Return number and nodal diameter of the mode that the head says.

    Raises
    ------
    DataError
        There is none.
    """
    said, diameter = whole_word(table, "mode"), whole_word(table, "nodal_diameter")
    mode = 1 if said is None else said
    try:
        check_mode(at_nodal_diameter(scene, diameter), mode)
    except SettingError as error:
        raise table.refusal(table.words.get(error.name, mode), str(error)) from error
    return mode, diameter


_AT, _OF_A_MODE = ("modal_amplitude",), {"frequency": "frequency_sd", "damping_ratio": "damping_sd"}

_AMPLITUDE_AND_FREQUENCY = (
    Column(
        "modal_amplitude", Dimension.NUMBER,
        "a [√kg m], of a displacement divided by the mass-normalised mode shape there.",
    ),
    Column("frequency", Dimension.FREQUENCY, "Of the excitation; of the mode beside `modal_amplitude`."),
)  # fmt: skip
_FREQUENCY_SD = Column(
    "frequency_sd", Dimension.FREQUENCY, "Standard deviation of each frequency, if it is known."
)

MODE = DataKind(
    name="mode",
    help="Frequency and damping ratio of a nonlinear mode over its amplitude: phase resonance, decay.",
    columns=(
        *_AMPLITUDE_AND_FREQUENCY,
        Column("damping_ratio", Dimension.NUMBER, "ζ of the mode."),
        _FREQUENCY_SD,
        Column("damping_sd", Dimension.NUMBER, "Standard deviation of each damping ratio, if it is known."),
    ),
    marks=(("modal_amplitude", "frequency"), ("modal_amplitude", "damping_ratio")),
    words=WORDS,
    read=read_mode,
)  # fmt: skip


_BEGINS, _ENDS = 1.5, 20.0  # factors on the amplitudes measured between which the mode is looked at
_STEP = 0.08  # of ln a between its points
_FINE = 8  # places between two of them at which τ is summed up
_FEWEST = 8  # points of the mode that make a course
_MOST_ROUNDS, _CLOSE = 50, 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class DecayRun(CurveRun):
    """Amplitude, and perhaps frequency, over the time."""

    mode: Annotated[int, "Number of the mode."]
    nodal_diameter: Annotated[int | None, "Of a cyclic structure."]
    range: Annotated[tuple[float, float], "Largest and smallest amplitude measured [√kg m]."]

    KIND_NAME: ClassVar = "decay"
    UNIT_WORDS: ClassVar = "modal amplitudes [√kg m]"
    FITTED_BESIDES: ClassVar = 1  # the shift of the time
    TOLD: ClassVar = {
        "modal_amplitude": "modal amplitude a [√kg m]",
        "frequency": "frequency [Hz]",
        "time": "time [s]",
    }
    SHARES: ClassVar = {"frequency": SHARPER}  # frequencies are measured much better

    def model(self, scene: Scene, paths: Sequence[str], harmonics: int) -> RunModel:
        """As the base says."""
        return _DecayModel(self, scene, paths, harmonics)


@dataclass(frozen=True, slots=True, kw_only=True)
class _AtTimes:
    """s = ln a at times, and how it moves."""

    s: Annotated[Real, "NaN beyond the course, (m,)."]
    speed: Annotated[Real, "ds/dt, (m,)."]
    by_paths: Annotated[Real, "ds/dp at fixed times, (m, n_paths)."]
    bend: Annotated[Real, "Derivative of the speed by s, (m,)."]
    speed_by_paths: Annotated[Real, "Derivatives of the speed by the paths at fixed times, (m, n_paths)."]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Course:
    """s = ln a over the time, on a grid of s from the largest amplitude down."""

    s: Annotated[Real, "Falling, (g,)."]
    tau: Annotated[Real, "Time since the largest [s] and its derivatives by the paths, (g, 1 + n_paths)."]
    damping: Annotated[CubicSpline, "ln(ζω) and its derivatives by the paths over s, (1 + n_paths,)."]
    frequency: Annotated[CubicSpline, "ln ω and its derivatives likewise."]
    stored: Annotated[CubicSpline, "g and its derivatives likewise."]

    def at(self, t: Real) -> _AtTimes:
        """Return the course at times."""
        s = np.interp(t, self.tau[:, 0], self.s, left=math.nan, right=math.nan)
        place = np.interp(t, self.tau[:, 0], np.arange(self.s.size, dtype=np.float64))
        before = np.minimum(place.astype(np.int64), self.s.size - 2)
        for _ in range(2):  # Newton's steps from the line between two places
            s = s - (self._time(s, before)[:, 0] - t) / -self.paces(s)[:, 0]
        paces = self.paces(s)
        speed = -1.0 / paces[:, 0]
        by_paths = -speed[:, None] * self._time(s, before)[:, 1:]
        bend = speed * (self.damping(s, 1) - self.stored(s, 1) / self.stored(s))[:, 0]
        by_speed = bend[:, None] * by_paths - speed[:, None] * paces[:, 1:] / paces[:, :1]
        return _AtTimes(s=s, speed=speed, by_paths=by_paths, bend=bend, speed_by_paths=by_speed)

    def paces(self, s: Real) -> Real:
        """Return −dτ/ds and its derivatives by the paths, (m, 1 + n_paths)."""
        damping, stored = self.damping(s), self.stored(s)
        pace = np.exp(-damping[:, :1])
        found = pace * (stored - stored[:, :1] * damping)
        found[:, :1] = pace * stored[:, :1]
        return np.asarray(found)

    def hertz(self, along: _AtTimes) -> tuple[Real, Real]:
        """Return the frequency of the decaying motion [Hz], (m,), and its derivatives by the paths at s."""
        told, damping = self.frequency(along.s), self.damping(along.s)
        zeta2 = np.exp(2.0 * (damping[:, 0] - told[:, 0]))
        hertz = np.exp(told[:, 0]) * np.sqrt(np.maximum(1.0 - zeta2, 0.0)) / (2.0 * math.pi)
        less = (zeta2 / np.maximum(1.0 - zeta2, 1e-300))[:, None]

        def moved(by: Real, by_damping: Real) -> Real:
            return np.asarray(hertz[:, None] * (by - less * (by_damping - by)))

        by_s = moved(self.frequency(along.s, 1)[:, :1], self.damping(along.s, 1)[:, :1])
        return hertz, moved(told[:, 1:], damping[:, 1:]) + by_s * along.by_paths

    def _time(self, s: Real, before: np.ndarray) -> Real:
        """Return τ and its derivatives at s by Simpson's rule from the place before, (m, 1 + n_paths)."""
        begin, span = self.s[before], self.s[before] - s
        inner = self.paces(begin) + 4.0 * self.paces(begin - 0.5 * span) + self.paces(s)
        return np.asarray(self.tau[before] + span[:, None] * inner / 6.0)


class _DecayModel(FollowedMode):
    """The decay along the nonlinear mode of the scene."""

    def __init__(self, run: DecayRun, scene: Scene, paths: Sequence[str], harmonics: int) -> None:
        super().__init__(scene, run.mode, run.nodal_diameter, paths, harmonics)
        self._run = run
        rubs = all(contact.RUBBING for contact in scene.contacts)
        self._slides = rubs and even_harmonics_reason(scene, paths) is None
        high, low = math.log(_BEGINS * run.range[0]), math.log(run.range[1] / _ENDS)
        self._s = np.linspace(high, low, math.ceil((high - low) / _STEP) + 1)

    def evaluate(self, values: Mapping[str, float]) -> Predicted:
        """As the base says."""
        run = self._run
        names, found = self.looked_at({**values, **run.conditions}, np.exp(self._s))
        course = _course(self._s, found, slides=self._slides)
        if course is None:
            return Predicted.nothing(run.observations.size, len(self._paths))
        shift, by_shift = _shift(course, run)
        along = course.at(run.x + shift)
        along = replace(along, by_paths=along.by_paths + np.outer(along.speed, by_shift))
        columns = {"modal_amplitude": (np.exp(along.s), np.exp(along.s)[:, None] * along.by_paths)}
        columns["frequency"] = course.hertz(along)
        near = np.abs(np.nan_to_num(along.s)[:, None] - self._s).argmin(axis=1)
        states = {name: found.states[near, c] for c, name in enumerate(names)}
        return Predicted.of([columns[name] for name in run.data], states)


def _course(s: Real, found: ModePoints, *, slides: bool) -> _Course | None:
    """Return the course of the time, as far down as the mode was found and dissipates.

    `slides`: contacts are friction under loads that stand, and store as Masing's rule has it.
    """
    good = np.isfinite(found.damping_ratio) & (found.damping_ratio > 0.0)
    good &= np.isfinite(found.by_frequency).all(axis=1) & np.isfinite(found.by_damping).all(axis=1)
    count = int(np.argmin(np.append(good, False)))
    if count < _FEWEST:
        return None
    s, zeta, hertz = s[:count], found.damping_ratio[:count], found.frequency_hz[:count]
    by_omega = found.by_frequency[:count] / hertz[:, None]
    omega = np.column_stack([np.log(2.0 * math.pi * hertz), by_omega])
    rate = omega + np.column_stack([np.log(zeta), found.by_damping[:count] / zeta[:, None]])
    fine = np.linspace(s[0], s[-1], _FINE * (count - 1) + 1)
    up, damping, frequency = s[::-1], CubicSpline(s[::-1], rate[::-1]), CubicSpline(s[::-1], omega[::-1])
    stored = _stored_by_friction(up, rate[::-1], omega[::-1]) if slides else 0.5 * frequency(up, 1)
    stored[:, 0] += 0.0 if slides else 1.0
    course = _Course(
        s=fine, tau=np.zeros((fine.size, omega.shape[1])), damping=damping, frequency=frequency,
        stored=CubicSpline(up, stored),
    )  # fmt: skip
    ends, middles = course.paces(fine), course.paces(0.5 * (fine[1:] + fine[:-1]))
    steps = np.diff(-fine)[:, None] / 6.0 * (ends[:-1] + 4.0 * middles + ends[1:])
    np.cumsum(steps, axis=0, out=course.tau[1:])
    return course if (ends[:, 0] > 0.0).all() else None


def _stored_by_friction(s: Real, rate: Real, omega: Real) -> Real:
    """Return g with its derivatives at rising s, (n, 1 + n_paths), of ln(ζω) and ln ω with theirs."""

    def grown(logs: Real) -> Real:
        """Return e to the power of logarithms, with derivatives."""
        sizes = np.exp(logs[:, :1])
        return np.hstack([sizes, sizes * logs[:, 1:]])

    loss = 2.0 * math.pi * (grown(rate + omega) - grown(rate[:1] + omega))
    of_s = CubicSpline(s, loss)
    stiff = grown(2.0 * omega[:1]) - 0.25 * of_s(s, 1) - 0.75 * loss - 0.5 * of_s.antiderivative()(s)
    squares = np.exp(-2.0 * omega[:, :1])
    found = squares * (stiff - 2.0 * stiff[:, :1] * omega)
    found[:, :1] = squares * stiff[:, :1]
    return np.asarray(found)


def _shift(course: _Course, run: DecayRun) -> tuple[float, Real]:
    """Return the shift c of the time with which the amplitudes fit best, and its derivatives by the paths.

    Σ w (a − y)² is least where g = Σ w (a − y) ∂a/∂c is 0, so dc/dp = −g_p / g_c. Of amplitudes not known the
    first is the largest of those that the run is like.
    """
    t, y = run.x, run.data["modal_amplitude"]
    known = bool(np.isfinite(y).all())
    shift = float(np.interp(-math.log(y[0] if known else run.range[0]), -course.s, course.tau[:, 0]) - t[0])
    if not known:
        begin = course.at(np.array([shift + t[0]]))
        return shift, np.asarray(-begin.by_paths[0] / begin.speed[0])
    noise = run.noise_shape(run.observations)[: t.size] if run.sd is None else run.sd["modal_amplitude"]
    low = float(-t[0])
    high = max(float(course.tau[-1, 0] - t[-1]), low)
    for _ in range(_MOST_ROUNDS):
        along = course.at(t + shift)
        inside = np.isfinite(along.s)
        if not inside.any():
            break
        a, weights = np.exp(along.s[inside]), 1.0 / noise[inside] ** 2
        by, rest = a * along.speed[inside], a - y[inside]
        before, step = shift, float(np.sum(weights * by * rest) / np.sum(weights * by**2))
        shift = min(max(shift - step, low), high)
        if abs(shift - before) <= _CLOSE * float(t[-1] - t[0]):
            break
    along = course.at(t + shift)
    inside = np.isfinite(along.s)
    a, weights, speed = np.exp(along.s[inside]), 1.0 / noise[inside] ** 2, along.speed[inside]
    rest, by_paths = weights * (a - y[inside]), along.by_paths[inside]
    held = not low < shift < high
    g_c = float(np.sum(weights * (a * speed) ** 2 + rest * a * speed * (speed + along.bend[inside])))
    g_p = (weights * a**2 * speed) @ by_paths + (rest * a) @ (
        by_paths * speed[:, None] + along.speed_by_paths[inside]
    )
    return shift, np.zeros(len(g_p)) if held or g_c == 0.0 else np.asarray(-g_p / g_c)


def read_decay(scene: Scene, table: Table) -> MeasuredRows:
    """As `DataKind.read` says."""
    table.need(4, "points")
    check_monotone(table, "time")
    at, data, sd = columns_of(table, ("time",), _OF_A_DECAY)
    falls = np.flatnonzero(np.diff(at["time"]) <= 0.0)
    if falls.size:
        raise table.error(int(falls[0]) + 1, "time", "must rise from row to row")
    amplitude = data["modal_amplitude"]
    if not amplitude[-1] < amplitude[0]:
        wanted = "must fall: the last is to be below the first"
        raise table.error(len(table) - 1, "modal_amplitude", wanted)
    mode, diameter = checked_mode(scene, table)
    return DecayRun(
        source=table.source, conditions=dict(table.conditions), at=at, data=data, sd=sd, mode=mode,
        nodal_diameter=diameter, range=(float(amplitude.max()), float(amplitude.min())),
    )  # fmt: skip


_OF_A_DECAY = {"frequency": "frequency_sd", "modal_amplitude": "modal_amplitude_sd"}

DECAY = DataKind(
    name="decay",
    help="The amplitude of a ring-down over time, and its frequency.",
    columns=(
        Column("time", Dimension.TIME, "Of each sample; of a loop without it, even over one period."),
        *_AMPLITUDE_AND_FREQUENCY,
        _FREQUENCY_SD,
        Column("modal_amplitude_sd", Dimension.NUMBER, "Standard deviation of each, of a decay, if known."),
    ),
    marks=(("time", "modal_amplitude"),),
    words=WORDS,
    read=read_decay,
)  # fmt: skip

KIND = (MODE, DECAY)
