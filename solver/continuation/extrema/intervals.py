"""What may stand between two nodes of a branch, by the cubics and slopes there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from solver.balance.kernels.locate import HIGH_PEAK, LOW_PEAK
from solver.balance.kernels.output import HIGH, HIGH_SLOPE, LOW, LOW_SLOPE, MAX_ABS
from solver.continuation.extrema.node_table import PointRow
from solver.continuation.extrema.nodes import Between

CURVES = ((HIGH, HIGH_SLOPE, HIGH_PEAK), (LOW, LOW_SLOPE, LOW_PEAK))


def may_cross(nodes: Sequence[PointRow], between: Between, limit: float) -> NDArray[np.bool_]:
    """Return where max|x| might cross the limit and come back between nodes, (P − 1,)."""
    above = np.array([node.measures[MAX_ABS] for node in nodes]) > limit
    slopes = between.slopes
    # Between ends above the limit it has to fall at first and to rise at last; else the reverse.
    falls = np.any((slopes[:, 0] < 0.0) & (slopes[:, 1] > 0.0), axis=1)
    rises = between.reach > limit
    return np.asarray((above[:-1] & above[1:] & falls) | (~above[:-1] & ~above[1:] & rises))


def highest_share(
    left: PointRow, right: PointRow, by_share: tuple[float, float], limit: float
) -> float | None:
    """Return the share where max|x| may be above the limit between two nodes below it, or None."""
    for value, slope, _ in CURVES:
        a, b = left.measures[value], right.measures[value]
        rise, fall = left.measures[slope] * by_share[0], right.measures[slope] * by_share[1]
        if rise > 0.0 > fall and max(a, b) + 0.25 * (rise - fall) > limit:
            return _extreme(a, rise, b, fall)
    return None


def lowest_share(
    left: PointRow, right: PointRow, by_share: tuple[float, float], limit: float
) -> float | None:
    """Return the share where max|x| may be below the limit between two nodes above it, or None.

    It is below only where both curves are; the tangents at the ends bound a curve that is bent upward, such
    as the one of a motion that passes through zero.
    """
    places = []
    for value, slope, _ in CURVES:
        a, b = left.measures[value], right.measures[value]
        fall, rise = left.measures[slope] * by_share[0], right.measures[slope] * by_share[1]
        if a <= limit or b <= limit:
            # This curve is below somewhere anyway; the other one decides.
            continue
        if fall >= 0.0 or rise <= 0.0:
            return None
        share = min(max((b - rise - a) / (fall - rise), 0.0), 1.0)
        if a + fall * share > limit:
            return None
        places.append(share)
    if not places:
        # One curve is above at each end: between they change places.
        return 0.5
    return min(max(sum(places) / len(places), 0.05), 0.95)


def _extreme(a: float, da: float, b: float, db: float) -> float:
    """Return where the cubic of these values and slopes at two ends is extreme, kept off the ends."""
    chord = b - a
    c1, c2 = 3.0 * chord - 2.0 * da - db, da + db - 2.0 * chord
    root = math.sqrt(max(c1 * c1 - 3.0 * c2 * da, 0.0))
    # The stable form of the root between the ends.
    below = -c1 - math.copysign(root, c1)
    places = [da / below if below != 0.0 else 0.5, below / (3.0 * c2) if c2 != 0.0 else 0.5]
    inside = [t for t in places if 0.0 < t < 1.0]
    return min(max(inside[0] if inside else da / (da - db), 0.05), 0.95)
