"""What a Pareto search returns: the points of the front, its slope, its knee."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.measures import Measured
from solver.results.told import Piece
from solver.results.views import Views

if TYPE_CHECKING:
    from optim.problem.design_problem import Problem
    from optim.results.design_result import DesignResult, DesignStatus

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

    VIEWS: ClassVar = Views("optim.views", "design:front", "designs:pareto_figure", "front_dataset")
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
