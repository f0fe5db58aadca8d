"""What `worst_mistuning` returns: the worst pattern with its bounds, and intentional patterns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

from solver.arrays import FloatOrNaN
from solver.results.base import Drawn
from solver.results.known import OF_X, Measured
from solver.results.known import Note
from solver.results.told import Piece
from solver.results.base import Data, Views
from solver.studies.study_results import MistuningStatus


class WorstMistuningStatus(Enum):
    """How a search ended; the value is a sentence a user can act on."""

    COMPLETED = "All climbs asked for are made: no pattern worse than this was found within the bounds."
    INCOMPLETE = (
        "The response of a pattern did not reach the end of the band, so the worst is that of the others: "
        "use more harmonics or another band."
    )
    NO_RESPONSE = MistuningStatus.NO_RESPONSE.value
    UNDAMPED = MistuningStatus.UNDAMPED.value
    STOPPED = "The search was stopped by the caller: the worst is that of the patterns so far."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PatternPeak(Piece):
    """The highest peak of a disk whose blades have factors."""

    factors: Annotated[tuple[float, ...], "One for each sector."]
    magnification: Annotated[float, "Its highest peak relative to that of the tuned disk."]
    peak: Annotated[float, "[m]."]
    blade: Annotated[int, "The sector that has it."]
    at_hz: Annotated[float, "Where [Hz]."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ResidualPeak(Piece):
    """The largest amplitude of a disk over its factors and the forces left in contacts that stick."""

    factors: Annotated[tuple[float, ...], "One for each sector."]
    contacts: Annotated[tuple[str, ...], "Contacts of the annulus that stick and keep a force."]
    tractions: Annotated[tuple[float, ...], "The force each keeps beside kt u [N]."]
    magnification: Annotated[float, "The largest max|x| relative to the peak of the tuned disk."]
    peak: Annotated[float, "It [m]."]
    blade: Annotated[int, "The sector that has it."]
    at_hz: Annotated[float, "Where [Hz]."]
    without: Annotated[float, "max|x| there of contacts that were free of force at the beginning [m]."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class IntentionalPattern(Piece):
    """An intentional pattern of blade types round the disk."""

    pattern: Annotated[str, "A letter for each blade type, repeated round the disk."]
    disk: Annotated[PatternPeak, "With the pattern alone."]
    worst: Annotated[
        PatternPeak | None, "With the worst mistuning within the bounds on top; none if it was not asked for."
    ] = None

    @property
    def counts(self) -> float:
        """The magnification that it is ranked by: of the worst, if that is known."""
        return (self.worst or self.disk).magnification


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class WorstMistuning(Drawn):
    """The mistuning within bounds that makes the highest peak of any blade largest."""

    VIEWS: ClassVar = Views(
        "stickslip.lab.worst_mistuning", "tables:worst_mistuning", "pictures:worst_mistuning_figure"
    )
    DATA: ClassVar = Data(
        "worst-mistuning", {"sector": "factor=worst.factors"},
        "within rms of contacts dof magnification=worst.magnification whitehead martel power_bound"
        " tuned_peak tuned_at_hz",
        index="sector",
    )  # fmt: skip
    JSON: ClassVar = (
        "scene dof measured of within rms detuning contacts tuned_peak tuned_at_hz worst residual whitehead"
        " martel power_bound starts climbs alike climbed patterns best n_harmonics notes seconds"
        " completed=reached status"
    )

    scene: Annotated[str, "Its name."]
    dof: Annotated[str, "The DOF in one sector whose amplitude counts."]
    measured: Annotated[Measured, "What the peaks are of."] = OF_X
    of: Annotated[tuple[str, ...], "The parts that have factors."]
    within: Annotated[float, "Largest deviation of a factor."]
    rms: Annotated[float | None, "Largest root mean square of the deviations; none."]
    detuning: Annotated[float, "Deviation of the first and (negative) the last blade type of patterns."]
    contacts: Annotated[str, "How they count: solved, stuck, open or residual."]
    tuned_peak: Annotated[FloatOrNaN, "Highest peak of the tuned disk [m]."]
    tuned_at_hz: Annotated[FloatOrNaN, "Where [Hz]."]
    worst: Annotated[PatternPeak | None, "The worst pattern found."]
    residual: Annotated[
        ResidualPeak | None,
        "The largest amplitude over factors, frequency and the forces that contacts which stick may hold; "
        "none if it was not asked for, or no contact sticks.",
    ] = None
    whitehead: Annotated[float, "Whitehead's bound of the magnification, (1 + √N)/2."]
    martel: Annotated[
        FloatOrNaN, "Martel's bound, with the damping of every nodal diameter; unknown where there is none."
    ] = math.nan
    power_bound: Annotated[
        FloatOrNaN,
        "No pattern of the linear disk exceeds this magnification at the frequency of the worst; unknown "
        "where damping does not take power from every motion, or mistuning changes it.",
    ] = math.nan
    starts: Annotated[int, "Climbs in each linear limit."]
    climbs: Annotated[int, "Climbs with the contacts solved; 0 in a linear limit."]
    alike: Annotated[
        int, "Climbs that ended at the height of the worst pattern; with the contacts solved, of those."
    ]
    climbed: Annotated[int, "Responses with the contacts solved that were computed to climb on."] = 0
    patterns: Annotated[tuple[IntentionalPattern, ...], "Intentional patterns, the best first."] = ()
    notes: Annotated[
        tuple[Note, ...], "A highest amplitude, of the tuned disk or the worst, at an end of the band."
    ] = ()
    n_harmonics: int
    status: WorstMistuningStatus
    seconds: float

    @property
    def best(self) -> str | None:
        """The intentional pattern with the least magnification."""
        return self.patterns[0].pattern if self.patterns else None
