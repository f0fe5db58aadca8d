"""Contacts that change the piece of their law between points of a branch: both sides of a change are solved.

Within one piece of every law the curves of a branch are smooth, and points that are close enough show their
maxima. Where a piece changes between two points, the slope may jump, turn and come back in a small share of
the interval, and nothing at its ends tells of that.
"""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.locate import measured_on_plane
from solver.balance.kernels.newton import arc_newton, newton
from solver.balance.kernels.output import (
    HIGH,
    HIGH_SLOPE,
    LOW,
    LOW_SLOPE,
    MAX_ABS,
    PIECE,
    RANGE_SLOPE,
    SLOPE,
    piece,
)
from solver.balance.kernels.residual import contact_values, element
from solver.contacts.kernels.columns import KT, MU
from solver.contacts.kernels.state_durations import find_segments
from solver.contacts.kernels.stick_slip_events import piece_of
from solver.contacts.kernels.system import SIZE, Evaluation, Receptance, System
from solver.continuation.extrema.kernels.node_table import (
    BENT,
    MATTERS,
    MOST_ITERATIONS,
    NO_SOLUTION,
    NOT_CLOSED_IN,
    NOWHERE,
    SPENT,
    STEEP,
    UNDONE,
    Look,
    Nodes,
    add_row,
    between_rows,
    curve,
    halve,
    highest,
    longer,
    look,
    note,
    place_of,
    solved_at,
    way_of,
    with_inside,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Flags, Integer, Real, coefficient_count
from solver.jit.lapack import copy_to
from solver.jit.separate import apart
from solver.linear.kernels.receptance import receptance

_HALVED = 5  # halvings of the interpolated motion: the cubic is no better than their result
_BEYOND = 0.1  # share of a step between two solutions by which the next one goes beyond the change foretold
_LARGE = 100  # unknowns from which steps are tried first for which old factors may serve
_NEAREST = 1e-3  # share of the interval left next to an end


@compiled
def _interpolated(rows: Real, ways: Real, t: float, u: Real) -> None:
    """Fill `u` with the cubic at the share t of the way between two solutions; see `locate_change`."""
    n, r = u.size, 1.0 - t
    width = rows[1, n] - rows[0, n]
    a, b = (1.0 + 2.0 * t) * r * r, t * t * (3.0 - 2.0 * t)
    da, db = t * r * r * width, -t * t * r * width
    for i in range(n):
        u[i] = a * rows[0, i] + da * ways[0, i] + b * rows[1, i] + db * ways[1, i]


@apart
def _find_pieces(system: System, u: Real, p: float, asked: Integer, point: Evaluation) -> None:
    """Fill `point.pieces` of the elements asked for (1) from the motions u at λ = p."""
    n = coefficient_count(system.ks)
    table, load, slope, dload = contact_values(system, p, 0.0)
    for e in range(system.laws.size):
        if asked[e] == 0:
            continue
        if system.jenkins[e] == 0 or system.samples > 0:
            element(system, e, u, table[e], load[e], slope[e], dload[e], True, point)
            continue
        c = system.first_port[e]
        _, count = find_segments(
            u[c * n : (c + 1) * n], system.ks, load[e], system.load_ks, table[e, KT], table[e, MU],
            system.cos_table, system.sin_table, point.segments,
        )  # fmt: skip
        point.pieces[e] = piece_of(point.segments, count)


@compiled
def _changing(system: System, rows: Real, pieces: Integer, asked: Integer, point: Evaluation) -> None:
    """Fill `pieces` (ne,) with those at the first of two solutions; keep of `asked` (1) where they change."""
    n = rows.shape[1] - 1
    _find_pieces(system, rows[0, :n], rows[0, n], asked, point)
    for e in range(pieces.size):
        pieces[e] = point.pieces[e]
    _find_pieces(system, rows[1, :n], rows[1, n], asked, point)
    for e in range(pieces.size):
        asked[e] = 1 if point.pieces[e] != pieces[e] else 0


@compiled
def _foretold(
    system: System, point: Evaluation, rows: Real, ways: Real, pieces: Integer, asked: Integer, u: Real
) -> float:
    """Return the λ at which a piece changes if the motion between two solutions is a cubic."""
    n = u.size
    before, after = 0.0, 1.0
    for _ in range(_HALVED):
        t = 0.5 * (before + after)
        _interpolated(rows, ways, t, u)
        _find_pieces(system, u, rows[0, n] + t * (rows[1, n] - rows[0, n]), asked, point)
        changed = False
        for e in range(pieces.size):
            changed = changed or (asked[e] == 1 and point.pieces[e] != pieces[e])
        if changed:
            after = t
        else:
            before = t
    return rows[0, n] + 0.5 * (before + after) * (rows[1, n] - rows[0, n])


@compiled
def _settled(measures: Real, width: float, allowed: float) -> bool:
    """Return whether between two solutions whose λ are `width` apart the slope merely jumps.

    Then the chord is between both slopes. Another piece between them, in which the curves rise or fall more,
    is told by the step it leaves.
    """
    for c in range(2):
        value, slope = (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)
        before, after = measures[0, slope] * width, measures[1, slope] * width
        chord = measures[1, value] - measures[0, value]
        if not min(before, after) - allowed <= chord <= max(before, after) + allowed:
            return False
    return True


@apart
def locate_change(
    system: System, linear: Receptance, point: Evaluation, found: Real, ways: Real, x: Real, measures: Real,
    states: Integer, allowed: float, trials: int, most: int, sides: Integer,
) -> int:  # fmt: skip
    """Close in on the first change of a contact's piece between two points of a branch.

    Parameters
    ----------
    found : (2, nt + 1) both points, λ last; ways : (2, nt + 1) the slopes by λ there; x : (2, n) observed;
        measures : (2, MEASURES) with slopes by λ; states : (2, ne). They become those of the
        nearest solutions before and behind the change.
    allowed : amplitude [m] up to which a maximum between both sides does not matter.
    trials : solutions at most; most : Newton iterations of each.
    sides : (2,) 1 where such a solution was found, else 0; filled.

    Returns
    -------
    Newton iterations.
    """
    n = found.shape[1] - 1
    row, way, at, out = np.empty(n + 1), np.empty(n + 1), np.empty(x.shape[1]), np.empty(measures.shape[1])
    onward = np.zeros(n + 1)
    onward[n] = 1.0
    last, behind, total = 0.0, False, 0
    pieces, asked = np.empty(states.shape[1], np.int64), np.ones(states.shape[1], np.int64)
    _changing(system, found, pieces, asked, point)
    sides[0], sides[1] = 0, 0
    for _ in range(trials):
        lo, hi = found[0, n], found[1, n]
        p = _foretold(system, point, found, ways, pieces, asked, row[:n])
        if sides[0] + sides[1] > 0:
            beyond = max(_BEYOND * abs(p - last), abs(hi - lo) * 0.5**_HALVED)
            p += math.copysign(beyond, (hi - lo) * (-1.0 if behind else 1.0))
        margin = _NEAREST * (hi - lo)
        p = lo + margin if (p - lo) * (hi - lo) < margin * (hi - lo) else p
        p = hi - margin if (hi - p) * (hi - lo) < margin * (hi - lo) else p
        good, share = False, (p - lo) / (hi - lo)
        if point.counts[SIZE] >= _LARGE:
            _interpolated(found, ways, share, row[:n])
            good, iterations, _, norm = arc_newton(
                system, linear, row[:n], p, row, p, onward, 0.0, 1.0, point, most
            )
            total += iterations
        if not good:
            _interpolated(found, ways, share, row[:n])
            receptance(system, p, linear)
            good, iterations, norm = newton(system, linear, row[:n], p, 0.0, point)
            total += iterations
        row[n] = p
        good = good and measured_on_plane(
            system, linear, point, onward, 0.0, 1.0, False, norm, row, way, at, out
        )
        if not (good and math.isfinite(out[HIGH] + out[LOW] + out[HIGH_SLOPE] + out[LOW_SLOPE])):
            break
        behind = piece(point) != measures[0, PIECE]
        side, last = (1 if behind else 0), p
        copy_to(found[side], row)
        copy_to(ways[side], way)
        copy_to(x[side], at)
        copy_to(measures[side], out)
        for e in range(states.shape[1]):
            states[side, e] = point.states[e]
        sides[side] = 1
        if sides[0] + sides[1] == 2 and _settled(measures, found[1, n] - found[0, n], allowed):
            break
    return total


# Up to these departures from what the points beside an interval foretell a change in it hides no maximum:
# relative to the amplitude, and as a part of the slopes.
_FORETOLD, _STEEPER = 1e-3, 12.0
_FORETOLD_BESIDE = 1e-2  # the first of them, of an interval beside a change
_MOST_CHANGES = 16  # in one interval of the branch
_MOST_HALVINGS = 4  # of what a change leaves on either side of it
_MOST_SOLVES = 12  # of a change of state
# From so many contacts on an interval with changes is halved before each of them is closed in on: of many
# small ones hardly any departs that far once it is short.
_MANY_CONTACTS = 16
# A contact whose motion, by its slope at an end, changes over an interval by so many times its size may do
# something else in between and the same again at the other end.
_CHANGES_ALL = 2.0
_BESIDE = 4.0  # times steeper than usual the curves have to be beside a change for no check
_APART, _BEFORE, _BEHIND, _BETWEEN = 0, 1, 2, 3  # an interval and changes
# Where the highest is looked for alone: share of it, and of the range, from which an interval is parted in
# which contacts change, and how often at most.
_NOT_FAR, _CHANGE_LENGTH, _CHANGE_HALVINGS = 0.3, 0.01, 3


@apart
def settle_changes(nodes: Nodes, worth: float, highest_alone: bool) -> None:
    """Add to a branch the points on both sides of changes of piece, and between where the curves bend.

    Parameters
    ----------
    worth : share of the highest point below which changes do not matter.
    highest_alone : whether intervals are long, and are parted first where contacts change.
    """
    if nodes.order.size < 2:
        return
    if highest_alone:
        _part(nodes)
    top = highest(nodes)
    seen = look(nodes, top)
    departs = _departs(seen, _FORETOLD)
    for _ in range(_MOST_HALVINGS):
        hiding = _hiding(nodes, seen, worth * top, departs)
        if nodes.states.shape[1] >= _MANY_CONTACTS:
            hiding |= _wanted(nodes, seen, worth * top, departs)
        if not hiding.any():
            break
        halve(nodes, hiding, False)
        seen = look(nodes, top)
        departs = _departs(seen, _FORETOLD)
    chain = _with_sides(nodes, _wanted(nodes, seen, worth * top, departs))
    if chain.shape[0] > nodes.order.size:
        nodes.order = chain[:, 0].copy()
        _check(nodes, chain[1:, 1].copy(), top)


@apart
def _part(nodes: Nodes) -> None:
    """Halve long intervals in which contacts change and the amplitude is not far from the top.

    A resonance moves with what the contacts do, and may pass between ends where it is seen from neither.
    """
    first, last = nodes.order[0], nodes.order[nodes.order.size - 1]
    span = abs(place_of(nodes, last) - place_of(nodes, first))
    for _ in range(_CHANGE_HALVINGS):
        top = highest(nodes)
        seen = look(nodes, top)
        middles, found = np.full((seen.reach.size, 1), NOWHERE), False
        for j in range(seen.reach.size - 1, -1, -1):
            changes = seen.measures[j, PIECE] != seen.measures[j + 1, PIECE]
            long = abs(seen.at[j + 1] - seen.at[j]) > _CHANGE_LENGTH * span
            if not (changes and long and seen.reach[j] >= _NOT_FAR * top):
                continue
            found = True
            middles[j, 0] = _middle(nodes, nodes.order[j], nodes.order[j + 1])
            if middles[j, 0] == NOWHERE:
                note(nodes, UNDONE, seen.at[j], NO_SOLUTION, 0.0)
        if not found:
            break
        nodes.order = with_inside(nodes.order, middles)


@compiled
def _middle(nodes: Nodes, a: int, b: int) -> int:
    """Return the row at the λ between two far apart, from the cubic through them or from each."""
    if way_of(nodes, a) * way_of(nodes, b) <= 0.0:
        return NOWHERE
    n = nodes.solutions.shape[1] - 1
    left, right, guesses = nodes.solutions[a], nodes.solutions[b], np.empty((3, n))
    length = right[n] - left[n]
    for i in range(n):
        bend = nodes.tangents[a, i] / nodes.tangents[a, n] - nodes.tangents[b, i] / nodes.tangents[b, n]
        guesses[0, i] = 0.5 * (left[i] + right[i]) + 0.125 * length * bend
        guesses[1, i], guesses[2, i] = left[i], right[i]
    p = 0.5 * (left[n] + right[n])
    return solved_at(nodes, p, guesses, math.copysign(1.0, length), True)


@compiled
def _stands(seen: Look, j: int) -> float:
    """Return the amplitude of an interval [m]."""
    return float(max(seen.measures[j, MAX_ABS], seen.measures[j + 1, MAX_ABS]))


@apart
def _hiding(nodes: Nodes, seen: Look, worth: float, departs: Flags) -> Flags:
    """Return where a contact may change and change back with a maximum between, (P − 1,)."""
    n, last = nodes.observed.shape[1], nodes.solutions.shape[1] - 1
    may = np.zeros(seen.reach.size, np.bool_)
    for j in range(may.size):
        if seen.measures[j, PIECE] != seen.measures[j + 1, PIECE] or _stands(seen, j) < worth:
            continue
        if not (departs[0, j] and departs[1, j]):
            continue
        length, a, b = abs(seen.at[j + 1] - seen.at[j]), nodes.order[j], nodes.order[j + 1]
        for c in range(last // n):
            size = max(_length_of(nodes.solutions[a], c, n), _length_of(nodes.solutions[b], c, n))
            for row in (a, b):
                slope = _length_of(nodes.tangents[row], c, n) * length
                if slope > _CHANGES_ALL * abs(nodes.tangents[row, last]) * size:
                    may[j] = True
    return may


@compiled
def _length_of(row: Real, c: int, n: int) -> float:
    """Return the length of the coefficients of port c."""
    total = 0.0
    for i in range(c * n, (c + 1) * n):
        total += row[i] * row[i]
    return math.sqrt(total)


@compiled
def _wanted(nodes: Nodes, seen: Look, worth: float, departs: Flags) -> Flags:
    """Return in which intervals a change may hide a maximum, (P − 1,)."""
    wanted = np.zeros(seen.reach.size, np.bool_)
    for j in range(wanted.size):
        changes = seen.measures[j, PIECE] != seen.measures[j + 1, PIECE] and _stands(seen, j) >= worth
        onward = way_of(nodes, nodes.order[j]) * way_of(nodes, nodes.order[j + 1]) > 0.0
        wanted[j] = changes and onward and (departs[0, j] or departs[1, j])
    return wanted


@apart
def _departs(seen: Look, allowed: float) -> Flags:
    """Return where a maximum may hide by what the points before, and behind, foretell, (2, P − 1).

    That is the parabola that goes on from the interval before, or from the one behind; where there is none
    it may.
    """
    count = seen.reach.size
    found = np.zeros((2, count), np.bool_)
    for j in range(count):
        stands = _stands(seen, j)
        for c in range(2):
            value = curve(c)[0]
            rise = seen.measures[j + 1, value] - seen.measures[j, value]
            begin, end = seen.slopes[j, 0, c], seen.slopes[j, 1, c]
            steep = min(abs(begin), abs(end)) if begin * end > 0.0 else 0.0
            if max(abs(rise), max(abs(begin), abs(end))) <= MATTERS * stands:
                continue
            for side in range(2):
                off, beside = math.inf, j - 1 if side == 0 else j + 1
                if 0 <= beside < count:
                    bend = _bend_beside(seen, beside, value, c, side) * _ratio(seen, j, beside)
                    missed = begin + 0.5 * bend - rise if side == 0 else rise - end + 0.5 * bend
                    off = max(abs(end - begin - bend), abs(missed))
                if off > allowed * stands and _STEEPER * off > steep:
                    found[side, j] = True
    return found


@compiled
def _bend_beside(seen: Look, j: int, value: int, c: int, side: int) -> float:
    """Return the second derivative of a cubic, by its own share, at its end (side 0) or its beginning."""
    rise = seen.measures[j + 1, value] - seen.measures[j, value]
    if side == 0:
        return float(-6.0 * rise + 2.0 * seen.slopes[j, 0, c] + 4.0 * seen.slopes[j, 1, c])
    return float(6.0 * rise - 4.0 * seen.slopes[j, 0, c] - 2.0 * seen.slopes[j, 1, c])


@compiled
def _ratio(seen: Look, j: int, beside: int) -> float:
    """Return the squared ratio of the lengths of two intervals."""
    length, other = abs(seen.at[j + 1] - seen.at[j]), abs(seen.at[beside + 1] - seen.at[beside])
    # The square of a ratio must not overflow.
    return float((max(length, 1e-100) / max(other, 1e-100)) ** 2)


@compiled
def _put(chain: Integer, length: int, row: int, kind: int) -> tuple[Integer, int]:
    """Put a row behind others, and what the interval that ends there is; return both longer."""
    if length == chain.shape[0]:
        chain = longer(chain, 2 * length)
    chain[length, 0], chain[length, 1] = row, kind
    return chain, length + 1


@compiled
def _push(todo: Integer, count: int, a: int, b: int, is_change: int, more: int) -> int:
    todo[count, 0], todo[count, 1], todo[count, 2], todo[count, 3] = a, b, is_change, more
    return count + 1


@apart
def _with_sides(nodes: Nodes, wanted: Flags) -> Integer:
    """Return rows of the branch with those on both sides of the changes in the intervals wanted (P − 1,).

    Beside each stands what the interval that ends there is beside a change.
    """
    chain, length = _put(np.empty((wanted.size + 64, 2), np.int64), 0, nodes.order[0], _APART)
    todo = np.empty((2 * _MOST_CHANGES, 4), np.int64)  # rows, whether the first is a change, how many more
    for j in range(wanted.size):
        count = _push(todo, 0, nodes.order[j], nodes.order[j + 1], 0, _MOST_CHANGES)
        while count > 0:
            count -= 1
            a, b, is_change, more = todo[count, 0], todo[count, 1], todo[count, 2], todo[count, 3]
            kind, one, other, middle = _APART, NOWHERE, NOWHERE, NOWHERE
            if nodes.measures[a, PIECE] == nodes.measures[b, PIECE]:
                kind = _BEHIND if is_change == 1 else _APART
            elif wanted[j]:
                before, behind = nodes.measures[a, MAX_ABS], nodes.measures[b, MAX_ABS]
                stands = max(before, behind)
                if more > 0:
                    one, other = _sides(nodes, a, b, MATTERS * stands)
                if (one == NOWHERE or other == NOWHERE) and abs(behind - before) > _FORETOLD * stands:
                    # Where the branch is so steep that no solution was found at a given λ, there is one along
                    # the arc.
                    if more > 0:
                        middle, _ = between_rows(nodes, a, b, 0.5)
                    if middle == NOWHERE:
                        note(nodes, UNDONE, place_of(nodes, a), NOT_CLOSED_IN, 0.0)
            if one != NOWHERE and other != NOWHERE:
                # Between both sides of a change nothing is left to be found.
                chain, length = _put(chain, length, one, _BETWEEN if is_change == 1 else _BEFORE)
                chain, length = _put(chain, length, other, _APART)
                count = _push(todo, count, other, b, 1, more - 1)
            elif middle != NOWHERE:
                count = _push(todo, count, middle, b, 0, more // 2)
                count = _push(todo, count, a, middle, is_change, more // 2)
            else:
                chain, length = _put(chain, length, b, kind)
    return chain[:length].copy()


@apart
def _sides(nodes: Nodes, a: int, b: int, allowed: float) -> tuple[int, int]:
    """Return the rows nearest to the first change of state between two, before and behind it.

    NOWHERE stands for one that was not found. `allowed` is the height of a maximum between both that does not
    matter [m].
    """
    n, ends, onward = nodes.solutions.shape[1], np.array([a, b]), math.copysign(1.0, way_of(nodes, a))
    found, ways, x = nodes.solutions[ends], nodes.tangents[ends], nodes.observed[ends]
    measures, states, sides = nodes.measures[ends], nodes.states[ends], np.zeros(2, np.int64)
    for side in range(2):
        _turn(ways[side], measures[side], 1.0 / ways[side, n - 1])
    nodes.counts[SPENT] += locate_change(
        nodes.system, nodes.linear, nodes.point, found, ways, x, measures, states, allowed, _MOST_SOLVES,
        MOST_ITERATIONS, sides,
    )  # fmt: skip
    for side in range(2):
        _turn(ways[side], measures[side], onward)
        ends[side] = NOWHERE
        if sides[side] == 1:
            ends[side] = add_row(nodes, found[side], ways[side], states[side], x[side], measures[side])
    return ends[0], ends[1]


@compiled
def _turn(way: Real, measures: Real, factor: float) -> None:
    """Multiply a tangent and the measures that are slopes along it."""
    for i in range(way.size):
        way[i] *= factor
    measures[SLOPE] *= factor
    measures[RANGE_SLOPE] *= factor
    measures[HIGH_SLOPE] *= factor
    measures[LOW_SLOPE] *= factor


@apart
def _check(nodes: Nodes, kinds: Integer, top: float) -> None:
    """Put rows in the middle of intervals beside changes, until cubics foretell these.

    Of the two neighbours of such an interval only the one that is not the change foretells anything. Where a
    point of the branch stands next to the change, the interval on its other side is the longer one, and as
    much beside the change.
    """
    seen, count = look(nodes, top), kinds.size
    departs = _departs(seen, _FORETOLD_BESIDE)
    wanted = np.zeros(count, np.bool_)
    for j in range(count):
        length = abs(seen.at[j + 1] - seen.at[j])
        before, behind = kinds[j] == _BEFORE, kinds[j] == _BEHIND
        if j + 1 < count and kinds[j + 1] == _BEFORE:
            before = before or length > abs(seen.at[j + 2] - seen.at[j + 1])
        if j > 0 and kinds[j - 1] == _BEHIND:
            behind = behind or length > abs(seen.at[j] - seen.at[j - 1])
        wanted[j] = kinds[j] == _BETWEEN or (before and departs[0, j]) or (behind and departs[1, j])
    for _ in range(_MOST_HALVINGS):
        if not wanted.any():
            break
        off = halve(nodes, wanted, False)
        seen = look(nodes, top)
        wanted = np.zeros(off.size, np.bool_)
        for j in range(off.size):
            steep = math.inf
            for c in range(2):
                begin, end = seen.slopes[j, 0, c], seen.slopes[j, 1, c]
                steep = min(steep, min(abs(begin), abs(end)) if begin * end > 0.0 else 0.0)
            wanted[j] = off[j] > BENT * _stands(seen, j) and _BESIDE * STEEP * off[j] > steep
