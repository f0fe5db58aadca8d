"""The branches that leave another at its branch points.

At a simple branch point [dr/du dr/dλ] has two null vectors: the tangent t of the branch and one across it, v.
The other branch is met on the plane a small way along v from the point, orthogonal to v (H. B. Keller, in
Applications of Bifurcation Theory, ed. P. H. Rabinowitz, 1977, p. 359: switching by a parallel plane), on
both sides, and followed from there away from the point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import Balance
from solver.balance.kernels.newton import arc_newton
from solver.balance.workspace import Workspace
from solver.continuation.branch import AnyBranch, Branch
from solver.continuation.branches.sweep import sweep
from solver.continuation.continuation_settings import ContinuationSettings
from solver.continuation.marks import Mark, MarkKind
from solver.continuation.segment import Course
from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.response.stability.bifurcations import bifurcations
from solver.results.told import Piece

AWAY = (1e-3, 3e-3, 1e-2, 3e-2, 0.1)  # of the size of the motion: how far from the point the branch is met
_ASIDE = 3.0  # times as far: a solution further from the guess is on another branch
_MOST = 30  # Newton iterations
_ORBITS = "must be of contacts with finite stiffnesses: exact orbits are not followed past branch points"


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
    points = [mark for mark in found if mark.kind is MarkKind.BRANCH_POINT]
    return tuple(_switched(branch, mark, settings) for mark in points)


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


def _switched(branch: Branch, mark: Mark, settings: ContinuationSettings | None) -> Switched:
    inside = branch.balance.parameter.inside
    span = abs(inside(branch.stop) - inside(branch.start))
    found = leaving(branch.balance, mark, branch.tangents[mark.after], span)
    followed = tuple(_followed(branch, beside, mark.solution, settings) for beside in found.beside)
    return Switched(mark=mark, tangents=found.tangents, branches=followed)


def _followed(branch: Branch, beside: Real, place: Real, settings: ContinuationSettings | None) -> Branch:
    """Follow a branch from a solution beside a branch point, away from it in the parameter."""
    balance = branch.balance
    low, high = sorted((branch.start, branch.stop))
    at = float(balance.parameter.outside(float(beside[-1])))
    onward = high if beside[-1] >= place[-1] else low
    hertz = None if branch.parameter == "frequency" else balance.system.omega / (2.0 * math.pi)
    return sweep(
        balance.scene, branch.parameter, min(max(at, low), high), onward, harmonics=balance.n_harmonics,
        frequency_hz=hertz, settings=settings, effects=balance.effects,
        course=Course(guess=beside[:-1].copy()),
    )  # fmt: skip
