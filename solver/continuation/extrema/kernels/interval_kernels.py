"""What may stand between neighbouring points of a branch, by the cubics of max x and −min x through them."""

from __future__ import annotations

import math

import numpy as np

from solver.balance.kernels.locate import between
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, PIECE
from solver.contacts.kernels.system import Evaluation, Receptance, System
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.separate import apart

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
def _known_scales(
    solutions: Real, tangents: Real, partners: Integer, scales: Real, one: int, other: int, least: float
) -> tuple[float, float]:
    """Return `share_scales` from row `one` of a table to row `other`, worked out once for neighbours."""
    if partners[one] != other:
        partners[one] = other
        scales[one, 0], scales[one, 1] = share_scales(
            solutions[one], solutions[other], tangents[one], tangents[other], least
        )
    return scales[one, 0], scales[one, 1]


@apart
def middles_between(
    system: System, linear: Receptance, point: Evaluation, solutions: Real, tangents: Real, measures: Real,
    partners: Integer, kept: Real, pairs: Integer, share: float, most: int, found: Real, ways: Real, x: Real,
    out: Real, states: Integer, off: Real,
) -> int:  # fmt: skip
    """Solve at a share of the way, as `between`, of every pair of points.

    Parameters
    ----------
    solutions, tangents, measures, partners, kept : a table of points, as in `look_between`.
    pairs : (P, 2) rows of it.
    found, ways, x, out, states : (P, …) what is found between each pair; filled.
    off : (P,) by how much the cubics of max x and −min x miss the values found [m], NaN where no solution
        was found; filled.

    Returns
    -------
    Newton iterations.
    """
    n, total = solutions.shape[1], 0
    left_slope, right_slope = np.empty(n), np.empty(n)
    t, r = share, 1.0 - share
    for i in range(off.size):
        a, b = pairs[i, 0], pairs[i, 1]
        left, right, way, onward = solutions[a], solutions[b], tangents[a], tangents[b]
        scales = _known_scales(solutions, tangents, partners, kept, a, b, system.least_size)
        for k in range(n):
            left_slope[k], right_slope[k] = scales[0] * way[k], scales[1] * onward[k]
        good, iterations = between(
            system, linear, point, left, left_slope, right, right_slope, share, most, found[i], ways[i], x[i],
            out[i],
        )  # fmt: skip
        total += iterations
        # Around a fold nothing holds λ to its place but the motion: a solution far from both ends is another.
        span = abs(right[n - 1] - left[n - 1])
        away = abs(found[i, n - 1] - left[n - 1] - share * (right[n - 1] - left[n - 1]))
        off[i] = np.nan
        if not good or away > span + 0.5 * (abs(left_slope[n - 1]) + abs(right_slope[n - 1])):
            continue
        off[i] = 0.0
        for c in range(2):
            value, slope = (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)
            cubic = (
                (1.0 + 2.0 * t) * r * r * measures[a, value]
                + t * r * r * scales[0] * measures[a, slope]
                + t * t * (3.0 - 2.0 * t) * measures[b, value]
                - t * t * r * scales[1] * measures[b, slope]
            )
            off[i] = max(off[i], abs(cubic - out[i, value]))
        for e in range(states.shape[1]):
            states[i, e] = point.states[e]
    return total


@apart
def look_between(
    solutions: Real, tangents: Real, partners: Integer, kept: Real, rows: Integer, at: Real, measures: Real,
    least: float, top: float, slopes: Real, reach: Real, error: Real, flags: Integer,
) -> None:  # fmt: skip
    """Look at all intervals between neighbouring points.

    Neighbouring cubics share value and slope at a point, and their second derivatives differ there by
    D ≈ (ℓ² + ℓ'²) x⁗ / 12 where x is smooth, by its own jump where a contact changes the piece of its law: in
    both cases the cubic is wrong by about D ℓ² / 64 in the middle (Hermite's error x⁗ ℓ⁴ / 384). Where both
    sides of such a change are solved, D tells of the change alone and counts on neither side of it.

    Parameters
    ----------
    solutions, tangents : (R, nt + 1) a table of points, λ last.
    partners, kept : (R,) and (R, 2) the row that `share_scales` are known to from each, and these; filled.
    rows : (P,) the points of the branch in the table, in its order.
    at, measures : (P,) λ and (P, MEASURES) of these, with slopes along the tangents.
    least : size of a motion below which it is rounding [m].
    top : the highest amplitude [m].
    slopes : (P − 1, 2, 2) interval, end, max x or −min x: by the share of the interval; filled.
    reach : (P − 1,) how high max|x| may be there by its slopes [m]; filled.
    error : (P − 1,) by how much the cubics are estimated to be wrong [m], 0 where that was not looked at;
        filled.
    flags : (P − 1,) bits of `IS_BENT` and `WAVES`; filled.
    """
    count = rows.size - 1
    for j in range(count):
        scales = _known_scales(solutions, tangents, partners, kept, rows[j], rows[j + 1], least)
        reach[j], flags[j] = 0.0, 0
        for c in range(2):
            value, slope = (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)
            a, b = measures[j, value], measures[j + 1, value]
            da, db = measures[j, slope] * scales[0], measures[j + 1, slope] * scales[1]
            slopes[j, 0, c], slopes[j, 1, c] = da, db
            reach[j] = max(reach[j], max(a, b) + 0.25 * (max(da, 0.0) + max(-db, 0.0)))
            most = max(abs(da), abs(db), abs(b - a))
            if (
                max(a, b) >= WORTH_POLISHING * top
                and most > 5.0 * MATTERS * max(a, b)
                and _waves(a, da, b, db)
            ):
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
        error[j] = 0.0
        if stands < WORTH_POLISHING * top or length[j] <= far or narrow[j]:
            continue
        before, after = j > 0 and not narrow[j - 1], j + 1 < count and not narrow[j + 1]
        for c in range(2):
            value = HIGH if c == 0 else LOW
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


@compiled
def _jump(at: Real, measures: Real, slopes: Real, j: int, c: int, value: int) -> float:
    """Return by how much the second derivatives by λ of the cubics left and right of point j differ."""
    left, right = at[j] - at[j - 1], at[j + 1] - at[j]
    here = measures[j, value]
    before = 6.0 * (measures[j - 1, value] - here) + 2.0 * slopes[j - 1, 0, c] + 4.0 * slopes[j - 1, 1, c]
    after = 6.0 * (measures[j + 1, value] - here) - 4.0 * slopes[j, 0, c] - 2.0 * slopes[j, 1, c]
    return abs(after / max(right * right, 1e-300) - before / max(left * left, 1e-300))
