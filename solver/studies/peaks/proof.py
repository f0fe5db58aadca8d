"""What a sweep at the least point of the lines proves, and the result that is made of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from solver.continuation.extrema.kernels.peak_continuation import DHEIGHT, HEIGHT, OMEGA, Z
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.studies.peaks.envelope_minimum import Lowest, flat, rows_at
from solver.studies.peaks.track import Look
from solver.studies.peaks.track_results import ActivePeak, Basin, ChosenBy, LeastPeak, TrackStatus
from solver.studies.peaks.tracker import Tracker

if TYPE_CHECKING:
    from solver.studies.peaks.peak_plateau import Plateau

HIGHER = 1e-7  # relative height by which a sweep must exceed the lines to count as higher
EQUAL = 1e-7  # relative distance within which peaks count as equally high
SAME_PLACE = 1e-9  # share of the range within which two places are one
LEVEL = 1e-6  # relative change of the peak over the range below which it does not fall at an end
_AS_SEEN = (TrackStatus.WORK_USED_UP, TrackStatus.UNPROVEN, TrackStatus.GAPS)


def seen(tracker: Tracker, z: float) -> Look | None:
    """Return the sweep made at z, if one was."""
    near = SAME_PLACE * tracker.scale.span
    return next((look for look in tracker.looks if abs(look.z - z) <= near), None)


def judge(look: Look, best: Lowest) -> TrackStatus:
    """Compare a sweep at a least point with the lines there.

    This is the one place where a proof is accepted. It holds as far as the sweep has seen every peak, which
    its certificate says.
    """
    if not look.branch.peak_certificate.known or look.top > best.height * (1.0 + HIGHER):
        return TrackStatus.UNPROVEN
    if look.top < best.height * (1.0 - HIGHER):
        return TrackStatus.OTHER_BRANCH
    return TrackStatus.TRACKED


def result_of(
    tracker: Tracker, found: list[Lowest], status: TrackStatus, begun: float, plateau: Plateau | None = None
) -> LeastPeak:
    """Put the result together."""
    if not found:
        return LeastPeak(
            status=status, at=math.nan, peak=math.nan, active=(), basins=(), branch=None,
            sweeps=tracker.sweeps, work=_work(tracker, None), seconds=clock() - begun,
        )  # fmt: skip
    if status in _AS_SEEN:
        found = _with_best_seen(tracker, found)
    best, look = found[0], seen(tracker, found[0].z)
    # Which of equally high peaks is higher is rounding.
    rows = sorted(_highest(best.rows), key=lambda row: float(row[OMEGA]))
    active = tuple(_active(tracker, row) for row in rows)
    if status is TrackStatus.TRACKED:
        status = _refined(tracker, best, plateau)
    ends = None if plateau is None else (plateau.low, plateau.high)
    return LeastPeak(
        status=status, at=tracker.scale.outside(best.z), peak=best.height, active=active,
        basins=tuple(_basin(tracker, one) for one in found), branch=None if look is None else look.branch,
        sweeps=tracker.sweeps, work=_work(tracker, look), seconds=clock() - begun,
        plateau=None if ends is None else (tracker.scale.outside(ends[0]), tracker.scale.outside(ends[1])),
        chosen_by=(ChosenBy.HIGHEST_PEAK if plateau is None else plateau.by).value,
    )  # fmt: skip


def _with_best_seen(tracker: Tracker, found: list[Lowest]) -> list[Lowest]:
    """Put the best response seen first: where nothing is proven the lines are a bound, and no response."""
    look = min((look for look in tracker.looks if look.seen), key=lambda look: look.top, default=None)
    if look is None:
        return found
    near, rows = SAME_PLACE * tracker.scale.span, rows_at(tracker, look.z)
    top = max((float(row[HEIGHT]) for row in rows.values()), default=-math.inf)
    best = Lowest(
        z=look.z,
        rows=rows if abs(top - look.top) <= EQUAL * look.top else {},
        height=look.top,
        bracketed=False,
    )
    return [best, *(one for one in found if abs(one.z - look.z) > near)]


def _refined(tracker: Tracker, best: Lowest, plateau: Plateau | None) -> TrackStatus:
    """Tell an optimum within the range from one at its end, and from a peak that does not change."""
    if flat(tracker):
        return TrackStatus.FLAT
    if plateau is not None:
        return TrackStatus.PLATEAU
    slopes = [float(row[DHEIGHT]) for row in _highest(best.rows)]
    level = LEVEL * best.height / tracker.scale.span
    if (best.z == tracker.scale.low and min(slopes) > level) or (
        best.z == tracker.scale.high and max(slopes) < -level
    ):
        return TrackStatus.AT_BOUND
    return TrackStatus.TRACKED


def _highest(rows: Mapping[int, Real]) -> list[Real]:
    """Return the rows that are as high as the highest."""
    top = max((float(row[HEIGHT]) for row in rows.values()), default=math.inf)
    return [row for row in rows.values() if row[HEIGHT] >= top * (1.0 - EQUAL)]


def _basin(tracker: Tracker, one: Lowest) -> Basin:
    look = seen(tracker, one.z)
    # What was only the best response seen is no minimum of the lines.
    proven = one.solved and one.bracketed and look is not None and judge(look, one) is TrackStatus.TRACKED
    return Basin(at=tracker.scale.outside(one.z), peak=one.height, solved=one.solved, proven=proven)


def _work(tracker: Tracker, look: Look | None) -> float:
    """Return the Newton iterations of everything in units of one sweep; 0 before the first."""
    if not tracker.looks:
        return 0.0
    every = [one.branch.newton_iterations for one in tracker.looks]
    unit = sum(every) / len(every) if look is None else look.branch.newton_iterations
    return tracker.work / max(unit, 1)


def _active(tracker: Tracker, row: Real) -> ActivePeak:
    p = np.array([tracker.scale.outside(float(row[Z]))])
    return ActivePeak(
        frequency=float(row[OMEGA]) / (2.0 * math.pi), value=float(row[HEIGHT]),
        slope=float(row[DHEIGHT] / tracker.scale.by_z(p)[0]),
    )  # fmt: skip
