"""Where a branch turns back, where another branch leaves it, where it ends, and which of it is not stable.

Along a branch the determinant of dr/du is that of 1 minus the monodromy matrix but for a positive factor: it
is negative where an odd number of real perturbations of the same period grows. Its sign changes at a fold,
where the parameter turns too, and at a simple branch point, where it does not (W. Govaerts, Numerical Methods
for Bifurcations of Dynamical Equilibria, 2000, chapters 3 and 8, doi:10.1137/1.9780898719543). Where a motion
goes over to twice its period, or a second frequency grows, Floquet multipliers alone tell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from solver.balance.balance import Balance
from solver.balance.kernels.jacobian import factorise
from solver.balance.kernels.output import MAX_ABS
from solver.balance.workspace import Workspace
from solver.continuation.branch import AnyBranch, Branch, BranchStatus, Points
from solver.continuation.branches.point_by_point import is_unique
from solver.continuation.extrema.node_table import PointRow
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.folds import fold_between
from solver.continuation.marks import Bifurcations, Mark, MarkKind
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.response.stability.floquet import branch_stability
from solver.response.stability.multipliers import Growth

LARGE = 1200  # unknowns above which no result looks by itself
_HALVINGS = 40
_MULTIPLIERS = 14  # halvings with multipliers, which cost more
_NEAR = 1e-9  # relative width of the interval a branch point is known to


_CROSSED = {Growth.PERIOD_DOUBLING: MarkKind.PERIOD_DOUBLING, Growth.TORUS: MarkKind.TORUS}


def bifurcations(branch: AnyBranch, *, multipliers: bool = False) -> Bifurcations:
    """Return which points of a branch are not stable, and its folds, branch points and early end.

    Parameters
    ----------
    branch : from `sweep`.
    multipliers : with Floquet multipliers at every point, which cost more than the branch itself: then
        period doublings and second frequencies are seen too.

    Raises
    ------
    SettingError
        With `multipliers`: a law that does not say how it is perturbed.
    """
    begun = clock()
    if not isinstance(branch, Branch):
        return branch.bifurcations  # exact orbits come with their multipliers
    count, unique, marks = len(branch.values), is_unique(branch.balance), tuple[Mark, ...]()
    unstable, known_by = np.zeros(count, bool), "uniqueness" if unique and count else "determinant"
    if count and not (unique and branch.reached):
        nothing = np.zeros((count, branch.balance.n_coefficients))
        along = Along(branch.balance, Points.of(branch, observed=nothing))
        if not unique and multipliers:
            unstable, marks, known_by = *_by_multipliers(branch, along), "multipliers"
        elif not unique:
            unstable, marks = along.signs < 0.0, along.by_determinant()
        marks = (*marks, *_end(branch, along))
    return Bifurcations(
        unstable=unstable, marks=marks, known_by=known_by, parameter=branch.parameter,
        seconds=clock() - begun,
    )  # fmt: skip


def of_branch(branch: Branch) -> Bifurcations:
    """Return `bifurcations`, or nothing but the end for a branch whose matrices take long."""
    if branch.balance.n_unknowns <= LARGE or is_unique(branch.balance):
        return bifurcations(branch)
    return Bifurcations(
        unstable=np.zeros(len(branch.values), bool), marks=(), known_by="nothing: it is large",
        parameter=branch.parameter, seconds=0.0,
    )  # fmt: skip


class Along:
    """Points along a branch with the sign of the determinant of dr/du at each of them."""

    def __init__(self, balance: Balance, points: Points) -> None:
        self.balance, self.workspace = balance, Workspace.of(balance)
        self.solver = NodeSolver(self.workspace)
        self.nodes = self.solver.nodes_of(points)
        self._signs: Real | None = None

    @property
    def signs(self) -> Real:
        """The sign of the determinant at every point, 0 where it is singular."""
        if self._signs is None:
            self._signs = np.array([self.sign(node) for node in self.nodes])
        return self._signs

    def sign(self, node: PointRow) -> float:
        """The sign of the determinant at a node."""
        workspace = self.workspace
        workspace.forces(np.ascontiguousarray(node.solution[:-1]), node.at)
        nothing = np.zeros(node.solution.size)
        return float(factorise(workspace.system, workspace.linear, workspace.point, nothing, 0.0, 0.0))

    def by_determinant(self) -> tuple[Mark, ...]:
        """Folds and branch points."""
        marks = []
        for i, (left, right) in enumerate(pairwise(self.nodes)):
            if left.tangent[-1] * right.tangent[-1] < 0.0:
                marks.append(self._fold(i, left, right))
            elif self.signs[i] * self.signs[i + 1] < 0.0:
                sign = self.signs[i]
                node = self.halved(i, partial(self._has_sign, sign), _HALVINGS)
                marks.append(self.mark(MarkKind.BRANCH_POINT, node, i))
        return tuple(marks)

    def _has_sign(self, sign: float, node: PointRow) -> bool:
        return self.sign(node) == sign

    def _fold(self, i: int, left: PointRow, right: PointRow) -> Mark:
        found = fold_between(partial(self.solver.between, left, right), left, right)
        node, smooth = found or (left, True)
        return self.mark(MarkKind.FOLD, node, i, corner=not smooth)

    def halved(self, i: int, like_the_left: Callable[[PointRow], bool], most: int) -> PointRow:
        """The last node behind point i that is like it, by halving."""
        left, right = self.nodes[i], self.nodes[i + 1]
        for _ in range(most):
            middle = self.solver.between(left, right, 0.5)
            if middle is None:
                break
            left, right = (middle, right) if like_the_left(middle) else (left, middle)
            if abs(right.at - left.at) <= _NEAR * abs(left.at):
                break
        return left

    def mark(
        self, kind: MarkKind, node: PointRow, after: int, *, corner: bool = False, why: str = ""
    ) -> Mark:
        """A mark at a node behind a point."""
        outside = self.balance.parameter.outside
        return Mark(
            kind=kind, at=float(outside(node.at)), amplitude=float(node.measures[MAX_ABS]),
            solution=node.solution.copy(), after=after, corner=corner, why=why,
        )  # fmt: skip


def _by_multipliers(branch: Branch, along: Along) -> tuple[NDArray[np.bool_], tuple[Mark, ...]]:
    """Points that are not stable, and marks of every kind."""
    found = branch_stability(branch)
    marks = list(along.by_determinant())
    taken = {mark.after for mark in marks}

    def like(stable: bool, node: PointRow) -> bool:
        values = branch.balance.parameter.all_outside(np.array([node.at]))
        point = replace(branch, values=values, solutions=node.solution[None, :])
        return branch_stability(point)[0].stable == stable

    for i, (here, there) in enumerate(pairwise(found)):
        kind = _CROSSED.get((there if here.stable else here).growth)
        if here.stable == there.stable or kind is None or i in taken:
            continue
        node = along.halved(i, partial(like, here.stable), _MULTIPLIERS)
        marks.append(along.mark(kind, node, i))
    unstable = np.array([not each.stable for each in found])
    return unstable, tuple(sorted(marks, key=lambda mark: mark.after))


def _end(branch: Branch, along: Along) -> tuple[Mark, ...]:
    """The last point, where the branch did not reach the end of the range."""
    if branch.reached or branch.status is BranchStatus.ACCURACY_NOT_REACHED:
        return ()
    last = along.nodes[-1]
    return (along.mark(MarkKind.END, last, len(along.nodes) - 1, why=branch.status.value),)
