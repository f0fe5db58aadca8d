"""What a branch is looked at for: its peaks, and the band in which the amplitude exceeds a limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from solver.jit.fourier import Real
from solver.results.told import Piece


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Peak(Piece):
    """A local maximum of the amplitude along a branch, polished to the stationary point.

    Attributes
    ----------
    value : float
        max|x| of the observed DOF [m].
    at : float
        Parameter value there, in user units (Hz for a frequency).
    solution : (n_unknowns,) array
        Slip motions of the contacts there [m].
    interior : bool
        A true maximum, not an end of the branch.
    """

    UNITS: ClassVar[Mapping[str, str]] = {"value": "m"}
    JSON: ClassVar = "value at"

    value: float
    at: float
    solution: Real
    interior: bool


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Edge(Piece):
    """An end of an interval in which the amplitude exceeds a limit: where it equals the limit, or a fold.

    Attributes
    ----------
    at : float
        Parameter value, in user units.
    solution : (n_unknowns,) array
        Slip motions of the contacts there [m].
    opens : bool
        The interval begins here; otherwise it ends here.
    fold : bool
        The branch turns back here, above the limit.
    corner : bool
        It does so where a contact changes its state: the end has no derivative.
    """

    at: float
    solution: Real
    opens: bool
    fold: bool = False
    corner: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Band(Piece):
    """Where the amplitude exceeds a limit.

    Attributes
    ----------
    limit : float
        The limit [m].
    width : float
        Measure of {parameter : amplitude > limit}, in user units (Hz for a frequency).
    intervals : tuple of (low, high)
        Its intervals, ascending.
    edges : tuple of Edge
        The interval ends inside the branch (an end of the range itself is not one).
    known : bool
        Wherever the amplitude may cross the limit between two points, that was settled by solutions; see
        also `Branch.peak_certificate`.
    """

    UNITS: ClassVar[Mapping[str, str]] = {"limit": "m"}

    limit: float
    width: float
    intervals: tuple[tuple[float, float], ...]
    edges: tuple[Edge, ...]
    known: bool = True
