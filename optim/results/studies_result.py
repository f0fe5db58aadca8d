"""What studies of designs return: a Campbell diagram, a front of peak against band, sensitivities."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from solver.arrays import FloatOrNaN
from solver.results.base import Drawn, MadeOfResponses, Views
from solver.results.known import NOTHING_DAMPS, Known, Measured
from solver.results.told import Piece
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from optim.problem.design_problem import Problem
    from optim.results.design_result import DesignResult, DesignStatus
    from solver.continuation.branch import Branch, Peak


Ranges = tuple[tuple[float, float], ...]


class CampbellStatus(Enum):
    """How a diagram ended; the value is a sentence a user can act on."""

    COMPLETED = "Every response covers its whole range of frequencies."
    INCOMPLETE = (
        "A response ended before the end of its range, so peaks may be missing: its own status says why. Try "
        "more harmonics or a narrower band."
    )
    UNDAMPED = NOTHING_DAMPS
    STOPPED = "The diagram was stopped before all responses were computed."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Crossing(Piece):
    """A speed at which an order meets a peak of its response."""

    speed_rpm: Annotated[float, "Running speed [1/min]."]
    frequency_hz: Annotated[float, "Frequency of the peak [Hz]."]
    amplitude: Annotated[float, "Its height [m]."]
    inside: Annotated[bool, "Whether the speed is a running speed."]
    margin: Annotated[float, "Distance to the nearest running speed, relative to that; 0 inside."]
    error_estimate: Annotated[float, "Estimated error of the amplitude [m]; NaN if not known."] = math.nan


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class OrderResponse(Piece):
    """What one order excites; natural frequencies are of its nodal diameter if the structure is cyclic."""

    JSON: ClassVar = (
        "order range_hz running_hz limit peaks=branch.interior_peaks bands_hz exceeded_rpm"
        " exceeded_running_rpm crossings_rpm crossings highest_running stuck_hz open_hz"
        " peak_certificate=branch.peak_certificate band_known=branch.band_known measure peak_max_abs"
        " error_estimate peak_half_peak_to_peak half_peak_to_peak_error relative_error"
        " flags completed=branch.reached status=branch.status"
    )

    order: Annotated[int, "Excitations a revolution."]
    branch: Annotated[Branch, "The frequency response; without sectors it is the same for all orders."]
    running_hz: Annotated[Ranges, "Excitation frequencies of the running speeds [Hz]."]
    limit: Annotated[float, "Amplitude of the bands [m]: as asked for, else half power of the highest peak."]
    bands_hz: Annotated[Ranges, "Where the amplitude exceeds it [Hz]."]
    exceeded_rpm: Annotated[Ranges, "The same as speeds [1/min]."]
    exceeded_running_rpm: Annotated[Ranges, "The same as far as they are running speeds [1/min]."]
    crossings: Annotated[tuple[Crossing, ...], "Every peak inside the range looked at, ascending."]
    highest_running: Annotated[
        Crossing | None,
        "The largest amplitude at any running speed; None where the response does not reach one. Its error "
        "is what any amplitude at a running speed may be higher by.",
    ]
    stuck_hz: Annotated[tuple[float, ...], "Undamped natural frequencies there, all contacts stuck [Hz]."]
    open_hz: Annotated[tuple[float, ...], "The same with all contacts open [Hz]."]

    def to_json(self) -> dict[str, Any]:
        """Return the response of the order as one JSON object."""
        known = self.branch.known.to_json()
        del known["peaks_open"]
        return self._json(
            range_hz=(self.branch.start, self.branch.stop),
            crossings_rpm=[crossing.speed_rpm for crossing in self.crossings], **known,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CampbellDiagram(MadeOfResponses, Drawn):
    """Orders of a running speed against the resonances of a scene."""

    VIEWS: ClassVar = Views("optim.views", "studies:campbell", "of_campbell", "campbell_dataset")
    JSON: ClassVar = (
        "scene measured=scene.measured speeds_rpm limit clear orders n_harmonics seconds completed=reached"
        " status"
    )

    scene: Annotated[Scene, "With the values all responses share."]
    speeds_rpm: Annotated[Ranges, "The running speeds [1/min]."]
    limit: Annotated[float | None, "Amplitude [m] asked for."]
    orders: Annotated[tuple[OrderResponse, ...], "What each excites, ascending."]
    n_harmonics: Annotated[int, "Highest harmonic kept."]
    status: Annotated[CampbellStatus, "How it ended, and what to try if it fell short."]
    seconds: Annotated[float, "Time taken [s]."]

    @property
    def clear(self) -> bool | None:
        """Whether the amplitude stays within the limit at every running speed; None if that is not known.

        Without a limit: whether no peak lies at a running speed. It is not known either where a peak may hide
        between two points of a response, see `Branch.peak_certificate`, nor where the highest amplitude is
        nearer to the limit than its estimated error, or has none.
        """
        if self.limit is None:
            meets = any(crossing.inside for one in self.orders for crossing in one.crossings)
        else:
            meets = any(one.exceeded_running_rpm for one in self.orders)
        known = all(one.branch.peak_certificate.known and self._within(one) for one in self.orders)
        return False if meets else True if self.reached and known else None

    def _within(self, one: OrderResponse) -> bool:
        """Return whether the amplitude at running speeds stays within the limit whatever its error is."""
        highest = one.highest_running
        if self.limit is None or highest is None:
            return True
        return highest.error_estimate < self.limit - highest.amplitude

    def known_parts(self) -> Iterable[Known]:
        """The response of every order."""
        return [one.branch.known for one in self.orders]


SAME = 1e-7  # relative distance within which two points are one


class ParetoStatus(Enum):
    """How the search of a front ended; the value is a sentence a user can act on."""

    COMPLETE = "Every point of the front was found."
    PARTIAL = "Some points of the front were not found: no design tried keeps the band as narrow as that."
    NO_TRADE_OFF = "The least peak has the narrowest band too: there is nothing to trade, one design is best."
    NO_END = "An end of the front was not found; the status of that search says why and what to do."
    NOT_KNOWN = (
        "Every point of the front was found with these harmonics, but the peak of some is not known within "
        "5 %: ask for more harmonics."
    )
    STOPPED = "The search was stopped by the caller; the points found so far are given."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParetoPoint(Piece):
    """A design on the front, with the two indicators of a damper: risk range and largest amplitude."""

    JSON: ClassVar = (
        "values peak at=at_hz band_hz intervals slope hz_per_metre active=design.active"
        " optimality=design.optimality status=design.status"
    )

    design: Annotated[DesignResult, "The design with its responses, active limits and conditions."]
    peak: Annotated[float, "Largest amplitude [m]."]
    at_hz: Annotated[float, "Its frequency [Hz]."]
    band_hz: Annotated[float, "Width of the resonance band, the frequencies at risk [Hz]."]
    intervals: Annotated[tuple[tuple[float, float], ...], "Where they are [Hz]."]
    slope: Annotated[
        float, "d peak / d band along the front [m/Hz], at most 0; NaN where the front ends in a vertical."
    ]

    @classmethod
    def of(cls, design: DesignResult, slope: float) -> ParetoPoint:
        """Return the point of a design that has a peak and a band."""
        peak, band = design.peak, design.band_hz
        if peak is None or band is None or design.evaluation is None:
            raise ValueError("a point of a front needs a peak and a band")
        row = design.evaluation.band
        mine = [r.branch.band for r in design.evaluation.responses if row is not None and r.case == row.case]
        intervals = mine[0].intervals if mine and mine[0] is not None else ()
        return cls(
            design=design, peak=peak.value, at_hz=peak.at, band_hz=band, intervals=intervals, slope=slope
        )

    @property
    def values(self) -> Mapping[str, float]:
        """Variable name to value."""
        return self.design.optimum

    @property
    def hz_per_metre(self) -> float:
        """How much wider the band becomes for a peak that is lower by so much [Hz/m]."""
        return -1.0 / self.slope if self.slope < 0.0 else math.nan

    def dominates(self, other: ParetoPoint) -> bool:
        """Return whether this point is as good in both and better in one; the same twice counts as better."""
        peak, band = other.peak * (1.0 + SAME), other.band_hz * (1.0 + SAME)
        return self.peak <= peak and self.band_hz <= band

    def to_json(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        return self._json() | self.design.known.to_json()


class FrontEndStatus(NamedTuple):
    """How the search of an end of the front ended."""

    status: DesignStatus
    reached: bool


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParetoResult(MadeOfResponses, Drawn):
    """The front of peak against band: designs of which none is better in both than another."""

    VIEWS: ClassVar = Views("optim.views", "design:front", "figures:pareto_figure", "front_dataset")
    JSON: ClassVar = (
        "scene=problem.scene.name dof=problem.scene.observe.dof measured limit=problem.limit points knee"
        " dominated missed ends=ended evaluations seconds reached status"
    )

    problem: Annotated[Problem, "What was asked."]
    status: Annotated[ParetoStatus, "How the search ended."]
    ends: Annotated[tuple[DesignResult, ...], "The least peak, and the narrowest band."]
    points: Annotated[tuple[ParetoPoint, ...], "The front from the least peak on."]
    dominated: Annotated[tuple[ParetoPoint, ...], "Designs found that another one beats in both."]
    missed: Annotated[tuple[float, ...], "Widths [Hz] for which no design was found."]
    evaluations: Annotated[int, "Designs evaluated."]
    seconds: Annotated[float, "Time in all [s]."]

    @property
    def reached(self) -> bool:
        """Whether the whole front was found."""
        return self.status in (ParetoStatus.COMPLETE, ParetoStatus.NO_TRADE_OFF)

    @property
    def measured(self) -> Measured:
        """What the peaks are of."""
        return self.ends[0].measured if self.ends else self.problem.scene.measured

    @property
    def ended(self) -> tuple[FrontEndStatus, ...]:
        """How the searches of both ends ended."""
        return tuple(FrontEndStatus(end.status, end.reached) for end in self.ends)

    @property
    def knee(self) -> int | None:
        """Which point lies farthest below the line between the ends, in shares of the front; or None."""
        if len(self.points) < 3:
            return None
        first, last = self.points[0], self.points[-1]
        wide, tall = first.band_hz - last.band_hz, last.peak - first.peak
        below = [1.0 - (p.band_hz - last.band_hz) / wide - (p.peak - first.peak) / tall for p in self.points]
        place = max(range(len(below)), key=below.__getitem__)
        return place if below[place] > 0.0 else None

    def known_parts(self) -> Iterable[Known]:
        """Both ends and every point of the front."""
        return [one.known for one in (*self.ends, *(point.design for point in self.points))]


def front_of(found: Sequence[ParetoPoint]) -> tuple[tuple[ParetoPoint, ...], tuple[ParetoPoint, ...]]:
    """Return the points that no other dominates, from the least peak on, and the others."""
    ordered = sorted(found, key=lambda point: (point.peak, point.band_hz))
    kept: list[ParetoPoint] = []
    dominated = []
    for point in ordered:
        if any(other.dominates(point) for other in kept):
            dominated.append(point)
        else:
            kept.append(point)
    return tuple(kept), tuple(dominated)


class SensitivityStatus(Enum):
    """Whether there are sensitivities; the value is a sentence a user can act on."""

    KNOWN = "Every derivative is exact for the harmonics kept."
    SINGULAR = (
        "Some derivatives do not exist at this design (the peak or a band edge sits on a change of contact "
        "state): those are left out; look at a design beside it."
    )
    NO_RESPONSE = (
        "The frequency response could not be computed over the whole band: use more harmonics or a narrower "
        "band."
    )
    UNDAMPED = (
        "There is a resonance in the band and no damping, so that nothing bounds the response: give the "
        "structure some (damping_ratio = 0.001, say), or a band without the resonance."
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParameterSensitivity(Piece):
    """What one parameter does to the peaks and the band."""

    path: Annotated[str, "The parameter."]
    unit: Annotated[str, "Its unit."]
    value: Annotated[float, "Its value."]
    relative: Annotated[bool, "Whether per cent of it mean something: not of angles, and not of what is 0."]
    peaks: Annotated[
        tuple[float, ...], "Derivative of every competing peak [m per unit], in the order of the result."
    ]
    band: Annotated[float, "Derivative of the band's width [Hz per unit]; NaN without a band."]


class WithoutDerivative(NamedTuple):
    """A parameter without a derivative, and why."""

    path: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SensitivityResult(MadeOfResponses, Drawn):
    """Sensitivities of a design."""

    VIEWS: ClassVar = Views(
        "optim.views", "studies:shares", "figures:sensitivities_figure", "sensitivities_dataset"
    )
    JSON: ClassVar = (
        "scene peaks band_hz limit band_by_limit rows left_out peak_certificate=branch.peak_certificate"
        " seconds reached status"
    )

    scene: Annotated[Scene, "With the values of the design."]
    status: Annotated[SensitivityStatus, "Whether there are sensitivities."]
    branch: Annotated[Branch, "The response."]
    peaks: Annotated[tuple[Peak, ...], "Those that compete, highest first."]
    rows: Annotated[
        tuple[ParameterSensitivity, ...],
        "What matters most for the highest peak first; those without per cents last.",
    ]
    band_by_limit: Annotated[FloatOrNaN, "Of the band's width by the limit [Hz/m], the peaks held."]
    left_out: Annotated[tuple[WithoutDerivative, ...], "Parameters without a derivative, with the reason."]
    seconds: Annotated[float, "Time in all [s]."]

    @property
    def reached(self) -> bool:
        """Whether there are sensitivities."""
        return self.status not in (SensitivityStatus.NO_RESPONSE, SensitivityStatus.UNDAMPED)

    @property
    def band_hz(self) -> FloatOrNaN:
        """Width of the resonance band [Hz]; NaN without one."""
        return math.nan if self.branch.band is None else self.branch.band.width

    @property
    def limit(self) -> FloatOrNaN:
        """Amplitude above which the band is measured [m]; NaN without one."""
        return math.nan if self.branch.band is None else self.branch.band.limit

    def peak_elasticities(self, row: ParameterSensitivity) -> tuple[float, ...]:
        """Return the per cent of every competing peak for one per cent of a parameter; NaN where none."""
        factor = row.value if row.relative else math.nan
        return tuple(
            slope * factor / peak.value if peak.value > 0.0 else math.nan
            for slope, peak in zip(row.peaks, self.peaks, strict=True)
        )

    def band_elasticity(self, row: ParameterSensitivity) -> float:
        """Return the per cent of the band for one per cent of a parameter; NaN where none."""
        return row.band * row.value / self.band_hz if row.relative and self.band_hz > 0.0 else math.nan

    def known_parts(self) -> Iterable[Known]:
        """The response."""
        return (self.branch.known,)

    def to_json(self) -> dict[str, Any]:
        """Return the result as one JSON object."""
        shares = {row.path: self.peak_elasticities(row) for row in self.rows}
        rows = [
            {
                "path": row.path, "unit": row.unit, "value": row.value,
                "peak_percent": shares[row.path][0], "peaks_percent": shares[row.path],
                "band_percent": self.band_elasticity(row), "peak_slope": row.peaks[0],
                "peak_slopes": row.peaks, "band_slope": row.band,
            }
            for row in self.rows
        ]  # fmt: skip
        return self._json(rows=rows)
