"""The responses of one scene over one parameter that were computed, and the work that went into them.

The work allowed is counted in Newton iterations, in units of a frequency response, so that the same question
always ends at the same place, however fast the machine is.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch, Peak
from solver.continuation.branches.sweep import if_damped, sweep, walk_branch
from solver.continuation.extrema.extrema import Rival, crests
from solver.continuation.parameter_scale import scale_of
from solver.continuation.stretches import Course, Stretch
from solver.continuation.walk import ContinuationSettings, Pace
from solver.jit.fourier import Integer, Real
from solver.jit.timer import clock
from solver.scene.scene import Scene
from solver.studies.peaks.peak_lines import Line
from solver.studies.peaks.track_results import TrackStatus

RESPONSES = 100.0  # frequency responses whose work may be spent
LEAST_UNIT = 200.0  # Newton iterations: a response that is nearly linear takes fewer
LONGEST = 30.0  # times a response that one may take
AFTERWARDS = 0.25  # s that may be spent on what was found once the end has come
_EVERY = 0.1  # s between two questions to the caller


class HaltedError(Exception):
    """Nothing more is to be followed; the status says why."""

    def __init__(self, status: TrackStatus) -> None:
        self.status = status
        super().__init__(status.value)


class Allowance:
    """Asks the caller, and counts the work.

    Parameters
    ----------
    should_stop : the caller's; None: never.
    responses : whose work is allowed.
    """

    def __init__(self, should_stop: Callable[[], bool] | None, responses: float = RESPONSES) -> None:
        self._should_stop, self._responses = should_stop, responses
        self._asked = clock()
        self._ended = math.inf
        self._status: TrackStatus | None = None
        self._unit = math.inf

    @property
    def most(self) -> float:
        """Newton iterations allowed in all; infinity before the first response."""
        return self._responses * self._unit

    @property
    def longest(self) -> float:
        """Newton iterations after which a response is given up; infinity before the first."""
        return LONGEST * self._unit

    def measure(self, iterations: Sequence[int]) -> None:
        """Take the median of the Newton iterations of responses as the unit of work."""
        if iterations:
            self._unit = max(float(sorted(iterations)[len(iterations) // 2]), LEAST_UNIT)

    def ask(self) -> bool:
        """Return whether the caller wants it to end."""
        self._asked = clock()
        return self._should_stop is not None and self._should_stop()

    def due(self) -> bool:
        """Return whether the caller wants it to end, asking now and then only."""
        return clock() - self._asked >= _EVERY and self.ask()

    def check(self, spent: float) -> None:
        """Raise HaltedError if the end has come; `spent`: Newton iterations so far."""
        if self._status is not None:
            raise HaltedError(self._status)
        if self.due():
            raise HaltedError(TrackStatus.STOPPED)
        if spent > self.most:
            raise HaltedError(TrackStatus.WORK_USED_UP)

    def end(self, status: TrackStatus) -> None:
        """Say that the end has come: what was found may still be read, for a moment."""
        if self._status is None:
            self._status, self._ended = status, clock()

    @property
    def ended(self) -> bool:
        """Whether the end has come."""
        return self._status is not None

    @property
    def over(self) -> bool:
        """Whether what was found may not even be read any more, as far as that takes solving."""
        return clock() - self._ended > AFTERWARDS


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingPace:
    """How closely peaks are followed."""

    steps: Annotated[Pace, "Shares of the range; the error of each says how long the next is."]
    height_error: Annotated[float, "Relative error of the trapezoidal rule allowed in a step."]
    omega_error: Annotated[float, "Likewise."]
    above: Annotated[
        float,
        "Where a line is higher than this times the least highest peak of a sweep so far, it only has to "
        "show that it is; infinity: it is followed closely everywhere.",
    ]
    slack: Annotated[float, "Share of what it is higher by that its height may be wrong by then."]
    climb_from: Annotated[
        float,
        "Share of the range: step at which a peak that Newton's method does not find is looked for uphill.",
    ]


EVERYWHERE = TrackingPace(
    steps=Pace(first=0.02, least=1e-4, largest=0.125), height_error=3e-3, omega_error=1e-3, above=math.inf,
    slack=0.0, climb_from=math.inf,
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Glance:
    """One walk over the band at one z with fewer harmonics, its peaks as near as its points are."""

    z: Annotated[float, "Where."]
    crests: Annotated[tuple[Rival, ...], "Peaks of max|x|, highest first."]
    ks: Annotated[Integer, "The harmonics kept."]
    iterations: Annotated[int, "Newton iterations spent."]


def glance_at(
    z: float, scene: Scene, harmonics: int, effects: Effects | None, check: Callable[[], None]
) -> Glance:
    """Walk over the band of a scene; of a walk that does not reach its end the peaks met are returned.

    Parameters
    ----------
    z : what the scene stands for.
    check : called between stretches of the walk; it may raise to end it.
    """
    balance = build(scene, "frequency", harmonics=harmonics, frequency_hz=None, effects=effects)
    low, high = scene.observe.band
    stretches = []
    for stretch in walk_branch(Workspace.of(balance), low, high, ContinuationSettings()):
        stretches.append(stretch)
        check()
    return Glance(
        z=z,
        crests=tuple(
            crests(
                np.concatenate([stretch.solutions for stretch in stretches]),
                np.concatenate([stretch.measures for stretch in stretches]),
            )
        ),
        ks=balance.system.ks,
        iterations=stretches[-1].newton_iterations,
    )


class _TooLongError(Exception):
    """A sweep takes far longer than those before."""


def sweep_within(scene: Scene, harmonics: int, effects: Effects | None, allowance: Allowance) -> Branch:
    """Sweep over a band; HaltedError if the caller wants it to end. What takes far too long is given up.

    Of that one a beginning without peaks is returned, with all its Newton iterations: to look for peaks
    among its many points would cost several times what it has cost already.
    """
    spent = 0

    def watch(stretch: Stretch) -> None:
        nonlocal spent
        spent = stretch.newton_iterations

    def stop() -> bool:
        if allowance.due():
            raise HaltedError(TrackStatus.STOPPED)
        if spent > allowance.longest:
            raise _TooLongError
        return False

    try:
        return if_damped(sweep(
            scene, harmonics=harmonics, effects=effects, settings=ContinuationSettings(errors=False),
            course=Course(on_stretch=watch), should_stop=stop,
        ))  # fmt: skip
    except _TooLongError:
        settings = ContinuationSettings(peaks=False)
        begun = sweep(
            scene, harmonics=harmonics, effects=effects, settings=settings, should_stop=lambda: True
        )
        return replace(begun, newton_iterations=spent)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """One sweep over the band at one z; surprising if it found what no line had reached."""

    z: float
    branch: Branch
    surprising: bool
    peaks: Annotated[tuple[Peak, ...], "Those of the branch that count, highest first."]

    @property
    def top(self) -> float:
        """The highest peak [m]; −inf if there is none."""
        return self.peaks[0].value if self.peaks else -math.inf

    @property
    def seen(self) -> bool:
        """Whether the whole band was seen."""
        return self.branch.reached and bool(self.peaks)


SAME = (
    1e-3  # relative distance, in height and a fifth of it in frequency, within which two peaks are the same
)
FEWEST = 3  # harmonics of a glance
Counting = Callable[[Branch], tuple[Peak, ...]]
OnLook = Callable[[float, Branch], None] | None


def all_peaks(branch: Branch) -> tuple[Peak, ...]:
    """Return all peaks of a branch, highest first."""
    return branch.peaks


class Looking(ABC):
    """Sweeps over the band at values of one parameter; the lines are added by
    `solver.studies.peaks.tracker.Tracker`."""

    def __init__(
        self, scene: Scene, parameter: str, start: float, stop: float, harmonics: int,
        effects: Effects | None, pace: TrackingPace, allowance: Allowance | None = None,
    ) -> None:  # fmt: skip
        self.scale = scale_of(scene, parameter, start, stop)
        self.balance = build(
            scene, parameter, harmonics=harmonics, frequency_hz=scene.observe.band[0], effects=effects
        )
        self.lines: list[Line] = []
        self.looks: list[Look] = []
        self.glances: list[Glance] = []
        self.allowance = allowance or Allowance(None)
        self.on_look: OnLook = None
        self._effects, self._pace = effects, pace
        self._scene, self._harmonics = self.balance.scene, harmonics
        self._counting: Counting = all_peaks
        self._parts: list[Self] = []  # of the range
        self._lent = 0  # looks taken over from the whole range
        self.before = 0  # responses that told where to begin

    @property
    @abstractmethod
    def spent(self) -> int:
        """Evaluations of the balance in following peaks so far."""

    def envelope(self, z: Real) -> Real:
        """Return the height of the highest line; −inf where there is none."""
        heights = [line.heights(z) for line in self.lines]
        return np.max(heights, axis=0) if heights else np.full(z.size, -np.inf)

    def within(self, low: float, high: float, counting: Counting, looks: Sequence[Look]) -> Self:
        """Return the same for a part of the range, and for some of the peaks only.

        Parameters
        ----------
        low, high : values of the parameter in user units.
        counting : the peaks of a branch that count, highest first.
        looks : of these, to be taken over.
        """
        part = type(self)(
            self._scene, self.balance.parameter.path, low, high, self._harmonics, self._effects, self._pace,
            self.allowance,
        )  # fmt: skip
        part._counting, part._lent = counting, len(looks)
        for look in looks:
            z = min(max(part.scale.inside(self.scale.outside(look.z)), part.scale.low), part.scale.high)
            part.looks.append(replace(look, z=z, surprising=False, peaks=counting(look.branch)))
        self._parts.append(part)
        return part

    @property
    def sweeps(self) -> int:
        """How many responses were computed, those with fewer harmonics included."""
        mine = self.before + len(self.looks) - self._lent + len(self.glances)
        return mine + sum(part.sweeps for part in self._parts)

    @property
    def work(self) -> int:
        """Newton iterations of everything so far."""
        swept = sum(look.branch.newton_iterations for look in self.looks[self._lent :])
        swept += sum(glance.iterations for glance in self.glances)
        return swept + self.spent + sum(part.work for part in self._parts)

    def ask(self) -> None:
        """Raise HaltedError if the caller wants it to end."""
        if self.allowance.ask():
            raise HaltedError(TrackStatus.STOPPED)

    def check(self) -> None:
        """Raise HaltedError if the caller wants it to end, or the work allowed is used up."""
        self.allowance.check(self.work)

    def look(self, z: float) -> Look:
        """Sweep at z; one that takes far longer than those before is given up. Raises as `check`."""
        self.check()
        scene = self._scene.with_values({self.balance.parameter.path: self.scale.outside(z)})
        branch = sweep_within(scene, self._harmonics, self._effects, self.allowance)
        peaks = self._counting(branch)
        top = peaks[0].value if peaks else -math.inf
        higher = bool(self.lines) and top > float(self.envelope(np.array([z]))[0]) * (1.0 + SAME)
        look = Look(z=z, branch=branch, surprising=higher, peaks=peaks)
        self.looks.append(look)
        if self.on_look is not None and look.seen:
            self.on_look(self.scale.outside(z), branch)
        self.allowance.measure([one.branch.newton_iterations for one in self.looks])
        return look

    def glance(self, z: float) -> Glance:
        """Look at z with fewer harmonics, in which peaks lie nearly where they are."""
        path, fewer = self.balance.parameter.path, max(FEWEST, self._harmonics // 2)
        scene = self._scene.with_values({path: self.scale.outside(z)})
        glance = glance_at(z, scene, min(fewer, self._harmonics), self._effects, self.check)
        self.glances.append(glance)
        return glance
