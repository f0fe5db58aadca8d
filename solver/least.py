"""The value of one parameter at which the highest peak of the frequency response is least.

Peaks are followed from a sweep over the parameter; the highest of them bounds the highest peak from below
everywhere, so a sweep at the least point of the bound that finds nothing higher proves the optimum over the
whole range; otherwise what it found is followed too, and so on. The least highest peak of a sweep bounds the
optimum from above: where a line is higher than that it only has to show that it is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from solver.errors import SettingError
from solver.fourier import Real
from solver.further import NEAR, with_further
from solver.kernels.track import DHEIGHT, HEIGHT, OMEGA, Z
from solver.lines import Look, Pace
from solver.lowest import DOUBT, Lowest, flat, minima
from solver.peak_tracks import ActivePeak, Basin, LeastPeak, TrackStatus
from solver.ridges import Tracker
from solver.savings import Effects
from solver.scene import Scene
from solver.tighten import tighten

COMPETES = 0.6  # share of the highest peak of a sweep from which a peak is followed
CLOSE = 0.97  # the same once the least highest peak is being closed in on
RIVAL = 0.9  # the same for a peak of max x or −min x that the other of the two hides
HIGHER = 1e-7  # relative height by which a sweep must exceed the lines to count as higher
EQUAL = 1e-7  # relative distance within which peaks count as equally high
MOST_LOOKS = 40
GAP = 2e-3  # share of the range below which a gap between lines is no gap
SAME_PLACE = 1e-9  # likewise of two places
LEVEL = 1e-6  # relative change of the peak over the range below which it does not fall at an end
WIDE = 1.3  # times the best peak: how high other basins may be that are looked for thoroughly
COARSE = 0.08  # share of the range: sweeps closer than that do not look for other basins between them
_STARTS = (0.5, 0.25, 0.75, 0.0, 1.0)  # shares of the range where the first sweep is tried
_PACE = Pace(
    first_step=0.02, largest_step=0.25, smallest_step=1e-3, height_error=6e-3, omega_error=2e-3, above=1.005,
    slack=0.2, climb_from=4e-3,
)  # fmt: skip


def least_peak(
    scene: Scene,
    parameter: str,
    low: float,
    high: float,
    *,
    harmonics: int = 11,
    first: float | None = None,
    basins: int = 1,
    thorough: bool = False,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> LeastPeak:
    """Find the value of one parameter at which the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``shroud.N0``.
    low, high : its bounds in user units.
    harmonics : highest harmonic kept.
    first : where the first sweep is made; the middle of the range if left out.
    basins : how many local minima are looked for. With more than one, a coarse stage follows the proof of the
        optimum, which stays as it is: a response with half the harmonics in the middle of every stretch that
        no sweep was made in and that the lines leave lower than 1.05 times the optimum (three at most), and
        one at a further basin that nothing was looked at near. Further basins are the minima of the lines
        met, solved for; only where a sweep happened to be made are they proven, and there may be others.
    thorough : look for further basins by sweeps in steps over the range, wherever no line is known to be 1.3
        times as high as the optimum, and check as many of them as are asked for by a sweep each.
    effects : what is paid for though the scene does not call for it.
    on_progress : called after every sweep with (share done, as far as that is known; sweeps so far).
    should_stop : asked before every sweep; once the optimum is proven it only ends the coarse stage.

    Raises
    ------
    SettingError
        A bad path, range or number of harmonics or basins, or a first sweep outside the range.
    """
    begun = time.perf_counter()
    if isinstance(basins, bool) or not isinstance(basins, int) or basins < 1:
        raise SettingError("basins", basins, "must be a whole number >= 1")
    pace = replace(_PACE, above=WIDE) if thorough and basins > 1 else _PACE
    tracker = Tracker(scene, parameter, low, high, harmonics, effects, pace)
    scale = tracker.scale
    places = [scale.low + share * scale.span for share in _STARTS]
    if first is not None:
        z = scale.inside(tracker.balance.parameter.check("first", first))
        if not scale.low <= z <= scale.high:
            raise SettingError("first", first, f"must be from {min(low, high)} to {max(low, high)}")
        places.insert(0, z)
    for z in places:
        if tracker.lines or (should_stop is not None and should_stop()):
            break
        look = tracker.look(z)
        tracker.follow(look, COMPETES)
        tracker.follow_rivals(look, RIVAL)
        if on_progress is not None:
            on_progress(_share_done(tracker), len(tracker.looks))
    best = prove(
        tracker, CLOSE, begun, basins=basins, thorough=thorough, on_progress=on_progress,
        should_stop=should_stop,
    )  # fmt: skip
    if on_progress is not None:
        on_progress(1.0, best.sweeps)
    return best


def prove(
    tracker: Tracker,
    share: float,
    begun: float,
    *,
    basins: int = 1,
    thorough: bool = False,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> LeastPeak:
    """Sweep at the least point of the lines until nothing higher is found there, and where no line is.

    Parameters
    ----------
    tracker : with what is followed already.
    share : of the highest peak of a sweep from which another peak of it is followed.
    begun : when the work began, for the time it took.
    basins, thorough, on_progress, should_stop : as for `least_peak`.
    """
    doubt = WIDE - 1.0 if thorough and basins > 1 else DOUBT
    checked = basins if thorough else 1
    status: TrackStatus | None = None
    found: list[Lowest] | None = None
    settled: list[float] = []
    while status is None:
        found = None
        if should_stop is not None and should_stop():
            status = TrackStatus.STOPPED
        elif not tracker.lines:
            status = TrackStatus.NO_RESPONSE
        elif len(tracker.looks) >= MOST_LOOKS:
            status = TrackStatus.UNPROVEN
        else:
            before = _sweeps(tracker)
            status, found = _next_step(tracker, share, checked, doubt, settled)
            if status is TrackStatus.TRACKED and found and basins > checked:
                found, standing = with_further(tracker, found, basins, should_stop)
                if not standing:
                    status, doubt = None, NEAR - 1.0
            if on_progress is not None and _sweeps(tracker) > before:
                on_progress(_share_done(tracker), _sweeps(tracker))
    if found is None:
        found = minima(tracker, doubt)
    return _least(tracker, found, status, begun)


def _next_step(
    tracker: Tracker, share: float, basins: int, doubt: float, settled: list[float]
) -> tuple[TrackStatus | None, list[Lowest] | None]:
    """Close a gap, or check one of the first basins.

    Parameters
    ----------
    settled : places of further basins that need no more looking; added to.

    Returns
    -------
    The status once there is nothing left to do, and the minima if they are still those of the lines.
    """
    gap = _gap(tracker)
    if gap is not None:
        look = tracker.look(gap)
        new = tracker.follow(look, 1.0 if look.top > tracker.enough else share)
        new = new or tracker.follow(look, COMPETES)
        return (None if new else TrackStatus.GAPS), None
    if tighten(tracker, doubt):
        return None, None
    found = minima(tracker, doubt)
    if not found[0].solved:
        at = found[0].z
        new = _seen(tracker, at) is None and tracker.follow(tracker.look(at), share)
        return (None, None) if new else (TrackStatus.GAPS, found)
    for rank, one in enumerate(found[:basins]):
        if not one.solved or one.z in settled:
            continue
        look = _seen(tracker, one.z) or tracker.look(one.z)
        verdict = _judge(look, one)
        if verdict is TrackStatus.UNPROVEN and tracker.follow(look, share, one.rows):
            return None, None
        if rank == 0 and (verdict is not TrackStatus.TRACKED or not one.bracketed):
            return TrackStatus.UNPROVEN if verdict is TrackStatus.TRACKED else verdict, found
        settled.append(one.z)
        place = _unseen(tracker, one.height * WIDE) if basins > 1 and rank == 0 else None
        if place is not None:
            settled.clear()
            tracker.follow(tracker.look(place), RIVAL)
            return None, None
    return TrackStatus.TRACKED, found


def _unseen(tracker: Tracker, height: float) -> float | None:
    """Return the middle of the widest stretch without a sweep where the lines are lower than `height`."""
    scale = tracker.scale
    taken = np.unique([scale.low, *(look.z for look in tracker.looks), scale.high])
    middles, widths = 0.5 * (taken[1:] + taken[:-1]), np.diff(taken)
    widths[(tracker.envelope(middles) >= height) | (widths <= COARSE * scale.span)] = 0.0
    return float(middles[np.argmax(widths)]) if widths.max() > 0.0 else None


def _share_done(tracker: Tracker) -> float:
    """Return a guess of the share done: how many sweeps are to come is not known."""
    sweeps = _sweeps(tracker)
    return sweeps / (sweeps + 1.0)


def _sweeps(tracker: Tracker) -> int:
    """Return how many responses were computed, those with fewer harmonics included."""
    return len(tracker.looks) + len(tracker.glances)


def _seen(tracker: Tracker, z: float) -> Look | None:
    """Return the sweep made at z, if one was."""
    near = SAME_PLACE * tracker.scale.span
    return next((look for look in tracker.looks if abs(look.z - z) <= near), None)


def _judge(look: Look, best: Lowest) -> TrackStatus:
    """Compare a sweep at a least point with the lines there."""
    if not look.branch.completed or look.top > best.height * (1.0 + HIGHER):
        return TrackStatus.UNPROVEN
    if look.top < best.height * (1.0 - HIGHER):
        return TrackStatus.OTHER_BRANCH
    return TrackStatus.TRACKED


def _gap(tracker: Tracker) -> float | None:
    """Return the middle of the widest stretch that no line covers; None if there is none to speak of."""
    widest, middle, reached = GAP * tracker.scale.span, None, tracker.scale.low
    for low, high in sorted((line.low, line.high) for line in tracker.lines):
        if low - reached > widest:
            widest, middle = low - reached, 0.5 * (reached + low)
        reached = max(reached, high)
    if tracker.scale.high - reached > widest:
        middle = 0.5 * (reached + tracker.scale.high)
    return middle


def _least(tracker: Tracker, found: list[Lowest], status: TrackStatus, begun: float) -> LeastPeak:
    """Put the result together."""
    if not found:
        return LeastPeak(
            status=status, at=math.nan, peak=math.nan, active=(), basins=(), branch=None,
            sweeps=_sweeps(tracker), work=_work(tracker, None), seconds=time.perf_counter() - begun,
        )  # fmt: skip
    best, look = found[0], _seen(tracker, found[0].z)
    active = tuple(_active(tracker, row) for row in _highest(best.rows))
    if status is TrackStatus.TRACKED:
        status = _refined(tracker, best)
    return LeastPeak(
        status=status, at=tracker.scale.outside(best.z), peak=best.height, active=active,
        basins=tuple(_basin(tracker, one) for one in found), branch=None if look is None else look.branch,
        sweeps=_sweeps(tracker), work=_work(tracker, look), seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _refined(tracker: Tracker, best: Lowest) -> TrackStatus:
    """Tell an optimum within the range from one at its end, and from a peak that does not change."""
    if flat(tracker):
        return TrackStatus.FLAT
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
    look = _seen(tracker, one.z)
    proven = one.solved and look is not None and _judge(look, one) is TrackStatus.TRACKED
    return Basin(at=tracker.scale.outside(one.z), peak=one.height, solved=one.solved, proven=proven)


def _work(tracker: Tracker, look: Look | None) -> float:
    """Return the Newton iterations of everything in units of one sweep; 0 before the first."""
    if not tracker.looks:
        return 0.0
    swept = sum(one.branch.newton_iterations for one in tracker.looks)
    unit = swept / len(tracker.looks) if look is None else look.branch.newton_iterations
    glanced = sum(one.iterations for one in tracker.glances)
    return (swept + glanced + tracker.spent) / max(unit, 1)


def _active(tracker: Tracker, row: Real) -> ActivePeak:
    p = np.array([tracker.scale.outside(float(row[Z]))])
    return ActivePeak(
        frequency=float(row[OMEGA]) / (2.0 * math.pi), value=float(row[HEIGHT]),
        slope=float(row[DHEIGHT] / tracker.scale.by_z(p)[0]),
    )  # fmt: skip
