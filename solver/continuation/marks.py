"""What is marked on a branch: folds, points where other branches leave, its end, and what is not stable.

`solver.response.stability.bifurcations` finds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from solver.jit.fourier import Real
from solver.results.told import Piece


class MarkKind(Enum):
    """What happens at a mark; the value is what a user reads."""

    FOLD = "fold: the branch turns back in its parameter"
    BRANCH_POINT = "branch point: another branch leaves this one"
    PERIOD_DOUBLING = "period doubling: a motion of twice the period leaves this branch"
    TORUS = "torus: a second frequency grows (Neimark-Sacker)"
    END = "end: the branch goes no further"


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Mark(Piece):
    """A place on a branch.

    Attributes
    ----------
    kind : MarkKind
        What happens there.
    at : float
        Parameter value, in user units.
    amplitude : float
        max|x| of the observed DOF there [m].
    solution : (n_unknowns + 1,) array
        Slip motions [m] with λ (inside unit) last.
    after : int
        The point of the branch it comes behind.
    corner : bool
        Of a fold: a contact changes its state there.
    why : str
        Of an end: how the branch ended.
    """

    UNITS: ClassVar[Mapping[str, str]] = {"amplitude": "m"}

    kind: MarkKind
    at: float
    amplitude: float
    solution: Real
    after: int
    corner: bool = False
    why: str = ""

    def to_json(self) -> dict[str, object]:
        """Return the mark as one JSON object."""
        found: dict[str, object] = {
            "kind": self.kind.name.lower(), "at": self.at, "amplitude": self.amplitude, "after": self.after,
        }  # fmt: skip
        if self.kind is MarkKind.FOLD:
            found["corner"] = self.corner
        return {**found, "why": self.why} if self.why else found


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Bifurcations(Piece):
    """Stability along a branch, and its marks.

    Attributes
    ----------
    unstable : (P,) array of bool
        Points at which a perturbation grows, as far as `known_by` sees.
    marks : tuple of Mark
        In their order along the branch.
    known_by : str
        ``uniqueness``: loads are given and everything takes out power, so that all points are stable;
        ``determinant``: real perturbations of the same period alone are seen; ``multipliers``: all are.
    parameter : str
        Path of the parameter.
    seconds : float
        What it took.
    """

    unstable: NDArray[np.bool_]
    marks: tuple[Mark, ...]
    known_by: str
    parameter: str
    seconds: float

    @property
    def stretches(self) -> tuple[tuple[int, int], ...]:
        """First and last point of every stretch that is not stable."""
        changes = np.flatnonzero(np.diff(np.concatenate([[0], self.unstable.astype(int), [0]])))
        return tuple((int(first), int(last) - 1) for first, last in changes.reshape(-1, 2))

    def of_a_branch(self) -> dict[str, object]:
        """Return what the JSON object of a branch has of it."""
        return {
            "unstable": [list(stretch) for stretch in self.stretches],
            "marks": [mark.to_json() for mark in self.marks],
            "stability_known_by": self.known_by,
        }

    def to_json(self) -> dict[str, object]:
        """Return the answer as one JSON object."""
        return {
            "known_by": self.known_by,
            "parameter_path": self.parameter,
            "unstable": [list(stretch) for stretch in self.stretches],
            "marks": [mark.to_json() for mark in self.marks],
            "seconds": self.seconds,
        }
