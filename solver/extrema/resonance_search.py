"""Narrow resonances between the points of a branch: found by linear algebra, then solved for.

Continuation steps by what the contacts see. A resonance that they hardly see (a node of the mode at the
contact, blades in phase) leaves no trace in their motion, and one that is narrow may stand between two points
without a trace in either. But the structure is known exactly, and between two points the contacts change
little: each harmonic of their forces is interpolated, their answer to a small change is the slope ĝ at the
points, and every resonance of the structure with the springs ĝ is an eigenvalue
(`solver.extrema.closed_loop_poles`). At each that is too narrow for the points around it the motion is
predicted, (I + A ĝ) δu = −r with the residual r of the interpolated motion; where the prediction matters the
balance is solved, on a ladder of frequencies round the resonance, until the points are as dense as it is
narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS
from solver.contacts.kernels.columns import COULOMB
from solver.contacts.slopes import amplitudes
from solver.extrema.closed_loop_poles import ClosedLoop
from solver.extrema.contact_springs import LocalModel, Resonance, unknowns
from solver.extrema.nodes import Node, NodeSolver
from solver.jit.fourier import Complex, Real

# What a resonance adds to the amplitude, relative to what stands there, from which it is solved for. What
# stands there counts as this share of the highest point at least.
MATTERS, OF_THE_TOP = 5e-4, 0.01
# What it adds to the motion of a contact, relative to that motion, from which it is solved for: the contact
# may slip there, and then nothing is linear any more.
MOVES = 0.3
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


@dataclass(slots=True)
class Search:
    """What a search did.

    Attributes
    ----------
    nodes : list of Node
        The branch with what was added.
    solved : int
        Resonances that were solved for.
    left : list of (float, str)
        Places (λ) where a resonance that matters was not solved for, and why.
    unseen : float
        Highest amplitude predicted at the resonances that do not matter [m].
    """

    nodes: list[Node]
    solved: int = 0
    left: list[tuple[float, str]] = field(default_factory=list)
    unseen: float = 0.0


class ResonanceSearch:
    """Adds nodes to a branch over the frequency until no narrow resonance can stand between two of them."""

    def __init__(self, solver: NodeSolver, loop: ClosedLoop) -> None:
        self._solver, self._loop = solver, loop
        self._model = LocalModel(solver)
        self._added = 0

    def run(self, nodes: list[Node]) -> Search:
        """Search between all neighbours; the list is not changed."""
        found = Search(nodes=list(nodes))
        fresh = {id(node) for node in nodes[:-1]}
        for _ in range(MOST_ROUNDS):
            top = max(node.measures[MAX_ABS] for node in found.nodes)
            pairs = [(a, b) for a, b in pairwise(found.nodes) if id(a) in fresh]
            if not pairs:
                break
            wanted = self._wanted(pairs, top, found)
            if not wanted:
                break
            fresh = set()
            grown: list[Node] = []
            for left, right in pairwise(found.nodes):
                grown.append(left)
                inside = self._ladders(left, right, wanted.get(id(left), ()), top, found)
                fresh |= {id(node) for node in (left, *inside)} if inside else set()
                grown += inside
            found.nodes = [*grown, found.nodes[-1]]
        else:
            found.left += [(a.at, "the search ended before it settled") for a, _ in pairs if id(a) in wanted]
        return found

    def _wanted(
        self, pairs: list[tuple[Node, Node]], top: float, found: Search
    ) -> dict[int, list[Resonance]]:
        """Return the resonances that matter, by the node on the left of them."""
        wanted: dict[int, list[Resonance]] = {}
        suspects = self._unsettled(pairs, self._suspects(pairs, top))
        self._model.linearise([node for flagged in suspects.values() for j in flagged for node in pairs[j]])
        for i, flagged in suspects.items():
            for j, one in self._narrow(pairs, flagged, i):
                left, right = pairs[j]
                height, share = self._model.adds(left, right, one)
                stands = max(left.measures[MAX_ABS], right.measures[MAX_ABS])
                if share > MOVES or height > MATTERS * max(stands, OF_THE_TOP * top):
                    wanted.setdefault(id(left), []).append(one)
                else:
                    found.unseen = max(found.unseen, stands + height)
        return wanted

    def _unsettled(
        self, pairs: list[tuple[Node, Node]], suspects: dict[int, list[int]]
    ) -> dict[int, list[int]]:
        """Return the suspects without the groups of neighbours at whose ends every resonance near is broad.

        What contacts that slip take out of a resonance changes little from one point to the next.
        """
        groups = {i: _groups(flagged) for i, flagged in suspects.items()}
        ends = [
            node
            for found in groups.values()
            for group in found
            for node in (pairs[group[0]][0], pairs[group[-1]][1])
        ]
        self._model.linearise(ends)
        left: dict[int, list[int]] = {}
        for i, found in groups.items():
            narrow = self._are_narrow(pairs, found, i)
            kept = [j for group, wanted in zip(found, narrow, strict=True) if wanted for j in group]
            if kept:
                left[i] = kept
        return left

    def _are_narrow(self, pairs: list[tuple[Node, Node]], groups: list[list[int]], i: int) -> list[bool]:
        """Return whether a resonance near a group of intervals may be narrower than they are, of each."""
        ends = [(pairs[group[0]][0], pairs[group[-1]][1]) for group in groups]
        linear = [[self._model.at(node) for node in pair] for pair in ends]
        known = [
            len(group) == GROUP and np.array_equal(pair[0].states, pair[1].states) and None not in both
            for group, pair, both in zip(groups, ends, linear, strict=True)
        ]
        rows = [j for j, one in enumerate(known) if one]
        if not rows:
            return [True] * len(groups)
        stiffness = np.array([each.stiffness[i] for j in rows for each in linear[j] if each is not None])
        at = np.array([[node.at for node in ends[j]] for j in rows])
        # Within 1.5 lengths of the middle is within twice the length of an end.
        reach = np.repeat(2.0 * np.abs(at[:, 1] - at[:, 0]), 2)
        ends_may = self._loop.may_meet(stiffness, i, at.reshape(-1), reach)
        may = np.asarray(ends_may[0::2] | ends_may[1::2])
        narrow = [True] * len(groups)
        for j, one in zip(rows, may, strict=True):
            narrow[j] = bool(one)
        rows = [j for j, one in zip(rows, may, strict=True) if one]
        if not rows:
            return narrow
        stiffness, at = stiffness[np.repeat(may, 2)], at[may]
        poles = self._loop.of_harmonic(stiffness, i, at.reshape(-1))
        span = np.abs(at[:, 1] - at[:, 0])[:, None]
        middle = at.mean(axis=1)[:, None]
        poles_at, half_width = poles.at.reshape(len(rows), -1), poles.half_width.reshape(len(rows), -1)
        longest = np.array([[max(abs(pairs[k][1].at - pairs[k][0].at) for k in groups[j])] for j in rows])
        near = (np.abs(poles_at - middle) <= 1.5 * span) & (half_width * RESOLVED <= BROAD * longest)
        for j, one in zip(rows, near.any(axis=1), strict=True):
            narrow[j] = bool(one)
        return narrow

    def _narrow(
        self, pairs: list[tuple[Node, Node]], flagged: list[int], i: int
    ) -> list[tuple[int, Resonance]]:
        """Return the resonances of harmonic number i in intervals too wide for them, with those."""
        rows: dict[int, tuple[float, Complex]] = {}
        reach: dict[int, float] = {}
        for j in flagged:
            for node in pairs[j]:
                linear = self._model.at(node)
                if linear is not None:
                    rows[id(node)] = node.at, linear.stiffness[i]
                    reach[id(node)] = max(reach.get(id(node), 0.0), abs(pairs[j][1].at - pairs[j][0].at))
        if not rows:
            return []
        ats, stiffness = (np.array(part) for part in zip(*rows.values(), strict=True))
        may = self._loop.may_meet(stiffness, i, ats, np.array(list(reach.values())))
        if not may.any():
            return []
        number = {
            key: row for row, key in enumerate(key for key, here in zip(rows, may, strict=True) if here)
        }
        poles = self._loop.of_harmonic(stiffness[may], i, ats[may])
        ends = [(j, number[id(node)]) for j in flagged for node in pairs[j] if id(node) in number]
        where, chosen = (np.array(part) for part in zip(*ends, strict=True))
        low, high = np.sort([(pairs[j][0].at, pairs[j][1].at) for j in where], axis=1).T[:, :, None]
        at, half_width = poles.at[chosen], poles.half_width[chosen]
        inside = (at > low) & (at < high) & (RESOLVED * half_width < high - low)
        return [
            (
                int(where[row]),
                Resonance(at=at[row, m], half_width=max(half_width[row, m], 1e-13 * at[row, m]), harmonic=i),
            )
            for row, m in np.argwhere(inside)
        ]

    def _suspects(self, pairs: list[tuple[Node, Node]], top: float) -> dict[int, list[int]]:
        """Return the intervals that may hold a resonance narrower than they are, by number of the harmonic.

        Contacts that are springs between nothing and full stick move the m-th resonance at most from its
        place with all contacts free to that with all stuck (Weyl's inequalities), and do not narrow it. Its
        flanks R/|ω − ω_m| reach to the ends of the interval, where they are h/|ω − ω_m| times as high as the
        top R/h: what is far lower there, at both ends, is low at the top too.
        """
        system, found = self._loop.system, {}
        ends = np.array([(a.at, b.at) for a, b in pairs])
        low, high = ends.min(axis=1), ends.max(axis=1)
        flanks = FLANKS * self._shares(pairs, top)
        friction = bool(np.all(system.laws == COULOMB))
        for i, k in enumerate(system.ks):
            if k == 0:
                continue
            free, stuck = self._loop.free[int(system.which[i])], self._loop.stuck[int(system.which[i])]
            begin, end = free.at / k, np.maximum(stuck.at, free.at) / k
            if not friction:
                begin, end = np.zeros_like(begin), np.full_like(end, np.inf)
            width = np.minimum(free.half_width, stuck.half_width) / k
            meets = (begin[None, :] <= high[:, None]) & (end[None, :] >= low[:, None])
            narrow = (
                np.maximum(RESOLVED, 1.0 / np.maximum(flanks[i], 1e-300))[:, None] * width
                < (high - low)[:, None]
            )
            flagged = np.flatnonzero(np.any(meets & narrow, axis=1))
            if flagged.size:
                found[i] = flagged.tolist()
        return found

    def _shares(self, pairs: list[tuple[Node, Node]], top: float) -> Real:
        """Return how large each harmonic is at the ends of intervals, relative to what matters, (nk, P)."""
        n_ports = self._solver.workspace.balance.n_ports
        observed = np.abs(
            amplitudes(np.array([[node.observed for node in pair] for pair in pairs]), self._loop.system)
        )
        stands = np.array([[node.measures[MAX_ABS] for node in pair] for pair in pairs]).max(axis=1)
        counts = MATTERS * np.maximum(stands, OF_THE_TOP * top)
        shares: Real = observed.max(axis=2) / np.maximum(counts, 1e-300)
        if n_ports:
            rows = np.array([[node.solution[:-1] for node in pair] for pair in pairs])
            moved = np.abs(amplitudes(rows.reshape(len(pairs), 2, n_ports, -1), self._loop.system)).max(
                axis=2
            )
            whole = np.maximum(moved.max(axis=0), self._solver.least)
            shares = np.maximum(shares, (moved / np.maximum(MOVES * whole, 1e-300)).max(axis=2))
        return shares

    def _ladders(
        self, left: Node, right: Node, wanted: list[Resonance] | tuple[()], top: float, found: Search
    ) -> list[Node]:
        """Return nodes on ladders round resonances between two nodes, and between the rungs."""
        if not wanted:
            return []
        low, high = sorted((left.at, right.at))
        rungs: set[float] = set()
        taken: list[Resonance] = []
        for one in sorted(wanted, key=lambda one: one.half_width):
            if any(abs(one.at - other.at) <= 0.5 * other.half_width for other in taken):
                continue
            taken.append(one)
            rungs |= {at for at in _ladder(one, low, high) if low < at < high}
        onward = 1.0 if right.at > left.at else -1.0
        inside: list[Node] = []
        for at in sorted(rungs, reverse=onward < 0.0):
            node = self._solve(left, right, at, onward)
            if node is None:
                found.left.append((at, "no solution was found at a resonance"))
            else:
                inside.append(node)
        found.solved += len(taken)
        chain = [left, *inside, right]
        dense: list[Node] = []
        for a, b in pairwise(chain):
            dense += [a, *self._halved(a, b, top, MOST_HALVINGS, found)]
        return dense[1:]

    def _solve(self, left: Node, right: Node, at: float, onward: float) -> Node | None:
        """Solve at λ = `at` from what is predicted there, then from what is interpolated."""
        self._added += 1
        if self._added > MOST_NODES:
            return None
        predicted = self._model.predicted(left, right, at)
        share = (at - left.at) / (right.at - left.at)
        straight = (1.0 - share) * left.solution[:-1] + share * right.solution[:-1]
        guesses = [straight]
        if predicted is not None and np.all(np.isfinite(predicted[0])):
            guesses.insert(0, unknowns(predicted[0], self._loop.system.ks))
        return self._solver.at(at, guesses, onward)

    def _halved(self, left: Node, right: Node, top: float, depth: int, found: Search) -> list[Node]:
        """Return nodes between two until the cubics of the amplitude predict what lies between."""
        highest = max(left.measures[MAX_ABS], right.measures[MAX_ABS])
        allowed = max(PREDICTED * highest, PREDICTED_OF_TOP * top)
        if depth == 0 or abs(right.at - left.at) <= 1e-13 * abs(right.at):
            return []
        by_share = self._solver.scales(left, right)
        cubics = []
        for value, slope in ((HIGH, HIGH_SLOPE), (LOW, LOW_SLOPE)):
            turn = left.measures[slope] * by_share[0] - right.measures[slope] * by_share[1]
            cubics.append(0.5 * (left.measures[value] + right.measures[value]) + turn / 8.0)
        straight = 0.5 * (left.measures[MAX_ABS] + right.measures[MAX_ABS])
        if abs(max(cubics) - straight) <= allowed and highest < 0.1 * top:
            return []
        onward = 1.0 if right.at > left.at else -1.0
        middle = self._solve(left, right, 0.5 * (left.at + right.at), onward)
        if middle is None:
            found.left.append((0.5 * (left.at + right.at), "no solution was found beside a resonance"))
            return []
        off = max(abs(middle.measures[HIGH] - cubics[0]), abs(middle.measures[LOW] - cubics[1]))
        if off <= allowed:
            return [middle]
        before = self._halved(left, middle, top, depth - 1, found)
        return [*before, middle, *self._halved(middle, right, top, depth - 1, found)]


def _groups(flagged: list[int]) -> list[list[int]]:
    """Return ascending numbers in groups of neighbours, up to `GROUP` in each."""
    groups: list[list[int]] = []
    for j in flagged:
        if groups and len(groups[-1]) < GROUP and groups[-1][-1] == j - 1:
            groups[-1].append(j)
        else:
            groups.append([j])
    return groups


def _ladder(one: Resonance, low: float, high: float) -> list[float]:
    """Return the frequencies round a resonance that resolve it."""
    rungs, step = [one.at], one.half_width
    for _ in range(MOST_RUNGS):
        rungs += [one.at - step, one.at + step]
        step *= RUNG
        if one.at - step <= low and one.at + step >= high:
            break
    return rungs
