"""The table of a branch's points, in which rows keep their numbers while others are solved between them.

What is looked for on a branch is compiled and works on row numbers: its order is one array of them. A
solution that Newton's method does not find from the points beside it may still be the only one there is; the
place is then noted (`ASKED`), the search goes on without it, and whoever called it finds the solution from
nothing, notes it as an answer and begins again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from solver.balance.kernels.locate import between, tangent_at
from solver.balance.kernels.mechanics import ALLOWED, unaccounted
from solver.balance.kernels.newton import newton
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS, PIECE, RESIDUAL, measure
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Flags, Integer, Real
from solver.jit.kernel_records import referenced
from solver.jit.lapack import are_finite
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

# Every maximum above this share of the highest is polished.
WORTH_POLISHING = 5e-3
BENT = 5e-4  # relative error of the cubics from which an interval is halved wherever it is
STEEP = 8.0  # slope by the share, relative to that error, above which a cubic hides no extremum
# Share of a neighbour below which an interval with a change of piece is one whose both sides were solved.
LOCATED = 0.34
MATTERS = 1e-4  # relative height up to which a maximum is left unpolished beside others
# Bits of the flags: the cubics are too far from the curves; a maximum and a minimum may both stand there.
IS_BENT, WAVES = 1, 2


@compiled
def share_scales(before: Real, after: Real, way: Real, onward: Real, least: float) -> tuple[float, float]:
    """Return the factors that turn both tangents into derivatives by the share of the chord between them.

    `least` is the size of a motion below which it is rounding [m], as in `solver.balance.kernels.locate`.
    Around a fold λ goes there and back, so that the motion alone tells how far it is. Across a resonance much
    narrower than the chord the motion comes back turned round, against its tangent: there λ alone tells it,
    so that slopes keep their signs and no maximum is lost.
    """
    nt = before.size - 1
    size = least
    for i in range(nt):
        size = max(size, abs(before[i]))
    weight = 1.0 / max(size * size, 1e-300)
    length, at_left, at_right = 0.0, 0.0, 0.0
    for i in range(nt):
        step = (after[i] - before[i]) * weight
        length += step * (after[i] - before[i])
        at_left += step * way[i]
        at_right += step * onward[i]
    moved = after[nt] - before[nt]
    if way[nt] * onward[nt] >= 0.0:
        step = moved / max(moved * moved, 1e-300)
        length += step * moved
        at_left += step * way[nt]
        at_right += step * onward[nt]
    if min(at_left, at_right) < 0.0 and moved * way[nt] > 0.0 and moved * onward[nt] > 0.0:
        return moved / way[nt], moved / onward[nt]
    return length / at_left if at_left != 0.0 else 0.0, length / at_right if at_right != 0.0 else 0.0


@compiled
def _least_slope(a: float, da: float, b: float, db: float) -> float:
    """Return the least absolute slope of a cubic by the share, 0 where it changes its sign."""
    c1, c2 = 3.0 * (b - a) - 2.0 * da - db, da + db - 2.0 * (b - a)
    turn = min(max(-c1 / (3.0 * c2), 0.0), 1.0) if c2 != 0.0 else 0.0
    inside = da + turn * (2.0 * c1 + 3.0 * c2 * turn)
    low, high = min(da, db, inside), max(da, db, inside)
    return 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))


@compiled
def _waves(a: float, da: float, b: float, db: float) -> bool:
    """Return whether a cubic has both a maximum and a minimum inside while its ends lead the same way.

    With slopes up to three times that of the chord there is none (F. N. Fritsch, R. E. Carlson, SIAM J.
    Numer. Anal. 17 (1980) 238, doi:10.1137/0717021).
    """
    chord = b - a
    if da * db <= 0.0 or (da * chord > 0.0 and max(abs(da), abs(db)) <= 3.0 * abs(chord)):
        return False
    # The derivative is da + 2 c1 t + 3 c2 t².
    c1, c2 = 3.0 * chord - 2.0 * da - db, da + db - 2.0 * chord
    root = c1 * c1 - 3.0 * c2 * da
    if root <= 0.0 or c2 == 0.0:
        return False
    one, other = (-c1 - math.sqrt(root)) / (3.0 * c2), (-c1 + math.sqrt(root)) / (3.0 * c2)
    return 0.0 < one < 1.0 and 0.0 < other < 1.0


@compiled
def known_scales(
    solutions: Real, tangents: Real, partners: Integer, scales: Real, one: int, other: int, least: float
) -> tuple[float, float]:
    """Return `share_scales` from row `one` of a table to row `other`, worked out once for neighbours."""
    if partners[one] != other:
        partners[one] = other
        scales[one, 0], scales[one, 1] = share_scales(
            solutions[one], solutions[other], tangents[one], tangents[other], least
        )
    return scales[one, 0], scales[one, 1]


@compiled
def curve(c: int) -> tuple[int, int]:
    """Return the columns of value and slope of max x (0) or −min x (1)."""
    return (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)


@compiled
def _jump(at: Real, measures: Real, slopes: Real, j: int, c: int, value: int) -> float:
    """Return by how much the second derivatives by λ of the cubics left and right of point j differ."""
    left, right = at[j] - at[j - 1], at[j + 1] - at[j]
    here = measures[j, value]
    before = 6.0 * (measures[j - 1, value] - here) + 2.0 * slopes[j - 1, 0, c] + 4.0 * slopes[j - 1, 1, c]
    after = 6.0 * (measures[j + 1, value] - here) - 4.0 * slopes[j, 0, c] - 2.0 * slopes[j, 1, c]
    return abs(after / max(right * right, 1e-300) - before / max(left * left, 1e-300))


class Look(NamedTuple):
    """What may stand between P neighbouring points."""

    at: Real  # (P,) λ
    measures: Real  # (P, MEASURES) with slopes along the tangents
    slopes: Real  # (P − 1, 2, 2) interval, end, max x or −min x: by the share of the interval
    reach: Real  # (P − 1,) how high max|x| may be there by its slopes [m]
    error: Real  # (P − 1,) by how much the cubics are estimated to be wrong [m], 0 where it was not looked at
    flags: Integer  # (P − 1,) bits of `IS_BENT` and `WAVES`


@apart
def look_between(
    solutions: Real, tangents: Real, table: Real, partners: Integer, kept: Real, rows: Integer, least: float,
    top: float,
) -> Look:  # fmt: skip
    """Look at all intervals between neighbouring points, at least two.

    Neighbouring cubics share value and slope at a point, and their second derivatives differ there by
    D ≈ (ℓ² + ℓ'²) x⁗ / 12 where x is smooth, by its own jump where a contact changes the piece of its law: in
    both cases the cubic is wrong by about D ℓ² / 64 in the middle (Hermite's error x⁗ ℓ⁴ / 384). Where both
    sides of such a change are solved, D tells of the change alone and counts on neither side of it.

    Parameters
    ----------
    solutions, tangents, table : (R, nt + 1) points, λ last, and (R, MEASURES).
    partners, kept : (R,) and (R, 2) the row that `share_scales` are known to from each, and these; filled.
    rows : (P,) the points of the branch in the table, in its order.
    least : size of a motion below which it is rounding [m].
    top : the highest amplitude [m].
    """
    count, last = rows.size - 1, solutions.shape[1] - 1
    at, measures = np.empty(count + 1), np.empty((count + 1, table.shape[1]))
    slopes, reach, error = np.empty((count, 2, 2)), np.zeros(count), np.zeros(count)
    flags = np.zeros(count, np.int64)
    for j in range(count + 1):
        at[j], measures[j] = solutions[rows[j], last], table[rows[j]]
    for j in range(count):
        scales = known_scales(solutions, tangents, partners, kept, rows[j], rows[j + 1], least)
        for c in range(2):
            value, slope = curve(c)
            a, b = measures[j, value], measures[j + 1, value]
            da, db = measures[j, slope] * scales[0], measures[j + 1, slope] * scales[1]
            slopes[j, 0, c], slopes[j, 1, c] = da, db
            reach[j] = max(reach[j], max(a, b) + 0.25 * (max(da, 0.0) + max(-db, 0.0)))
            most = max(abs(da), abs(db), abs(b - a))
            counts = max(a, b) >= WORTH_POLISHING * top and most > 5.0 * MATTERS * max(a, b)
            if counts and _waves(a, da, b, db):
                flags[j] |= WAVES
    far = 1e-9 * abs(at[count])
    length, narrow = np.empty(count), np.zeros(count, np.bool_)
    for j in range(count):
        length[j] = abs(at[j + 1] - at[j])
    for j in range(count):
        beside = max(length[j - 1] if j > 0 else 0.0, length[j + 1] if j + 1 < count else 0.0)
        narrow[j] = length[j] < LOCATED * beside and measures[j, PIECE] != measures[j + 1, PIECE]
    for j in range(count):
        stands = max(measures[j, HIGH], measures[j, LOW], measures[j + 1, HIGH], measures[j + 1, LOW])
        if stands < WORTH_POLISHING * top or length[j] <= far or narrow[j]:
            continue
        before, after = j > 0 and not narrow[j - 1], j + 1 < count and not narrow[j + 1]
        for c in range(2):
            value = curve(c)[0]
            jump = _jump(at, measures, slopes, j, c, value) if before else 0.0
            if after:
                jump = max(jump, _jump(at, measures, slopes, j + 1, c, value))
            off = jump * length[j] * length[j] / 64.0
            error[j] = max(error[j], off)
            a, b = measures[j, value], measures[j + 1, value]
            da, db = slopes[j, 0, c], slopes[j, 1, c]
            # A curve that is steeper than its error can bend hides no extremum.
            if off > BENT * stands and _least_slope(a, da, b, db) < STEEP * off:
                flags[j] |= IS_BENT
    return Look(at, measures, slopes, reach, error, flags)


NOWHERE = -1  # the row of what was not found
MOST_ITERATIONS = 12  # of a solution on the plane across a chord
# Lists of `Nodes.notes`: rows of maxima, and 1 where one is no end of the branch; λ of what was not settled,
# and why, a number of `WHY`; λ of two rows and of a place between them without a solution; λ where a solution
# is to be found from nothing, and the way of dλ along the branch; λ where that was done, and the row found.
PEAKS, UNDONE, LOST, ASKED, ANSWERED = range(5)
# Entries of `Nodes.counts` behind the lengths of these: rows of the table, Newton iterations, and whether
# there is one solution only, wherever it is found from.
ROWS, SPENT, ONE_SOLUTION = 5, 6, 7
NO_SOLUTION, NOT_CLOSED_IN, NOT_POLISHED = 0, 1, 2
WHY = (
    "no solution was found between two points", "a change of a contact was not closed in on",
    "a peak could not be polished",
)  # fmt: skip


class Nodes:
    """Points of a branch, λ last, in arrays longer than there are rows; `counts` says how many there are."""

    system: System
    linear: Receptance
    point: Evaluation
    solutions: Real  # (rows, nt + 1)
    tangents: Real  # (rows, nt + 1) onward along the branch
    measures: Real  # (rows, MEASURES) slopes along the tangents
    observed: Real  # (rows, n)
    states: Integer  # (rows, ne)
    partners: Integer  # (rows,) the row that `share_scales` are known to from each
    scales: Real  # (rows, 2) these
    order: Integer  # rows along the branch
    notes: Real  # (lists, ·, 3)
    counts: Integer  # (8,)


_new: Callable[..., Nodes] = referenced("Nodes", __name__, tuple(Nodes.__annotations__), replaced=True)


@compiled
def longer(array: Any, rows: int) -> Any:
    """Return an array of more rows that begins with those of another."""
    out = np.empty((rows, *array.shape[1:]), array.dtype)
    out[: array.shape[0]] = array
    return out


@compiled
def new_nodes(
    system: System, linear: Receptance, point: Evaluation, one_solution: bool, solutions: Real,
    tangents: Real, states: Integer, observed: Real, measures: Real,
) -> Nodes:  # fmt: skip
    """Return the table of the points of a branch (P, …)."""
    count = solutions.shape[0]
    room, counts = count + count // 2 + 64, np.zeros(8, np.int64)
    counts[ROWS], counts[ONE_SOLUTION] = count, 1 if one_solution else 0
    return _new(
        system, linear, point, longer(solutions, room), longer(tangents, room), longer(measures, room),
        longer(observed, room), longer(states, room), np.full(room, NOWHERE), np.empty((room, 2)),
        np.arange(count), np.empty((5, 16, 3)), counts,
    )  # fmt: skip


class PointRow(NamedTuple):
    """One point; the tangent points onward along the branch, and slopes are along it."""

    solution: Real
    tangent: Real
    measures: Real
    observed: Real
    states: Integer
    number: int  # of its row

    @property
    def at(self) -> float:
        """λ, in the unit inside."""
        return float(self.solution[-1])


class Table(NamedTuple):
    """The arrays of a table as they are now, for Python."""

    solutions: Real
    tangents: Real
    measures: Real
    observed: Real
    states: Integer
    order: Integer
    notes: Real
    counts: Integer


@compiled
def arrays_of(nodes: Nodes) -> Table:
    """Return the arrays of a table."""
    return Table(
        nodes.solutions, nodes.tangents, nodes.measures, nodes.observed, nodes.states, nodes.order,
        nodes.notes, nodes.counts,
    )  # fmt: skip


@compiled
def order_of(nodes: Nodes) -> Integer:
    """Return the rows along the branch."""
    return nodes.order


@compiled
def row_of(nodes: Nodes, row: int) -> PointRow:
    """Return one row."""
    solution, tangent, measures = nodes.solutions[row], nodes.tangents[row], nodes.measures[row]
    return PointRow(solution, tangent, measures, nodes.observed[row], nodes.states[row], row)


@compiled
def set_order(nodes: Nodes, order: Integer) -> None:
    """Have the branch go through other rows of the table."""
    nodes.order = order.copy()


@compiled
def look_with(nodes: Nodes, system: System, linear: Receptance, point: Evaluation) -> None:
    """Have another DOF of the same scene observed."""
    nodes.system, nodes.linear, nodes.point = system, linear, point


@compiled
def note(nodes: Nodes, which: int, one: float, two: float, three: float) -> None:
    """Put an entry into one of the lists."""
    count, room = nodes.counts[which], nodes.notes.shape[1]
    if count == room:
        notes = np.empty((nodes.notes.shape[0], 2 * room, 3))
        notes[:, :room] = nodes.notes
        nodes.notes = notes
    nodes.notes[which, count, 0], nodes.notes[which, count, 1] = one, two
    nodes.notes[which, count, 2] = three
    nodes.counts[which] += 1


@apart
def add_row(
    nodes: Nodes, solution: Real, tangent: Real, states: Integer, observed: Real, measures: Real
) -> int:  # fmt: skip
    """Add a row; return its number."""
    row, room = nodes.counts[ROWS], nodes.partners.size
    if row == room:
        room += room // 2 + 16
        nodes.solutions, nodes.tangents = longer(nodes.solutions, room), longer(nodes.tangents, room)
        nodes.measures, nodes.observed = longer(nodes.measures, room), longer(nodes.observed, room)
        nodes.states, nodes.scales = longer(nodes.states, room), longer(nodes.scales, room)
        nodes.partners = longer(nodes.partners, room)
    nodes.solutions[row], nodes.tangents[row], nodes.measures[row] = solution, tangent, measures
    nodes.observed[row], nodes.states[row], nodes.partners[row] = observed, states, NOWHERE
    nodes.counts[ROWS] += 1
    return int(row)


@compiled
def place_of(nodes: Nodes, row: int) -> float:
    """Return λ of a row, in the unit inside."""
    return float(nodes.solutions[row, nodes.solutions.shape[1] - 1])


@compiled
def way_of(nodes: Nodes, row: int) -> float:
    """Return dλ along the branch at a row."""
    return float(nodes.tangents[row, nodes.tangents.shape[1] - 1])


@compiled
def highest(nodes: Nodes) -> float:
    """Return the highest amplitude of the branch [m]."""
    top = 0.0
    for row in nodes.order:
        top = max(top, nodes.measures[row, MAX_ABS])
    return float(top)


@compiled
def look(nodes: Nodes, top: float) -> Look:
    """Return what may stand between neighbouring points of the branch, at least two."""
    return look_between(
        nodes.solutions, nodes.tangents, nodes.measures, nodes.partners, nodes.scales, nodes.order,
        nodes.system.least_size, top,
    )  # fmt: skip


@compiled
def scales_of(nodes: Nodes, a: int, b: int) -> tuple[float, float]:
    """Return `share_scales` between two rows."""
    return known_scales(
        nodes.solutions, nodes.tangents, nodes.partners, nodes.scales, a, b, nodes.system.least_size
    )


@compiled
def ways_of(nodes: Nodes, a: int, b: int) -> Real:
    """Return the tangents of two rows by the share of the way between them, (2, nt + 1)."""
    by_left, by_right = scales_of(nodes, a, b)
    ways = np.empty((2, nodes.solutions.shape[1]))
    for i in range(ways.shape[1]):
        ways[0, i], ways[1, i] = by_left * nodes.tangents[a, i], by_right * nodes.tangents[b, i]
    return ways


@compiled
def with_inside(order: Integer, inside: Integer) -> Integer:
    """Return rows with others between them, (P − 1, ·), NOWHERE where none comes."""
    grown, length = np.empty(order.size + inside.size, np.int64), 0
    for j in range(order.size):
        grown[length] = order[j]
        length += 1
        for k in range(inside.shape[1] if j < inside.shape[0] else 0):
            if inside[j, k] != NOWHERE:
                grown[length] = inside[j, k]
                length += 1
    return grown[:length].copy()


@apart
def measured_at(nodes: Nodes, u: Real, p: float, norm: float, onward: float) -> int:
    """Return the row of a solution, evaluated last with the residual `norm`; NOWHERE where it has no slope.

    `onward` is the sign of dλ along the branch.
    """
    system, linear, point, n = nodes.system, nodes.linear, nodes.point, u.size
    solution, tangent = np.empty(n + 1), np.empty(n + 1)
    if not tangent_at(system, linear, point, tangent):
        return NOWHERE
    solution[:n], solution[n] = u, p
    for i in range(n + 1):
        tangent[i] *= onward
    x, out = np.zeros(nodes.observed.shape[1]), np.zeros(nodes.measures.shape[1])
    measure(system, linear, u, point, tangent[:n], onward, x, out)
    out[RESIDUAL] = norm
    return add_row(nodes, solution, tangent, point.states, x, out) if are_finite(out) else NOWHERE


@apart
def solved_at(nodes: Nodes, p: float, guesses: Real, onward: float, from_nothing: bool) -> int:
    """Return the row of a solution at λ = p, NOWHERE if none is found.

    Parameters
    ----------
    guesses : (G, nt) slip motions to start from, one after the other.
    onward : the sign of dλ along the branch.
    from_nothing : whether to ask for what starts from nothing at last, where there is one solution only:
        elsewhere that may be of another branch.
    """
    system, linear, point, u = nodes.system, nodes.linear, nodes.point, np.empty(guesses.shape[1])
    for guess in guesses:
        u[:] = guess
        receptance(system, p, linear)
        good, iterations, norm = newton(system, linear, u, p, 0.0, point)
        nodes.counts[SPENT] += iterations
        if good and unaccounted(system, linear, u, point) <= ALLOWED:
            return measured_at(nodes, u, p, norm, onward)
    if not from_nothing or nodes.counts[ONE_SOLUTION] == 0:
        return NOWHERE
    for i in range(nodes.counts[ANSWERED]):
        if nodes.notes[ANSWERED, i, 0] == p:
            return int(nodes.notes[ANSWERED, i, 1])
    note(nodes, ASKED, p, onward, 0.0)
    return NOWHERE


@apart
def aside(nodes: Nodes, a: int, b: int, p: float) -> int:
    """Return the row at λ = p between two, NOWHERE if the branch turns there or has no solution.

    Where a contact changes its state the arc between two points bends so sharply that the plane across the
    chord meets it far away, or not at all; a solution for a given λ is there all the same. Where none was
    found it is not looked for again: that would cost as much as hundreds of points.
    """
    left, right = place_of(nodes, a), place_of(nodes, b)
    if way_of(nodes, a) * way_of(nodes, b) <= 0.0 or left == right:
        return NOWHERE
    for i in range(nodes.counts[LOST]):
        known = nodes.notes[LOST, i]
        if known[0] == left and known[1] == right and known[2] == p:
            return NOWHERE
    share, straight = (p - left) / (right - left), np.empty((1, nodes.solutions.shape[1] - 1))
    for i in range(straight.size):
        straight[0, i] = (1.0 - share) * nodes.solutions[a, i] + share * nodes.solutions[b, i]
    row = solved_at(nodes, p, straight, math.copysign(1.0, right - left), True)
    if row == NOWHERE:
        note(nodes, LOST, left, right, p)
    return row


@apart
def between_rows(nodes: Nodes, a: int, b: int, share: float) -> tuple[int, float]:
    """Return the row at a share of the way between two, NOWHERE if there is no solution, and a distance.

    It is by how much the cubics of max x and −min x miss what was found [m], infinite where that was not on
    the plane across the chord.
    """
    last, length = nodes.solutions.shape[1] - 1, place_of(nodes, b) - place_of(nodes, a)
    ways, found, way = ways_of(nodes, a, b), np.empty(last + 1), np.empty(last + 1)
    x, out = np.zeros(nodes.observed.shape[1]), np.zeros(nodes.measures.shape[1])
    good, iterations = between(
        nodes.system, nodes.linear, nodes.point, nodes.solutions[a], ways[0], nodes.solutions[b], ways[1],
        share, MOST_ITERATIONS, found, way, x, out,
    )  # fmt: skip
    nodes.counts[SPENT] += iterations
    # Around a fold nothing holds λ to its place but the motion: a solution far from both ends is another.
    away = abs(found[last] - place_of(nodes, a) - share * length)
    near = away <= abs(length) + 0.5 * (abs(ways[0, last]) + abs(ways[1, last]))
    if not (good and near and are_finite(out)):
        return aside(nodes, a, b, place_of(nodes, a) + share * length), math.inf
    off, t, r = 0.0, share, 1.0 - share
    by_left, by_right = scales_of(nodes, a, b)
    for c in range(2):
        value, slope = curve(c)
        cubic = (
            (1.0 + 2.0 * t) * r * r * nodes.measures[a, value]
            + t * r * r * by_left * nodes.measures[a, slope]
            + t * t * (3.0 - 2.0 * t) * nodes.measures[b, value]
            - t * t * r * by_right * nodes.measures[b, slope]
        )
        off = max(off, abs(cubic - out[value]))
    return add_row(nodes, found, way, nodes.point.states, x, out), off


@apart
def halve(nodes: Nodes, wanted: Flags, notes: bool) -> Real:
    """Put solutions in the middle of the intervals wanted (P − 1,) of the branch.

    With `notes` places without a solution are left undone.

    Returns
    -------
    Of each interval that there is then by how much the cubics missed its new end [m], 0 without one.
    """
    count, length = wanted.size, 0
    inside, off = np.full((count, 1), NOWHERE), np.zeros(2 * count)
    for j in range(count):
        length += 1
        if not wanted[j]:
            continue
        a = nodes.order[j]
        inside[j, 0], missed = between_rows(nodes, a, nodes.order[j + 1], 0.5)
        if inside[j, 0] != NOWHERE:
            off[length - 1], off[length] = missed, missed
            length += 1
        elif notes:
            note(nodes, UNDONE, place_of(nodes, a), NO_SOLUTION, 0.0)
    nodes.order = with_inside(nodes.order, inside)
    return off[:length]
