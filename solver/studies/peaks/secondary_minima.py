"""Further basins beside a proven optimum, by a coarse stage: glances where nothing has been looked at.

A further basin is a local minimum of the highest peak that is not the least. A line that no sweep has met may
make one. So wherever the lines known are nearly as low as the optimum and no sweep was made, a walk over the
band with half the harmonics is made, and what it shows that is on no line yet is solved for with all of them
and followed. That costs half a response a place, and proves nothing: what is not looked at is not seen.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from solver.continuation.extrema.kernels.peak_continuation import HEIGHT
from solver.jit.fourier import Real
from solver.studies.peaks.envelope_minimum import Lowest, flat, minima
from solver.studies.peaks.survey import HaltedError

if TYPE_CHECKING:
    from solver.studies.peaks.tracker import Tracker

NEAR = 1.05  # times the best peak: how high further basins may be that are looked for
APART = 0.08  # share of the range: no look is made between places closer than that
MOST_GLANCES = 3
HIGH = 0.97  # share of the highest line there from which a peak of a glance is followed
SAME = 1e-6  # share of the range within which two minima are one
ROUNDING = 1e-7  # relative distance within which heights are equal


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
