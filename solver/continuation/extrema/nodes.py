"""Points of a branch, and further ones solved between them: what peaks and bands are found on.

A branch is looked at again whenever points were solved between others. Rows are stacked once in a table in
which each keeps its number while others come between (`solver.continuation.extrema.kernels.node_table`), and
what is known between two neighbours stays known: the contacts at points as springs, and the motion that
follows from them between points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from solver.balance.kernels.linearised_contacts import linearise, springs_at
from solver.continuation.branch import ROWS, Points
from solver.continuation.extrema.kernels import node_table as table
from solver.continuation.extrema.kernels.node_table import Look, PointRow
from solver.jit.fourier import Complex, Integer, Real, cosine_position
from solver.scene.scene_harmonics import Amplitudes

if TYPE_CHECKING:
    from solver.balance.workspace import Workspace
    from solver.continuation.extrema.resonance_search import Resonance

_UNKNOWN = -2  # row of a node whose stiffness was not asked for


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
        rows, workspace = self._solver.table, self._solver.workspace
        if numbers.max(initial=-1) >= self._rows.size:
            unknown = np.full(len(rows.solutions) - self._rows.size, _UNKNOWN)
            self._rows = np.concatenate([self._rows, unknown])
        new = np.unique(numbers[self._rows[numbers] == _UNKNOWN])
        self._rows[new] = -1
        chosen = new[rows.tangents[new, -1] != 0.0]
        if chosen.size:
            first, solutions = len(self._blocks), rows.solutions[chosen]
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


class NodeSolver:
    """A table of points of a branch, and solutions between them; counts the Newton iterations it spends.

    Parameters
    ----------
    workspace : of the branch.
    points : the rows that the table begins with.

    Attributes
    ----------
    workspace : Workspace
        Of the branch; of another DOF observed after `observe`.
    """

    def __init__(self, workspace: Workspace, points: Points) -> None:
        self.workspace, balance = workspace, workspace.balance
        self.least = balance.system.least_size
        one_solution = all(contact.keeps_together for contact in balance.scene.contacts)
        self._nodes: table.Nodes = cast(Any, table.new_nodes)(
            workspace.system, workspace.linear, workspace.point, one_solution,
            *(np.ascontiguousarray(getattr(points, name)) for name in ROWS),
        )  # fmt: skip
        self._counts = self.table.counts
        self._model: LocalModel | None = None

    @property
    def model(self) -> LocalModel:
        """The contacts at its points as springs."""
        self._model = self._model or LocalModel(self)
        return self._model

    @property
    def table(self) -> table.Table:
        """The rows of all points, and what was found."""
        return table.arrays_of(self._nodes)

    @property
    def peaks(self) -> Integer:
        """(·, 2) rows of maxima, and 1 where one is no end of the branch."""
        return self._noted(table.PEAKS).astype(np.int64)

    @property
    def undone(self) -> Real:
        """(·, 2) λ of what was not settled, and why."""
        return self._noted(table.UNDONE)

    def _noted(self, which: int) -> Real:
        return self.table.notes[which, : self._counts[which], :2]

    @property
    def order(self) -> Integer:
        """Rows along the branch."""
        order: Integer = table.order_of(self._nodes)
        return order

    @property
    def spent(self) -> int:
        """Newton iterations."""
        return int(self._counts[table.SPENT])

    def begin(self, order: Integer | None = None) -> None:
        """Have the branch go through rows of the table, all of them if left out; notes are forgotten."""
        self.follow(np.arange(self._counts[table.ROWS]) if order is None else order)
        self._counts[: table.ROWS] = 0

    def follow(self, order: Integer) -> None:
        """Have the branch go through other rows; what was noted stays."""
        table.set_order(self._nodes, np.ascontiguousarray(order, np.int64))

    def run(self, search: Callable[..., Any], *wanted: object) -> Any:
        """Return what a compiled search finds; it is begun again with every solution it asks for."""
        counts, order, before = self._counts, self.order, self._counts.copy()
        while True:
            found = search(self._nodes, *wanted)
            if not counts[table.ASKED]:
                return found
            asked = self._noted(table.ASKED).tolist()
            for p, onward in dict(asked).items():
                table.note(self._nodes, table.ANSWERED, p, float(self._from_nothing(p, onward)), 0.0)
            table.set_order(self._nodes, order)
            counts[: table.ANSWERED] = before[: table.ANSWERED]

    def _from_nothing(self, p: float, onward: float) -> int:
        """Return the row of the solution at λ = `p` found from nothing, NOWHERE if there is none."""
        found = self.workspace.solve(p)
        self._counts[table.SPENT] += found.iterations
        if not found.converged:
            return table.NOWHERE
        return int(table.measured_at(self._nodes, found.u, p, found.residual, onward))

    def observe(self, workspace: Workspace, order: Integer, observed: Real, measures: Real) -> None:
        """Have rows seen as another DOF sees them.

        Parameters
        ----------
        workspace : of the same scene with that DOF observed.
        observed, measures : of the rows with it.
        """
        self.workspace, rows = workspace, self.table
        table.look_with(self._nodes, workspace.system, workspace.linear, workspace.point)
        rows.observed[order], rows.measures[order] = observed, measures

    def points_of(self, rows: Iterable[int] | Integer) -> Points:
        """Return rows of the table as those of a branch."""
        here, chosen = self.table, np.fromiter(rows, np.int64)
        return Points(**{name: getattr(here, name)[chosen] for name in ROWS})

    def nodes(self, rows: Iterable[int] | Integer) -> list[PointRow]:
        """Return rows of the table one by one."""
        return [table.row_of(self._nodes, row) for row in rows]

    def added(self, points: Points) -> list[PointRow]:
        """Return the rows of a branch as nodes of this table."""
        rows = zip(*(getattr(points, name) for name in ROWS), strict=True)
        return self.nodes([table.add_row(self._nodes, *row) for row in rows])

    def look(self, top: float) -> Look:
        """Return what may stand between neighbouring points of the branch, at least two."""
        return table.look(self._nodes, top)

    def between(self, left: PointRow, right: PointRow, share: float) -> PointRow | None:
        """Return the node at a share of the way between two, or None if there is no solution there."""
        row, _ = self.run(table.between_rows, left.number, right.number, share)
        return None if row == table.NOWHERE else self.nodes([row])[0]

    def at(
        self, p: float, guesses: Sequence[Real], onward: float, *, from_nothing: bool = True
    ) -> PointRow | None:
        """Return the node at λ = `p`, or None if no solution is found there; see `kernels.node_table`."""
        starts = np.array(guesses).reshape(len(guesses), self.workspace.balance.n_unknowns)
        row = self.run(table.solved_at, p, starts, onward, from_nothing)
        return None if row == table.NOWHERE else self.nodes([row])[0]
