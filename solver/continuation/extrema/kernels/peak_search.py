"""Maxima and band edges between the points of a branch, and the points that it takes to be sure of them."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.locate import EDGE, HIGH_PEAK, LOW_PEAK, MAY_BE_LOW, refine
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS, PIECE, RESIDUAL
from solver.continuation.extrema.kernels.node_table import (
    IS_BENT,
    MOST_ITERATIONS,
    NOT_POLISHED,
    NOWHERE,
    PEAKS,
    SPENT,
    UNDONE,
    WAVES,
    Look,
    Nodes,
    add_row,
    aside,
    between_rows,
    curve,
    halve,
    highest,
    longer,
    look,
    note,
    place_of,
    scales_of,
    solved_at,
    way_of,
    ways_of,
    with_inside,
)
from solver.jit.decorators import compiled
from solver.jit.fourier import Flags, Integer, Real
from solver.jit.lapack import are_finite
from solver.jit.separate import apart

_SHARP_RESIDUAL = 2e-11  # of a peak; what is above was accepted because arcs allowed no better
_NEAR_BY = 1e-2
# A curve this far below the other one all over an interval is no max|x| there, nor is one that so many times
# what both change by keeps below it.
_HIDDEN, _FAR_BELOW = 0.8, 10.0
_OF_THE_ERROR = 4.0  # times the error estimated of a cubic that it may be wrong by
_COMPETES = 0.5  # share of the highest from which a maximum is polished to the last digits
_SHARP, _ENOUGH = 1e-10, 1e-5  # slope relative to that of the interval at which a maximum is found
NEAR_THE_TOP = 0.97  # share of the highest point from which the branch has to be dense
PREDICTED = 1e-4  # relative error of the cubics up to which it is
SURE = 0.03  # share of that up to which the error the neighbours suggest needs no solution to tell it
MOST_HALVINGS = 5
# Elsewhere: each makes the error of a cubic 16 times smaller, and a kink needs no more.
_COARSE_HALVINGS = 4
_MOST_WAVES = 4  # halvings of an interval in which a cubic has a maximum and a minimum
_MOST_DIPS = 24  # of one in which the amplitude may cross the limit there and back
_NARROW = 1e-13  # relative width at which a place is found
_MOST = 120  # points on the way to a root
_ASIDE = 1e-3  # share of the bracket that a trial keeps from its ends
_STATIONARY = 1e-11  # dλ/dshare of a fold, relative to that at the points it lies between
_SMOOTH = 1e-6  # above: it jumps, the fold is a corner where a contact changes its state


@apart
def find_peaks(nodes: Nodes, worth: float, highest_alone: bool) -> None:
    """Make a branch dense, and collect the maxima of max|x| and the ends the branch falls from.

    Parameters
    ----------
    worth : share of the highest point below which nothing is looked for.
    highest_alone : whether the highest peak is all that is wanted.
    """
    _densify(nodes, worth)
    top = highest(nodes)
    if nodes.order.size > 1:
        for _ in range(_MOST_WAVES):
            waving = look(nodes, top).flags & WAVES > 0
            if not waving.any():
                break
            halve(nodes, waving, False)
        _polish(nodes, worth * top, top, highest_alone)
    first, last = nodes.order[0], nodes.order[nodes.order.size - 1]
    if nodes.order.size == 1 or _slope(nodes, first) <= 0.0:
        note(nodes, PEAKS, first, 0.0, 0.0)
    if nodes.order.size > 1 and _slope(nodes, last) >= 0.0:
        note(nodes, PEAKS, last, 0.0, 0.0)


@compiled
def _slope(nodes: Nodes, row: int) -> float:
    """Return the slope of max|x| along the tangent at a row."""
    values = nodes.measures[row]
    return float(values[HIGH_SLOPE] if values[HIGH] >= values[LOW] else values[LOW_SLOPE])


@apart
def _densify(nodes: Nodes, worth: float) -> None:
    """Halve intervals until cubics predict what lies between: finely near the top, coarsely elsewhere."""
    if nodes.order.size < 2:
        return
    for _ in range(_COARSE_HALVINGS):
        top = highest(nodes)
        seen = look(nodes, top)
        bent = (seen.flags & IS_BENT > 0) & (seen.reach + _OF_THE_ERROR * seen.error >= worth * top)
        if not bent.any():
            break
        halve(nodes, bent, False)
    top = highest(nodes)
    seen = look(nodes, top)
    off = np.full(seen.reach.size, np.inf)
    for j in range(off.size):
        same = seen.measures[j, PIECE] == seen.measures[j + 1, PIECE]
        if same and seen.error[j] <= SURE * PREDICTED * top:
            off[j] = 0.0
    for _ in range(MOST_HALVINGS):
        wanted = (seen.reach >= NEAR_THE_TOP * top) & (off > PREDICTED * top)
        if not wanted.any():
            break
        off = halve(nodes, wanted, True)
        seen = look(nodes, top)


@apart
def _polish(nodes: Nodes, least: float, top: float, highest_alone: bool) -> None:
    """Collect the maxima of both curves where they are max|x|, and put them into the branch.

    `least` is the amplitude below which no maximum is polished [m]; where the highest alone is wanted it
    rises to what was found.
    """
    seen = look(nodes, top)
    count = seen.reach.size
    inside, places, more = np.full((count, 2), NOWHERE), np.empty(count, np.int64), 0
    for j in range(count):
        for c in range(2):
            if seen.slopes[j, 0, c] > 0.0 >= seen.slopes[j, 1, c]:
                places[more] = j
                more += 1
                break
    for i in range(more):
        best = i  # where the highest may stand is polished first
        for k in range(i + 1, more):
            ahead, behind = seen.reach[places[k]], seen.reach[places[best]]
            if ahead > behind or (ahead == behind and places[k] < places[best]):
                best = k
        j = places[best]
        places[best], places[i] = places[i], j
        least = _peaks_between(nodes, j, seen, least, top, highest_alone, inside[j])
    nodes.order = with_inside(nodes.order, inside)


@apart
def _peaks_between(
    nodes: Nodes, j: int, seen: Look, least: float, top: float, highest_alone: bool, inside: Integer
) -> float:
    """Collect the maxima of max|x| in interval j; return the amplitude from which others are polished then.

    `inside` (2,) gets the rows that come into it for them.
    """
    a, b = nodes.order[j], nodes.order[j + 1]
    found, count = np.full(2, NOWHERE), 0
    for c in range(2):
        begin, end = seen.slopes[j, 0, c], seen.slopes[j, 1, c]
        if not begin > 0.0 >= end:
            continue
        other = abs(seen.slopes[j, 0, 1 - c]) + abs(seen.slopes[j, 1, 1 - c])
        row, least = _peak_between(nodes, a, b, c, begin, end, other, least, top, highest_alone)
        value = HIGH if c == 0 else LOW
        if nodes.measures[row, value] >= nodes.measures[row, MAX_ABS] * (1.0 - 1e-12):
            found[count] = row
            count += 1
    if count == 2:
        way = way_of(nodes, a)
        if way * way_of(nodes, b) > 0.0 and place_of(nodes, found[1]) * way < place_of(nodes, found[0]) * way:
            found[0], found[1] = found[1], found[0]
        first, second = place_of(nodes, found[0]), place_of(nodes, found[1])
        if abs(first - second) <= 1e-7 * abs(first):
            # Both curves agree in a symmetric motion: one place.
            if nodes.measures[found[1], MAX_ABS] > nodes.measures[found[0], MAX_ABS]:
                found[0] = found[1]
            count = 1
    more = 0
    for i in range(count):
        row = _sharpened(nodes, found[i])
        note(nodes, PEAKS, row, 1.0, 0.0)
        if row not in (a, b):
            inside[more] = row
            more += 1
    return least


@apart
def _peak_between(
    nodes: Nodes, a: int, b: int, c: int, begin: float, end: float, other: float, least: float, top: float,
    highest_alone: bool,
) -> tuple[int, float]:  # fmt: skip
    """Return the maximum of max x (c = 0) or −min x between two rows; where it fails, the higher of them.

    `begin` and `end` are its slopes there, `other` the sum of the sizes of those of the other curve. The
    second value is the amplitude from which others are polished then.
    """
    value, what = (HIGH, HIGH_PEAK) if c == 0 else (LOW, LOW_PEAK)
    measures = nodes.measures
    higher = a if measures[a, value] > measures[b, value] else b
    rise, above = begin - end, min(measures[a, MAX_ABS], measures[b, MAX_ABS])
    height = measures[higher, value] + 0.25 * rise
    hidden = height < _HIDDEN * above or height + _FAR_BELOW * (rise + other) < above
    if hidden or height < least:
        return higher, least
    close = _SHARP if height >= _COMPETES * top else _ENOUGH
    row = _refined(nodes, a, b, what, 0.0, begin, end, close)
    if row == NOWHERE:
        note(nodes, UNDONE, place_of(nodes, higher), NOT_POLISHED, 0.0)
        return higher, least
    if nodes.measures[row, value] < nodes.measures[higher, value]:
        # The residual left may have lifted it.
        higher = _sharpened(nodes, higher)
    if nodes.measures[row, value] < nodes.measures[higher, value]:
        return higher, least
    if highest_alone:
        least = max(least, nodes.measures[row, value] - PREDICTED * top)
    return row, least


@apart
def _sharpened(nodes: Nodes, row: int) -> int:
    """Return a row that was accepted with a residual near what may be, solved again for its λ.

    With contacts far stiffer than the structure the residual left moves their forces, and with them the
    amplitude, by far more than its own size.
    """
    if nodes.measures[row, RESIDUAL] <= _SHARP_RESIDUAL or way_of(nodes, row) == 0.0:
        return row
    guess, onward = nodes.solutions[row : row + 1, :-1].copy(), math.copysign(1.0, way_of(nodes, row))
    again = solved_at(nodes, place_of(nodes, row), guess, onward, True)
    if again == NOWHERE or nodes.measures[again, RESIDUAL] >= nodes.measures[row, RESIDUAL]:
        return row
    # Another response at the same λ, beside a fold, is not what was meant.
    before = nodes.measures[row, MAX_ABS]
    return again if abs(nodes.measures[again, MAX_ABS] - before) <= _NEAR_BY * before else row


@apart
def _refined(
    nodes: Nodes, a: int, b: int, what: int, level: float, begin: float, end: float, close: float
) -> int:
    """Return the row of a peak or edge between two, NOWHERE if there is no solution on the way.

    Parameters
    ----------
    what, level : as in `solver.balance.kernels.locate.refine`.
    begin, end : the function whose root it is at both ends, of opposite signs.
    close : how near to the root, relative to the larger of them.
    """
    n, value = nodes.solutions.shape[1], LOW if what == LOW_PEAK else HIGH
    ways, found, way = ways_of(nodes, a, b), np.empty(n), np.empty(n)
    x, out = np.zeros(nodes.observed.shape[1]), np.zeros(nodes.measures.shape[1])
    good, iterations = refine(
        nodes.system, nodes.linear, nodes.point, nodes.solutions[a], ways[0], nodes.solutions[b], ways[1],
        what, level, begin, end, nodes.measures[a, value], nodes.measures[b, value], close, MOST_ITERATIONS,
        found, way, x, out,
    )  # fmt: skip
    nodes.counts[SPENT] += iterations
    if not good:
        return _bracketed(nodes, a, b, what, level, close)
    return add_row(nodes, found, way, nodes.point.states, x, out) if are_finite(out) else NOWHERE


@compiled
def _next_place(trial: int, low: float, high: float, g_low: float, g_high: float) -> float:
    """Return where the next trial of a bracketed secant goes, every third time the middle.

    Illinois: M. Dowell, P. Jarratt, BIT 11 (1971) 168, doi:10.1007/BF01934364; where the function jumps over
    0 the bracket closes on that place.
    """
    share = g_low / (g_low - g_high) if g_low != g_high and trial % 3 != 2 else 0.5
    return low + min(max(share, _ASIDE), 1.0 - _ASIDE) * (high - low)


@compiled
def _narrowed(
    here: float, g: float, low: float, high: float, g_low: float, g_high: float, side: int
) -> tuple[float, float, float, float, int]:
    """Return the bracket with a trial: both ends, the function there, and the side it came on."""
    if (g > 0.0) == (g_low > 0.0):
        return here, high, g, g_high * (0.5 if side < 0 else 1.0), -1
    return low, here, g_low * (0.5 if side > 0 else 1.0), g, 1


@compiled
def _off(nodes: Nodes, row: int, what: int, level: float) -> float:
    """Return the function whose root is looked for by values of λ."""
    if what == EDGE:
        return float(nodes.measures[row, MAX_ABS] - level)
    slope = nodes.measures[row, HIGH_SLOPE if what == HIGH_PEAK else LOW_SLOPE]
    return float(slope / abs(way_of(nodes, row)))


@apart
def _bracketed(nodes: Nodes, a: int, b: int, what: int, level: float, close: float) -> int:
    """Return the row of a peak or edge between two by solving at values of λ, else NOWHERE."""
    if way_of(nodes, a) * way_of(nodes, b) <= 0.0:
        return NOWHERE
    g_low, g_high, low, high, side = _off(nodes, a, what, level), _off(nodes, b, what, level), 0.0, 1.0, 0
    size, begin, length = max(abs(g_low), abs(g_high)), place_of(nodes, a), place_of(nodes, b)
    length -= begin
    value = HIGH if what == HIGH_PEAK else LOW if what == LOW_PEAK else MAX_ABS
    inside, places, count = np.empty(_MOST + 2, np.int64), np.empty(_MOST + 2), 2
    inside[0], inside[1], places[0], places[1] = a, b, 0.0, 1.0
    for trial in range(_MOST):
        width, here = high - low, _next_place(trial, low, high, g_low, g_high)
        if here in (low, high):
            break
        k = 0
        while places[k] < here:
            k += 1
        row = aside(nodes, inside[k - 1], inside[k], begin + here * length)
        if row == NOWHERE:
            break
        for i in range(count, k, -1):
            inside[i], places[i] = inside[i - 1], places[i - 1]
        inside[k], places[k] = row, here
        count += 1
        best, g = row, _off(nodes, row, what, level)
        if what != EDGE:
            best = inside[0]
            for i in range(1, count):
                best = inside[i] if nodes.measures[inside[i], value] > nodes.measures[best, value] else best
        if abs(g) <= close * size or abs(width * length) <= _NARROW * abs(place_of(nodes, row)):
            return best
        left_over = abs(g * width * length)
        if what != EDGE and close >= MAY_BE_LOW and left_over <= MAY_BE_LOW * nodes.measures[row, value]:
            return best
        low, high, g_low, g_high, side = _narrowed(here, g, low, high, g_low, g_high, side)
    return NOWHERE


@apart
def find_band(nodes: Nodes, limit: float) -> tuple[Real, Real, Integer, Flags, bool]:
    """Find where the amplitude exceeds `limit` [m] on a branch.

    Returns
    -------
    (·, 2) λ of both ends of every piece above it; (·, nt + 1) points at which the amplitude equals it, in
    their order; rows of the folds above it, and whether each is smooth; whether all this is sure.
    """
    order, folds, smooth = _with_folds(nodes, limit)
    order, sure = _with_dips(nodes, order, limit)
    n, count = nodes.solutions.shape[1], 0
    pieces, crossings, crossed = np.empty((order.size, 2)), np.empty((order.size, n)), 0
    for j in range(order.size - 1):
        a, b = order[j], order[j + 1]
        before, behind = nodes.measures[a, MAX_ABS] - limit, nodes.measures[b, MAX_ABS] - limit
        if before <= 0.0 and behind <= 0.0:
            continue
        pieces[count, 0], pieces[count, 1] = place_of(nodes, a), place_of(nodes, b)
        if (before > 0.0) != (behind > 0.0):
            row = _refined(nodes, a, b, EDGE, limit, before, behind, _SHARP)
            share, left = before / (before - behind), nodes.solutions[a]
            # Between two solutions the straight line stands in; its error is that of the branch.
            straight = left + share * (nodes.solutions[b] - left)
            crossings[crossed] = straight if row == NOWHERE else nodes.solutions[row]
            pieces[count, 1 if before > 0.0 else 0] = crossings[crossed, n - 1]
            crossed += 1
        count += 1
    return pieces[:count], crossings[:crossed], folds, smooth, sure


@apart
def _with_folds(nodes: Nodes, limit: float) -> tuple[Integer, Integer, Flags]:
    """Return the rows of the branch with the folds above the limit, and these (and whether smooth)."""
    inside, found = np.full((nodes.order.size - 1, 1), NOWHERE), 0
    folds, smooth = np.empty(nodes.order.size, np.int64), np.zeros(nodes.order.size, np.bool_)
    for j in range(inside.shape[0]):
        a, b = nodes.order[j], nodes.order[j + 1]
        high = max(nodes.measures[a, MAX_ABS], nodes.measures[b, MAX_ABS]) > limit
        if high and way_of(nodes, a) * way_of(nodes, b) < 0.0:
            inside[j, 0], is_smooth = fold_of(nodes, a, b)
            if inside[j, 0] != NOWHERE and nodes.measures[inside[j, 0], MAX_ABS] > limit:
                folds[found], smooth[found] = inside[j, 0], is_smooth
                found += 1
    return with_inside(nodes.order, inside), folds[:found], smooth[:found]


@apart
def fold_of(nodes: Nodes, a: int, b: int) -> tuple[int, bool]:
    """Return the row of the fold between two with dλ of opposite signs, and whether it is no corner.

    Around a fold λ goes there and back, so that the motion alone tells how far it is: dλ/dshare is of the
    share of its chord, and 0 where the motion is the same at both rows, which then are one but for rounding,
    with no fold between them.
    """
    n = nodes.solutions.shape[1] - 1
    length, left, right = 0.0, 0.0, 0.0
    for i in range(n):
        chord = nodes.solutions[b, i] - nodes.solutions[a, i]
        length += chord * chord
        left += chord * nodes.tangents[a, i]
        right += chord * nodes.tangents[b, i]
    g_low = way_of(nodes, a) * (length / left if left != 0.0 else 0.0)
    g_high = way_of(nodes, b) * (length / right if right != 0.0 else 0.0)
    size, low, high, side = max(abs(g_low), abs(g_high)), 0.0, 1.0, 0
    best, least = NOWHERE, math.inf
    if size == 0.0:
        return NOWHERE, True
    for trial in range(_MOST):
        width, here = high - low, _next_place(trial, low, high, g_low, g_high)
        if here in (low, high):
            break
        row, _ = between_rows(nodes, a, b, here)
        if row == NOWHERE:
            break
        g = way_of(nodes, row)
        if abs(g) <= least:
            best, least = row, abs(g)
        if abs(g) <= _STATIONARY * size or width <= _NARROW:
            break
        low, high, g_low, g_high, side = _narrowed(here, g, low, high, g_low, g_high, side)
    return best, best == NOWHERE or least <= _SMOOTH * size


@apart
def _with_dips(nodes: Nodes, order: Integer, limit: float) -> tuple[Integer, bool]:
    """Return rows with those where the amplitude may cross the limit and come back, and whether all is sure.

    Where it may and no solution is found there it is not.
    """
    sure, length = True, 1
    grown = np.empty((order.size + 64, 1), np.int64)
    grown[0, 0] = order[0]
    todo = np.empty((_MOST_DIPS + 4, 3), np.int64)  # left, right, how often that is still parted
    for j in range(order.size - 1):
        todo[0, 0], todo[0, 1], todo[0, 2], count = order[j], order[j + 1], _MOST_DIPS + 1, 1
        while count > 0:
            count -= 1
            a, b, depth, row = todo[count, 0], todo[count, 1], todo[count, 2], NOWHERE
            if depth > 0 and _may_dip(nodes, a, b, limit, depth == _MOST_DIPS + 1):
                if depth > 1:
                    row, _ = between_rows(nodes, a, b, 0.5)
                sure = sure and row != NOWHERE
            if row != NOWHERE:
                todo[count, 0], todo[count, 1], todo[count, 2] = row, b, depth - 1
                todo[count + 1, 0], todo[count + 1, 1], todo[count + 1, 2] = a, row, depth - 1
                count += 2
                continue
            if length == grown.shape[0]:
                grown = longer(grown, 2 * length)
            grown[length, 0] = b
            length += 1
    return grown[:length, 0].copy(), sure


@compiled
def _may_dip(nodes: Nodes, a: int, b: int, limit: float, first: bool) -> bool:
    """Return whether the amplitude may cross the limit and come back between two rows.

    It comes above between rows below where a curve rises at first and falls at last, and below between rows
    above where both curves do: the tangents at the ends bound a curve that is bent upward, such as the one of
    a motion that passes through zero. Between points of the branch itself (`first`) one has to fall at first.
    """
    left, right = nodes.measures[a], nodes.measures[b]
    above, length = left[MAX_ABS] > limit, place_of(nodes, b) - place_of(nodes, a)
    if above != (right[MAX_ABS] > limit) or abs(length) <= 1e-12 * abs(place_of(nodes, b)):
        return False
    by_left, by_right = scales_of(nodes, a, b)
    falls = not first
    for c in range(2):
        value, slope = curve(c)
        begin, end = left[slope] * by_left, right[slope] * by_right
        if not above and begin > 0.0 > end:
            if max(left[value], right[value]) + 0.25 * (begin - end) > limit:
                return True
        elif above:
            falls = falls or begin < 0.0 < end
            if min(left[value], right[value]) > limit:
                if begin >= 0.0 or end <= 0.0:
                    return False
                share = min(max((right[value] - end - left[value]) / (begin - end), 0.0), 1.0)
                if left[value] + begin * share > limit:
                    return False
    return above and falls
