"""Peaks of a branch and the band above a limit, polished on the branch itself.

max|x| is the larger of max x and −min x, and each of these is smooth along a branch between changes of
contact state. First the branch is made dense: narrow resonances that stand between its points are solved for
(`solver.continuation.extrema.resonance_search`), so are both sides of changes of what contacts do
(`solver.continuation.extrema.state_changes`), and near the top cubics through its points have to predict the
solutions between them. A maximum then shows between two points as a change of sign of its slope along the
arc, a band edge as a change of sign of amplitude − limit; both are refined by solving on the arc between the
points, so that folds need no special care. What could not be settled is said in the certificate
(`solver.continuation.branch`).

Where a normal load varies the motion is lopsided, and max|x| is the larger of two curves over the frequency.
A peak of the other one is no peak of max|x|, but a parameter may make it one: it is worth following, and a
sweep shows it for nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from solver.balance.balance import Kind
from solver.balance.closed_loop_poles import ClosedLoop
from solver.balance.kernels.locate import EDGE, HIGH_PEAK, LOW_PEAK
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS, PIECE, RESIDUAL
from solver.continuation.bracketing import dense_between, fold_between
from solver.continuation.branch import Band, Branch, Edge, Peak, PeakCertificate, Points, certified, uncertain
from solver.continuation.extrema.kernels.interval_kernels import IS_BENT, WAVES, WORTH_POLISHING
from solver.continuation.extrema.nodes import Between, NodeSolver, PointRow
from solver.continuation.extrema.resonance_search import ResonanceSearch, Search
from solver.continuation.extrema.state_changes import ChangeSearch
from solver.jit.fourier import Real

if TYPE_CHECKING:
    from solver.balance.workspace import Workspace

CURVES = ((HIGH, HIGH_SLOPE, HIGH_PEAK), (LOW, LOW_SLOPE, LOW_PEAK))

_CURVES = ((HIGH, HIGH_SLOPE, 1.0), (LOW, LOW_SLOPE, -1.0))
_HIDDEN = 1e-9  # relative distance below max|x| from which a curve is hidden

SHARP_RESIDUAL = 2e-11  # of a peak; what is above was accepted because arcs allowed no better
NEAR_BY = 1e-2
HALF_POWER = 1.0 / math.sqrt(2.0)
# A curve this far below the other one all over an interval is no max|x| there, nor is one that so many times
# what both change by keeps below it.
HIDDEN, FAR_BELOW = 0.8, 10.0
COMPETES_FOR_HIGHEST = 0.8  # share of the highest point from which a maximum may turn out to be the highest
# Where the highest is looked for alone: share of it, and of the range, from which an interval is parted in
# which contacts change, how often at most, and how much more than estimated a cubic may be wrong.
NOT_FAR, CHANGE_LENGTH, CHANGE_HALVINGS = 0.3, 0.01, 3
OF_THE_ERROR = 4.0
COMPETES = 0.5  # share of the highest from which a maximum is polished to the last digits
SHARP, ENOUGH = 1e-10, 1e-5  # slope relative to that of the interval at which a maximum is found
NEAR_THE_TOP = 0.97  # share of the highest point from which the branch has to be dense
PREDICTED = 1e-4  # relative error of the cubics up to which it is
SURE = 0.03  # share of that up to which the error the neighbours suggest needs no solution to tell it
MOST_HALVINGS = 5
# Elsewhere: each makes the error of a cubic 16 times smaller, and a kink needs no more.
COARSE_HALVINGS = 4
MOST_WAVES = 4  # halvings of an interval in which a cubic has a maximum and a minimum
MOST_DIPS = 24  # of one in which the amplitude may cross the limit there and back


def may_cross(nodes: Sequence[PointRow], between: Between, limit: float) -> NDArray[np.bool_]:
    """Return where max|x| might cross the limit and come back between nodes, (P − 1,)."""
    above = np.array([node.measures[MAX_ABS] for node in nodes]) > limit
    slopes = between.slopes
    # Between ends above the limit it has to fall at first and to rise at last; else the reverse.
    falls = np.any((slopes[:, 0] < 0.0) & (slopes[:, 1] > 0.0), axis=1)
    rises = between.reach > limit
    return np.asarray((above[:-1] & above[1:] & falls) | (~above[:-1] & ~above[1:] & rises))


def highest_share(
    left: PointRow, right: PointRow, by_share: tuple[float, float], limit: float
) -> float | None:
    """Return the share where max|x| may be above the limit between two nodes below it, or None."""
    for value, slope, _ in CURVES:
        a, b = left.measures[value], right.measures[value]
        rise, fall = left.measures[slope] * by_share[0], right.measures[slope] * by_share[1]
        if rise > 0.0 > fall and max(a, b) + 0.25 * (rise - fall) > limit:
            return _extreme(a, rise, b, fall)
    return None


def lowest_share(
    left: PointRow, right: PointRow, by_share: tuple[float, float], limit: float
) -> float | None:
    """Return the share where max|x| may be below the limit between two nodes above it, or None.

    It is below only where both curves are; the tangents at the ends bound a curve that is bent upward, such
    as the one of a motion that passes through zero.
    """
    places = []
    for value, slope, _ in CURVES:
        a, b = left.measures[value], right.measures[value]
        fall, rise = left.measures[slope] * by_share[0], right.measures[slope] * by_share[1]
        if a <= limit or b <= limit:
            # This curve is below somewhere anyway; the other one decides.
            continue
        if fall >= 0.0 or rise <= 0.0:
            return None
        share = min(max((b - rise - a) / (fall - rise), 0.0), 1.0)
        if a + fall * share > limit:
            return None
        places.append(share)
    if not places:
        # One curve is above at each end: between they change places.
        return 0.5
    return min(max(sum(places) / len(places), 0.05), 0.95)


def _extreme(a: float, da: float, b: float, db: float) -> float:
    """Return where the cubic of these values and slopes at two ends is extreme, kept off the ends."""
    chord = b - a
    c1, c2 = 3.0 * chord - 2.0 * da - db, da + db - 2.0 * chord
    root = math.sqrt(max(c1 * c1 - 3.0 * c2 * da, 0.0))
    # The stable form of the root between the ends.
    below = -c1 - math.copysign(root, c1)
    places = [da / below if below != 0.0 else 0.5, below / (3.0 * c2) if c2 != 0.0 else 0.5]
    inside = [t for t in places if 0.0 < t < 1.0]
    return min(max(inside[0] if inside else da / (da - db), 0.05), 0.95)


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
    solver, nodes : of the branch.
    highest_alone : whether the highest peak is all that is wanted. Then the branch is made dense where that
        may stand alone, and the nodes may be as far apart as those of `solver.continuation.branches.sweep`.
    """

    def __init__(self, solver: NodeSolver, nodes: list[PointRow], *, highest_alone: bool = False) -> None:
        self._workspace, self._highest_alone = solver.workspace, highest_alone
        # Share of the highest point below which nothing stands that is looked for.
        self._worth = COMPETES_FOR_HIGHEST if highest_alone else WORTH_POLISHING
        self._least = 0.0  # amplitude below which no maximum is polished [m]
        self._solver, self._nodes = solver, nodes
        self._peaks: list[Peak] = []
        self._undone: list[tuple[float, str]] = []  # λ and why
        self._search = Search(nodes=self._nodes)
        if self._nodes:
            if len(self._nodes) > 1:
                if highest_alone:
                    self._part_changes()
                changes = ChangeSearch(self._solver, self._worth)
                self._nodes = changes.run(self._nodes)
                self._undone += changes.left
            if len(self._nodes) > 1 and ClosedLoop.serves(solver.workspace.balance):
                competes = self._worth if highest_alone else 0.0
                self._search = ResonanceSearch(self._solver, competes).run(self._nodes)
                self._nodes = self._search.nodes
            self._densify()
            self._find_peaks()

    @classmethod
    def of(cls, workspace: Workspace, points: Points) -> Survey:
        """Return the survey of a branch."""
        solver = NodeSolver(workspace)
        return cls(solver, solver.nodes_of(points))

    @property
    def spent(self) -> int:
        """Newton iterations."""
        return self._solver.spent

    @property
    def peaks(self) -> tuple[Peak, ...]:
        """Every local maximum of max|x|, highest first; the ends of the branch are in it too."""
        return tuple(sorted(self._peaks, key=lambda peak: -peak.value))

    @property
    def nodes(self) -> list[PointRow]:
        """The branch with everything that was solved for between its points, peaks included."""
        return self._nodes

    @property
    def points(self) -> Points:
        """The same as rows."""
        return self._solver.points_of(self._nodes)

    def certificate(self, *, completed: bool) -> PeakCertificate:
        """Say why no higher peak hides between two points, or why that is not known."""
        outside = self._workspace.balance.parameter.outside
        if not self._nodes or not completed:
            return uncertain("the branch does not cover the range")
        undone = [*self._search.left, *self._undone]
        ends = self._workspace.balance.parameter.all_outside(np.array([node.at for node in self._nodes]))
        gap = float(np.abs(np.diff(ends)).max(initial=0.0))
        if self._workspace.balance.parameter.kind is Kind.STRUCTURE:
            return uncertain("resonances between points are looked for over the frequency alone", gap)
        if undone:
            at, why = undone[0]
            return uncertain(f"{why} at {float(outside(at)):.6g}", gap)
        top = max(peak.value for peak in self._peaks)
        bound = max(self._search.unseen, top)
        if len(self._nodes) > 1 and self._solver.look(self._nodes, top).reach.max() >= NEAR_THE_TOP * top:
            # There cubics are known to be right to their share of it.
            bound = max(bound, top * (1.0 + PREDICTED))
        return certified(bound=bound, gap=gap, resonances=self._search.solved)

    def _part_changes(self) -> None:
        """Halve long intervals in which contacts change and the amplitude is not far from the top.

        A resonance moves with what the contacts do, and may pass between ends where it is seen from neither.
        """
        span = abs(self._nodes[-1].at - self._nodes[0].at)
        for _ in range(CHANGE_HALVINGS):
            top = max(node.measures[MAX_ABS] for node in self._nodes)
            seen = self._solver.look(self._nodes, top)
            wanted = (np.diff(seen.measures[:, PIECE]) != 0.0) & (seen.reach >= NOT_FAR * top)
            wanted &= np.abs(np.diff(seen.at)) > CHANGE_LENGTH * span
            if not wanted.any():
                break
            grown = list(self._nodes)
            for j in reversed(np.flatnonzero(wanted).tolist()):
                middle = self._solver.middle(*self._nodes[j : j + 2])
                if middle is None:
                    self._undone.append((self._nodes[j].at, "no solution was found between two points"))
                else:
                    grown.insert(j + 1, middle)
            self._nodes = grown

    def _densify(self) -> None:
        """Halve intervals until cubics predict what lies between: finely near the top, coarsely elsewhere."""
        if len(self._nodes) < 2:
            return
        for _ in range(COARSE_HALVINGS):
            top = max(node.measures[MAX_ABS] for node in self._nodes)
            seen = self._solver.look(self._nodes, top)
            bent = (seen.flags & IS_BENT > 0) & (seen.reach + OF_THE_ERROR * seen.error >= self._worth * top)
            if not bent.any():
                break
            self._nodes, _, _ = self._solver.halved(self._nodes, bent)
        top = max(node.measures[MAX_ABS] for node in self._nodes)
        off = np.full(len(self._nodes) - 1, np.inf)
        seen = self._solver.look(self._nodes, top)
        off[(seen.error <= SURE * PREDICTED * top) & (np.diff(seen.measures[:, PIECE]) == 0.0)] = 0.0
        for _ in range(MOST_HALVINGS):
            near = self._solver.look(self._nodes, top).reach >= NEAR_THE_TOP * top
            wanted = near & (off > PREDICTED * top)
            if not wanted.any():
                break
            self._nodes, off, lost = self._solver.halved(self._nodes, wanted)
            self._undone += [(at, "no solution was found between two points") for at in lost]

    def _find_peaks(self) -> None:
        """Collect the maxima of both curves where they are max|x|, and the ends the branch falls from."""
        top = max(node.measures[MAX_ABS] for node in self._nodes)
        dense = self._nodes
        for _ in range(MOST_WAVES if len(dense) > 1 else 0):
            waving = self._solver.look(dense, top).flags & WAVES > 0
            if not waving.any():
                break
            dense, _, _ = self._solver.halved(dense, waving)
        self._least, refined, begun, found = self._worth * top, list[PointRow](), 0, {}
        if len(dense) > 1:  # where the highest may stand is polished first
            seen = self._solver.look(dense, top)
            falls = np.any((seen.slopes[:, 0] > 0.0) & (seen.slopes[:, 1] <= 0.0), axis=1)
            for j in sorted(np.flatnonzero(falls).tolist(), key=lambda j: -float(seen.reach[j])):
                found[j] = self._peaks_between(dense[j], dense[j + 1], seen.slopes[j].tolist(), top)
        for j, inside in sorted(found.items()):
            refined += [*dense[begun : j + 1], *inside]
            begun = j + 1
        self._nodes = [*refined, *dense[begun:]]
        first, last = self._nodes[0], self._nodes[-1]
        if len(self._nodes) == 1 or _slope(first) <= 0.0:
            self._peaks.append(self._peak(first, interior=False))
        if len(self._nodes) > 1 and _slope(last) >= 0.0:
            self._peaks.append(self._peak(last, interior=False))

    def _peaks_between(
        self, left: PointRow, right: PointRow, slopes: list[list[float]], top: float
    ) -> list[PointRow]:
        """Collect the maxima of max|x| between two nodes; return the nodes that come between for them.

        `slopes` are those of max x and −min x by the share, at the left and at the right.
        """
        inside = []
        for c, curve in enumerate(CURVES):
            ends = slopes[0][c], slopes[1][c]
            if ends[0] > 0.0 >= ends[1]:
                other = abs(slopes[0][1 - c]) + abs(slopes[1][1 - c])
                node = self._peak_between(left, right, curve, ends, other, top)
                if node.measures[curve[0]] >= node.measures[MAX_ABS] * (1.0 - 1e-12):
                    inside.append(node)
        if left.tangent[-1] * right.tangent[-1] > 0.0:
            inside.sort(key=lambda node: node.at * left.tangent[-1])
        found = [self._sharpened(node) for node in _distinct(inside)]
        self._peaks += [self._peak(node, interior=True) for node in found]
        return [node for node in found if node is not left and node is not right]

    def _peak_between(
        self,
        left: PointRow,
        right: PointRow,
        curve: tuple[int, int, int],
        ends: tuple[float, float],
        other: float,
        top: float,
    ) -> PointRow:
        """Return the maximum of one curve between two nodes; where polishing fails, the higher of the two.

        `ends` are its slopes there, `other` the sum of the sizes of those of the other curve.
        """
        value, _, what = curve
        higher = left if left.measures[value] > right.measures[value] else right
        rise, above = ends[0] - ends[1], min(left.measures[MAX_ABS], right.measures[MAX_ABS])
        height = higher.measures[value] + 0.25 * rise
        hidden = height < HIDDEN * above or height + FAR_BELOW * (rise + other) < above
        if hidden or height < self._least:
            return higher
        close = SHARP if height >= COMPETES * top else ENOUGH
        node = self._solver.refine(left, right, what, 0.0, ends, close)
        if node is None:
            self._undone.append((higher.at, "a peak could not be polished"))
            return higher
        if node.measures[value] < higher.measures[value]:
            higher = self._sharpened(higher)  # the residual left may have lifted it
        if node.measures[value] < higher.measures[value]:
            return higher
        if self._highest_alone:
            self._least = max(self._least, node.measures[value] - PREDICTED * top)
        return node

    def _sharpened(self, node: PointRow) -> PointRow:
        """Return a node that was accepted with a residual near what may be, solved again for its λ.

        With contacts far stiffer than the structure the residual left moves their forces, and with them the
        amplitude, by far more than its own size.
        """
        if node.measures[RESIDUAL] <= SHARP_RESIDUAL or node.tangent[-1] == 0.0:
            return node
        again = self._solver.at(node.at, [node.solution[:-1]], math.copysign(1.0, node.tangent[-1]))
        if again is None or again.measures[RESIDUAL] >= node.measures[RESIDUAL]:
            return node
        # Another response at the same λ, beside a fold, is not what was meant.
        near = abs(again.measures[MAX_ABS] - node.measures[MAX_ABS]) <= NEAR_BY * node.measures[MAX_ABS]
        return again if near else node

    def _peak(self, node: PointRow, *, interior: bool) -> Peak:
        at = float(self._workspace.balance.parameter.outside(node.at))
        return Peak(
            value=float(node.measures[MAX_ABS]), at=at, solution=node.solution[:-1].copy(), interior=interior
        )

    def band(self, limit: float) -> Band:
        """Return where the amplitude exceeds `limit` [m], anywhere on the branch."""
        outside = self._workspace.balance.parameter.outside
        pieces, crossings, unsure = [], [], list[float]()
        turned, folds = self._with_folds(limit)
        nodes = [turned[0]]
        top = max(node.measures[MAX_ABS] for node in turned)
        crosses = may_cross(turned, self._solver.look(turned, top), limit) if len(turned) > 1 else ()
        for right, wanted in zip(turned[1:], crosses, strict=True):
            if wanted:
                dips = partial(self._dipped, limit, unsure)
                nodes += dense_between(nodes[-1], right, MOST_DIPS + 1, dips)
            nodes.append(right)
        above = np.array([node.measures[MAX_ABS] for node in nodes]) > limit
        for j in np.flatnonzero(above[1:] | above[:-1]).tolist():
            left, right = nodes[j], nodes[j + 1]
            gaps = left.measures[MAX_ABS] - limit, right.measures[MAX_ABS] - limit
            begin, end = left.solution, right.solution
            if (gaps[0] > 0.0) != (gaps[1] > 0.0):
                edge = self._edge(left, right, limit, gaps)
                crossings.append(edge)
                begin, end = (begin, edge) if gaps[0] > 0.0 else (edge, end)
            ends = float(outside(float(begin[-1]))), float(outside(float(end[-1])))
            pieces.append((min(ends), max(ends)))
        merged = _merge(pieces)
        edges = []
        for edge in crossings:
            at = float(outside(float(edge[-1])))
            for low, high in merged:
                if at in (low, high):
                    edges.append(Edge(at=at, solution=edge[:-1].copy(), opens=at == low))
        for node, smooth in folds:
            at = float(outside(float(node.solution[-1])))
            for low, high in merged:
                if at in (low, high):
                    turned_at = node.solution[:-1].copy()
                    edges.append(
                        Edge(at=at, solution=turned_at, opens=at == low, fold=True, corner=not smooth)
                    )
        width = float(sum(high - low for low, high in merged))
        return Band(limit=limit, width=width, intervals=tuple(merged), edges=tuple(edges), known=not unsure)

    def _with_folds(self, limit: float) -> tuple[list[PointRow], list[tuple[PointRow, bool]]]:
        """Return the nodes with the folds above the limit among them, and these (and whether smooth)."""
        onward = self._solver.table.tangents[self._solver.numbers(self._nodes), -1]
        turns = onward[1:] * onward[:-1] < 0.0
        if not turns.any():
            return self._nodes, []
        nodes: list[PointRow] = [self._nodes[0]]
        folds = []
        for (left, right), turned in zip(pairwise(self._nodes), turns.tolist(), strict=True):
            if turned and max(left.measures[MAX_ABS], right.measures[MAX_ABS]) > limit:
                found = fold_between(partial(self._solver.between, left, right), left, right)
                if found is not None:
                    nodes.append(found[0])
                    if found[0].measures[MAX_ABS] > limit:
                        folds.append(found)
            nodes.append(right)
        return nodes, folds

    def _dipped(
        self, limit: float, unsure: list[float], left: PointRow, right: PointRow, depth: int
    ) -> tuple[PointRow | None, bool]:
        """Return a node where the amplitude may cross the limit and come back between two, if it does.

        Where it may and no node is found that is added to what is unsure.
        """
        gaps = left.measures[MAX_ABS] - limit, right.measures[MAX_ABS] - limit
        if (gaps[0] > 0.0) != (gaps[1] > 0.0) or abs(right.at - left.at) <= 1e-12 * abs(right.at):
            return None, True
        may = lowest_share if gaps[0] > 0.0 else highest_share
        share = may(left, right, self._solver.scales(left, right), limit)
        if share is None:
            return None, True
        middle = self._solver.between(left, right, share) if depth > 1 else None
        if middle is None:
            unsure.append(left.at)
        return middle, False

    def _edge(self, left: PointRow, right: PointRow, limit: float, gaps: tuple[float, float]) -> Real:
        """Return the point where the amplitude equals the limit."""
        node = self._solver.refine(left, right, EDGE, limit, gaps, SHARP)
        if node is not None:
            return node.solution
        # Between two converged points the straight line stands in; its error is that of the branch.
        share = gaps[0] / (gaps[0] - gaps[1])
        straight: Real = left.solution + share * (right.solution - left.solution)
        return straight


def band_limit(limit: float | None, peaks: tuple[Peak, ...], kind: Kind) -> float | None:
    """Return the limit of the band: the one asked for, else half power; None where a band has no meaning."""
    if not peaks or kind is not Kind.FREQUENCY:
        return None
    return limit if limit is not None else peaks[0].value * HALF_POWER


def _slope(node: PointRow) -> float:
    """Return the slope of max|x| along the node's tangent."""
    higher = HIGH_SLOPE if node.measures[HIGH] >= node.measures[LOW] else LOW_SLOPE
    return node.measures[higher]


def _distinct(nodes: list[PointRow]) -> list[PointRow]:
    """Return the nodes without a second one at the same place (both curves agree in a symmetric motion)."""
    if len(nodes) == 2:
        first, second = (node.solution[-1] for node in nodes)
        if abs(first - second) <= 1e-7 * abs(first):
            return [max(nodes, key=lambda node: float(node.measures[MAX_ABS]))]
    return nodes


def _merge(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the union of intervals (a folded branch passes a frequency more than once)."""
    merged: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if merged and low <= merged[-1][1] * (1.0 + 1e-12):
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged
