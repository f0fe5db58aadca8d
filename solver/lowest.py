"""Where the highest of several tracked peaks is least: between rows by cubics, then by solving.

Between two places the height of every line is the cubic through its values and slopes there. The least
maximum of the cubics is the next place, the bracket shrinks to the side the highest line falls towards, and
the cubics become exact: it converges faster than linearly at a smooth minimum and at a crossing alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from solver.fourier import Real
from solver.kernels.track import DHEIGHT, HEIGHT, Z
from solver.ridges import Tracker

SUBDIVIDED = 6  # places between two rows at which the envelope is looked at
NEAR_THE_TOP = 0.95  # share of the envelope from which a line may be the highest within a bracket
SHARP = 1e-12  # of the range, where the search ends
_MOST = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Lowest:
    """The place of the least highest peak.

    Attributes
    ----------
    z : float
        Where.
    rows : mapping of line to row
        The lines near the top there, solved; the highest first.
    settled : bool
        Whether the search ended by its own criterion.
    """

    z: float
    rows: Mapping[int, Real]
    settled: bool

    @property
    def height(self) -> float:
        """The highest peak there [m]."""
        return float(max(row[HEIGHT] for row in self.rows.values()))


def places(tracker: Tracker) -> Real:
    """Return the places where the envelope is looked at: all rows of all lines, and between them."""
    ends = np.array([tracker.scale.low, tracker.scale.high])
    nodes = np.unique(np.concatenate([ends, *(line.rows[:, Z] for line in tracker.lines)]))
    share = np.arange(SUBDIVIDED) / SUBDIVIDED
    between = nodes[:-1, None] + share * np.diff(nodes)[:, None]
    return np.append(between.reshape(-1), nodes[-1])


def lowest(tracker: Tracker) -> Lowest | None:
    """Return where the highest line is least; None if the lines cannot be solved there."""
    z = places(tracker)
    heights = tracker.envelope(z)
    heights[~np.isfinite(heights)] = np.inf
    best = int(np.argmin(heights))
    low, high = float(z[max(best - 1, 0)]), float(z[min(best + 1, z.size - 1)])
    near = [
        index
        for index, line in enumerate(tracker.lines)
        if np.any(line.heights(z[[best]]) >= NEAR_THE_TOP * heights[best])
    ]
    return _search(tracker, near, float(z[best]), low, high)


def _search(tracker: Tracker, near: list[int], best: float, low: float, high: float) -> Lowest | None:
    """Close the bracket [low, high] on the least maximum of the lines `near`."""
    sides = [_solve(tracker, near, place) for place in (low, high)]
    if not sides[0] or not sides[1]:
        rows = _solve(tracker, near, best)
        return Lowest(z=best, rows=rows, settled=False) if rows else None
    left, right = sides
    before = np.inf
    for _ in range(_MOST):
        z = _least(left, right)
        if (
            abs(z - before) <= SHARP * tracker.scale.span
            or not left[next(iter(left))][Z] < z < right[next(iter(right))][Z]
        ):
            nearer = min((left, right), key=lambda side: abs(next(iter(side.values()))[Z] - z))
            return Lowest(z=float(next(iter(nearer.values()))[Z]), rows=nearer, settled=True)
        rows = _solve(tracker, near, z)
        if not rows:
            break
        if next(iter(rows.values()))[DHEIGHT] > 0.0:
            right = rows
        else:
            left = rows
        before = z
    nearer = min((left, right), key=lambda side: next(iter(side.values()))[HEIGHT])
    return Lowest(z=float(next(iter(nearer.values()))[Z]), rows=nearer, settled=False)


def _solve(tracker: Tracker, near: list[int], z: float) -> dict[int, Real]:
    """Return the solved rows at z of the lines that reach it, the highest first."""
    rows = {index: tracker.exact(tracker.lines[index], z) for index in near}
    found = [(index, row) for index, row in rows.items() if row is not None]
    return dict(sorted(found, key=lambda item: -float(item[1][HEIGHT])))


def _least(left: Mapping[int, Real], right: Mapping[int, Real]) -> float:
    """Return where the highest of the cubics between two sets of rows is least."""
    cubics = [(left[index], right[index]) for index in left if index in right]
    low, high = float(next(iter(left.values()))[Z]), float(next(iter(right.values()))[Z])
    if not cubics:
        return 0.5 * (low + high)
    length = high - low
    begin, end = 0.0, 1.0
    for _ in range(60):
        t = 0.5 * (begin + end)
        if _top_slope(cubics, t, length) > 0.0:
            end = t
        else:
            begin = t
    if end < 1e-15:
        return low
    if begin > 1.0 - 1e-15:
        return high
    return low + 0.5 * (begin + end) * length


def _top_slope(cubics: list[tuple[Real, Real]], t: float, length: float) -> float:
    """Return the slope of the highest cubic at the share t."""
    top, slope, r = -np.inf, 0.0, 1.0 - t
    for a, b in cubics:
        value = (1.0 + 2.0 * t) * r * r * a[HEIGHT] + t * t * (3.0 - 2.0 * t) * b[HEIGHT]
        value += t * r * length * (r * a[DHEIGHT] - t * b[DHEIGHT])
        if value > top:
            top = value
            slope = 6.0 * t * r * (b[HEIGHT] - a[HEIGHT])
            slope += length * (r * (1.0 - 3.0 * t) * a[DHEIGHT] + t * (3.0 * t - 2.0) * b[DHEIGHT])
    return float(slope)
