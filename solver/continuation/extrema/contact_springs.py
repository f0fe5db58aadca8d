"""The contacts of a branch as springs at its nodes, and the motion that follows from them between nodes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product
from typing import Annotated, Protocol

import numpy as np

from solver.balance.kernels.linearised_contacts import linearise, springs_at
from solver.balance.whole_motion import Amplitudes
from solver.balance.workspace import Workspace
from solver.continuation.extrema.node_table import NodeTable, PointRow
from solver.jit.fourier import Complex, Integer, cosine_position

_UNKNOWN = -2  # row of a node whose stiffness was not asked for


@dataclass(frozen=True, slots=True, kw_only=True)
class Resonance:
    """A resonance between two nodes."""

    at: Annotated[float, "ω [rad/s]."]
    half_width: Annotated[float, "Likewise [rad/s]."]
    harmonic: Annotated[int, "Number of the harmonic in `System.ks` that meets it."]


@dataclass(frozen=True, slots=True, eq=False)
class Springs:
    """The contacts at a node: forces, their slopes by λ, and what a small change of motion changes."""

    u: Complex  # (nk, nc) motions
    du: Complex  # by λ
    F: Complex  # forces less those of the shift
    dF: Complex
    stiffness: Complex  # (nk, nc, nc)


class OfBranch(Protocol):
    """Whose nodes they are (`solver.continuation.extrema.nodes.NodeSolver`)."""

    workspace: Workspace
    table: NodeTable
    least: float


class LocalModel:
    """Contacts linearised at nodes of a branch over the frequency, each once, and predictions between two."""

    def __init__(self, solver: OfBranch) -> None:
        self._solver = solver
        balance = solver.workspace.balance
        self._system, self.amplitudes = balance.system, Amplitudes(balance)
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
