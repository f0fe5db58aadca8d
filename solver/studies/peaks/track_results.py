"""Tracked peaks: what `solver.studies.peaks.track_peak` returns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple

from solver.arrays import Real
from solver.continuation.branch import unsettled
from solver.errors import SettingError
from solver.results.base import Data, Drawn, MadeOfResponses, Views
from solver.results.known import NOTHING_DAMPS, OF_X, Known, Measured
from solver.results.told import Piece

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from solver.continuation.branch import Branch
    from solver.scene.scene import Scene


class TrackStatus(Enum):
    """How tracking ended; the value is a sentence a user can act on."""

    TRACKED = "The peaks were tracked over the whole range; every sweep made to check found nothing higher."
    AT_BOUND = (
        "The highest peak is least at an end of the range and still falls there: a wider range may do better."
    )
    PLATEAU = (
        "The highest peak is least, and the same, over an interval of the parameter: the value in it was "
        "chosen by what else changes."
    )
    FLAT = "The highest peak does not depend on the parameter: every value in the range is as good."
    GAPS = "Somewhere in the range no peak could be tracked: use a shorter range or more harmonics."
    UNPROVEN = (
        "The sweeps went on finding higher peaks, or the peaks could not be followed to both sides of their "
        "least height: use a shorter range, or compare sweeps of your own."
    )
    OTHER_BRANCH = (
        "The highest tracked peak is on a response that a sweep does not reach: compare sweeps of your own."
    )
    NO_RESPONSE = "No frequency response could be computed: start somewhere else, or use more harmonics."
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "The tracking was stopped by the caller."
    WORK_USED_UP = (
        "The work allowed was used up before the optimum was proven; the best value seen is given: use a "
        "shorter range or fewer harmonics, or compare sweeps of your own."
    )

    @property
    def proven(self) -> bool:
        """Whether an optimum with this status is proven over the whole range."""
        return self in (TrackStatus.TRACKED, TrackStatus.AT_BOUND, TrackStatus.PLATEAU, TrackStatus.FLAT)


class ChosenBy(Enum):
    """What decided where an optimum is; the value is what a user reads."""

    HIGHEST_PEAK = "highest peak"
    NEXT_PEAK = "next peak"
    BAND = "resonance band"
    LEAST_VALUE = "least value"
    NOTHING = "nothing depends on it"


class Exchange(NamedTuple):
    """Where another peak becomes the highest: value of the parameter, and the height there [m]."""

    at: float
    peak: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ActivePeak(Piece):
    """A peak that is highest at the optimum."""

    frequency: Annotated[float, "Where it is [Hz]."]
    value: Annotated[float, "Its height [m]."]
    slope: Annotated[float, "d value / d parameter."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Basin(Piece):
    """A local minimum of the highest peak over the parameter."""

    at: Annotated[float, "The value of the parameter."]
    peak: Annotated[float, "The highest peak that was followed to there [m]."]
    solved: Annotated[bool, "Place and peak are solved for, not read from cubics between solved places."]
    proven: Annotated[
        bool,
        "A sweep there found nothing higher. Otherwise the highest peak is at least as high as `peak`: the "
        "basin is no better than that, but may be worse. What the coarse stage finds is seldom proven.",
    ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LeastPeak(MadeOfResponses):
    """Where the highest peak is least."""

    VIEWS: ClassVar = Views("solver.views", "of_least")
    DATA: ClassVar = Data(
        "least", {"minimum=basins": "parameter=at peak solved proven"}, "least_at=at least_peak=peak",
        scene="branch.balance.scene",
    )  # fmt: skip
    JSON: ClassVar = "at peak active plateau chosen_by"

    status: Annotated[TrackStatus, "How it ended; proven only if `status.proven`."]
    at: Annotated[float, "The value of the parameter; NaN without a response."]
    peak: Annotated[
        float, "Highest peak there [m]; unless proven, OTHER_BRANCH or STOPPED, of the best response seen."
    ]
    active: Annotated[tuple[ActivePeak, ...], "The peaks that are equally high there, by frequency."]
    basins: Annotated[tuple[Basin, ...], "The local minima that were met, best first, as the optimum is."]
    branch: Annotated[Branch | None, "The response at the optimum, of the sweep that proves it, if any."]
    sweeps: Annotated[
        int, "Responses computed, those with half the harmonics that look for further basins included."
    ]
    work: Annotated[
        float,
        "Newton iterations of all of those and of following the peaks, divided by those of the sweep at the "
        "optimum (of a mean sweep where there is none): the work in units of one frequency response.",
    ]
    seconds: Annotated[float, "Time in all [s]."]
    plateau: Annotated[
        tuple[float, float] | None,
        "The interval of the parameter around `at` over which the highest peak is the same (PLATEAU, FLAT).",
    ] = None
    chosen_by: Annotated[
        str,
        "What decided where in it `at` is, one of `ChosenBy`: the highest peak where there is no interval; "
        "the highest of the other peaks that depends on the parameter; the width of the resonance band at "
        "half power; the least value of the parameter.",
    ] = ChosenBy.HIGHEST_PEAK.value

    @property
    def reached(self) -> bool:
        """Whether it is proven over the whole range."""
        return self.status.proven

    def plot(self, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw the response at the optimum; `ax`: axes to draw into, else a new figure."""
        if self.branch is None:
            raise SettingError(
                "branch", None, "must be the response at the optimum to be drawn: there is none"
            )
        return self.branch.plot(ax=ax)

    def known_parts(self) -> Iterable[Known]:
        """The response at the optimum."""
        return () if self.branch is None else (self.branch.known,)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CompetingPeak(Piece):
    """One peak over the parameter, in the direction of the range; P values."""

    JSON: ClassVar = "parameter peak frequency ends at_band_end"

    parameter: Annotated[Real, "Values of the parameter, (P,)."]
    peak: Annotated[Real, "Its height [m], (P,)."]
    frequency: Annotated[Real, "Where it is [Hz], (P,)."]
    slope: Annotated[Real, "d height / d parameter, (P,)."]
    ends: Annotated[tuple[str, str], "Why it begins and ends where it does."]
    at_band_end: Annotated[bool, "The amplitude at an end of the band instead of a stationary peak."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakTrack(MadeOfResponses, Drawn):
    """The highest peak over a parameter; where two peaks change places both are listed."""

    VIEWS: ClassVar = Views("solver.views", "tracks:track", "tracks:track_figure")
    DATA: ClassVar = Data(
        "peaks", {"point": "parameter peak frequency slope"},
        "parameter=parameter_path harmonics=n_harmonics least_at=optimum.at least_peak=optimum.peak",
        scene="given",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene measured parameter parameter_path unit peak frequency slope optimum exchanges competing"
        " peaks_open n_harmonics sweeps seconds completed=reached status"
    )

    scene: Annotated[str, "Name of the scene."]
    parameter_path: Annotated[str, "Path of the parameter."]
    unit: Annotated[str, "Unit of the parameter."]
    parameter: Annotated[Real, "Values of the parameter from start to stop, (P,)."]
    peak: Annotated[Real, "Highest peak [m], (P,)."]
    frequency: Annotated[Real, "Frequency of the highest peak [Hz], (P,)."]
    slope: Annotated[Real, "d peak / d parameter, (P,)."]
    optimum: Annotated[LeastPeak, "Where the peak is least."]
    competing: Annotated[tuple[CompetingPeak, ...], "Every peak that was followed."]
    exchanges: Annotated[tuple[Exchange, ...], "Where another peak becomes the highest."]
    branches: Annotated[tuple[Branch, ...], "The sweeps that were made on the way, in their order."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    sweeps: Annotated[int, "Responses computed."]
    status: Annotated[TrackStatus, "How it ended, and what to try if it fell short."]
    seconds: Annotated[float, "Time taken [s]."]
    given: Annotated[
        Scene | None, "What it is of, with the values that stayed fixed; None if read from a file."
    ] = None

    @property
    def measured(self) -> Measured:
        """What the heights are of."""
        return OF_X if self.given is None else self.given.measured

    @property
    def peaks_open(self) -> tuple[str, ...]:
        """Why of some sweeps it is not known that no higher peak hides between their points."""
        return tuple(unsettled(one.peak_certificate for one in self.branches))

    def known_parts(self) -> Iterable[Known]:
        """Every sweep, and the response at the optimum."""
        return (*(one.known for one in self.branches), *self.optimum.known_parts())
