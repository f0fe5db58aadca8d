"""The best design that a search knows while it is still under way, and how well it knows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from solver.results.told import json_number

VERIFIED = "Its whole response was computed with all harmonics."
FEWER_HARMONICS = "Ranked with fewer harmonics; those that count are computed with all of them."
PEAKS_OPEN = "Its response was computed, but a higher peak may lie between its points."
NOMINAL = "The best without the uncertainty; what that does to it is looked at next."


@dataclass(frozen=True, slots=True, kw_only=True)
class BestSoFar:
    """The best design of a search on its way; the result may be another.

    Attributes
    ----------
    values : mapping of variable name to value
        The design.
    peak : float
        Its highest peak [m]; of a robust design the highest over the scenarios looked at.
    objective : float
        What is minimised.
    feasible : bool
        Whether it keeps the limits.
    verified : bool
        Whether these are the numbers of whole responses of the problem as it was asked.
    words : str
        What is known of it, a sentence.
    evaluations : int
        Designs, of a tracked peak responses, looked at when it was found.
    """

    values: Mapping[str, float]
    peak: float
    objective: float
    feasible: bool
    verified: bool
    words: str
    evaluations: int

    def to_json(self) -> dict[str, Any]:
        """The design as JSON."""
        return {
            "values": dict(self.values),
            "peak": json_number(self.peak),
            "objective": json_number(self.objective),
            "feasible": self.feasible,
            "verified": self.verified,
            "words": self.words,
            "evaluations": self.evaluations,
        }


OnBest = Callable[[BestSoFar], None] | None
