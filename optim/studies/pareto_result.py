"""What a Pareto search returns: the points of the front, its slope, its knee."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from optim.problem.problem import Problem
from optim.results.design import DesignResult
from solver.results.base import Drawn, MadeOfResponses
from solver.results.known import Known
from solver.results.told import json_number
from solver.results.views import Views

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


@dataclass(frozen=True, slots=True, kw_only=True)
class ParetoPoint:
    """A design on the front, with the two indicators of a damper: risk range and largest amplitude.

    Attributes
    ----------
    design : DesignResult
        The design with its responses, active limits and conditions.
    peak, at_hz : float
        Largest amplitude [m] and its frequency.
    band_hz : float
        Width of the resonance band, the frequencies at risk [Hz].
    intervals : tuple of (low, high)
        Where they are [Hz].
    slope : float
        d peak / d band along the front [m/Hz], at most 0; NaN where the front ends in a vertical.
    """

    design: DesignResult
    peak: float
    at_hz: float
    band_hz: float
    intervals: tuple[tuple[float, float], ...]
    slope: float

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

    def to_json(self) -> dict[str, object]:
        """Return it as one JSON object."""
        return {
            "values": dict(self.values),
            "peak": self.peak,
            "at": self.at_hz,
            "band_hz": self.band_hz,
            "intervals": [list(pair) for pair in self.intervals],
            "slope": json_number(self.slope),
            "hz_per_metre": json_number(self.hz_per_metre),
            "active": list(self.design.active),
            "optimality": json_number(self.design.optimality),
            "status": self.design.status.value,
            **self.design.known.to_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParetoResult(MadeOfResponses, Drawn):
    """The front of peak against band.

    Attributes
    ----------
    problem : Problem
        What was asked.
    status : ParetoStatus
        How the search ended.
    ends : tuple of DesignResult
        The least peak, and the narrowest band.
    points, dominated : tuple of ParetoPoint
        The front from the least peak on, and designs found that another one beats in both.
    missed : tuple of float
        Widths [Hz] for which no design was found.
    evaluations : int
        Designs evaluated.
    seconds : float
        Time in all.
    """

    problem: Problem
    status: ParetoStatus
    ends: tuple[DesignResult, ...]
    points: tuple[ParetoPoint, ...]
    dominated: tuple[ParetoPoint, ...]
    missed: tuple[float, ...]
    evaluations: int
    seconds: float

    @property
    def reached(self) -> bool:
        """Whether the whole front was found."""
        return self.status in (ParetoStatus.COMPLETE, ParetoStatus.NO_TRADE_OFF)

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

    VIEWS: ClassVar = Views("optim.views", "of_front", "front_dataset", "designs:pareto_figure")

    def known_parts(self) -> Iterable[Known]:
        """Both ends and every point of the front."""
        return [one.known for one in (*self.ends, *(point.design for point in self.points))]

    def own_json(self) -> dict[str, object]:
        """Return the result as one JSON object."""
        return {
            "scene": self.problem.scene.name,
            "dof": self.problem.scene.observe.dof,
            "limit": self.problem.limit,
            "points": [point.to_json() for point in self.points],
            "knee": self.knee,
            "dominated": [point.to_json() for point in self.dominated],
            "missed": list(self.missed),
            "ends": [{"status": end.status.value, "reached": end.reached} for end in self.ends],
            "evaluations": self.evaluations,
            "seconds": self.seconds,
            "reached": self.reached,
            "status": self.status.value,
        }


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
