"""Points of a branch, and further ones solved between them: what peaks and bands are found on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.locate import EDGE, HIGH_PEAK, LOW_PEAK, between, refine
from solver.balance.kernels.output import (
    HIGH,
    HIGH_SLOPE,
    LOW,
    LOW_SLOPE,
    MAX_ABS,
    MEASURES,
    RESIDUAL,
    measure,
)
from solver.balance.workspace import Workspace
from solver.contacts.kernels.system import evaluation_by_value
from solver.continuation.folds import OnBranch, motion_scales
from solver.extrema.kernels.intervals import look_between
from solver.jit.fourier import Integer, Real

MOST_ITERATIONS = 12
MOST_TRIALS = 120
NARROW = 1e-13  # relative width at which a place is found


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """The rows of a branch; see `solver.continuation.branch.Branch`."""

    solutions: Real
    tangents: Real
    measures: Real
    observed: Real
    states: Integer


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Node:
    """One row of `Points`; the tangent points onward along the branch, and slopes are along it."""

    solution: Real
    tangent: Real
    measures: list[float]  # not an array: they are looked at one by one
    observed: Real
    states: Integer

    @property
    def at(self) -> float:
        """λ, in the unit inside."""
        return float(self.solution[-1])


def points_of(nodes: Sequence[Node], like: Points) -> Points:
    """Return nodes as the rows of a branch; `like` gives the shapes where there is none."""
    if not nodes:
        return like
    return Points(
        solutions=np.array([node.solution for node in nodes]),
        tangents=np.array([node.tangent for node in nodes]),
        measures=np.array([node.measures for node in nodes]),
        observed=np.array([node.observed for node in nodes]),
        states=np.array([node.states for node in nodes]),
    )


def nodes_of(points: Points) -> list[Node]:
    """Return the rows of a branch as nodes."""
    rows = zip(
        points.solutions, points.tangents, points.measures.tolist(), points.observed, points.states,
        strict=True,
    )  # fmt: skip
    return [Node(solution=s, tangent=t, measures=m, observed=o, states=e) for s, t, m, o, e in rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class Between:
    """What may stand between nodes, see `solver.extrema.kernels.intervals.look_between` for the shapes."""

    slopes: Real
    reach: Real
    flags: Integer


class NodeSolver:
    """Solves for nodes between others; counts the Newton iterations it spends."""

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        self.spent = 0
        self.least = workspace.balance.system.least_size
        self._last: tuple[Sequence[Node], float, Between] | tuple[None, float, None] = None, 0.0, None

    def look(self, nodes: Sequence[Node], top: float) -> Between:
        """Return what may stand between neighbouring nodes, at least two; that of the last list is kept."""
        known = self._last[2]
        if known is not None and nodes is self._last[0] and top == self._last[1]:
            return known
        size, count = nodes[0].solution.size, len(nodes) - 1
        solutions = np.concatenate([node.solution for node in nodes]).reshape(-1, size)
        tangents = np.concatenate([node.tangent for node in nodes]).reshape(-1, size)
        found = Between(
            slopes=np.empty((count, 2, 2)), reach=np.empty(count), flags=np.empty(count, np.int64)
        )
        measures = np.array([node.measures for node in nodes])
        look_between(solutions, tangents, measures, self.least, top, found.slopes, found.reach, found.flags)
        self._last = nodes, top, found
        return found

    def scales(self, left: Node, right: Node) -> tuple[float, float]:
        """Return `share_scales` between two nodes."""
        return share_scales(left, right, self.least)

    def between(self, left: Node, right: Node, share: float) -> Node | None:
        """Return the node at a share of the way between two, or None if there is no solution there."""
        rows = self._rows(left)
        by_share = self.scales(left, right)
        workspace = self.workspace
        good, iterations = between(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], share, MOST_ITERATIONS, *rows,
        )  # fmt: skip
        self.spent += int(iterations)
        # Around a fold nothing holds λ to its place but the motion: a solution far from both ends is another.
        ways = abs(left.tangent[-1] * by_share[0]) + abs(right.tangent[-1] * by_share[1])
        away = abs(rows[0][-1] - left.at - share * (right.at - left.at))
        if good and away <= abs(right.at - left.at) + 0.5 * ways:
            return self._node(*rows)
        return self._aside(left, right, left.at + share * (right.at - left.at))

    def refine(
        self, left: Node, right: Node, what: int, level: float, ends: tuple[float, float], close: float
    ) -> Node | None:
        """Return the peak or edge between two nodes, or None if there is no solution on the way.

        Parameters
        ----------
        what, level : as in `solver.balance.kernels.locate.refine`.
        ends : the function whose root it is at both ends, of opposite signs.
        close : how near to the root, relative to the larger of them.
        """
        rows = self._rows(left)
        by_share = self.scales(left, right)
        workspace = self.workspace
        good, iterations = refine(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], what, level, *ends, close, MOST_ITERATIONS, *rows,
        )  # fmt: skip
        self.spent += int(iterations)
        return self._node(*rows) if good else self._bracketed(left, right, what, level, close)

    def _aside(self, left: Node, right: Node, p: float) -> Node | None:
        """Return the node at λ = `p` between two, or None if the branch turns there or has no solution.

        Where a contact changes its state the arc between two nodes bends so sharply that the plane across
        the chord meets it far away, or not at all; a solution for a given λ is there all the same.
        """
        if left.tangent[-1] * right.tangent[-1] <= 0.0 or right.at == left.at:
            return None
        share = (p - left.at) / (right.at - left.at)
        straight = (1.0 - share) * left.solution[:-1] + share * right.solution[:-1]
        return self.at(p, [straight], math.copysign(1.0, right.at - left.at))

    def _bracketed(self, left: Node, right: Node, what: int, level: float, close: float) -> Node | None:
        """Return the peak or edge between two nodes by solving at values of λ (Illinois), else None."""

        def off(node: Node) -> float:
            if what == EDGE:
                return node.measures[MAX_ABS] - level
            slope = node.measures[HIGH_SLOPE if what == HIGH_PEAK else LOW_SLOPE]
            return slope / abs(float(node.tangent[-1]))

        if left.tangent[-1] * right.tangent[-1] <= 0.0:
            return None
        low, high, g_low, g_high, side = left, right, off(left), off(right), 0
        scale = max(abs(g_low), abs(g_high))
        value = {HIGH_PEAK: HIGH, LOW_PEAK: LOW}.get(what, MAX_ABS)
        best = max((left, right), key=lambda node: node.measures[value])
        for trial in range(MOST_TRIALS):
            share = g_low / (g_low - g_high) if g_low != g_high and trial % 3 != 2 else 0.5
            node = self._aside(low, high, low.at + min(max(share, 1e-3), 1.0 - 1e-3) * (high.at - low.at))
            if node is None:
                return None
            g = off(node)
            best = node if what == EDGE else max((best, node), key=lambda one: one.measures[value])
            if abs(g) <= close * scale or abs(high.at - low.at) <= NARROW * abs(node.at):
                return best
            if (g > 0.0) == (g_low > 0.0):
                low, g_low, g_high, side = node, g, g_high * (0.5 if side < 0 else 1.0), -1
            else:
                high, g_high, g_low, side = node, g, g_low * (0.5 if side > 0 else 1.0), 1
        return None

    def at(self, p: float, guesses: Sequence[Real], onward: float) -> Node | None:
        """Return the node at λ = `p`, or None if no solution is found there.

        Parameters
        ----------
        guesses : slip motions to start from, one after the other; at last from nothing.
        onward : the sign of dλ along the branch.
        """
        workspace = self.workspace
        found = None
        for guess in guesses:
            found = workspace.solve_from(p, guess)
            self.spent += found.iterations
            if found.converged:
                break
        if found is None or not found.converged:
            found = workspace.solve(p)
            self.spent += found.iterations
        if not found.converged:
            return None
        system, linear, point = workspace.system, workspace.linear, workspace.point
        slope = np.zeros(found.u.size)
        if factorise(system, linear, point, slope, 0.0, 0.0) == 0.0:
            return None
        slope[:] = -evaluation_by_value(point).dr_dp
        step_back(system, point, slope)
        if not np.all(np.isfinite(slope)):
            return None
        observed, values = np.zeros(workspace.balance.n_coefficients), np.zeros(MEASURES)
        measure(system, linear, found.u, point, onward * slope, onward, observed, values)
        values[RESIDUAL] = found.residual
        solution, tangent = np.append(found.u, p), onward * np.append(slope, 1.0)
        return self._node(solution, tangent, observed, values)

    def _rows(self, like: Node) -> tuple[Real, Real, Real, Real]:
        size = like.solution.size
        n = self.workspace.balance.n_coefficients
        return np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(MEASURES)

    def _node(self, solution: Real, tangent: Real, observed: Real, values: Real) -> Node | None:
        if not np.all(np.isfinite(values)):
            return None
        states = evaluation_by_value(self.workspace.point).states.copy()
        return Node(
            solution=solution, tangent=tangent, measures=values.tolist(), observed=observed, states=states
        )


def share_scales(left: OnBranch, right: OnBranch, least: float) -> tuple[float, float]:
    """Return the factors that turn both tangents into derivatives by the share of the chord between them.

    `least` is the size of a motion below which it is rounding [m], as in `solver.balance.kernels.locate`.
    Around a fold λ goes there and back, so that the motion alone tells how far it is. Across a resonance much
    narrower than the chord the motion comes back turned round, against its tangent: there λ alone tells it,
    so that slopes keep their signs and no maximum is lost.
    """
    if left.tangent[-1] * right.tangent[-1] < 0.0:
        return motion_scales(left, right)
    chord = right.solution - left.solution
    moved, size = float(chord[-1]), max(float(np.abs(left.solution[:-1]).max(initial=0.0)), least)
    weighted = chord / max(size**2, 1e-300)
    weighted[-1] = moved / max(moved**2, 1e-300)
    length = float(weighted @ chord)
    at_left, at_right = float(weighted @ left.tangent), float(weighted @ right.tangent)
    torn = at_left < 0.0 or at_right < 0.0
    if torn and moved * left.tangent[-1] > 0.0 and moved * right.tangent[-1] > 0.0:
        return moved / float(left.tangent[-1]), moved / float(right.tangent[-1])
    return length / at_left if at_left != 0.0 else 0.0, length / at_right if at_right != 0.0 else 0.0
