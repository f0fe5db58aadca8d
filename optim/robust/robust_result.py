"""What a robust design returns: the nominal and the robust optimum side by side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from optim.criteria.peak_criterion import PEAK
from optim.problem.checks import Aim
from optim.results.design_result import DesignStatus
from solver.arrays import FloatOrNaN
from solver.results.base import Drawn, MadeOfResponses, Views
from solver.results.known import NOTHING_KNOWN, Known, Note
from solver.results.order_statistics import quantile_json
from solver.results.told import Piece, json_number

if TYPE_CHECKING:
    from optim.problem.design_problem import Problem
    from optim.problem.uncertainty_set import Scenario, UncertainSet
    from optim.results.design_result import Conditions, DesignResult
    from optim.robust.scenarios import Outcome

QUANTILES = (0.05, 0.5, 0.95)


class RobustStatus(Enum):
    """How a robust search ended; the value is a sentence a user can act on."""

    OPTIMAL = "What is minimised over the uncertainty can not be lowered further within the bounds."
    KINK = (
        "The search could not improve the design, but the first-order conditions do not hold there: the "
        "response has a kink at this design, or more harmonics are needed."
    )
    LOCAL = (
        "No scenario looked at is worse, but the look over the whole uncertainty did not come to its end: a "
        "worse one may be left. Use narrower intervals or fewer uncertain parameters."
    )
    FLAT = (
        "The peak does not depend on these variables in any scenario (no friction, or contacts that never "
        "slip): choose others."
    )
    INFEASIBLE = (
        "No design tried keeps all limits in the scenarios that count; the one that breaks them least is "
        "given: relax the limits, narrow the uncertainty, allow wider bounds or give a start that keeps them."
    )
    NO_RESPONSE = DesignStatus.NO_RESPONSE.value
    UNDAMPED = DesignStatus.UNDAMPED.value
    UNKNOWN_SCENARIO = (
        "The response could not be computed in a scenario that counts, so the worst case is not known: use "
        "more harmonics, a narrower band, or a smaller uncertainty."
    )
    NOT_CLOSED = (
        "The cuts did not close: worse scenarios than those the design was made for are left, the gap says "
        "by how much; narrow the uncertainty or use more harmonics."
    )
    NOT_KNOWN = (
        "No better design is near with these harmonics, but its highest peak is not known within 5 %: ask "
        "for more harmonics."
    )
    TOO_MANY = "The largest number of responses was used up before the search settled: allow more."
    STOPPED = "The search was stopped by the caller."


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """The highest peak over samples of the uncertainty."""

    peaks: Annotated[
        tuple[float, ...],
        "One a sample [m], in the order they were drawn; NaN where a response could not be computed.",
    ]

    @property
    def mean(self) -> float:
        """Mean [m]; NaN if a sample is not known."""
        return float(np.mean(self.peaks)) if self.peaks else math.nan

    @property
    def deviation(self) -> float:
        """Standard deviation [m]."""
        return float(np.std(self.peaks, ddof=1)) if len(self.peaks) > 1 else math.nan

    def quantile(self, share: float) -> float:
        """Return the least peak that at least this share of the samples does not exceed [m]."""
        # Loaded here: it brings the compiled loops along, which who knows what results are does not need.
        from optim.robust.scenarios import rank_of

        if not self.peaks or not all(math.isfinite(peak) for peak in self.peaks):
            return math.nan
        return sorted(self.peaks)[rank_of(share, len(self.peaks)) - 1]

    def to_json(self, quantile: float) -> dict[str, object]:
        """Return it as one JSON object."""
        shares = sorted({*QUANTILES, quantile})
        return {
            "count": len(self.peaks),
            "mean": json_number(self.mean),
            "deviation": json_number(self.deviation),
            "quantiles": [quantile_json("peak", self.quantile(share), self.peaks, share) for share in shares],
            "peaks": [json_number(peak) for peak in self.peaks],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One design, nominal and over the uncertainty."""

    values: Annotated[Mapping[str, float], "Variable name to value."]
    peak: Annotated[float, "Highest peak with every parameter at its nominal value [m]."]
    at_hz: Annotated[float, "Its frequency [Hz]."]
    band_hz: Annotated[float, "Width of the widest band then [Hz]."]
    worst: Annotated[
        Outcome | None, "The design in the scenario with the highest peak; None if that is not known."
    ]
    spread: Annotated[Spread, "Over samples."]
    feasible: Annotated[bool, "Whether the limits are kept in every scenario that counts."]
    unknown: Annotated[
        Scenario | None, "The scenario that could not be computed, if the worst peak is not known for that."
    ]
    known: Annotated[
        Known,
        "How well the highest peak is known, with every parameter at its nominal value and in the worst "
        "scenario, whichever is less.",
    ] = NOTHING_KNOWN

    @property
    def worst_peak(self) -> float:
        """Highest peak over the uncertainty [m]; NaN if it is not known."""
        row = None if self.worst is None else self.worst.highest(PEAK)
        return math.nan if row is None else row.value

    @property
    def worst_scenario(self) -> Scenario | None:
        """The scenario that gives it."""
        return None if self.worst is None else self.worst.scenario

    def to_json(self, quantile: float) -> dict[str, object]:
        """Return it as one JSON object."""
        row = None if self.worst is None else self.worst.highest(PEAK)
        worst = None
        if self.worst is not None and row is not None:
            worst = {"peak": row.value, "at": row.at_hz, "scenario": self.worst.scenario.to_json()}
        return {
            "values": dict(self.values),
            "peak": {"value": json_number(self.peak), "at": json_number(self.at_hz)},
            "band_hz": json_number(self.band_hz),
            "worst": worst,
            "samples": self.spread.to_json(quantile),
            "feasible": self.feasible,
            **self.known.to_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Cut(Piece):
    """A scenario the master problem was given, and what brought it in."""

    scenario: Annotated[Scenario, "What is the case."]
    peak: Annotated[float, "Highest peak [m] of the design it was found at."]
    exceeds: Annotated[
        float,
        "By how much, relative, it was worse than all scenarios before; NaN for those the search began with.",
    ]
    multiplier: Annotated[
        float,
        "With which force it holds the robust optimum; those of all scenarios sum to 1 for a peak alone.",
    ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RobustResult(MadeOfResponses, Drawn):
    """The nominal and the robust optimum side by side."""

    VIEWS: ClassVar = Views("optim.views", "design:robust", "figures:robust_figure", "robust_dataset")
    JSON: ClassVar = (
        "scene=problem.scene.name measured=design.measured aim quantile uncertain optimum nominal robust"
        " objective gain cuts gap inner_look optimality=conditions.residual"
        " violation=conditions.violation unknown designs responses seconds nominal_status=design.status"
        " warnings=design.warnings reached status"
    )

    problem: Annotated[Problem, "What was asked."]
    uncertain: Annotated[UncertainSet, "Over what."]
    aim: Annotated[Aim, "What was minimised over it."]
    quantile: Annotated[float, "Share of the uncertainty, where a quantile was minimised."]
    status: Annotated[RobustStatus, "How the search ended."]
    design: Annotated[DesignResult, "The search without uncertainty."]
    nominal: Annotated[Side | None, "The optimum without uncertainty; None where no design is known."]
    robust: Annotated[Side | None, "The optimum over the uncertainty, likewise."]
    objective: Annotated[FloatOrNaN, "What was minimised, at the robust optimum."]
    conditions: Annotated[Conditions | None, "First-order conditions there."]
    cuts: Annotated[tuple[Cut, ...], "The scenarios the robust optimum was made for."]
    gap: Annotated[
        FloatOrNaN,
        "Worst case: by how much, relative, the worst scenario found exceeds the worst of the cuts. The "
        "latter bounds the optimum of its basin from below, the former from above. NaN for other aims.",
    ]
    inner_look: Annotated[
        bool,
        "Worst case: whether the look over the whole uncertainty, at the robust optimum, came to its end: "
        "the gap is that of the worst scenario of all, as far as corners, middles, a space-filling "
        "sequence and climbs from these tell. False for other aims.",
    ] = False
    unknown: Annotated[Scenario | None, "The scenario that could not be computed."]
    designs: Annotated[int, "Designs tried over the uncertainty."]
    responses: Annotated[int, "Frequency responses in all."]
    seconds: Annotated[float, "Time in all [s]."]

    @property
    def optimum(self) -> Mapping[str, float]:
        """Variable name to value of the robust optimum; empty when there is none."""
        return {} if self.robust is None else dict(self.robust.values)

    @property
    def gain(self) -> FloatOrNaN:
        """By which share the robust optimum lowers the worst peak of the nominal one; NaN of a peak of 0."""
        if self.nominal is None or self.robust is None or not self.nominal.worst_peak:
            return math.nan
        return 1.0 - self.robust.worst_peak / self.nominal.worst_peak

    def known_parts(self) -> Iterable[Known]:
        """The robust optimum, nominal and in its worst scenario; the nominal one where there is no other."""
        return self.design.known_parts() if self.robust is None else (self.robust.known,)

    @property
    def of_scene(self) -> tuple[Note, ...]:
        """What of the scene is hardly meant."""
        return self.design.of_scene

    def to_json(self) -> dict[str, Any]:
        """Return the result as one JSON object."""
        return self._json(
            quantile=self.quantile if self.aim is Aim.QUANTILE else None,
            nominal=None if self.nominal is None else self.nominal.to_json(self.quantile),
            robust=None if self.robust is None else self.robust.to_json(self.quantile),
        )
