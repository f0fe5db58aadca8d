"""`least_worn_peak`: the parameter with which contacts that wear are best, at the end of life or over it.

A wear coefficient f times as large is a clock that runs f times as fast: w(t; f α) = w(f t; α). Whatever f is
between two factors and whatever the time between two, the worst is therefore the largest amplitude of one
life between two instants of that clock. It is the largest of its local maxima, each of which has an exact
derivative; where two of them are as high is a corner, in which their tangents meet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np

from solver.arrays import FloatOrNaN, Real
from solver.continuation.parameter_scale import scale_of
from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from solver.results.base import Shown
from solver.results.base import Data, Views
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene
from stickslip.lab.wear_life.life import course_of
from stickslip.lab.wear_life.life_result import WearLifeStatus
from stickslip.lab.wear_life.mission import Mission
from stickslip.lab.wear_life.wearing import WearLaw

FEWEST_LOOKS = 3
MOST_CLOSING = 40
SHARP, LEVEL = 1e-8, 1e-10  # of the range, and relative to the height: where it ends


class WornStatus(Enum):
    """How the search ended; the value is a sentence a user can act on."""

    COMPLETED = "The worst amplitude is least there, of all basins that the first looks show."
    AT_BOUND = "The worst amplitude still falls at an end of the range: a wider range may do better."
    NO_RESPONSE = "No life could be followed to its end: look at one of them with `wear_life`."
    STOPPED = "Stopped on request: the best so far."


@dataclass(frozen=True, slots=True, kw_only=True)
class _LifeLook:
    """A value of the parameter with the worst amplitude of the life; infinite where it does not last."""

    z: float
    value: float
    slope: float
    hours: float
    first: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LeastWornPeak(Shown):
    """The best value of a parameter for contacts that wear, and the k values that were looked at."""

    VIEWS: ClassVar = Views("stickslip.lab.wear_life", "tables:least_worn_peak")
    DATA: ClassVar = Data(
        "least-worn-peak",
        {"look": "looked_at heights"},
        "parameter at worst worst_hours first",
        scene="scene",
    )
    JSON: ClassVar = (
        "scene parameter unit at worst worst_hours first looked_at heights completed=reached status seconds"
    )

    scene: Annotated[str, "Name of the scene."]
    status: Annotated[WornStatus, "How it ended."]
    parameter: Annotated[str, "Path of the parameter."]
    unit: Annotated[str, "Unit of its values."]
    at: Annotated[FloatOrNaN, "The best value."]
    worst: Annotated[FloatOrNaN, "The worst amplitude with it [m]."]
    worst_hours: Annotated[FloatOrNaN, "When that is, with the coefficient as it was given [h]."]
    first: Annotated[FloatOrNaN, "The amplitude before anything is worn [m]."]
    looked_at: Annotated[Real, "Every value looked at, in the order of the search, (k,)."]
    heights: Annotated[Real, "The worst amplitude of each [m], (k,)."]
    seconds: Annotated[float, "Time taken [s]."]


@shows_progress("least worn peak")
def least_worn_peak(
    scene: Scene, parameter: str, start: float, stop: float, mission: Mission, wear: WearLaw, *,
    from_hours: float | None = None, factors: Sequence[float] = (1.0, 1.0), looks: int = 9,
    tolerance: float = 1e-5, harmonics: int = 11, on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> LeastWornPeak:  # fmt: skip
    """Find the value of a parameter with which the amplitude is least at the end of life, or over it.

    Parameters
    ----------
    scene, mission, wear : as of `wear_life`, likewise what is not said here.
    parameter : path of what is chosen, for example ``shroud.N0``, its value before anything is worn.
    start, stop : its range in user units.
    from_hours : the amplitude counts from then on [h]: 0 over the whole life; at its end alone if left out.
    factors : the wear coefficients are anywhere from the first to the second times those given.
    looks : values over the range, on its scale, that the search begins with; it goes on in the best of them.

    Raises
    ------
    SettingError
        As `wear_life`; a range, factors or looks that are none.
    """
    begun = clock()
    low, high = checked_factors(factors)
    since, longest = checked_since(from_hours, mission.hours), replace(mission, hours=mission.hours * high)
    check_count("looks", looks, FEWEST_LOOKS, 1000)
    scale = scale_of(scene, parameter, start, stop)

    def look(z: float) -> _LifeLook:
        value = scale.outside(z)
        course = course_of(
            scene.with_values({parameter: value}), longest, wear, paths=(parameter,), tolerance=tolerance,
            harmonics=harmonics, should_stop=should_stop,
        )  # fmt: skip
        course.follow(None, should_stop)
        if course.status is not WearLifeStatus.COMPLETED:
            return _LifeLook(z=z, value=math.inf, slope=math.nan, hours=math.nan, first=math.nan)
        worst = course.maxima(since * low, longest.hours)[0]
        slope = float(worst.gradient[0]) * float(scale.by_z(np.array([value]))[0])
        first = course.stretches[0].begin.amplitude
        return _LifeLook(z=z, value=worst.amplitude, slope=slope, hours=worst.hours, first=first)

    search = _ClosingSearch(look, scale.low, scale.high, looks, on_progress, should_stop)
    status = search.run()
    best, known = search.best, bool(search.looked) and math.isfinite(search.best.value)
    return LeastWornPeak(
        scene=scene.name, status=status, parameter=parameter, unit=scale.parameter.unit,
        at=scale.outside(best.z) if known else math.nan, worst=best.value if known else math.nan,
        worst_hours=best.hours, first=best.first,
        looked_at=np.array([scale.outside(one.z) for one in search.looked]),
        heights=np.array([one.value for one in search.looked]), seconds=clock() - begun,
    )  # fmt: skip


def checked_since(from_hours: float | None, hours: float) -> float:
    """Return from when on the amplitude counts [h]."""
    since = hours if from_hours is None else from_hours
    if not isinstance(since, int | float) or isinstance(since, bool) or not 0.0 <= since <= hours:
        raise SettingError("from_hours", from_hours, f"must be from 0 to {hours}")
    return since


def checked_factors(factors: Sequence[float]) -> tuple[float, float]:
    """Return the least and the largest factor of the wear coefficients."""
    pair = list(factors)
    numbers = all(isinstance(one, int | float) and not isinstance(one, bool) for one in pair)
    if len(pair) != 2 or not numbers or not 0.0 < pair[0] <= pair[1] < math.inf:
        raise SettingError("factors", pair, "must be two numbers > 0, the first not above the second")
    return float(pair[0]), float(pair[1])


@dataclass(slots=True)
class _ClosingSearch:
    """Looks over a range, then closes in on the best of them from both sides."""

    look: Callable[[float], _LifeLook]
    low: float
    high: float
    looks: int
    on_progress: OnProgress
    should_stop: ShouldStop
    looked: list[_LifeLook] = field(default_factory=list)

    @property
    def best(self) -> _LifeLook:
        """The least so far."""
        return min(self.looked, key=lambda one: one.value)

    def run(self) -> WornStatus:
        """Search; return how it ended."""
        for z in np.linspace(self.low, self.high, self.looks).tolist():
            if self._stopped(z):
                return WornStatus.STOPPED
        at = sorted(self.looked, key=lambda one: one.z)
        best = at.index(self.best)
        if not math.isfinite(at[best].value):
            return WornStatus.NO_RESPONSE
        beyond = best + (1 if at[best].slope < 0.0 else -1)
        if not 0 <= beyond < len(at):
            return WornStatus.AT_BOUND
        left, right = sorted((at[best], at[beyond]), key=lambda one: one.z)
        for turn in range(MOST_CLOSING):
            if right.z - left.z <= SHARP * (self.high - self.low) or self._level(left, right):
                break
            if self._stopped(_between(left, right, turn)):
                return WornStatus.STOPPED
            left, right = _closer(left, right, self.looked[-1])
        if self.on_progress is not None:
            self.on_progress(1.0, len(self.looked))
        return WornStatus.COMPLETED

    def _stopped(self, z: float) -> bool:
        """Look at a value; return whether the caller wants it to end."""
        self.looked.append(self.look(z))
        if self.on_progress is not None:
            self.on_progress(len(self.looked) / (len(self.looked) + self.looks), len(self.looked))
        return self.should_stop is not None and self.should_stop()

    def _level(self, left: _LifeLook, right: _LifeLook) -> bool:
        """Return whether the tangents say that nothing between two looks is lower."""
        if not left.slope < 0.0 < right.slope:
            return False
        meet = _meeting(left, right)
        bound = left.value + left.slope * (meet - left.z)
        return bool(self.best.value - bound <= LEVEL * self.best.value)


def _meeting(left: _LifeLook, right: _LifeLook) -> float:
    """Return where the tangents of two looks meet."""
    rise = right.value - left.value + left.slope * left.z - right.slope * right.z
    return rise / (left.slope - right.slope)


def _between(left: _LifeLook, right: _LifeLook, turn: int) -> float:
    """Return where to look next: where tangents meet, or where the cubic is least, in turns."""
    width = right.z - left.z
    z = 0.5 * (left.z + right.z)
    if left.slope < 0.0 < right.slope:
        z = _meeting(left, right)
        if turn % 2:
            mean = left.slope + right.slope - 3.0 * (right.value - left.value) / width
            root = math.sqrt(max(mean**2 - left.slope * right.slope, 0.0))
            down = right.slope - left.slope + 2.0 * root
            z = right.z - width * (right.slope + root - mean) / down
    return min(max(z, left.z + 1e-3 * width), right.z - 1e-3 * width)


def _closer(left: _LifeLook, right: _LifeLook, middle: _LifeLook) -> tuple[_LifeLook, _LifeLook]:
    """Return the part between two looks that holds the least."""
    if not math.isfinite(middle.value) or middle.value > min(left.value, right.value):
        return (middle, right) if left.value > right.value else (left, middle)
    return (middle, right) if middle.slope < 0.0 else (left, middle)
