"""The rows of a branch: one, and a table in which each keeps its number while others come between.

A branch is looked at again whenever points were solved between others. Rows are stacked once, and what is
known between two neighbours stays known.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.jit.fourier import Integer, Real

_Number = TypeVar("_Number", np.float64, np.int64)


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
        if first + count > len(self.partners):
            self._grow(first + count)
        rows = slice(first, first + count)
        self.solutions[rows], self.tangents[rows], self.measures[rows] = solutions, tangents, measures
        self.observed[rows], self.states[rows], self.partners[rows] = observed, states, -1
        self._count += count
        return first

    def _grow(self, needed: int) -> None:
        size = needed + needed // 2 + 16
        self.solutions, self.tangents = _longer(self.solutions, size), _longer(self.tangents, size)
        self.measures, self.observed = _longer(self.measures, size), _longer(self.observed, size)
        self.states, self.scales = _longer(self.states, size), _longer(self.scales, size)
        self.partners = _longer(self.partners, size)


def _longer(array: NDArray[_Number], size: int) -> NDArray[_Number]:
    """Return an array with room for more rows."""
    longer = np.empty((size, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer
