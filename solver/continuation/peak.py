"""What a branch is looked at for: its peaks, and the band in which the amplitude exceeds a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from solver.arrays import Real
from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Peak(Piece):
    """A local maximum of the amplitude along a branch, polished to the stationary point."""

    JSON: ClassVar = "value at"

    value: Annotated[float, "max|x| of the observed DOF [m]."]
    at: Annotated[float, "Parameter value there, in user units (Hz for a frequency)."]
    solution: Annotated[Real, "Slip motions of the contacts there [m], (n_unknowns,)."]
    interior: Annotated[bool, "A true maximum, not an end of the branch."]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Edge(Piece):
    """An end of an interval in which the amplitude exceeds a limit: where it equals the limit, or a fold."""

    at: Annotated[float, "Parameter value, in user units."]
    solution: Annotated[Real, "Slip motions of the contacts there [m], (n_unknowns,)."]
    opens: Annotated[bool, "The interval begins here; otherwise it ends here."]
    fold: Annotated[bool, "The branch turns back here, above the limit."] = False
    corner: Annotated[bool, "It does so where a contact changes its state: the end has no derivative."] = (
        False
    )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Band(Piece):
    """Where the amplitude exceeds a limit."""

    limit: Annotated[float, "The limit [m]."]
    width: Annotated[float, "Measure of {parameter : amplitude > limit}, in user units (Hz for a frequency)."]
    intervals: Annotated[tuple[tuple[float, float], ...], "Its intervals, ascending."]
    edges: Annotated[
        tuple[Edge, ...], "The interval ends inside the branch (an end of the range itself is not one)."
    ]
    known: Annotated[
        bool,
        "Wherever the amplitude may cross the limit between two points, that was settled by solutions; see "
        "also `Branch.peak_certificate`.",
    ] = True
