"""Why no higher peak hides between two points of a branch, or that it is not known."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakCertificate(Piece):
    """What is known of the amplitude between the points of a branch.

    It is about the branch as it was computed, with its harmonics: what the harmonics left out may change is
    the error estimate, and another branch of a law that allows several is not on this one.
    """

    known: Annotated[
        bool,
        "No peak of the branch is higher than `bound`, and every peak above 1 % of the highest is listed.",
    ]
    reason: Annotated[str, "Why, or why it is not known."]
    bound: Annotated[
        float,
        "What the amplitude does not exceed between points [m]: of the cubics through them, which near the "
        "top are checked by their neighbours or by solutions between, and of the motion predicted at every "
        "resonance of the structure with its contacts that is narrower than the points are apart. NaN if "
        "not known.",
    ]
    widest_gap: Annotated[
        float, "Largest distance between neighbouring points, in units of the parameter (Hz for a frequency)."
    ]
    resonances: Annotated[int, "Narrow resonances between points that were solved for."]


def certified(*, bound: float, gap: float, resonances: int) -> PeakCertificate:
    """Return the certificate of a branch on which everything was settled."""
    solved = "" if resonances == 0 else f" {resonances} of them between points were solved for."
    reason = (
        "Every resonance of the structure with its contacts is as broad as the points are apart, or too "
        f"weakly driven to matter, or solved for.{solved}"
    )
    return PeakCertificate(known=True, reason=reason, bound=bound, widest_gap=gap, resonances=resonances)


def uncertain(why: str, gap: float = math.nan) -> PeakCertificate:
    """Return the certificate of a branch of which something is not known."""
    return PeakCertificate(
        known=False, reason=f"Not known: {why}.", bound=math.nan, widest_gap=gap, resonances=0
    )


def unsettled(certificates: Iterable[PeakCertificate]) -> list[str]:
    """Return why it is not known of some branches that no peak hides between points, each reason once."""
    return list(dict.fromkeys(one.reason for one in certificates if not one.known))
