"""Parts of a design: local optima, the best so far, what a performance curve is worth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar

from solver.results.told import Piece

SAME_PLACE = 1e-3  # scaled distance within which two optima are one


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LocalOptimum(Piece):
    """A local optimum."""

    values: Annotated[Mapping[str, float], "Variable name to value."]
    peak: Annotated[float, "Highest peak [m]."]
    objective: Annotated[float, "What is minimised."]
    settled: Annotated[bool, "Whether the first-order conditions hold there."]
    feasible: Annotated[bool, "Whether the limits are kept there."]
    proven: Annotated[
        bool,
        "Whether a response there was computed, so that no peak is higher than `peak`. A further basin of "
        "the tracked peak is solved for along the peaks that were followed: it is at least that high.",
    ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Checked(Piece):
    """A local optimum again with more harmonics."""

    JSON: ClassVar = "values n_harmonics=harmonics peak objective feasible"

    values: Annotated[Mapping[str, float], "Variable name to value."]
    harmonics: Annotated[int, "Highest harmonic kept."]
    peak: Annotated[float, "Highest peak [m]; NaN where a response could not be computed."]
    objective: Annotated[float, "What is minimised; NaN likewise."]
    feasible: Annotated[bool, "Whether the limits are kept."]


class OptionStatus(Enum):
    """What became of an option; the value is a sentence."""

    FEASIBLE = "It keeps all limits."
    INFEASIBLE = "No design of it keeps all limits."
    CUT = "Its mass alone is no better than the best design of another option."
    UNKNOWN = "No design of it could be computed: use more harmonics or a narrower band."
    STOPPED = "Stopped by the caller before it was looked at."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CatalogueOption(Piece):
    """One option of a catalogue."""

    name: Annotated[str, "As it was given."]
    status: Annotated[OptionStatus, "What became of it."]
    objective: Annotated[float, "Of its best design; inf without one."]
    least: Annotated[float, "What its objective cannot fall below, by its mass alone."]
    values: Annotated[Mapping[str, float], "Variable to value of its best design; empty without variables."]


VERIFIED = "Its whole response was computed with all harmonics."
FEWER_HARMONICS = "Ranked with fewer harmonics; those that count are computed with all of them."
PEAKS_OPEN = "Its response was computed, but a higher peak may lie between its points."
NOMINAL = "The best without the uncertainty; what that does to it is looked at next."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BestSoFar(Piece):
    """The best design of a search on its way; the result may be another."""

    values: Annotated[Mapping[str, float], "The design."]
    peak: Annotated[
        float, "Its highest peak [m]; of a robust design the highest over the scenarios looked at."
    ]
    objective: Annotated[float, "What is minimised."]
    feasible: Annotated[bool, "Whether it keeps the limits."]
    verified: Annotated[
        bool, "Whether these are the numbers of whole responses of the problem as it was asked."
    ]
    words: Annotated[str, "What is known of it, a sentence."]
    evaluations: Annotated[int, "Designs, of a tracked peak responses, looked at when it was found."]


OnBest = Callable[[BestSoFar], None] | None


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CurveCheck(Piece):
    """The peak of the performance curve at its optimum, beside exact ones."""

    JSON: ClassVar = (
        "mode shared curves synthesised corrected exact estimate error tolerance suffices holds curve_seconds"
        " correction_seconds response_seconds seconds_saved"
    )

    mode: Annotated[int, "Number of the mode that the curve is of."]
    shared: Annotated[bool, "One curve served all designs, because forces, loads and motions grow together."]
    curves: Annotated[int, "Curves followed."]
    synthesised: Annotated[float, "Peak of the curve at its optimum [m]."]
    corrected: Annotated[
        float,
        "What the whole balance next to the synthesised motion makes of it [m]; NaN if that was not found.",
    ]
    exact: Annotated[float, "Highest peak of the whole response [m]; NaN if it could not be computed."]
    tolerance: Annotated[float, "Relative error up to which the curve suffices."]
    curve_seconds: Annotated[float, "What the search on curves took [s]."]
    correction_seconds: Annotated[float, "What the correction took [s]."]
    response_seconds: Annotated[float, "What the whole response took [s]."]
    exact_responses: Annotated[float, "The work of an exact search, in whole responses, at least."]

    @property
    def estimate(self) -> float:
        """Relative error of the curve's peak by the correction, without a whole response; NaN if unknown."""
        return self.synthesised / self.corrected - 1.0

    @property
    def error(self) -> float:
        """Relative error of the curve's peak."""
        return self.synthesised / self.exact - 1.0

    @property
    def suffices(self) -> bool:
        """Whether the estimate alone says that the curve suffices."""
        return abs(self.estimate) <= self.tolerance

    @property
    def holds(self) -> bool:
        """Whether the curve is as good as asked for, by the whole response."""
        return abs(self.error) <= self.tolerance

    @property
    def seconds_saved(self) -> float:
        """Time [s] saved against an exact search of the least work; below 0 if that had been quicker."""
        spent = self.curve_seconds + self.correction_seconds + self.response_seconds
        return self.exact_responses * self.response_seconds - spent

    def to_json(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return self._json(holds=math.isfinite(self.error) and self.holds)
