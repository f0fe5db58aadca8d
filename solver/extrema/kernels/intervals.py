"""What may stand between neighbouring points of a branch, by the cubics of max x and −min x through them."""

from __future__ import annotations

import math

from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE
from solver.jit.decorators import compiled
from solver.jit.fourier import Integer, Real
from solver.jit.separate import apart

# Every maximum above this share of the highest is polished.
WORTH_POLISHING = 5e-3
BENT = 5e-4  # relative error of the cubics from which an interval is halved wherever it is
STEEP = 8.0  # slope by the share, relative to that error, above which a cubic hides no extremum
# Bits of the flags: the cubics are too far from the curves; a maximum and a minimum may both stand there.
IS_BENT, WAVES = 1, 2


@compiled
def _share_scales(before: Real, after: Real, way: Real, onward: Real, least: float) -> tuple[float, float]:
    """Return the factors that turn both tangents into derivatives by the share of the chord.

    Around a fold λ goes there and back, so that the motion alone tells how far it is.
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
    # Where the arc bends so sharply that a tangent leads against the chord, λ tells how far it is.
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


@apart
def look_between(
    solutions: Real, tangents: Real, measures: Real, least: float, top: float, slopes: Real, reach: Real,
    flags: Integer,
) -> None:  # fmt: skip
    """Look at all intervals between neighbouring points.

    Neighbouring cubics share value and slope at a point, and their second derivatives differ there by
    D ≈ (ℓ² + ℓ'²) x⁗ / 12 where x is smooth, by its own jump at a change of contact state: in both cases the
    cubic is wrong by about D ℓ² / 64 in the middle (Hermite's error x⁗ ℓ⁴ / 384).

    Parameters
    ----------
    solutions, tangents : (P, nt + 1) λ last; measures : (P, MEASURES) with slopes along the tangents.
    least : size of a motion below which it is rounding [m].
    top : the highest amplitude [m].
    slopes : (P − 1, 2, 2) interval, end, max x or −min x: by the share of the interval; filled.
    reach : (P − 1,) how high max|x| may be there by its slopes [m]; filled.
    flags : (P − 1,) bits of `IS_BENT` and `WAVES`; filled.
    """
    count, nt = solutions.shape[0] - 1, solutions.shape[1] - 1
    far = 1e-9 * abs(solutions[count, nt])
    for j in range(count):
        scales = _share_scales(solutions[j], solutions[j + 1], tangents[j], tangents[j + 1], least)
        reach[j], flags[j] = 0.0, 0
        for c in range(2):
            value, slope = (HIGH, HIGH_SLOPE) if c == 0 else (LOW, LOW_SLOPE)
            a, b = measures[j, value], measures[j + 1, value]
            da, db = measures[j, slope] * scales[0], measures[j + 1, slope] * scales[1]
            slopes[j, 0, c], slopes[j, 1, c] = da, db
            reach[j] = max(reach[j], max(a, b) + 0.25 * (max(da, 0.0) + max(-db, 0.0)))
            if max(a, b) >= WORTH_POLISHING * top and _waves(a, da, b, db):
                flags[j] |= WAVES
    for c in range(2):
        value = HIGH if c == 0 else LOW
        for j in range(count):
            stands = max(measures[j, HIGH], measures[j, LOW], measures[j + 1, HIGH], measures[j + 1, LOW])
            length = abs(solutions[j + 1, nt] - solutions[j, nt])
            if stands < WORTH_POLISHING * top or length <= far:
                continue
            jump = 0.0
            if j > 0:
                jump = max(jump, _jump(solutions, measures, slopes, j, c, value))
            if j + 1 < count:
                jump = max(jump, _jump(solutions, measures, slopes, j + 1, c, value))
            error = jump * length * length / 64.0
            a, b = measures[j, value], measures[j + 1, value]
            da, db = slopes[j, 0, c], slopes[j, 1, c]
            # A curve that is steeper than its error can bend hides no extremum.
            if error > BENT * stands and _least_slope(a, da, b, db) < STEEP * error:
                flags[j] |= IS_BENT


@compiled
def _jump(solutions: Real, measures: Real, slopes: Real, j: int, c: int, value: int) -> float:
    """Return by how much the second derivatives by λ of the cubics left and right of point j differ."""
    nt = solutions.shape[1] - 1
    left, right = solutions[j, nt] - solutions[j - 1, nt], solutions[j + 1, nt] - solutions[j, nt]
    here = measures[j, value]
    before = 6.0 * (measures[j - 1, value] - here) + 2.0 * slopes[j - 1, 0, c] + 4.0 * slopes[j - 1, 1, c]
    after = 6.0 * (measures[j + 1, value] - here) - 4.0 * slopes[j, 0, c] - 2.0 * slopes[j, 1, c]
    return abs(after / max(right * right, 1e-300) - before / max(left * left, 1e-300))
