"""Narrow resonances between the points of a branch: found by linear algebra, then solved for.

Continuation steps by what the contacts see. A resonance that they hardly see (a node of the mode at the
contact, blades in phase) leaves no trace in their motion, and one that is narrow may stand between two points
without a trace in either. But the structure is known exactly, and between two points the contacts change
little: each harmonic of their forces is interpolated, their answer to a small change is the slope ĝ at the
points, and every resonance of the structure with the springs ĝ is an eigenvalue
(`solver.balance.closed_loop_poles`). At each that is too narrow for the points around it the motion is
predicted, (I + A ĝ) δu = −r with the residual r of the interpolated motion; where the prediction matters the
balance is solved, on a ladder of frequencies round the resonance, until the points are as dense as it is
narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS
from solver.continuation.bracketing import dense_between
from solver.continuation.extrema.kernels.node_table import share_scales
from solver.continuation.extrema.kernels.suspects import find_suspects
from solver.jit.fourier import Complex, Flags, Integer, Real

if TYPE_CHECKING:
    from solver.continuation.extrema.kernels.node_table import PointRow
    from solver.continuation.extrema.nodes import NodeSolver

# What a resonance adds to the amplitude, relative to what stands there, from which it is solved for. What
# stands there counts as this share of the highest point at least.
MATTERS, OF_THE_TOP = 5e-4, 0.01
# What it adds to the motion of a contact, relative to that motion, from which it is solved for: the contact
# may slip there, and then nothing is linear any more.
MOVES = 0.3
FEEDBACK = 4.0  # times what is predicted, that it may become as the contacts change with it
HUGE = 1e30
RESOLVED = 2.0  # half widths of a resonance that an interval may be long
FLANKS = 10.0  # how much lower than its flanks suggest a narrow resonance may look at the ends of an interval
RUNG = 4.0  # factor between the distances of neighbouring rungs from a resonance
MOST_RUNGS = 16
# Neighbouring intervals that are looked at together, and how many times broader than needed a resonance has
# to be at their ends not to be looked for between.
GROUP, BROAD = 4, 2.0
MOST_ROUNDS = 12
# Between rungs the cubic has to predict the amplitude to this share, or to this share of the highest point.
PREDICTED, PREDICTED_OF_TOP = 0.02, 2e-3
MOST_HALVINGS = 12
MOST_NODES = 6000  # that one search adds


@dataclass(frozen=True, slots=True, kw_only=True)
class Resonance:
    """A resonance between two nodes."""

    at: Annotated[float, "ω [rad/s]."]
    half_width: Annotated[float, "Likewise [rad/s]."]
    harmonic: Annotated[int, "Number of the harmonic in `System.ks` that meets it."]


@dataclass(slots=True)
class Search:
    """What a search did."""

    solved: Annotated[int, "Resonances that were solved for."] = 0
    left: Annotated[
        list[tuple[float, str]], "Places (λ) where a resonance that matters was not solved for, and why."
    ] = field(default_factory=list)
    unseen: Annotated[float, "Highest amplitude predicted at the resonances that do not matter [m]."] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Intervals:
    """Intervals between neighbouring points of a branch: P of them, N points."""

    begin: Annotated[Integer, "(P,) which point each begins at."]
    numbers: Annotated[Integer, "(N,) of the points in their table."]
    solutions: Annotated[Real, "(N, nt + 1) motions, λ last."]
    observed: Annotated[Real, "(N, …), see `solver.continuation.branch.Branch`."]
    states: Annotated[Integer, "Likewise."]
    amplitude: Annotated[Real, "(N,) of the points [m]."]
    at: Annotated[Real, "(N,) λ of the points [rad/s]."]
    low: Annotated[Real, "Lower end of each [rad/s], (P,)."]
    high: Annotated[Real, "Upper end [rad/s], (P,)."]
    length: Annotated[Real, "Length [rad/s], (P,)."]

    @classmethod
    def of(cls, solver: NodeSolver, begin: Integer) -> _Intervals:
        table = solver.table
        rows, at = table.order, table.solutions[table.order, -1]
        low, high = np.minimum(at[begin], at[begin + 1]), np.maximum(at[begin], at[begin + 1])
        return cls(
            begin=begin, numbers=rows, solutions=table.solutions[rows], observed=table.observed[rows],
            states=table.states[rows], amplitude=table.measures[rows, MAX_ABS], at=at, low=low, high=high,
            length=high - low,
        )  # fmt: skip


class ResonanceSearch:
    """Adds nodes to a branch over the frequency until no narrow resonance can stand between two of them.

    Parameters
    ----------
    competes : share of the highest point that a resonance has to reach to be solved for.
    """

    def __init__(self, solver: NodeSolver, competes: float = 0.0) -> None:
        self._competes = competes
        self._solver, self._loop = solver, solver.workspace.loop
        self._model = solver.model
        self._added = 0

    def run(self) -> Search:
        """Search between all neighbours of the branch, and put what was solved for into it."""
        found, solver = Search(), self._solver
        begin = np.arange(solver.order.size - 1)
        for _ in range(MOST_ROUNDS):
            rows = _Intervals.of(solver, begin)
            top = float(rows.amplitude.max())
            wanted = self._wanted(rows, top, found)
            if not wanted:
                break
            grown, fresh = list[int](), list[int]()
            for j, row in enumerate(rows.numbers.tolist()):
                grown.append(row)
                if j in wanted:
                    left, right = solver.nodes(rows.numbers[j : j + 2])
                    inside = self._ladders(left, right, wanted[j], top, found)
                    fresh += range(len(grown) - 1, len(grown) + len(inside)) if inside else ()
                    grown += [node.number for node in inside]
            solver.follow(np.array(grown))
            if not fresh:
                break
            begin = np.array(fresh)
        else:
            found.left += [(float(rows.at[j]), "the search ended before it settled") for j in wanted]
        return found

    def _wanted(self, rows: _Intervals, top: float, found: Search) -> dict[int, list[Resonance]]:
        """Return the resonances that matter in intervals, by the number of the point on the left of them."""
        wanted: dict[int, list[Resonance]] = {}
        for j, one in self._narrow(rows, *self._unsettled(rows, *np.nonzero(self._suspects(rows, top)))):
            here = int(rows.begin[j])
            left, right = self._solver.nodes(rows.numbers[here : here + 2])
            height, share = self._model.adds(left, right, one)
            stands = max(left.measures[MAX_ABS], right.measures[MAX_ABS])
            matters = share > MOVES or height > MATTERS * max(stands, OF_THE_TOP * top)
            if matters and stands + FEEDBACK * height >= self._competes * top:
                wanted.setdefault(here, []).append(one)
            else:
                found.unseen = max(found.unseen, stands + height)
        return wanted

    def _unsettled(self, rows: _Intervals, i: Integer, j: Integer) -> tuple[Integer, Integer]:
        """Return the suspects without the groups of neighbours at whose ends every resonance near is broad.

        What contacts that slip take out of a resonance changes little from one point to the next. The
        suspects are harmonics number i in intervals j, in this order.
        """
        if not i.size:
            return i, j
        first = _group_starts(i, j)
        last = np.append(first[1:], i.size) - 1
        group = np.repeat(np.arange(first.size), last - first + 1)
        ends = np.stack([rows.begin[j[first]], rows.begin[j[last]] + 1], axis=1)
        same = np.all(rows.states[ends[:, 0]] == rows.states[ends[:, 1]], axis=1)
        linear = self._model.rows(rows.numbers[ends])
        known = (last - first + 1 == GROUP) & same & np.all(linear >= 0, axis=1)
        narrow = np.ones(first.size, bool)
        narrow[known] = self._are_narrow(
            i[first[known]],
            self._model.stiffness(linear[known], np.repeat(i[first[known], None], 2, axis=1)),
            rows.at[ends[known]],
            np.maximum.reduceat(rows.length[j], first)[known],
        )
        return i[narrow[group]], j[narrow[group]]

    def _are_narrow(self, i: Integer, stiffness: Complex, at: Real, longest: Real) -> Flags:
        """Return whether a resonance near groups of intervals may be narrower than they are.

        Parameters
        ----------
        i : (G,) numbers of the harmonics.
        stiffness : (G, 2, nc, nc) of the contacts at the ends of each group.
        at : (G, 2) the ends [rad/s].
        longest : (G,) interval of each [rad/s].
        """
        # Within 1.5 lengths of the middle is within twice the length of an end.
        span = np.abs(at[:, 1] - at[:, 0])
        flat = stiffness.reshape(2 * len(i), *stiffness.shape[2:])
        may = self._loop.may_meet(flat, np.repeat(i, 2), at.ravel(), np.repeat(2.0 * span, 2))
        narrow: Flags = np.any(may.reshape(-1, 2), axis=1)
        if not narrow.any():
            return narrow
        span, at, twice = span[narrow, None], at[narrow], np.repeat(narrow, 2)
        poles = self._loop.of_harmonics(flat[twice], np.repeat(i[narrow], 2), at.ravel())
        places, half_width = poles.at.reshape(len(at), -1), poles.half_width.reshape(len(at), -1)
        near = np.abs(places - at.mean(axis=1)[:, None]) <= 1.5 * span
        near &= half_width * RESOLVED <= BROAD * longest[narrow, None]
        narrow[narrow] = near.any(axis=1)
        return narrow

    def _narrow(self, rows: _Intervals, i: Integer, j: Integer) -> list[tuple[int, Resonance]]:
        """Return the resonances of suspects in intervals too wide for them, with the interval's number."""
        if not i.size:
            return []
        ends = np.stack([rows.begin[j], rows.begin[j] + 1], axis=1)
        keys, entry = np.unique(i[:, None] * rows.at.size + ends, return_inverse=True)
        number, node = np.divmod(keys, rows.at.size)
        entry = entry.reshape(ends.shape)
        reach = np.zeros(keys.size)
        np.maximum.at(reach, entry, rows.length[j][:, None])
        linear = self._model.rows(rows.numbers[node])
        may = linear >= 0
        stiffness = self._model.stiffness(linear[may], number[may])
        meets = self._loop.may_meet(stiffness, number[may], rows.at[node[may]], reach[may])
        may[may] = meets
        if not may.any():
            return []
        poles = self._loop.of_harmonics(stiffness[meets], number[may], rows.at[node[may]])
        row = np.cumsum(may) - 1
        chosen = may[entry].ravel()
        at, half_width = (x[row[entry.ravel()[chosen]]] for x in (poles.at, poles.half_width))
        suspect = np.repeat(np.arange(i.size), 2)[chosen]
        low, high = (x[j[suspect], None] for x in (rows.low, rows.high))
        inside = (at > low) & (at < high) & (RESOLVED * half_width < high - low)
        found = []
        for r, m in np.argwhere(inside):
            width = max(half_width[r, m], 1e-13 * at[r, m])
            one = Resonance(at=at[r, m], half_width=width, harmonic=int(i[suspect[r]]))
            found.append((int(j[suspect[r]]), one))
        return found

    def _suspects(self, rows: _Intervals, top: float) -> Flags:
        """Return which intervals may hold a resonance narrower than they are, (nk, P).

        Contacts that are springs between nothing and full stick move the m-th resonance at most from its
        place with all contacts free to that with all stuck (Weyl's inequalities), and do not narrow it. Its
        flanks R/|ω − ω_m| reach to the ends of the interval, where they are h/|ω − ω_m| times as high as the
        top R/h: what is far lower there, at both ends, is low at the top too.
        """
        workspace = self._solver.workspace
        flags = np.empty((self._loop.system.ks.size, rows.begin.size), bool)
        stands = np.maximum(rows.amplitude[rows.begin], rows.amplitude[rows.begin + 1])
        counts, moves = MATTERS * np.maximum(stands, OF_THE_TOP * top), MOVES
        if self._competes > 0.0:
            # Whatever it makes the contacts do, it matters where it may be the highest.
            counts, moves = np.maximum(counts, (self._competes * top - stands) / FEEDBACK), HUGE
        find_suspects(
            workspace.system, *self._loop.range, rows.solutions, rows.observed, rows.begin, counts,
            self._solver.least, moves, FLANKS, RESOLVED, flags,
        )  # fmt: skip
        return flags

    def _ladders(
        self, left: PointRow, right: PointRow, wanted: list[Resonance], top: float, found: Search
    ) -> list[PointRow]:
        """Return nodes on ladders round resonances between two nodes, and between the rungs."""
        low, high = sorted((left.at, right.at))
        rungs: set[float] = set()
        taken: list[Resonance] = []
        for one in sorted(wanted, key=lambda one: one.half_width):
            if any(abs(one.at - other.at) <= 0.5 * other.half_width for other in taken):
                continue
            taken.append(one)
            rungs |= {at for at in _ladder(one, low, high) if low < at < high}
        onward = 1.0 if right.at > left.at else -1.0
        inside: list[PointRow] = []
        for at in sorted(rungs, reverse=onward < 0.0):
            node = self._solve(left, right, at, onward)
            if node is None:
                found.left.append((at, "no solution was found at a resonance"))
            else:
                inside.append(node)
        found.solved += len(taken)
        chain = [left, *inside, right]
        dense: list[PointRow] = []
        for a, b in pairwise(chain):
            dense += [a, *dense_between(a, b, MOST_HALVINGS, partial(self._halved, top, found))]
        return dense[1:]

    def _solve(self, left: PointRow, right: PointRow, at: float, onward: float) -> PointRow | None:
        """Solve at λ = `at` from what is predicted there, then from what is interpolated."""
        self._added += 1
        if self._added > MOST_NODES:
            return None
        predicted = self._model.predicted(left, right, at)
        share = (at - left.at) / (right.at - left.at)
        straight = (1.0 - share) * left.solution[:-1] + share * right.solution[:-1]
        guesses = [straight]
        if predicted is not None and np.all(np.isfinite(predicted[0])):
            guesses.insert(0, self._model.amplitudes.coefficients(predicted[0].T).reshape(-1))
        return self._solver.at(at, guesses, onward)

    def _halved(
        self, top: float, found: Search, left: PointRow, right: PointRow, _depth: int
    ) -> tuple[PointRow | None, bool]:
        """Return the node between two, and whether the cubics of the amplitude predict it."""
        highest = max(left.measures[MAX_ABS], right.measures[MAX_ABS])
        allowed = max(PREDICTED * highest, PREDICTED_OF_TOP * top)
        if abs(right.at - left.at) <= 1e-13 * abs(right.at):
            return None, True
        ends = left.solution, right.solution, left.tangent, right.tangent
        by_share = share_scales(*ends, self._solver.least)
        cubics = []
        for value, slope in ((HIGH, HIGH_SLOPE), (LOW, LOW_SLOPE)):
            turn = left.measures[slope] * by_share[0] - right.measures[slope] * by_share[1]
            cubics.append(0.5 * (left.measures[value] + right.measures[value]) + turn / 8.0)
        straight = 0.5 * (left.measures[MAX_ABS] + right.measures[MAX_ABS])
        if abs(max(cubics) - straight) <= allowed and highest < 0.1 * top:
            return None, True
        onward = 1.0 if right.at > left.at else -1.0
        middle = self._solve(left, right, 0.5 * (left.at + right.at), onward)
        if middle is None:
            found.left.append((0.5 * (left.at + right.at), "no solution was found beside a resonance"))
            return None, True
        return middle, max(
            abs(middle.measures[HIGH] - cubics[0]), abs(middle.measures[LOW] - cubics[1])
        ) <= allowed


def _group_starts(i: Integer, j: Integer) -> Integer:
    """Return where groups of neighbours begin, up to `GROUP` in each, in intervals j ascending for each i."""
    place = np.arange(i.size)
    follows = np.append(False, (np.diff(i) == 0) & (np.diff(j) == 1))
    run = np.maximum.accumulate(np.where(follows, 0, place))
    return np.flatnonzero((place - run) % GROUP == 0)


def _ladder(one: Resonance, low: float, high: float) -> list[float]:
    """Return the frequencies round a resonance that resolve it."""
    rungs, step = [one.at], one.half_width
    for _ in range(MOST_RUNGS):
        rungs += [one.at - step, one.at + step]
        step *= RUNG
        if one.at - step <= low and one.at + step >= high:
            break
    return rungs
