"""The best design that a search knows while it is still under way, and how well it knows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

from solver.results.told import Piece

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
