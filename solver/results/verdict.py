"""Whether a response is stable, as answers carry it: yes, no, or not known and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from solver.results.told import Piece


class Stable(Enum):
    """Whether small perturbations die out; the value is the word in answers."""

    YES = "yes"
    NO = "no"
    NOT_KNOWN = "not known"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verdict(Piece):
    """Whether a response is stable, and how that is known."""

    stable: Annotated[Stable, "Whether small perturbations die out: yes, no, or not known."]
    ground: Annotated[
        str,
        "Why, in one line; of a response that is not stable also a stable one of the same frequency, if "
        "the search of `solve_all` finds one.",
    ]

    def to_json(self) -> dict[str, str]:
        """Return it as entries of an answer."""
        return {"stable": self.stable.value, "stable_ground": self.ground}

    @property
    def line(self) -> str:
        """It in one line."""
        return f"{self.stable.value}: {self.ground}"


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the verdict of several responses: no if one is not stable, yes if all are."""
    if not verdicts:
        return Verdict(stable=Stable.NOT_KNOWN, ground="there is no response")
    order = (Stable.NO, Stable.NOT_KNOWN, Stable.YES)
    return min(verdicts, key=lambda each: order.index(each.stable))
