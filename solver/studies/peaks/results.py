"""Tracked peaks: what `solver.studies.peaks.track_peak` returns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

from solver.continuation.branch import Branch
from solver.continuation.certificate import unsettled
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.told import Piece, json_number
from solver.results.views import Views

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    STOPPED = "The tracking was stopped by the caller."
    WORK_USED_UP = (
        "The work allowed was used up before the optimum was proven; the best value seen is given: use a "
        "shorter range or fewer harmonics, or compare sweeps of your own."
    )

    @property
    def proven(self) -> bool:
        """Whether an optimum with this status is proven over the whole range."""
        return self in (
            TrackStatus.TRACKED, TrackStatus.AT_BOUND, TrackStatus.PLATEAU, TrackStatus.FLAT
        )  # fmt: skip


class ChosenBy(Enum):
    """What decided where an optimum is; the value is what a user reads."""

    HIGHEST_PEAK = "highest peak"
    NEXT_PEAK = "next peak"
    BAND = "resonance band"
    LEAST_VALUE = "least value"
    NOTHING = "nothing depends on it"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActivePeak:
    """A peak that is highest at the optimum.

    Attributes
    ----------
    frequency : float
        Hz.
    value : float
        m.
    slope : float
        d value / d parameter.
    """

    frequency: float
    value: float
    slope: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Basin(Piece):
    """A local minimum of the highest peak over the parameter.

    Attributes
    ----------
    at : float
        The value of the parameter.
    peak : float
        The highest peak that was followed to there [m].
    solved : bool
        The place and the peak are solved for; otherwise they are read from cubics between solved places.
    proven : bool
        A sweep there found nothing higher. Otherwise the highest peak is at least as high as `peak`: the
        basin is no better than that, but may be worse. What the coarse stage finds is seldom proven.
    """

    UNITS: ClassVar[Mapping[str, str]] = {"peak": "m"}

    at: float
    peak: float
    solved: bool
    proven: bool


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LeastPeak(MadeOfResponses):
    """Where the highest peak is least.

    Attributes
    ----------
    status : TrackStatus
        Proven only if `status.proven`: TRACKED, AT_BOUND, PLATEAU or FLAT.
    at : float
        The value of the parameter (NaN without a response).
    peak : float
        The highest peak there [m]; unless it is proven or OTHER_BRANCH or STOPPED, that of the best response
        seen.
    active : tuple of ActivePeak
        The peaks that are equally high there, highest first.
    basins : tuple of Basin
        The local minima of the highest peak that were met, best first; the optimum is the first of them.
    branch : Branch or None
        The frequency response at the optimum, from the sweep that proves it; None if there is none.
    sweeps : int
        Frequency responses computed, those with half the harmonics that look for further basins included.
    work : float
        Newton iterations of all of those and of following the peaks, divided by those of the sweep at the
        optimum (of a mean sweep where there is none): the work in units of one frequency response.
    seconds : float
        Time in all.
    plateau : (float, float) or None
        The interval of the parameter around `at` over which the highest peak is the same (PLATEAU, FLAT).
    chosen_by : str
        What decided where in it `at` is, one of `ChosenBy`: the highest peak where there is no interval; the
        highest of the other peaks that depends on the parameter; the width of the resonance band at half
        power; the least value of the parameter.
    """

    status: TrackStatus
    at: float
    peak: float
    active: tuple[ActivePeak, ...]
    basins: tuple[Basin, ...]
    branch: Branch | None
    sweeps: int
    work: float
    seconds: float
    plateau: tuple[float, float] | None = None
    chosen_by: str = ChosenBy.HIGHEST_PEAK.value

    VIEWS: ClassVar = Views("solver.views", "of_least", "least_dataset")

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

    def own_json(self) -> dict[str, object]:
        """Return the optimum as one JSON object."""
        active = [{"frequency": a.frequency, "value": a.value, "slope": a.slope} for a in self.active]
        return {
            "at": json_number(self.at), "peak": json_number(self.peak), "active": active,
            "plateau": None if self.plateau is None else list(self.plateau), "chosen_by": self.chosen_by,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CompetingPeak:
    """One peak over the parameter, in the direction of the range.

    Attributes
    ----------
    parameter, peak, frequency, slope : (P,) arrays
        Values of the parameter, height [m], frequency [Hz], d height / d parameter.
    ends : (str, str)
        Why it begins and ends where it does.
    at_band_end : bool
        The amplitude at an end of the band instead of a stationary peak.
    """

    parameter: Real
    peak: Real
    frequency: Real
    slope: Real
    ends: tuple[str, str]
    at_band_end: bool


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakTrack(MadeOfResponses, Drawn):
    """The highest peak over a parameter.

    Attributes
    ----------
    scene, parameter_path, unit : str
        Name of the scene, path and unit of the parameter.
    parameter, peak, frequency, slope : (P,) arrays
        Values of the parameter from start to stop, highest peak [m], its frequency [Hz], its derivative by
        the parameter; where two peaks change places both are listed.
    optimum : LeastPeak
        Where the peak is least.
    competing : tuple of CompetingPeak
        Every peak that was followed.
    exchanges : tuple of (float, float)
        Values of the parameter where another peak becomes the highest, and the height there.
    branches : tuple of Branch
        The sweeps that were made on the way, in the order they were made.
    status : TrackStatus
        How it ended.
    given : Scene or None
        What it is of, with the values that stayed fixed; None if it was read from a file.
    """

    scene: str
    parameter_path: str
    unit: str
    parameter: Real
    peak: Real
    frequency: Real
    slope: Real
    optimum: LeastPeak
    competing: tuple[CompetingPeak, ...]
    exchanges: tuple[tuple[float, float], ...]
    branches: tuple[Branch, ...]
    n_harmonics: int
    sweeps: int
    status: TrackStatus
    seconds: float
    given: Scene | None = None

    @property
    def peaks_open(self) -> tuple[str, ...]:
        """Why of some sweeps it is not known that no higher peak hides between their points."""
        return tuple(unsettled(one.peak_certificate for one in self.branches))

    @property
    def completed(self) -> bool:
        """Whether the whole range was covered and checked."""
        return self.status is TrackStatus.TRACKED

    VIEWS: ClassVar = Views("solver.views", "of_track", "track_dataset", "of_track")

    def known_parts(self) -> Iterable[Known]:
        """Every sweep, and the response at the optimum."""
        return (*(one.known for one in self.branches), *self.optimum.known_parts())

    def own_json(self) -> dict[str, object]:
        """Return the track as one JSON object."""
        return {
            "scene": self.scene,
            "parameter": self.parameter.tolist(),
            "parameter_path": self.parameter_path,
            "unit": self.unit,
            "peak": self.peak.tolist(),
            "frequency": self.frequency.tolist(),
            "slope": self.slope.tolist(),
            "optimum": self.optimum.to_json(),
            "exchanges": [{"at": at, "peak": peak} for at, peak in self.exchanges],
            "competing": [
                {
                    "parameter": line.parameter.tolist(), "peak": line.peak.tolist(),
                    "frequency": line.frequency.tolist(), "ends": list(line.ends),
                    "at_band_end": line.at_band_end,
                }
                for line in self.competing
            ],
            "peaks_open": list(self.peaks_open),
            "n_harmonics": self.n_harmonics,
            "sweeps": self.sweeps,
            "seconds": self.seconds,
            "completed": self.completed,
            "status": self.status.value,
        }  # fmt: skip
