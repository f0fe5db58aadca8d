"""What is marked on a branch: folds, points where other branches leave, its end, and what is not stable.

`solver.response.stability.bifurcations` finds them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
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
    """A place on a branch."""

    kind: Annotated[MarkKind, "What happens there."]
    at: Annotated[float, "Parameter value, in user units."]
    amplitude: Annotated[float, "max|x| of the observed DOF there [m]."]
    solution: Annotated[Real, "Slip motions [m] with λ (inside unit) last, (n_unknowns + 1,)."]
    after: Annotated[int, "The point of the branch it comes behind."]
    corner: Annotated[bool, "Of a fold: a contact changes its state there."] = False
    why: Annotated[str, "Of an end: how the branch ended."] = ""

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
    """Stability along a branch, and its marks."""

    JSON: ClassVar = "known_by parameter_path=parameter unstable=stretches marks seconds"

    unstable: Annotated[
        NDArray[np.bool_], "Points at which a perturbation grows, as far as `known_by` sees, (P,)."
    ]
    marks: Annotated[tuple[Mark, ...], "In their order along the branch."]
    known_by: Annotated[
        str,
        "``uniqueness``: loads are given and everything takes out power, so that all points are stable; "
        "``determinant``: real perturbations of the same period alone are seen; ``multipliers``: all are.",
    ]
    parameter: Annotated[str, "Path of the parameter."]
    seconds: Annotated[float, "What it took."]

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
