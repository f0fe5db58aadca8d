"""Lines made exact where the optimum may be: rows are added until cubics predict what lies between them.

How far two rows fit together says little about a kink between them. So between rows that are nearly as low as
the lowest place known, the peak in the middle is solved for and compared with the cubic; an interval that is
higher by some share may be wrong by a quarter of that, and no more, so that nothing lower hides in it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from solver.continuation.bracketing import dense_between
from solver.continuation.extrema.kernels.peak_continuation import HEIGHT, Z
from solver.studies.peaks.seeds import Line
from solver.studies.peaks.tracker import Place, Tracker

ALLOWED = 0.25  # share of what an interval is higher by that its cubic may be wrong by
EXACT = 1e-7  # relative error of a cubic that is no error
SHORTEST = 1e-5  # share of the range below which an interval is not divided
_SAMPLES = np.linspace(0.0, 1.0, 9)
_DEEPEST = 12


def tighten(tracker: Tracker, doubt: float) -> bool:
    """Add rows to the lines where they may be lowest; return whether there is anything new.

    Parameters
    ----------
    doubt : relative height above the lowest place up to which the lines have to be exact.
    """
    heights = tracker.envelope(tracker.places())
    heights = heights[np.isfinite(heights)]
    if heights.size == 0:
        return False
    least, new = float(heights.min()), False
    for index, line in enumerate(tracker.lines):
        matters = _matters(tracker, line, least, doubt)
        if any(matters):
            tracker.lines[index] = _with_more(tracker, line, matters, least)
            new = True
    return new


def _matters(tracker: Tracker, line: Line, least: float, doubt: float) -> list[bool]:
    """Return of every interval of a line whether it may hold the optimum, and has not been looked at."""
    rows = line.rows
    z = rows[:-1, Z, None] + _SAMPLES * np.diff(rows[:, Z])[:, None]
    top = tracker.envelope(z.reshape(-1)).reshape(z.shape)
    heights = line.heights(z.reshape(-1)).reshape(z.shape)
    low = np.any((top <= least * (1.0 + doubt)) & (heights >= top * (1.0 - doubt)), axis=1)
    return [
        bool(low[i]) and (rows[i, Z], rows[i + 1, Z], rows[i, HEIGHT]) not in tracker.exact_between
        for i in range(len(low))
    ]


def _with_more(tracker: Tracker, line: Line, matters: list[bool], least: float) -> Line:
    """Return a line with rows added in some of its intervals."""
    known = list(zip(line.rows, line.solutions, line.tangents, strict=True))
    places: list[Place] = [known[0]]
    for (left, right), wanted in zip(pairwise(known), matters, strict=True):
        if wanted:
            places += dense_between(left, right, _DEEPEST + 1, partial(_halved, tracker, line, least))
        places.append(right)
    rows, solutions, tangents = (np.array(part) for part in zip(*places, strict=True))
    return replace(line, rows=rows, solutions=solutions, tangents=tangents)


def _halved(
    tracker: Tracker, line: Line, least: float, left: Place, right: Place, depth: int
) -> tuple[Place | None, bool]:
    """Return the place in the middle of two, and whether the cubic is as exact as it has to be."""
    a, b = left[0], right[0]
    rows, solutions, tangents = (np.array(part) for part in zip(left, right, strict=True))
    pair = replace(line, rows=rows, solutions=solutions, tangents=tangents)
    middle = None
    if b[Z] - a[Z] > SHORTEST * tracker.scale.span:
        middle = tracker.solved(pair, 0.5 * (a[Z] + b[Z]), fitting=False)
    if middle is None:
        tracker.exact_between.add((a[Z], b[Z], a[HEIGHT]))
        return None, True
    height, cubic = float(middle[0][HEIGHT]), pair.heights(a[Z] + _SAMPLES * (b[Z] - a[Z]))
    allowed = max(EXACT * least, ALLOWED * (min(float(cubic.min()), height) - least))
    enough = abs(float(cubic[_SAMPLES.size // 2]) - height) <= allowed or depth == 1
    if enough:
        for one, other in ((a, middle[0]), (middle[0], b)):
            tracker.exact_between.add((one[Z], other[Z], one[HEIGHT]))
    return middle, enough
