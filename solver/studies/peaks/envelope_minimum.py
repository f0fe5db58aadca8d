"""Where the highest of several tracked peaks is least: between rows by cubics, then by solving.

Between two places the height of every line is the cubic through its values and slopes there. The least
maximum of the cubics is the next place, the bracket shrinks to the side the highest line falls towards, and
the cubics become exact: it converges faster than linearly at a smooth minimum and at a crossing alike.

The highest line may have several minima. Those whose cubics are nearly as low as the lowest are solved too,
so that the cubics do not decide between them.

A further basin is a local minimum of the highest peak that is not the least. A line that no sweep has met may
make one. So wherever the lines known are nearly as low as a proven optimum and no sweep was made, a walk over
the band with half the harmonics is made, and what it shows that is on no line yet is solved for with all of
them and followed. That costs half a response a place, and proves nothing: what is not looked at is not seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.continuation.bracketing import closing_in
from solver.continuation.extrema.kernels.peak_continuation import DHEIGHT, HEIGHT, Z
from solver.jit.fourier import Real
from solver.studies.peaks.survey import HaltedError

if TYPE_CHECKING:
    from solver.studies.peaks.tracker import Tracker

NEAR_THE_TOP = 0.95  # share of the envelope from which a line may be the highest within a bracket
SHARP = 1e-12  # of the range, where the search ends
DOUBT = 0.01  # relative error that is allowed for where cubics tell which minimum is lower
EVEN = 1e-9  # relative change over the range up to which a peak does not depend on the parameter
RISE = 1e-4  # relative height of what has to lie between two minima that are told apart
LEVEL = 1e-8  # relative change of the peak over the range that is none
ROUNDED = 1e-11  # relative difference of heights of which a good part may be rounding
_MOST = 60
NEAR = 1.05  # times the best peak: how high further basins may be that are looked for
APART = 0.08  # share of the range: no look is made between places closer than that
MOST_GLANCES = 3
HIGH = 0.97  # share of the highest line there from which a peak of a glance is followed
SAME = 1e-6  # share of the range within which two minima are one
ROUNDING = 1e-7  # relative distance within which heights are equal


@dataclass(frozen=True, slots=True, kw_only=True)
class Lowest:
    """The place of a least highest peak."""

    z: Annotated[float, "Where."]
    rows: Annotated[
        Mapping[int, Real],
        "The lines near the top there, solved, the highest first; empty if they are not solved.",
    ]
    height: Annotated[float, "The highest line there [m]."]
    bracketed: Annotated[bool, "It falls towards there from both sides, as far as there is a range."]

    @property
    def solved(self) -> bool:
        """Whether the lines are solved there, rather than read from their cubics."""
        return bool(self.rows)


def flat(tracker: Tracker) -> bool:
    """Return whether the highest line is everywhere, and does not depend on the parameter."""
    heights = tracker.envelope(tracker.places())
    return bool(np.isfinite(heights).all() and np.ptp(heights) <= EVEN * heights.max())


def minima(tracker: Tracker, doubt: float = DOUBT, most: int | None = None) -> list[Lowest]:
    """Return the minima of the highest line over the range, lowest first; the low ones are solved.

    Empty where no line is. Minima with no rise between them count as one; of a peak that does not depend on
    the parameter the place of the first sweep is returned.

    Parameters
    ----------
    doubt : relative height above the lowest up to which a minimum is solved for.
    most : how many are solved for at most; all of those if left out.
    """
    if not tracker.lines:
        return []
    if flat(tracker):
        rows = rows_at(tracker, tracker.looks[0].z)
        if rows:
            top = next(iter(rows.values()))
            height = float(top[HEIGHT])
            return [Lowest(z=tracker.looks[0].z, rows=rows, height=height, bracketed=True)]
    z = tracker.places()
    heights = tracker.envelope(z)
    heights[~np.isfinite(heights)] = np.inf
    before, after = np.append(np.inf, heights[:-1]), np.append(heights[1:], np.inf)
    at = np.flatnonzero((heights < before) & (heights <= after))
    kept: list[int] = []
    for index in at[np.argsort(heights[at], kind="stable")]:
        if all(_apart(heights, int(index), other) for other in kept):
            kept.append(int(index))
    # A line that only shows that it is high enough has no minima of a peak.
    kept = kept[:1] + [index for index in kept[1:] if heights[index] < tracker.enough]
    if not kept:
        return []
    limit, found, rest = heights[kept[0]] * (1.0 + doubt), [], []
    for rank, index in enumerate(kept):
        if heights[index] <= limit and (most is None or rank < most):
            found.append(_solved(tracker, z, heights, index))
        elif not found or heights[index] < min(one.height for one in found):
            # What was lower by the cubics is higher: this may be the lowest.
            found.append(_solved(tracker, z, heights, index))
        else:
            rest.append(Lowest(z=float(z[index]), rows={}, height=float(heights[index]), bracketed=False))
    return sorted(found + rest, key=lambda one: one.height)


def _apart(heights: Real, one: int, other: int) -> bool:
    """Return whether the highest line rises between two places, above both."""
    low, high = min(one, other), max(one, other)
    return bool(heights[low : high + 1].max() > max(heights[one], heights[other]) * (1.0 + RISE))


def _solved(tracker: Tracker, z: Real, heights: Real, index: int) -> Lowest:
    """Return a minimum of the highest line near a place, solved if that succeeds."""
    low, high = float(z[max(index - 1, 0)]), float(z[min(index + 1, z.size - 1)])
    near = [
        number
        for number, line in enumerate(tracker.lines)
        if np.any(line.heights(z[[index]]) >= NEAR_THE_TOP * heights[index])
    ]
    unsolved = Lowest(z=float(z[index]), rows={}, height=float(heights[index]), bracketed=False)
    rows, bracketed = _search(tracker, near, float(z[index]), low, high)
    if not rows:
        return unsolved
    top = next(iter(rows.values()))
    if top[HEIGHT] < tracker.envelope(top[[Z]])[0] * (1.0 - RISE):
        # A line that is higher ends there: what is low lies beyond its end.
        rows = _solve(tracker, near, float(z[index]))
        if not rows:
            return unsolved
        top, bracketed = next(iter(rows.values())), False
    return Lowest(z=float(top[Z]), rows=rows, height=float(top[HEIGHT]), bracketed=bracketed)


def _search(
    tracker: Tracker, near: list[int], best: float, low: float, high: float
) -> tuple[dict[int, Real], bool]:
    """Close the bracket [low, high] on the least maximum of the lines `near`.

    Returns
    -------
    The rows there, and whether the highest line falls towards it from both sides.
    """
    left, right = (_solve(tracker, near, place) for place in (low, high))
    if not left or not right:
        return _solve(tracker, near, best), False
    left, right = _widened(tracker, near, left, right)
    before = math.inf
    for turn in range(_MOST):
        z = _least(left, right) if turn % 4 < 3 else 0.5 * (_place(left) + _place(right))
        if abs(z - before) <= SHARP * tracker.scale.span or not _place(left) < z < _place(right):
            nearer = min((left, right), key=lambda side: abs(_place(side) - z))
            return nearer, _falls(tracker, left, 1.0) and _falls(tracker, right, -1.0)
        rows = _solve(tracker, near, z)
        if not rows:
            break
        if next(iter(rows.values()))[DHEIGHT] > 0.0:
            right = rows
        else:
            left = rows
        before = z
    return min((left, right), key=lambda side: next(iter(side.values()))[HEIGHT]), False


def _falls(tracker: Tracker, rows: dict[int, Real], way: float) -> bool:
    """Return whether the highest line falls (or is level) one way (1: upward), or the range ends."""
    end = tracker.scale.low if way > 0.0 else tracker.scale.high
    top = next(iter(rows.values()))
    return bool(top[Z] == end or way * top[DHEIGHT] * tracker.scale.span <= LEVEL * top[HEIGHT])


def _widened(
    tracker: Tracker, near: list[int], left: dict[int, Real], right: dict[int, Real]
) -> tuple[dict[int, Real], dict[int, Real]]:
    """Move a bracket downhill until both ends rise outward, or the lines end."""
    for _ in range(_MOST):
        width = _place(right) - _place(left)
        if next(iter(right.values()))[DHEIGHT] < 0.0:
            beyond = min(_place(right) + 2.0 * width, max(tracker.lines[index].high for index in right))
            rows = _solve(tracker, near, beyond) if beyond > _place(right) else {}
            if not rows:
                break
            left, right = right, rows
        elif next(iter(left.values()))[DHEIGHT] > 0.0:
            beyond = max(_place(left) - 2.0 * width, min(tracker.lines[index].low for index in left))
            rows = _solve(tracker, near, beyond) if beyond < _place(left) else {}
            if not rows:
                break
            left, right = rows, left
        else:
            break
    return left, right


def _place(rows: Mapping[int, Real]) -> float:
    """Return where rows are."""
    return float(next(iter(rows.values()))[Z])


def _solve(tracker: Tracker, near: list[int], z: float) -> dict[int, Real]:
    """Return the solved rows at z of the lines that reach it, the highest first."""
    lines = {index: tracker.lines[index] for index in near if not tracker.lines[index].held}
    rows = {index: tracker.exact(line, z, fitting=False) for index, line in lines.items()}
    found = [(index, row) for index, row in rows.items() if row is not None]
    return dict(sorted(found, key=lambda item: -float(item[1][HEIGHT])))


def rows_at(tracker: Tracker, z: float) -> dict[int, Real]:
    """Return the solved rows at z of all lines that reach it, the highest first."""
    return _solve(tracker, list(range(len(tracker.lines))), z)


def _least(left: Mapping[int, Real], right: Mapping[int, Real]) -> float:
    """Return where the highest of the cubics between two sets of rows is least."""
    both = [(left[index], right[index]) for index in left if index in right]
    low, high = _place(left), _place(right)
    if not both:
        return 0.5 * (low + high)
    length = high - low
    cubics = [_cubic(a, b, length) for a, b in both]
    ends = _top_slope(0.0, cubics), _top_slope(1.0, cubics)
    if ends[0] >= 0.0 or ends[1] <= 0.0:
        return low if ends[0] >= 0.0 else high
    least = 0.5
    # The slope jumps where lines cross: that is found as well as a root.
    for t, slope, _ in closing_in(float, lambda t: _top_slope(t, cubics), *ends):
        least = t
        if slope == 0.0:
            break
    return low + least * length


def _cubic(a: Real, b: Real, length: float) -> tuple[float, float, float, float]:
    """Return heights and slopes, by the share of the length, of a line's rows at both ends.

    Where the heights differ by little but rounding, the slopes say better by how much.
    """
    da, db = length * float(a[DHEIGHT]), length * float(b[DHEIGHT])
    height, other = float(a[HEIGHT]), float(b[HEIGHT])
    if abs(other - height) <= ROUNDED * abs(height):
        other = height + 0.5 * (da + db)
    return height, da, other, db


def _top_slope(t: float, cubics: list[tuple[float, float, float, float]]) -> float:
    """Return the slope of the highest cubic at the share t; heights and slopes by the share at both ends."""
    top, slope, r = -math.inf, 0.0, 1.0 - t
    for a, da, b, db in cubics:
        value = (1.0 + 2.0 * t) * r * r * a + t * t * (3.0 - 2.0 * t) * b + t * r * (r * da - t * db)
        if value > top:
            top = value
            slope = 6.0 * t * r * (b - a) + r * (1.0 - 3.0 * t) * da + t * (3.0 * t - 2.0) * db
    return slope


def with_further(tracker: Tracker, found: list[Lowest], count: int) -> tuple[list[Lowest], bool]:
    """Look for further basins beside a proven optimum.

    Parameters
    ----------
    found : minima, the proven optimum first.
    count : how many minima are solved for.

    Returns
    -------
    The minima, the optimum first, and whether the proof stands: what was met may be higher than the sweep at
    the optimum, or a minimum lower than the lines seemed to be.
    """
    best, before = found[0], len(tracker.lines)
    if flat(tracker):
        return found, True
    try:
        kept = _met(tracker, best, count)
        new = [line for line in tracker.lines[before:] if line.low <= best.z <= line.high]
        here = [tracker.exact(line, best.z, fitting=False) for line in new]
    except HaltedError as halt:
        tracker.allowance.end(halt.status)
        # Nothing is solved for any more: the cubics have to do.
        heights = [line.heights(np.array([best.z]))[0] for line in tracker.lines[before:]]
        return found, all(height <= best.height * (1.0 + ROUNDING) for height in heights)
    higher = any(row is not None and row[HEIGHT] > best.height * (1.0 + ROUNDING) for row in here)
    return kept, not higher and all(one.height >= best.height * (1.0 - ROUNDING) for one in kept)


def _met(tracker: Tracker, best: Lowest, count: int) -> list[Lowest]:
    """Look wherever there is reason to, and return the optimum and the other minima."""
    tracker.follow_up_to(NEAR)
    while _look_further(tracker, best.height * NEAR):
        continue
    kept = _listed(tracker, best, count)
    while _look_at(tracker, kept[1:], count):
        kept = _listed(tracker, best, count)
    return kept


def _look_further(tracker: Tracker, height: float) -> bool:
    """Glance at the middle of every stretch that is lower than `height` and was not looked at.

    Returns
    -------
    Whether there is a new line.
    """
    before = len(tracker.lines)
    for low, high in _stretches(tracker, height):
        if len(tracker.glances) >= MOST_GLANCES:
            break
        tracker.ask()
        _follow_new(tracker, 0.5 * (low + high), height)
    return len(tracker.lines) > before


def _look_at(tracker: Tracker, found: list[Lowest], count: int) -> bool:
    """Glance at minima that no look is near; return whether there is a new line."""
    before = len(tracker.lines)
    for one in found:
        if not one.solved or np.abs(_taken(tracker) - one.z).min() <= 0.5 * APART * tracker.scale.span:
            continue
        if len(tracker.glances) >= MOST_GLANCES + count - 1:
            break
        tracker.ask()
        _follow_new(tracker, one.z, one.height * NEAR)
    return len(tracker.lines) > before


def _follow_new(tracker: Tracker, z: float, height: float) -> None:
    """Glance at z and follow what is on no line, over the run around z that is lower than `height`."""
    glance = tracker.glance(z)
    runs = [run for run in _runs(tracker, height) if run[0] <= z <= run[1]]
    for guess in glance.crests:
        if guess.value >= HIGH * glance.crests[0].value:
            tracker.follow_guess(glance, guess, runs[0] if runs else (z, z), HIGH)


def _listed(tracker: Tracker, best: Lowest, count: int) -> list[Lowest]:
    """Return the optimum and the other minima of the lines.

    One that is solved for and is not the least from both sides is none.
    """
    near = SAME * tracker.scale.span
    kept = [best]
    for one in minima(tracker, NEAR - 1.0, most=count):
        apart = all(abs(one.z - other.z) > near for other in kept)
        if apart and (one.bracketed or not one.solved):
            kept.append(one)
    return kept


def _taken(tracker: Tracker) -> Real:
    """Return where something was looked at."""
    return np.array([look.z for look in tracker.looks] + [glance.z for glance in tracker.glances])


def _runs(tracker: Tracker, height: float) -> list[tuple[float, float]]:
    """Return the ends of every run of the range in which the lines are lower than `height`."""
    z = tracker.places()
    low = np.concatenate([[False], tracker.envelope(z) < height, [False]])
    begins, ends = np.flatnonzero(low[1:] & ~low[:-1]), np.flatnonzero(low[:-1] & ~low[1:]) - 1
    return [(float(z[begin]), float(z[end])) for begin, end in zip(begins, ends, strict=True)]


def _stretches(tracker: Tracker, height: float) -> list[tuple[float, float]]:
    """Return the ends of the stretches to look at, widest first."""
    taken, found = _taken(tracker), []
    for begin, end in _runs(tracker, height):
        marks = np.unique([begin, *taken[(taken > begin) & (taken < end)], end])
        found += [
            (float(left), float(right))
            for left, right in pairwise(marks)
            if right - left > APART * tracker.scale.span
        ]
    return sorted(found, key=lambda stretch: stretch[0] - stretch[1])
