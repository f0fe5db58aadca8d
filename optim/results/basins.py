"""The local optima of a design search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

SAME_PLACE = 1e-3  # scaled distance within which two optima are one


@dataclass(frozen=True, slots=True, kw_only=True)
class Basin:
    """A local optimum.

    Attributes
    ----------
    values : mapping
        Variable name to value.
    peak : float
        Highest peak [m].
    objective : float
        What is minimised.
    settled, feasible : bool
        Whether the first-order conditions hold and the limits are kept there.
    proven : bool
        Whether a response there was computed, so that no peak is higher than `peak`. A further basin of the
        tracked peak is solved for along the peaks that were followed: it is at least that high.
    """

    values: Mapping[str, float]
    peak: float
    objective: float
    settled: bool
    feasible: bool
    proven: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """A local optimum again with more harmonics.

    Attributes
    ----------
    values : mapping
        Variable name to value.
    harmonics : int
        Highest harmonic kept.
    peak, objective : float
        Highest peak [m] and what is minimised; NaN where a response could not be computed.
    feasible : bool
        Whether the limits are kept.
    """

    values: Mapping[str, float]
    harmonics: int
    peak: float
    objective: float
    feasible: bool
