"""Peaks of a branch and the band above a limit, polished on the branch itself.

max|x| is the larger of max x and −min x, and each of these is smooth along a branch between changes of
contact state. First the branch is made dense: both sides of changes of what contacts do are solved for
(`solver.continuation.extrema.kernels.change_search`), so are narrow resonances that stand between its points
(`solver.continuation.extrema.resonance_search`), and near the top cubics through its points have to predict
the solutions between them. A maximum then shows between two points as a change of sign of its slope along the
arc, a band edge as a change of sign of amplitude − limit; both are refined by solving on the arc between the
points, so that folds need no special care. All that is compiled and works on one table of points
(`solver.continuation.extrema.kernels.node_table`); what could not be settled is said in the certificate
(`solver.continuation.branch`).

Where a normal load varies the motion is lopsided, and max|x| is the larger of two curves over the frequency.
A peak of the other one is no peak of max|x|, but a parameter may make it one: it is worth following, and a
sweep shows it for nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.balance.balance import Kind
from solver.balance.closed_loop_poles import ClosedLoop
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS
from solver.continuation.branch import Band, Branch, Edge, Peak, PeakCertificate, Points, certified, uncertain
from solver.continuation.extrema.kernels.change_search import settle_changes
from solver.continuation.extrema.kernels.node_table import WHY, WORTH_POLISHING
from solver.continuation.extrema.kernels.peak_search import NEAR_THE_TOP, PREDICTED, find_band, find_peaks
from solver.continuation.extrema.nodes import NodeSolver
from solver.continuation.extrema.resonance_search import ResonanceSearch, Search
from solver.jit.fourier import Integer, Real

if TYPE_CHECKING:
    from solver.balance.workspace import Workspace

_CURVES = ((HIGH, HIGH_SLOPE, 1.0), (LOW, LOW_SLOPE, -1.0))
_HIDDEN = 1e-9  # relative distance below max|x| from which a curve is hidden

HALF_POWER = 1.0 / math.sqrt(2.0)
COMPETES_FOR_HIGHEST = 0.8  # share of the highest point from which a maximum may turn out to be the highest


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """A peak, as near as the points of the branch are."""

    value: Annotated[float, "The higher of the two points it lies between [m]."]
    omega: Annotated[float, "rad/s."]
    solution: Annotated[Real, "Slip motions there [m], (n_unknowns,)."]
    sign: Annotated[float, "1 for a peak of max x, −1 for one of −min x."]


def rivals(branch: Branch) -> list[Rival]:
    """Return the hidden peaks of a branch over the frequency, highest first."""
    return _crests(branch.solutions, branch.measures, hidden=True)


def crests(solutions: Real, measures: Real) -> list[Rival]:
    """Return the peaks of max|x| between points of a walk over the frequency, highest first.

    Parameters
    ----------
    solutions : (P, n_unknowns + 1) slip motions [m] and ω [rad/s].
    measures : (P, MEASURES) columns named in `solver.balance.kernels.output`.
    """
    return _crests(solutions, measures, hidden=False)


def _crests(solutions: Real, measures: Real, *, hidden: bool) -> list[Rival]:
    """Return the peaks of max x and of −min x that the larger of the two hides, or those it does not."""
    found = []
    for value, slope, sign in _CURVES:
        rising, falling = measures[:-1, slope], measures[1:, slope]
        wanted = (measures[:, value] < (1.0 - _HIDDEN) * measures[:, MAX_ABS]) == hidden
        for left in np.flatnonzero((rising > 0.0) & (falling <= 0.0) & wanted[:-1] & wanted[1:]):
            share = rising[left] / (rising[left] - falling[left])
            between = (1.0 - share) * solutions[left] + share * solutions[left + 1]
            height = float(measures[left : left + 2, value].max())
            found.append(
                Rival(value=height, omega=float(between[-1]), solution=between[:-1].copy(), sign=sign)
            )
    return sorted(found, key=lambda rival: -rival.value)


class Survey:
    """Looks for peaks and band edges on a branch; counts the Newton iterations it spends.

    Parameters
    ----------
    solver : of the branch, with its points.
    order : rows of its table along the branch, all of them in their order if left out.
    highest_alone : whether the highest peak is all that is wanted. Then the branch is made dense where that
        may stand alone, and the points may be as far apart as those of `solver.continuation.branches.sweep`.
    worth : share of the highest point below which nothing stands that is looked for.
    """

    def __init__(
        self, solver: NodeSolver, order: Integer | None = None, *, highest_alone: bool = False,
        worth: float = WORTH_POLISHING,
    ) -> None:  # fmt: skip
        self._solver, self._search = solver, Search()
        self._balance = balance = solver.workspace.balance
        solver.begin(order)
        worth = COMPETES_FOR_HIGHEST if highest_alone else worth
        if solver.order.size:
            solver.run(settle_changes, worth, highest_alone)
            if solver.order.size > 1 and ClosedLoop.serves(balance):
                self._search = ResonanceSearch(solver, worth if worth > WORTH_POLISHING else 0.0).run()
            solver.run(find_peaks, worth, highest_alone)
        self.order: Integer = solver.order  # rows of the table, with what was solved for between the points

    @classmethod
    def of(cls, workspace: Workspace, points: Points, worth: float = WORTH_POLISHING) -> Survey:
        """Return the survey of a branch."""
        return cls(NodeSolver(workspace, points), worth=worth)

    @property
    def spent(self) -> int:
        """Newton iterations."""
        return self._solver.spent

    @property
    def points(self) -> Points:
        """The branch with everything that was solved for between its points, peaks included."""
        return self._solver.points_of(self.order)

    @property
    def peaks(self) -> tuple[Peak, ...]:
        """Every local maximum of max|x|, highest first; the ends of the branch are in it too."""
        table, rows = self._solver.table, self._solver.peaks
        rows = rows[np.argsort(-table.measures[rows[:, 0], MAX_ABS], kind="stable")]
        outside = self._balance.parameter.outside
        return tuple(
            Peak(
                value=float(table.measures[row, MAX_ABS]), at=float(outside(float(table.solutions[row, -1]))),
                solution=table.solutions[row, :-1].copy(), interior=bool(interior),
            )
            for row, interior in rows.tolist()
        )  # fmt: skip

    def certificate(self, *, completed: bool) -> PeakCertificate:
        """Say why no higher peak hides between two points, or why that is not known."""
        parameter, table = self._balance.parameter, self._solver.table
        if not self.order.size or not completed:
            return uncertain("the branch does not cover the range")
        gap = float(np.abs(np.diff(parameter.all_outside(table.solutions[self.order, -1]))).max(initial=0.0))
        if parameter.kind is Kind.STRUCTURE:
            return uncertain("resonances between points are looked for over the frequency alone", gap)
        undone = [*self._search.left, *((at, WHY[int(why)]) for at, why in self._solver.undone)]
        if undone:
            at, why = undone[0]
            return uncertain(f"{why} at {float(parameter.outside(at)):.6g}", gap)
        top = float(table.measures[self._solver.peaks[:, 0], MAX_ABS].max())
        bound = max(self._search.unseen, top)
        if self.order.size > 1 and self._solver.look(top).reach.max() >= NEAR_THE_TOP * top:
            # There cubics are known to be right to their share of it.
            bound = max(bound, top * (1.0 + PREDICTED))
        return certified(bound=bound, gap=gap, resonances=self._search.solved)

    def band(self, limit: float) -> Band:
        """Return where the amplitude exceeds `limit` [m], anywhere on the branch."""
        outside = self._balance.parameter.outside
        pieces, crossings, folds, smooth, known = self._solver.run(find_band, limit)
        ends = np.sort(self._balance.parameter.all_outside(pieces.ravel().copy()).reshape(-1, 2))
        merged = _merge([(low, high) for low, high in ends.tolist()])
        turned = self._solver.table.solutions[folds]
        corners = [None] * len(crossings) + [not one for one in smooth.tolist()]  # None: it is no fold
        edges = []
        for place, corner in zip([*crossings, *turned], corners, strict=True):
            at = float(outside(float(place[-1])))
            edges += [
                Edge(
                    at=at, solution=place[:-1].copy(), opens=at == low, fold=corner is not None,
                    corner=bool(corner),
                )
                for low, high in merged if at in (low, high)
            ]  # fmt: skip
        width = float(sum(high - low for low, high in merged))
        return Band(limit=limit, width=width, intervals=tuple(merged), edges=tuple(edges), known=known)


def band_limit(limit: float | None, peaks: tuple[Peak, ...], kind: Kind) -> float | None:
    """Return the limit of the band: the one asked for, else half power; None where a band has no meaning."""
    if not peaks or kind is not Kind.FREQUENCY:
        return None
    return limit if limit is not None else peaks[0].value * HALF_POWER


def _merge(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the union of intervals (a folded branch passes a frequency more than once)."""
    merged: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if merged and low <= merged[-1][1] * (1.0 + 1e-12):
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged
