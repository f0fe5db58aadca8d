"""The local optima of a design search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

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
