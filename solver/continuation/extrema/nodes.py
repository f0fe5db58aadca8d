"""Points of a branch, and further ones solved between them: what peaks and bands are found on.

A branch is looked at again whenever points were solved between others. Rows are stacked once in a table in
which each keeps its number while others come between, and what is known between two neighbours stays known:
the contacts at nodes as springs, and the motion that follows from them between nodes.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.balance.kernels.jacobian import factorise, step_back
from solver.balance.kernels.linearised_contacts import linearise, springs_at
from solver.balance.kernels.locate import EDGE, HIGH_PEAK, LOW_PEAK, MAY_BE_LOW, refine
from solver.balance.kernels.output import (
    HIGH,
    HIGH_SLOPE,
    LOW,
    LOW_SLOPE,
    MAX_ABS,
    MEASURES,
    RANGE_SLOPE,
    RESIDUAL,
    SLOPE,
    measure,
)
from solver.contacts.kernels.system import evaluation_by_value
from solver.continuation.bracketing import OnBranch, closing_in
from solver.continuation.branch import ROWS, Points
from solver.continuation.extrema.kernels import interval_kernels as intervals
from solver.continuation.extrema.kernels.interval_kernels import look_between, middles_between
from solver.continuation.extrema.kernels.state_change_kernels import locate_change
from solver.jit.fourier import Complex, Integer, Real, cosine_position
from solver.scene.scene_harmonics import Amplitudes

if TYPE_CHECKING:
    from solver.balance.workspace import Workspace
    from solver.continuation.extrema.resonance_search import Resonance

_UNKNOWN = -2  # row of a node whose stiffness was not asked for

MOST_ITERATIONS = 12
MOST_SOLVES = 12  # of a change of state
SLOPES = [SLOPE, RANGE_SLOPE, HIGH_SLOPE, LOW_SLOPE]  # measures along the tangent
NARROW = 1e-13  # relative width at which a place is found


class PointRow(NamedTuple):
    """One row of `Points`; the tangent points onward along the branch, and slopes are along it.

    A tuple, because hundreds are made of every branch; nodes are told apart by identity.
    """

    solution: Real
    tangent: Real
    measures: list[float]  # the row as a list: they are looked at one by one
    observed: Real
    states: Integer
    number: int  # of its row in `NodeSolver.table`

    @property
    def at(self) -> float:
        """λ, in the unit inside."""
        return float(self.solution[-1])


class NodeTable:
    """Rows of `Points`; arrays are longer than there are rows.

    Attributes
    ----------
    solutions, tangents, measures, observed, states : one row each.
    partners, scales : (rows,) and (rows, 2) see `look_between`.
    """

    def __init__(self, unknowns: int, coefficients: int, measures: int, contacts: int) -> None:
        self._count = 0
        self.solutions, self.tangents = np.empty((0, unknowns + 1)), np.empty((0, unknowns + 1))
        self.measures, self.observed = np.empty((0, measures)), np.empty((0, coefficients))
        self.states = np.empty((0, contacts), np.int64)
        self.partners, self.scales = np.empty(0, np.int64), np.empty((0, 2))

    def add(self, solutions: Real, tangents: Real, measures: Real, observed: Real, states: Integer) -> int:
        """Add rows, one a row or a single one; return the number of the first."""
        first = self._count
        count = 1 if solutions.ndim == 1 else len(solutions)
        more = first + count + (first + count) // 2 + 16 - len(self.partners)
        if first + count > len(self.partners):
            for name in (*ROWS, "partners", "scales"):
                array = getattr(self, name)
                room = np.empty((more, *array.shape[1:]), array.dtype)
                setattr(self, name, np.concatenate([array, room]))
        rows = slice(first, first + count)
        self.solutions[rows], self.tangents[rows], self.measures[rows] = solutions, tangents, measures
        self.observed[rows], self.states[rows], self.partners[rows] = observed, states, -1
        self._count += count
        return first


@dataclass(frozen=True, slots=True, eq=False)
class Springs:
    """The contacts at a node: forces, their slopes by λ, and what a small change of motion changes."""

    u: Complex  # (nk, nc) motions
    du: Complex  # by λ
    F: Complex  # forces less those of the shift
    dF: Complex
    stiffness: Complex  # (nk, nc, nc)


class LocalModel:
    """Contacts linearised at nodes of a branch over the frequency, each once, and predictions between two."""

    def __init__(self, solver: NodeSolver) -> None:
        self._solver = solver
        balance = solver.workspace.balance
        self._system, self.amplitudes = balance.system, Amplitudes(balance.system.ks)
        self._rows = np.zeros(0, np.int64)
        self._springs: dict[int, Springs] = {}  # by the number of the node
        ends = pairwise(self._system.first_port.tolist())
        pairs = [pair for first, end in ends for pair in product(range(first, end), repeat=2)]
        self._sides = np.array(pairs, np.int64).reshape(-1, 2).T  # the ports of each block of springs
        self._blocks = np.zeros((0, self._system.ks.size, int(self._system.first_block[-1])), np.complex128)

    def rows(self, numbers: Integer) -> Integer:
        """Return rows for `stiffness` of nodes by their `numbers`, -1 for a fold.

        There nothing is a function of λ.
        """
        table, workspace = self._solver.table, self._solver.workspace
        if numbers.max(initial=-1) >= self._rows.size:
            unknown = np.full(len(table.partners) - self._rows.size, _UNKNOWN)
            self._rows = np.concatenate([self._rows, unknown])
        new = np.unique(numbers[self._rows[numbers] == _UNKNOWN])
        self._rows[new] = -1
        chosen = new[table.tangents[new, -1] != 0.0]
        if chosen.size:
            first, solutions = len(self._blocks), table.solutions[chosen]
            self._rows[chosen] = first + np.arange(chosen.size)
            blocks = np.empty((chosen.size, *self._blocks.shape[1:]), np.complex128)
            for j, springs in enumerate(workspace.springs.of(solutions)):
                if springs is None:
                    one = slice(j, j + 1)
                    springs_at(workspace.system, workspace.point, solutions[one], blocks[one])
                else:
                    blocks[j] = springs
            self._blocks = np.concatenate([self._blocks, blocks]) if first else blocks
        return self._rows[numbers]

    def stiffness(self, rows: Integer, harmonics: Integer) -> Complex:
        """Return the stiffness of the contacts against small changes of harmonics, (..., nc, nc) [N/m].

        `rows` of nodes and numbers of harmonics, of the same shape.
        """
        blocks = self._blocks[rows, harmonics]
        nc = self._system.owner.size
        found = np.zeros((*blocks.shape[:-1], nc, nc), np.complex128)
        found[..., self._sides[0], self._sides[1]] = blocks
        return found

    def at(self, node: PointRow) -> Springs | None:
        """Return the contacts at a node; None at a fold."""
        if node.tangent[-1] == 0.0:
            return None
        if node.number not in self._springs:
            workspace, balance = self._solver.workspace, self._solver.workspace.balance
            nk, nc = balance.system.ks.size, balance.n_ports
            motions, stiffness = np.empty((4, nk, nc), np.complex128), np.empty((nk, nc, nc), np.complex128)
            du = node.tangent[:-1] / node.tangent[-1]
            linearise(
                workspace.system, workspace.linear, workspace.point, node.solution[:-1], node.at, du, motions,
                stiffness,
            )  # fmt: skip
            self._springs[node.number] = Springs(motions[0], motions[1], motions[2], motions[3], stiffness)
        return self._springs[node.number]

    def adds(self, left: PointRow, right: PointRow, one: Resonance) -> tuple[float, float]:
        """Return what a resonance adds to what its neighbours suggest.

        Returns
        -------
        To the observed motion [m], and to that of the contact it moves most, relative to that motion.
        """
        predicted = self.predicted(left, right, one.at)
        a, b = self.at(left), self.at(right)
        if predicted is None or a is None or b is None:
            return np.inf, np.inf
        i, t = one.harmonic, (one.at - left.at) / (right.at - left.at)
        straight = (1.0 - t) * self._observed(left, i) + t * self._observed(right, i)
        height = float(abs(predicted[1][i] - straight))
        if not predicted[0].size:
            return height, 0.0
        moved = np.abs(predicted[0][i] - (1.0 - t) * a.u[i] - t * b.u[i])
        whole = np.maximum(np.abs(a.u).max(axis=0), np.abs(b.u).max(axis=0))
        return height, float(np.max(moved / np.maximum(whole, max(self._solver.least, 1e-300))))

    def _observed(self, node: PointRow, i: int) -> complex:
        """Return the complex amplitude of harmonic number i of the observed DOF [m]."""
        here = int(cosine_position(self._system.ks, i))
        return complex(node.observed[here], -node.observed[here + 1])

    def predicted(self, left: PointRow, right: PointRow, at: float) -> tuple[Complex, Complex] | None:
        """Return contact motions (nk, nc) and observed motion (nk,) predicted between two nodes."""
        a, b = self.at(left), self.at(right)
        if a is None or b is None or left.tangent[-1] * right.tangent[-1] <= 0.0:
            return None
        length = right.at - left.at
        t = (at - left.at) / length
        u = _cubic(t, a.u, length * a.du, b.u, length * b.du)
        F = _cubic(t, a.F, length * a.dF, b.F, length * b.dF)
        linear = self._solver.workspace.receptance(at)
        A, free, B, x = linear.A[0], linear.u_linear[0], linear.B[0], linear.x_linear[0]
        stiffness = (1.0 - t) * a.stiffness + t * b.stiffness - np.diag(self._system.shift)
        residual = u - free + np.einsum("kcd,kd->kc", A, F)
        matrix = np.eye(A.shape[1]) + A @ stiffness
        try:
            change = -np.linalg.solve(matrix, residual[..., None])[..., 0]
        except np.linalg.LinAlgError:
            return None
        F = F + np.einsum("kcd,kd->kc", stiffness, change)
        return u + change, x - np.einsum("kc,kc->k", B, F)


def _cubic(t: float, a: Complex, da: Complex, b: Complex, db: Complex) -> Complex:
    """Return the cubic through values and slopes at both ends, at the share t."""
    r = 1.0 - t
    return (1.0 + 2.0 * t) * r * r * a + t * r * r * da + t * t * (3.0 - 2.0 * t) * b - t * t * r * db


@dataclass(frozen=True, slots=True, kw_only=True)
class Between:
    """What may stand between nodes, with the shapes of `kernels.intervals.look_between`."""

    measures: Real
    at: Real
    slopes: Real
    reach: Real
    error: Real
    flags: Integer


class NodeSolver:
    """Solves for nodes between others; counts the Newton iterations it spends.

    Attributes
    ----------
    workspace : Workspace
        Of the branch; of another DOF observed after `observe`.
    table : NodeTable
        The rows of all nodes.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        # λ of two nodes, and λ between them, where no solution was found from anywhere: to look there again
        # would cost as much as hundreds of points.
        self._lost = set[tuple[float, float, float]]()
        self.spent = 0
        self.least = workspace.balance.system.least_size
        balance = workspace.balance
        self._one_solution = all(contact.keeps_together for contact in balance.scene.contacts)
        self.table = NodeTable(balance.n_unknowns, balance.n_coefficients, MEASURES, balance.system.laws.size)
        self._last: tuple[Sequence[PointRow], float, Between] | tuple[None, float, None] = None, 0.0, None

    @cached_property
    def model(self) -> LocalModel:
        """The contacts at its nodes as springs."""
        return LocalModel(self)

    def observe(
        self, workspace: Workspace, nodes: Sequence[PointRow], observed: Real, measures: Real
    ) -> list[PointRow]:
        """Return the nodes as another DOF sees them.

        Parameters
        ----------
        workspace : of the same scene with that DOF observed.
        observed, measures : rows of the nodes with it.
        """
        self.workspace, rows = workspace, self.numbers(nodes)
        self.table.observed[rows], self.table.measures[rows] = observed, measures
        self._last = None, 0.0, None
        seen = zip(nodes, measures.tolist(), observed, strict=True)
        return [node._replace(measures=values, observed=x) for node, values, x in seen]

    def nodes_of(self, points: Points) -> list[PointRow]:
        """Return the rows of a branch as nodes."""
        return self._added(points.solutions, points.tangents, points.measures, points.observed, points.states)

    def points_of(self, nodes: Sequence[PointRow]) -> Points:
        """Return nodes as the rows of a branch."""
        rows = self.numbers(nodes)
        return Points(**{name: getattr(self.table, name)[rows] for name in ROWS})

    def _added(
        self, solutions: Real, tangents: Real, measures: Real, observed: Real, states: Integer
    ) -> list[PointRow]:
        """Return rows as nodes, which stand in the table from then on."""
        first = self.table.add(solutions, tangents, measures, observed, states)
        numbers = range(first, first + len(solutions))
        rows = zip(solutions, tangents, measures.tolist(), observed, states, numbers, strict=True)
        return [PointRow._make(row) for row in rows]

    def look(self, nodes: Sequence[PointRow], top: float) -> Between:
        """Return what may stand between neighbouring nodes, at least two; that of the last list is kept."""
        known = self._last[2]
        if known is not None and nodes is self._last[0] and top == self._last[1]:
            return known
        count, table, rows = len(nodes) - 1, self.table, self.numbers(nodes)
        found = Between(
            measures=table.measures[rows], at=table.solutions[rows, -1], slopes=np.empty((count, 2, 2)),
            reach=np.empty(count), error=np.empty(count), flags=np.empty(count, np.int64),
        )  # fmt: skip
        look_between(
            table.solutions, table.tangents, table.partners, table.scales, rows, found.at, found.measures,
            self.least, top, found.slopes, found.reach, found.error, found.flags,
        )  # fmt: skip
        self._last = nodes, top, found
        return found

    @staticmethod
    def numbers(nodes: Sequence[PointRow]) -> Integer:
        """Return the rows of nodes in the table."""
        return np.array([node.number for node in nodes], np.int64)

    def scales(self, left: PointRow, right: PointRow) -> tuple[float, float]:
        """Return `share_scales` between two nodes."""
        return share_scales(left, right, self.least)

    def between(self, left: PointRow, right: PointRow, share: float) -> PointRow | None:
        """Return the node at a share of the way between two, or None if there is no solution there."""
        return self.between_pairs([left, right], share)[0][0]

    def between_pairs(
        self, ends: Sequence[PointRow], share: float = 0.5
    ) -> tuple[list[PointRow | None], Real]:
        """Return the nodes at a share of the way between pairs of nodes.

        Parameters
        ----------
        ends : (2k) left, right, left, right, …

        Returns
        -------
        The k nodes, None where there is no solution, and by how much the cubics of max x and −min x miss
        them [m], infinite where the node was not found on the plane across the chord.
        """
        table, pairs = self.table, self.numbers(ends).reshape(-1, 2)
        count = len(pairs)
        found, ways = np.zeros((count, table.solutions.shape[1])), np.zeros((count, table.solutions.shape[1]))
        x, out = np.zeros((count, table.observed.shape[1])), np.zeros((count, MEASURES))
        states, off = np.zeros((count, table.states.shape[1]), np.int64), np.zeros(count)
        workspace = self.workspace
        self.spent += middles_between(
            workspace.system, workspace.linear, workspace.point, table.solutions, table.tangents,
            table.measures, table.partners, table.scales, pairs, share, MOST_ITERATIONS, found, ways, x, out,
            states, off,
        )  # fmt: skip
        good = np.isfinite(off) & np.isfinite(out).all(axis=1)
        nodes: list[PointRow | None] = list(self._added(found, ways, out, x, states))
        for i in np.flatnonzero(~good).tolist():
            left, right = ends[2 * i], ends[2 * i + 1]
            nodes[i] = self._aside(left, right, left.at + share * (right.at - left.at))
        return nodes, np.where(good, off, np.inf)

    def halved(
        self, nodes: list[PointRow], wanted: NDArray[np.bool_]
    ) -> tuple[list[PointRow], Real, list[float]]:
        """Return the nodes with those in the middle of the intervals wanted.

        Returns
        -------
        The nodes; of each new interval by how much the cubics missed its new end [m], 0 without one; and the
        λ where intervals without a solution begin.
        """
        places = np.flatnonzero(wanted).tolist()
        middles, off = self.between_pairs([nodes[k] for j in places for k in (j, j + 1)])
        grown: list[PointRow] = []
        missed: list[float] = []
        lost: list[float] = []
        begun = 0
        for j, middle, by in zip(places, middles, off.tolist(), strict=True):
            grown += nodes[begun : j + 1]
            missed += [0.0] * (j - begun)
            begun = j + 1
            if middle is None:
                missed.append(0.0)
                lost.append(nodes[j].at)
            else:
                grown.append(middle)
                missed += [by, by]
        grown += nodes[begun:]
        missed += [0.0] * (len(nodes) - 1 - begun)
        return grown, np.array(missed), lost

    def refine(
        self,
        left: PointRow,
        right: PointRow,
        what: int,
        level: float,
        ends: tuple[float, float],
        close: float,
    ) -> PointRow | None:
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
        value = LOW if what == LOW_PEAK else HIGH
        values = left.measures[value], right.measures[value]
        good, iterations = refine(
            workspace.system, workspace.linear, workspace.point, left.solution, left.tangent * by_share[0],
            right.solution, right.tangent * by_share[1], what, level, *ends, *values, close,
            MOST_ITERATIONS, *rows,
        )  # fmt: skip
        self.spent += int(iterations)
        return self._node(*rows) if good else self._bracketed(left, right, what, level, close)

    def change(self, left: PointRow, right: PointRow, allowed: float) -> list[PointRow]:
        """Return the nodes nearest to the first change of state between two, of those before and behind it.

        `allowed` is the height of a maximum between both that does not matter [m].
        """
        by_parameter = np.array([1.0 / left.tangent[-1], 1.0 / right.tangent[-1]])
        table, rows = self.table, [left.number, right.number]
        found, ways = table.solutions[rows], table.tangents[rows] * by_parameter[:, None]
        x, measures, states = table.observed[rows], table.measures[rows], table.states[rows]
        for column in SLOPES:
            measures[:, column] *= by_parameter
        sides, onward = np.zeros(2, np.int64), math.copysign(1.0, left.tangent[-1])
        workspace = self.workspace
        self.spent += int(locate_change(
            workspace.system, workspace.linear, workspace.point, found, ways, x, measures, states, allowed,
            MOST_SOLVES, MOST_ITERATIONS, sides,
        ))  # fmt: skip
        ways *= onward
        for column in SLOPES:
            measures[:, column] *= onward
        near = sides > 0
        return self._added(found[near], ways[near], measures[near], x[near], states[near])

    def middle(self, left: PointRow, right: PointRow) -> PointRow | None:
        """Return the node at the λ between two far apart, from the cubic through them or from each."""
        if left.tangent[-1] * right.tangent[-1] <= 0.0:
            return None
        p, length, (a, b) = 0.5 * (left.at + right.at), right.at - left.at, (left.solution, right.solution)
        bend = left.tangent / left.tangent[-1] - right.tangent / right.tangent[-1]
        cubic = 0.5 * (a + b) + 0.125 * length * bend
        return self.at(p, [cubic[:-1], a[:-1], b[:-1]], math.copysign(1.0, length))

    def _aside(self, left: PointRow, right: PointRow, p: float) -> PointRow | None:
        """Return the node at λ = `p` between two, or None if the branch turns there or has no solution.

        Where a contact changes its state the arc between two nodes bends so sharply that the plane across
        the chord meets it far away, or not at all; a solution for a given λ is there all the same.
        """
        if left.tangent[-1] * right.tangent[-1] <= 0.0 or right.at == left.at:
            return None
        if (left.at, right.at, p) in self._lost:
            return None
        share = (p - left.at) / (right.at - left.at)
        straight = (1.0 - share) * left.solution[:-1] + share * right.solution[:-1]
        found = self.at(p, [straight], math.copysign(1.0, right.at - left.at))
        if found is None:
            self._lost.add((left.at, right.at, p))
        return found

    def _bracketed(
        self, left: PointRow, right: PointRow, what: int, level: float, close: float
    ) -> PointRow | None:
        """Return the peak or edge between two nodes by solving at values of λ (Illinois), else None."""

        def off(node: PointRow) -> float:
            if what == EDGE:
                return node.measures[MAX_ABS] - level
            slope = node.measures[HIGH_SLOPE if what == HIGH_PEAK else LOW_SLOPE]
            return slope / abs(float(node.tangent[-1]))

        if left.tangent[-1] * right.tangent[-1] <= 0.0:
            return None
        ends, inside = (off(left), off(right)), [left, right]
        value = {HIGH_PEAK: HIGH, LOW_PEAK: LOW}.get(what, MAX_ABS)
        length = right.at - left.at

        def at(share: float) -> PointRow | None:
            inside.sort(key=lambda node: (node.at - left.at) / length)
            behind = bisect_left(inside, share, key=lambda node: (node.at - left.at) / length)
            node = self._aside(inside[behind - 1], inside[behind], left.at + share * length)
            if node is not None:
                inside.append(node)
            return node

        for node, g, width in closing_in(at, off, *ends):
            best = node if what == EDGE else max(inside, key=lambda one: one.measures[value])
            if abs(g) <= close * max(map(abs, ends)) or abs(width * length) <= NARROW * abs(node.at):
                return best
            left_over = abs(g * width * length)
            if what != EDGE and close >= MAY_BE_LOW and left_over <= MAY_BE_LOW * node.measures[value]:
                return best
        return None

    def at(
        self, p: float, guesses: Sequence[Real], onward: float, *, from_nothing: bool = True
    ) -> PointRow | None:
        """Return the node at λ = `p`, or None if no solution is found there.

        Parameters
        ----------
        guesses : slip motions to start from, one after the other.
        onward : the sign of dλ along the branch.
        from_nothing : whether to start from nothing at last, where there is one solution only: elsewhere
            that may be of another branch.
        """
        workspace = self.workspace
        found = None
        for guess in guesses:
            found = workspace.solve_from(p, guess)
            self.spent += found.iterations
            if found.converged:
                break
        if found is None or (not found.converged and self._one_solution and from_nothing):
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

    def _rows(self, like: PointRow) -> tuple[Real, Real, Real, Real]:
        size = like.solution.size
        n = self.workspace.balance.n_coefficients
        return np.zeros(size), np.zeros(size), np.zeros(n), np.zeros(MEASURES)

    def _node(self, solution: Real, tangent: Real, observed: Real, values: Real) -> PointRow | None:
        if not np.all(np.isfinite(values)):
            return None
        states = evaluation_by_value(self.workspace.point).states.copy()
        return PointRow(
            solution=solution, tangent=tangent, measures=values.tolist(), observed=observed,
            states=states, number=self.table.add(solution, tangent, values, observed, states),
        )  # fmt: skip


def share_scales(left: OnBranch, right: OnBranch, least: float) -> tuple[float, float]:
    """Return the factors that turn both tangents into derivatives by the share of the chord between them.

    `least` is the size of a motion below which it is rounding [m]; see `kernels.intervals`.
    """
    scales: tuple[float, float] = intervals.share_scales(
        left.solution, right.solution, left.tangent, right.tangent, least
    )
    return scales
