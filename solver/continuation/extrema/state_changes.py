"""Contacts that change the piece of their law between points of a branch: both sides of a change are solved.

Within one piece of every law the curves of a branch are smooth, and points that are close enough show their
maxima. Where a piece changes between two points, the slope may jump, turn and come back in a small share of
the interval, and nothing at its ends tells of that (`state_change_kernels`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from solver.balance.kernels.output import HIGH, LOW, MAX_ABS, PIECE
from solver.continuation.extrema.kernels.interval_kernels import BENT, MATTERS, STEEP, WORTH_POLISHING
from solver.jit.fourier import Integer, Real

if TYPE_CHECKING:
    from solver.continuation.extrema.nodes import NodeSolver, PointRow

# Up to these departures from what the points beside an interval foretell a change in it hides no maximum:
# relative to the amplitude, and as a part of the slopes.
FORETOLD, STEEPER = 1e-3, 12.0
FORETOLD_BESIDE = 1e-2  # the first of them, of an interval beside a change
MOST_CHANGES = 16  # in one interval of the branch
MOST_HALVINGS = 4  # of what a change leaves on either side of it
# From so many contacts on an interval with changes is halved before each of them is closed in on: of many
# small ones hardly any departs that far once it is short.
MANY_CONTACTS = 16
# A contact whose motion, by its slope at an end, changes over an interval by so many times its size may do
# something else in between and the same again at the other end.
CHANGES_ALL = 2.0
BESIDE = 4.0  # times steeper than usual the curves have to be beside a change for no check
CURVES = [HIGH, LOW]
_APART, _BEFORE, _BEHIND, _BETWEEN = 0, 1, 2, 3  # an interval and changes


class ChangeSearch:
    """Adds to a branch the points on both sides of changes of piece, and between where the curves bend.

    Parameters
    ----------
    worth : share of the highest point below which changes do not matter.
    """

    def __init__(self, solver: NodeSolver, worth: float = WORTH_POLISHING) -> None:
        self._solver, self._worth = solver, worth
        self.left: list[tuple[float, str]] = []  # λ where a change was not settled, and why

    def run(self, nodes: list[PointRow]) -> list[PointRow]:
        """Return the nodes with those added."""
        top = max(node.measures[MAX_ABS] for node in nodes)
        departs = self._departs(nodes, top, FORETOLD)
        for _ in range(MOST_HALVINGS):
            hiding = self._hiding(nodes, top, departs)
            if nodes[0].states.size >= MANY_CONTACTS:
                hiding |= self._wanted(nodes, top, departs)
            if not hiding.any():
                break
            nodes, _, _ = self._solver.halved(nodes, hiding)
            departs = self._departs(nodes, top, FORETOLD)
        wanted = self._wanted(nodes, top, departs)
        if not wanted.any():
            return nodes
        grown: list[PointRow] = []
        kinds: list[int] = []
        begun = 0
        for j in np.flatnonzero(wanted).tolist():
            inside, between = self._inside(nodes[j], nodes[j + 1])
            if inside:
                grown += [*nodes[begun : j + 1], *inside]
                kinds += [*[_APART] * (j - begun), *between]
                begun = j + 1
        if not grown:
            return nodes
        grown += nodes[begun:]
        kinds += [_APART] * (len(nodes) - 1 - begun)
        return self._checked(grown, np.array(kinds), top)

    def _hiding(
        self, nodes: list[PointRow], top: float, departs: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return where a contact may change and change back with a maximum between, (P − 1,)."""
        seen, table, rows = self._solver.look(nodes, top), self._solver.table, self._solver.numbers(nodes)
        stands = np.maximum(seen.measures[1:, MAX_ABS], seen.measures[:-1, MAX_ABS])
        may = (np.diff(seen.measures[:, PIECE]) == 0.0) & (stands >= self._worth * top)
        may &= departs.all(axis=0)
        at = np.flatnonzero(may)
        if at.size == 0:
            return np.asarray(may, dtype=bool)
        balance = self._solver.workspace.balance
        shape = (2, at.size, balance.n_ports, balance.n_coefficients)
        ends = np.array([rows[at], rows[at + 1]])
        onward = np.abs(table.tangents[ends, -1])
        length = np.abs(seen.at[at + 1] - seen.at[at])
        sizes = np.linalg.norm(table.solutions[ends, :-1].reshape(shape), axis=-1).max(axis=0)
        slopes = np.linalg.norm(table.tangents[ends, :-1].reshape(shape), axis=-1) * length[:, None]
        may[at] = (slopes > CHANGES_ALL * onward[..., None] * sizes).any(axis=(0, 2))
        return np.asarray(may, dtype=bool)

    def _wanted(
        self, nodes: list[PointRow], top: float, departs: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return in which intervals a change may hide a maximum, (P − 1,)."""
        seen = self._solver.look(nodes, top)
        stands = np.maximum(seen.measures[1:, MAX_ABS], seen.measures[:-1, MAX_ABS])
        wanted = (np.diff(seen.measures[:, PIECE]) != 0.0) & (stands >= self._worth * top)
        onward = np.array([node.tangent[-1] for node in nodes])
        wanted &= onward[1:] * onward[:-1] > 0.0
        return np.asarray(wanted & departs.any(axis=0), dtype=bool)

    def _departs(self, nodes: list[PointRow], top: float, allowed: float) -> NDArray[np.bool_]:
        """Return where a maximum may hide by what the points before, and behind, foretell, (2, P − 1)."""
        seen = self._solver.look(nodes, top)
        stands = np.maximum(seen.measures[1:, MAX_ABS], seen.measures[:-1, MAX_ABS])
        v, begin, end = seen.measures[:, CURVES], seen.slopes[:, 0], seen.slopes[:, 1]
        off = _departures(v, begin, end, seen.at)
        sizes = np.abs(begin), np.abs(end)
        steep = np.where(begin * end > 0.0, np.minimum(*sizes), 0.0)
        changes = np.maximum(np.abs(np.diff(v, axis=0)), np.maximum(*sizes))
        stands = stands[:, None]
        departs = (off > allowed * stands) & (STEEPER * off > steep) & (changes > MATTERS * stands)
        return np.asarray(departs.any(axis=2), dtype=bool)

    def _inside(
        self, left: PointRow, right: PointRow, *, left_is_change: bool = False, more: int = MOST_CHANGES
    ) -> tuple[list[PointRow], list[int]]:
        """Return nodes on both sides of the changes between two, and what the intervals between are."""
        if left.measures[PIECE] == right.measures[PIECE]:
            return [], [_BEHIND if left_is_change else _APART]
        stands = max(left.measures[MAX_ABS], right.measures[MAX_ABS])
        sides = self._solver.change(left, right, MATTERS * stands) if more > 0 else []
        if len(sides) == 2:
            inside, kinds = self._inside(sides[1], right, left_is_change=True, more=more - 1)
            # Between both sides of a change nothing is left to be found.
            return [*sides, *inside], [_BETWEEN if left_is_change else _BEFORE, _APART, *kinds]
        if abs(right.measures[MAX_ABS] - left.measures[MAX_ABS]) <= FORETOLD * stands:
            return [], [_APART]
        # Where the branch is so steep that no solution was found at a given λ, there is one along the arc.
        middle = self._solver.between(left, right, 0.5) if more > 0 else None
        if middle is None:
            self.left.append((left.at, "a change of a contact was not closed in on"))
            return [], [_APART]
        before, kinds = self._inside(left, middle, left_is_change=left_is_change, more=more // 2)
        inside, behind = self._inside(middle, right, more=more // 2)
        return [*before, middle, *inside], [*kinds, *behind]

    def _checked(self, nodes: list[PointRow], kinds: Integer, top: float) -> list[PointRow]:
        """Return the nodes with those in the middle of intervals beside changes, until cubics foretell these.

        Of the two neighbours of such an interval only the one that is not the change foretells anything.
        Where a point of the branch stands next to the change, the interval on its other side is the longer
        one, and as much beside the change.
        """
        departs = self._departs(nodes, top, FORETOLD_BESIDE)
        length = np.abs(np.diff(self._solver.look(nodes, top).at))
        before, behind = kinds == _BEFORE, kinds == _BEHIND
        before[:-1] |= before[1:] & (length[:-1] > length[1:])
        behind[1:] |= behind[:-1] & (length[1:] > length[:-1])
        wanted = (kinds == _BETWEEN) | (before & departs[0]) | (behind & departs[1])
        for _ in range(MOST_HALVINGS):
            if not wanted.any():
                break
            nodes, off, _ = self._solver.halved(nodes, wanted)
            seen = self._solver.look(nodes, top)
            stands = np.maximum(seen.measures[1:, MAX_ABS], seen.measures[:-1, MAX_ABS])
            begin, end = seen.slopes[:, 0], seen.slopes[:, 1]
            steep = np.where(begin * end > 0.0, np.minimum(np.abs(begin), np.abs(end)), 0.0).min(axis=1)
            wanted = (off > BENT * stands) & (BESIDE * STEEP * off > steep)
        return nodes


def _departures(v: Real, begin: Real, end: Real, at: Real) -> Real:
    """Return how far the values and slopes of intervals are from what the intervals beside them foretell.

    Parameters
    ----------
    v : (P, 2) both curves; begin, end : (P − 1, 2) their slopes by the share of the interval; at : (P,) λ.

    Returns
    -------
    (2, P − 1, 2) : by the parabola that goes on from the interval before, and from the one behind; infinite
    where there is none.
    """
    lengths = np.maximum(np.abs(np.diff(at)), 1e-100)  # the square of a ratio must not overflow
    rise = np.diff(v, axis=0)
    ratio = ((lengths[1:] / lengths[:-1]) ** 2)[:, None]
    # Second derivatives, by the share of the interval itself, of the cubics of those beside it.
    bend = np.full((2, *rise.shape), np.inf)
    bend[0, 1:] = (-6.0 * rise + 2.0 * begin + 4.0 * end)[:-1] * ratio
    bend[1, :-1] = (6.0 * rise - 4.0 * begin - 2.0 * end)[1:] / ratio
    missed = np.array([begin + 0.5 * bend[0] - rise, rise - end + 0.5 * bend[1]])
    departures: Real = np.maximum(np.abs(end - begin - bend), np.abs(missed))
    return departures
