"""Peaks of a branch and the band above a limit, polished on the branch itself.

max|x| is the larger of max x and −min x, and each of these is smooth along a branch between changes of
contact state. A maximum of one shows between two points as a change of sign of its slope along the arc, a
band edge as a change of sign of amplitude − limit; both are refined by solving on the arc between the points,
so that folds need no special care. Two maxima may hide between two points: near the top the branch is first
made dense enough that cubics through its points predict the solutions between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from solver.branch import Band, Edge, Peak
from solver.fourier import Real
from solver.kernels.observe import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS, MEASURES
from solver.kernels.refine import EDGE, HIGH_PEAK, LOW_PEAK, between, refine
from solver.parameter import Kind
from solver.workspace import Workspace

HALF_POWER = 1.0 / math.sqrt(2.0)
# A maximum below this share of the highest point found is left at the resolution of the branch: polishing it
# would cost without a use, since it competes with nothing.
WORTH_POLISHING = 0.5
NEAR_THE_TOP = 0.97  # share of the highest point from which the branch has to be dense
FAR_BELOW = 0.7  # share below which no step of a branch can reach the top
PREDICTED = 1e-4  # relative error of the cubics up to which it is
MOST_HALVINGS = 5
_MOST_ITERATIONS = 12
_CURVES = ((HIGH, HIGH_SLOPE, HIGH_PEAK), (LOW, LOW_SLOPE, LOW_PEAK))


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """The rows of a branch that peaks are looked for in; see `solver.branch.Branch`."""

    solutions: Real
    tangents: Real
    measures: Real


class OnBranch(Protocol):
    """A point of a branch: solution and tangent, λ last."""

    @property
    def solution(self) -> Real:
        """Motions [m], λ last."""

    @property
    def tangent(self) -> Real:
        """Direction of the branch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Node:
    """One row of `Points`."""

    solution: Real
    tangent: Real
    measures: list[float]  # not an array: they are looked at one by one


class Survey:
    """Looks for peaks and band edges on a branch; counts the Newton iterations it spends."""

    def __init__(self, workspace: Workspace, points: Points) -> None:
        self.spent = 0
        self._workspace = workspace
        rows = zip(points.solutions, points.tangents, points.measures.tolist(), strict=True)
        self._nodes = [_Node(solution=s, tangent=t, measures=m) for s, t, m in rows]
        self._peaks: list[Peak] = []
        if self._nodes:
            self._densify()
            self._find_peaks()

    @property
    def peaks(self) -> tuple[Peak, ...]:
        """Every local maximum of max|x|, highest first; the ends of the branch are in it too."""
        return tuple(sorted(self._peaks, key=lambda peak: -peak.value))

    def _densify(self) -> None:
        """Halve the intervals near the top until cubics predict what lies between."""
        top = max(node.measures[MAX_ABS] for node in self._nodes)
        dense = [self._nodes[0]]
        for right in self._nodes[1:]:
            dense.extend(self._halved(dense[-1], right, top, MOST_HALVINGS))
            dense.append(right)
        self._nodes = dense

    def _halved(self, left: _Node, right: _Node, top: float, depth: int) -> list[_Node]:
        """Return the nodes to be inserted between two."""
        if max(left.measures[MAX_ABS], right.measures[MAX_ABS]) < FAR_BELOW * top:
            return []
        by_share = share_scales(left, right)
        reach = 0.0
        for value, slope, _ in _CURVES:
            rise = max(left.measures[slope] * by_share[0], 0.0) + max(
                -right.measures[slope] * by_share[1], 0.0
            )
            reach = max(reach, max(left.measures[value], right.measures[value]) + 0.25 * rise)
        if depth == 0 or reach < NEAR_THE_TOP * top:
            return []
        middle = self._between(left, right, 0.5)
        if middle is None:
            return []
        error = 0.0
        for value, slope, _ in _CURVES:
            turn = left.measures[slope] * by_share[0] - right.measures[slope] * by_share[1]
            cubic = 0.5 * (left.measures[value] + right.measures[value]) + turn / 8.0
            error = max(error, abs(cubic - middle.measures[value]))
        if error <= PREDICTED * top:
            return [middle]
        before = self._halved(left, middle, top, depth - 1)
        after = self._halved(middle, right, top, depth - 1)
        return [*before, middle, *after]

    def _find_peaks(self) -> None:
        """Collect the maxima of both curves where they are max|x|, and the ends the branch falls from."""
        top = max(node.measures[MAX_ABS] for node in self._nodes)
        refined: list[_Node] = [self._nodes[0]]
        for left, right in zip(self._nodes[:-1], self._nodes[1:], strict=True):
            inside = []
            for value, slope, what in _CURVES:
                if left.measures[slope] > 0.0 >= right.measures[slope]:
                    node = self._peak_between(left, right, value, slope, what, top)
                    if node.measures[value] >= node.measures[MAX_ABS] * (1.0 - 1e-12):
                        inside.append(node)
            for node in _distinct(inside):
                self._peaks.append(self._peak(node, interior=True))
                if node is not left and node is not right:
                    refined.append(node)
            refined.append(right)
        self._nodes = refined
        first, last = self._nodes[0], self._nodes[-1]
        if len(self._nodes) == 1 or _slope(first) <= 0.0:
            self._peaks.append(self._peak(first, interior=False))
        if len(self._nodes) > 1 and _slope(last) >= 0.0:
            self._peaks.append(self._peak(last, interior=False))

    def _peak_between(
        self, left: _Node, right: _Node, value: int, slope: int, what: int, top: float
    ) -> _Node:
        """Return the maximum of one curve between two nodes; where polishing fails, the higher of the two."""
        higher = left if left.measures[value] > right.measures[value] else right
        if higher.measures[value] < WORTH_POLISHING * top:
            return higher
        by_share = share_scales(left, right)
        g_left, g_right = left.measures[slope] * by_share[0], right.measures[slope] * by_share[1]
        node = self._refine(left, right, what, 0.0, g_left, g_right)
        return node if node is not None and node.measures[value] >= higher.measures[value] else higher

    def _peak(self, node: _Node, *, interior: bool) -> Peak:
        at = float(self._workspace.balance.parameter.outside(float(node.solution[-1])))
        return Peak(
            value=float(node.measures[MAX_ABS]), at=at, solution=node.solution[:-1].copy(), interior=interior
        )

    def band(self, limit: float) -> Band:
        """Return where the amplitude exceeds `limit` [m], anywhere on the branch."""
        outside = self._workspace.balance.parameter.outside
        pieces, crossings = [], []
        for left, right in zip(self._nodes[:-1], self._nodes[1:], strict=True):
            gaps = left.measures[MAX_ABS] - limit, right.measures[MAX_ABS] - limit
            if gaps[0] <= 0.0 and gaps[1] <= 0.0:
                continue
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
        width = float(sum(high - low for low, high in merged))
        return Band(limit=limit, width=width, intervals=tuple(merged), edges=tuple(edges))

    def _edge(self, left: _Node, right: _Node, limit: float, gaps: tuple[float, float]) -> Real:
        """Return the point where the amplitude equals the limit."""
        node = self._refine(left, right, EDGE, limit, float(gaps[0]), float(gaps[1]))
        if node is not None:
            return node.solution
        # Between two converged points the straight line stands in; its error is that of the branch.
        share = gaps[0] / (gaps[0] - gaps[1])
        straight: Real = left.solution + share * (right.solution - left.solution)
        return straight

    def _between(self, left: _Node, right: _Node, share: float) -> _Node | None:
        """Return the node at a share of the way between two, or None if there is no solution there."""
        found, tangent, observed, values = self._rows(left)
        by_share = share_scales(left, right)
        workspace = self._workspace
        good, iterations = between(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], share, _MOST_ITERATIONS, found, tangent, observed,
            values,
        )  # fmt: skip
        self.spent += int(iterations)
        return _Node(solution=found, tangent=tangent, measures=values.tolist()) if good else None

    def _refine(
        self, left: _Node, right: _Node, what: int, level: float, g_left: float, g_right: float
    ) -> _Node | None:
        """Return the peak or edge between two nodes, or None if there is no solution on the way."""
        found, tangent, observed, values = self._rows(left)
        by_share = share_scales(left, right)
        workspace = self._workspace
        good, iterations = refine(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], what, level, g_left, g_right, _MOST_ITERATIONS,
            found, tangent, observed, values,
        )  # fmt: skip
        self.spent += int(iterations)
        return _Node(solution=found, tangent=tangent, measures=values.tolist()) if good else None

    def _rows(self, like: _Node) -> tuple[Real, Real, Real, Real]:
        size = like.solution.size
        n = self._workspace.balance.n_coefficients
        return np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(MEASURES)


def band_limit(limit: float | None, peaks: tuple[Peak, ...], kind: Kind) -> float | None:
    """Return the limit of the band: the one asked for, else half power; None where a band has no meaning."""
    if not peaks or kind is not Kind.FREQUENCY:
        return None
    return limit if limit is not None else peaks[0].value * HALF_POWER


def _slope(node: _Node) -> float:
    """Return the slope of max|x| along the node's tangent."""
    higher = HIGH_SLOPE if node.measures[HIGH] >= node.measures[LOW] else LOW_SLOPE
    return node.measures[higher]


def share_scales(left: OnBranch, right: OnBranch) -> tuple[float, float]:
    """Return the factors that turn both tangents into derivatives by the share of the chord between them."""
    chord = right.solution - left.solution
    moved, size = float(chord[-1]), float(np.abs(left.solution[:-1]).max(initial=0.0))
    weighted = chord / max(size**2, 1e-300)
    weighted[-1] = moved / max(moved**2, 1e-300)
    length = float(weighted @ chord)
    at_left, at_right = float(weighted @ left.tangent), float(weighted @ right.tangent)
    return length / at_left if at_left != 0.0 else 0.0, length / at_right if at_right != 0.0 else 0.0


def _distinct(nodes: list[_Node]) -> list[_Node]:
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
