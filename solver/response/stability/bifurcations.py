"""Where a branch turns back, where another branch leaves it, where it ends, and which of it is not stable.

Along a branch the determinant of dr/du is that of 1 minus the monodromy matrix but for a positive factor: it
is negative where an odd number of real perturbations of the same period grows. Its sign changes at a fold,
where the parameter turns too, and at a simple branch point, where it does not (W. Govaerts, Numerical Methods
for Bifurcations of Dynamical Equilibria, 2000, chapters 3 and 8, doi:10.1137/1.9780898719543). Where a motion
goes over to twice its period, or a second frequency grows, Floquet multipliers alone tell.

At a simple branch point [dr/du dr/dλ] has two null vectors: the tangent t of the branch and one across it, v.
The other branch is met on the plane a small way along v from the point, orthogonal to v (H. B. Keller, in
Applications of Bifurcation Theory, ed. P. H. Rabinowitz, 1977, p. 359: switching by a parallel plane), on
both sides, and followed from there away from the point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from solver.balance.balance import Balance
from solver.balance.kernels.jacobian import factorise
from solver.balance.kernels.newton import arc_newton
from solver.balance.kernels.output import MAX_ABS
from solver.balance.workspace import Workspace
from solver.continuation.branch import AnyBranch, Bifurcations, Branch, BranchStatus, Mark, MarkKind, Points
from solver.continuation.branches.point_by_point import is_unique
from solver.continuation.branches.sweep import sweep
from solver.continuation.extrema.kernels.node_table import NOWHERE, PointRow
from solver.continuation.extrema.kernels.peak_search import fold_of
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.stretches import Course
from solver.continuation.walk import ContinuationSettings
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.response.stability.floquet import branch_stability
from solver.response.stability.multipliers import Growth
from solver.results.told import Piece

LARGE = 1200  # unknowns above which no result looks by itself
_HALVINGS = 40
_MULTIPLIERS = 14  # halvings with multipliers, which cost more
_NEAR = 1e-9  # relative width of the interval a branch point is known to


_CROSSED = {Growth.PERIOD_DOUBLING: MarkKind.PERIOD_DOUBLING, Growth.TORUS: MarkKind.TORUS}

AWAY = (1e-3, 3e-3, 1e-2, 3e-2, 0.1)  # of the size of the motion: how far from the point the branch is met
_ASIDE = 3.0  # times as far: a solution further from the guess is on another branch
_MOST = 30  # Newton iterations
_ORBITS = "must be of contacts with finite stiffnesses: exact orbits are not followed past branch points"


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
        along = BranchSigns(branch.balance, Points.of(branch, observed=nothing))
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


class BranchSigns:
    """Points along a branch with the sign of the determinant of dr/du at each of them."""

    def __init__(self, balance: Balance, points: Points) -> None:
        self.balance, self.workspace = balance, Workspace.of(balance)
        self.solver = NodeSolver(self.workspace, points)
        self.nodes = self.solver.nodes(self.solver.order)
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

        def alike(sign: float, node: PointRow) -> bool:
            return self.sign(node) == sign

        for i, (left, right) in enumerate(pairwise(self.nodes)):
            if left.tangent[-1] * right.tangent[-1] < 0.0:
                row, smooth = self.solver.run(fold_of, left.number, right.number)
                node = left if row == NOWHERE else self.solver.nodes([row])[0]
                marks.append(self.mark(MarkKind.FOLD, node, i, corner=not smooth))
            elif self.signs[i] * self.signs[i + 1] < 0.0:
                node = self.halved(i, partial(alike, self.signs[i]), _HALVINGS)
                marks.append(self.mark(MarkKind.BRANCH_POINT, node, i))
        return tuple(marks)

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


def _by_multipliers(branch: Branch, along: BranchSigns) -> tuple[NDArray[np.bool_], tuple[Mark, ...]]:
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


def _end(branch: Branch, along: BranchSigns) -> tuple[Mark, ...]:
    """The last point, where the branch did not reach the end of the range."""
    if branch.reached or branch.status is BranchStatus.ACCURACY_NOT_REACHED:
        return ()
    last = along.nodes[-1]
    return (along.mark(MarkKind.END, last, len(along.nodes) - 1, why=branch.status.value),)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Switched(Piece):
    """What leaves a branch at a branch point."""

    mark: Annotated[Mark, "The branch point."]
    tangents: Annotated[
        Real,
        "Directions of the branch itself and of the other one there; motions relative to their size, λ "
        "relative to the range, of length 1, (2, n_unknowns + 1).",
    ]
    branches: Annotated[
        tuple[Branch, ...],
        "The other branch on both sides of the point, each followed to an end of the range; fewer where "
        "one side was not met.",
    ]


def switch_branches(
    branch: AnyBranch, *, marks: tuple[Mark, ...] | None = None, settings: ContinuationSettings | None = None
) -> tuple[Switched, ...]:
    """Follow the branches that leave another at its branch points, to the ends of its range.

    Parameters
    ----------
    branch : from `sweep`.
    marks : its branch points; those `bifurcations` finds if left out.
    settings : of the continuation.

    Raises
    ------
    SettingError
        Exact orbits, which are not continued past such points.
    """
    if not isinstance(branch, Branch):
        raise SettingError("branches", branch.scene.name, _ORBITS)
    found = bifurcations(branch).marks if marks is None else marks
    inside, switched = branch.balance.parameter.inside, list[Switched]()
    span = abs(inside(branch.stop) - inside(branch.start))
    for mark in found:
        if mark.kind is MarkKind.BRANCH_POINT:
            other = leaving(branch.balance, mark, branch.tangents[mark.after], span)
            followed = tuple(_followed(branch, beside, mark.solution, settings) for beside in other.beside)
            switched.append(Switched(mark=mark, tangents=other.tangents, branches=followed))
    return tuple(switched)


class _Scaled:
    """The balance at a branch point in variables of size 1."""

    def __init__(self, balance: Balance, mark: Mark, span: float) -> None:
        self.workspace = Workspace.of(balance)
        size = float(np.abs(mark.solution[:-1]).max())
        self.scale = np.append(np.full(mark.solution.size - 1, size), span)
        self.place = mark.solution

    def across(self, tangent: Real) -> Real:
        """Return the null vector of [dr/du dr/dλ] orthogonal to the tangent, both of length 1."""
        n = self.place.size - 1
        _, point = self.workspace.evaluate(np.ascontiguousarray(self.place[:-1]), float(self.place[-1]))
        rows = np.zeros((n + 1, n + 1))
        rows[:n, :n], rows[:n, n] = point.jacobian, point.dr_dp
        rows[:n] *= self.scale / self.scale[0]
        rows[n] = tangent * float(np.abs(rows[:n]).max())
        across = np.linalg.svd(rows)[2][-1]
        across -= tangent * float(tangent @ across)
        return np.asarray(across / np.linalg.norm(across))

    def beside(self, across: Real, by: float) -> Real | None:
        """Return the solution (u, λ) on the plane a way along `across`, near it; None if there is none."""
        guess = self.place + by * across * self.scale
        u, way = guess[:-1].copy(), across * self.scale
        weight_u, weight_p = 1.0 / self.scale[0] ** 2, 1.0 / self.scale[-1] ** 2
        workspace = self.workspace
        good, _, p, _ = arc_newton(
            workspace.system, workspace.linear, u, float(guess[-1]), guess[:-1].copy(), float(guess[-1]), way,
            weight_u, weight_p, workspace.point, _MOST,
        )  # fmt: skip
        found = np.append(u, p)
        off = float(np.linalg.norm((found - guess) / self.scale))
        return found if good and off <= _ASIDE * abs(by) * math.sqrt(found.size) else None


@dataclass(frozen=True, slots=True)
class Leaving:
    """A branch point: both tangents (2, n + 1) as in `Switched`, and solutions with λ last beside it."""

    tangents: Real
    beside: tuple[Real, ...]


def leaving(balance: Balance, mark: Mark, tangent: Real, span: float) -> Leaving:
    """Return where another branch leaves at a branch point.

    Parameters
    ----------
    tangent : (n_unknowns + 1,) of the branch itself; span : range of λ (inside unit).
    """
    scaled = _Scaled(balance, mark, span)
    tangent = tangent / scaled.scale
    tangent /= np.linalg.norm(tangent)
    across = scaled.across(tangent)
    ways, found = [], []
    for side in (1.0, -1.0):
        beside = next((z for by in AWAY if (z := scaled.beside(across, side * by)) is not None), None)
        if beside is not None:
            way = (beside - mark.solution) / scaled.scale
            ways.append(way / np.linalg.norm(way))
            found.append(beside)
    return Leaving(np.array([tangent, ways[0] if ways else across]), tuple(found))


def _followed(branch: Branch, beside: Real, place: Real, settings: ContinuationSettings | None) -> Branch:
    """Follow a branch from a solution beside a branch point, away from it in the parameter."""
    balance = branch.balance
    low, high = sorted((branch.start, branch.stop))
    at = float(balance.parameter.outside(float(beside[-1])))
    onward = high if beside[-1] >= place[-1] else low
    hertz = None if branch.parameter == "frequency" else branch.scene_at(at)[1]
    return sweep(
        balance.scene, branch.parameter, min(max(at, low), high), onward, harmonics=balance.n_harmonics,
        frequency_hz=hertz, settings=settings, effects=balance.effects,
        course=Course(guess=beside[:-1].copy()),
    )  # fmt: skip
