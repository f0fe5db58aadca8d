"""Consecutive points of a branch with all that is needed to go on behind the last of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.jacobian import factorise
from solver.balance.kernels.newton import ACCEPTED
from solver.balance.kernels.output import MEASURES
from solver.balance.kernels.residual import evaluate
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import AT_BRANCH_POINT, evaluation_by_value
from solver.continuation.branch import ROWS, BranchStatus, Points
from solver.continuation.kernels.pseudo_arclength import begin_walk
from solver.continuation.kernels.walk_state import (
    COUNT,
    ITERATIONS,
    NUMBERS,
    Control,
    P,
    Walk,
    walk_by_value,
    weights,
)
from solver.errors import SettingError
from solver.jit.fourier import Integer, Real
from solver.linear.kernels.receptance import receptance
from solver.results.told import Piece

_ENDINGS = tuple(BranchStatus)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stretch(Points, Piece):
    """Some consecutive points of a branch."""

    status: Annotated[BranchStatus | None, "How the branch ended with this stretch; None if it goes on."]
    newton_iterations: Annotated[int, "Since the branch began."]
    rejected_steps: Annotated[int, "Since the branch began."]
    stepped_over: Annotated[int, "Since the branch began."]
    seconds: Annotated[float, "Since the branch began [s]."]
    walk: Annotated[
        Real,
        "The state of the continuation behind the last point; empty if the branch could not begin, (6 "
        "n_unknowns + 18,).",
    ]

    def first(self, count: int) -> Stretch:
        """Return the first points alone, without the state of a continuation, which is that of the last."""
        rows: dict[str, Any] = {name: getattr(self, name)[:count] for name in ROWS}
        return replace(self, **rows, status=None, walk=np.zeros(0))

    def to_arrays(self) -> dict[str, Real | Integer]:
        """Return everything as plain arrays, to be stored."""
        ending = -1 if self.status is None else _ENDINGS.index(self.status)
        counts = [ending, self.newton_iterations, self.rejected_steps, self.stepped_over]
        arrays: dict[str, Real | Integer] = {name: getattr(self, name) for name in ROWS}
        return arrays | {
            "counts": np.array(counts, np.int64), "seconds": np.array([self.seconds]), "walk": self.walk,
        }  # fmt: skip

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Real | Integer]) -> Stretch:
        """Return the stretch of such arrays (KeyError, ValueError or IndexError if they are not that)."""
        real = {name: np.ascontiguousarray(arrays[name], np.float64) for name in (*ROWS, "walk")}
        if real["measures"].shape[1] != MEASURES:
            raise ValueError(f"measures of a branch have {MEASURES} columns")
        ending, iterations, rejected, over = (int(number) for number in arrays["counts"])
        return cls(
            solutions=real["solutions"], tangents=real["tangents"],
            states=np.ascontiguousarray(arrays["states"], np.int64), observed=real["observed"],
            measures=real["measures"], status=None if ending < 0 else _ENDINGS[ending],
            newton_iterations=iterations, rejected_steps=rejected, stepped_over=over,
            seconds=float(arrays["seconds"][0]), walk=real["walk"],
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Where a branch begins, and who is given its points.

    Attributes
    ----------
    guess : (n_unknowns,) or None
        Slip motions [m] to start from, instead of the start-up ladder.
    resume : Stretch or None
        The beginning of the same branch, to go on behind its last point.
    on_stretch : callable or None
        Called with all consecutive points as they are found; `joined` they are what `resume` takes.
    on_points : callable or None
        Called with the new points, at first with those of `resume`: (k,) values in user units, (k,)
        amplitudes [m].
    """

    guess: Real | None = None
    resume: Stretch | None = None
    on_stretch: Callable[[Stretch], None] | None = None
    on_points: Callable[[Real, Real], None] | None = None


def joined(stretches: Sequence[Stretch]) -> Stretch:
    """Return consecutive stretches as one; at least one."""
    rows: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in stretches]) for name in ROWS}
    return replace(stretches[-1], **rows)


def rows_of(balance: Balance, count: int) -> dict[str, Any]:
    """Return empty rows for `count` points, in the order of `ROWS`."""
    nt, n, contacts = balance.n_unknowns, balance.n_coefficients, len(balance.scene.contacts)
    rows = [np.zeros((count, width)) for width in (nt + 1, nt + 1, contacts, n, MEASURES)]
    return dict(zip(ROWS, rows, strict=True)) | {"states": np.zeros((count, contacts), np.int64)}


def state_of(walk: Walk) -> Real:
    """Return the state of a continuation as one array."""
    return np.concatenate(walk_by_value(walk))


def go_on_from(workspace: Workspace, control: Control, stretch: Stretch) -> tuple[Walk, int]:
    """Return the continuation behind the last point of `stretch`, and the iterations before it began.

    The point is evaluated and its matrix factorised as they were when it was found, so that what follows is
    what would have followed.

    Raises
    ------
    SettingError
        The stretch is not of this balance: other sizes, or its last point is no solution.
    """
    balance, system, linear = workspace.balance, workspace.system, workspace.linear
    fits = all(getattr(stretch, name).shape[1:] == row.shape[1:] for name, row in rows_of(balance, 0).items())
    nt = balance.n_unknowns
    if not fits or stretch.walk.size != 6 * nt + 5 + NUMBERS or not len(stretch.solutions):
        raise _foreign(stretch)
    _, state = begin_walk(system, linear, workspace.point, control, stretch.walk[:nt].copy())
    places = walk_by_value(state)
    ends = np.cumsum([place.size for place in places])[:-1]
    for place, values in zip(places, np.split(stretch.walk, ends), strict=True):
        place[:] = values
    numbers = places.numbers
    receptance(system, numbers[P], linear)
    norm = evaluate(system, linear, places.u, numbers[P], 0.0, workspace.point)
    if not norm <= ACCEPTED or numbers[COUNT] < 0:
        raise _foreign(stretch)
    weight_u, weight_p = weights(system, state, control)
    if factorise(system, linear, workspace.point, places.before_tangent, weight_u, weight_p) != 0.0:
        evaluation_by_value(workspace.point).counts[AT_BRANCH_POINT] = 1
    return state, stretch.newton_iterations - int(numbers[ITERATIONS])


def _foreign(stretch: Stretch) -> SettingError:
    points = f"{len(stretch.solutions)} points"
    return SettingError("resume", points, "must be the beginning of the same branch")
