"""The highest peak of the frequency response over a parameter, and where it is least.

Peaks are followed by Newton's method on {r = 0, da/dω = 0} with exact second derivatives. The highest tracked
peak bounds the highest peak from below everywhere, so a sweep at the least point of the bound that finds
nothing higher proves the optimum over the whole range; otherwise what it found is followed too, and so on.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable

import numpy as np

from solver.errors import SettingError
from solver.fourier import Real
from solver.kernels.track import DHEIGHT, HEIGHT, OMEGA, Z
from solver.lowest import Lowest, lowest
from solver.peak_tracks import ActivePeak, CompetingPeak, LeastPeak, PeakTrack, TrackStatus
from solver.ridges import Line, LineEnd, Look, Tracker
from solver.savings import Effects
from solver.scene import Scene

COMPETES = 0.6  # share of the highest peak of a sweep from which a peak is followed
CLOSE = 0.97  # the same when only the least highest peak is looked for
HIGHER = 1e-7  # relative height by which a sweep must exceed the lines to count as higher
EQUAL = 1e-7  # relative distance within which peaks count as equally high
MOST_LOOKS = 40
BESIDE = 5e-3  # share of the range: how far beyond the end of a line is looked
NARROW = 1.0 / 64.0  # share of the range: sweeps closer than that are not halved further
GAP = 2e-3  # share of the range below which a gap between lines is no gap


def least_peak(
    scene: Scene,
    parameter: str,
    low: float,
    high: float,
    *,
    harmonics: int = 11,
    first: float | None = None,
    effects: Effects | None = None,
) -> LeastPeak:
    """Find the value of one parameter at which the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``shroud.N0``.
    low, high : its bounds in user units.
    harmonics : highest harmonic kept.
    first : where the first sweep is made; the middle of the range if left out.
    effects : what is paid for though the scene does not call for it.

    Raises
    ------
    SettingError
        A bad path, range or number of harmonics, or a first sweep outside the range.
    """
    begun = time.perf_counter()
    tracker = Tracker(scene, parameter, low, high, harmonics, effects)
    z = 0.5 * (tracker.scale.low + tracker.scale.high)
    if first is not None:
        z = tracker.scale.inside(tracker.balance.parameter.check("first", first))
        if not tracker.scale.low <= z <= tracker.scale.high:
            raise SettingError("first", first, f"must be from {min(low, high)} to {max(low, high)}")
    tracker.look(z, COMPETES)
    return _prove(tracker, CLOSE, begun)


def track_peak(
    scene: Scene,
    parameter: str,
    start: float,
    stop: float,
    *,
    harmonics: int = 11,
    checks: int = 3,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> PeakTrack:
    """Follow the highest peak over the scene's band while a parameter changes.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``shroud.N0``.
    start, stop : the range in user units.
    harmonics : highest harmonic kept.
    checks : sweeps between the ends that look for peaks nothing has followed; the optimum is checked besides.
    effects : what is paid for though the scene does not call for it.
    on_progress : called with (share done, sweeps so far).
    should_stop : asked between sweeps.

    Returns
    -------
    The highest peak with its derivative, every peak that competes, and where the highest is least.

    Raises
    ------
    SettingError
        A bad path, range, number of harmonics or of checks.
    """
    begun = time.perf_counter()
    if isinstance(checks, bool) or not isinstance(checks, int) or checks < 0:
        raise SettingError("checks", checks, "must be a whole number >= 0")
    tracker = Tracker(scene, parameter, start, stop, harmonics, effects)
    stopped = False
    for done, z in enumerate(np.linspace(tracker.scale.low, tracker.scale.high, checks + 2)):
        if should_stop is not None and should_stop():
            stopped = True
            break
        tracker.look(float(z), COMPETES)
        if on_progress is not None:
            on_progress((done + 1.0) / (checks + 3.0), len(tracker.looks))
    if not stopped:
        _look_closer(tracker)
    best = _prove(tracker, COMPETES, begun)
    if on_progress is not None:
        on_progress(1.0, len(tracker.looks))
    return _result(tracker, best, TrackStatus.STOPPED if stopped else best.status, start <= stop, begun)


def _look_closer(tracker: Tracker) -> None:
    """Sweep beyond every end of a line, and halve what lies beside sweeps that found something new."""
    while len(tracker.looks) < MOST_LOOKS:
        place = _next_place(tracker)
        if place is None:
            return
        tracker.look(place, COMPETES)


def _next_place(tracker: Tracker) -> float | None:
    """Return where to sweep next, if anywhere."""
    span, looks = tracker.scale.span, sorted(tracker.looks, key=lambda look: look.z)
    taken = np.array([look.z for look in looks])
    for line in tracker.lines:
        for end, way in ((line.low, -1.0), (line.high, 1.0)):
            beyond = end + way * BESIDE * span
            inside = tracker.scale.low < beyond < tracker.scale.high
            if inside and np.abs(taken - beyond).min() > 0.8 * BESIDE * span:
                return beyond
    for left, right in itertools.pairwise(looks):
        if (left.surprising or right.surprising) and right.z - left.z > NARROW * span:
            return 0.5 * (left.z + right.z)
    return None


def _prove(tracker: Tracker, share: float, begun: float) -> LeastPeak:
    """Sweep at the least point of the lines until nothing higher is found there, and where no line is."""
    best, status = None, TrackStatus.UNPROVEN
    for _ in range(MOST_LOOKS):
        gap = _gap(tracker)
        if gap is not None:
            known = len(tracker.lines)
            tracker.look(gap, share)
            if len(tracker.lines) == known:
                status = TrackStatus.GAPS
                break
            continue
        best = lowest(tracker)
        if best is None:
            status = TrackStatus.GAPS
            break
        here = best.z
        seen = next((look for look in tracker.looks if abs(look.z - here) <= 1e-9 * tracker.scale.span), None)
        known = len(tracker.lines)
        look = seen if seen is not None else tracker.look(here, share)
        status = _judge(look, best)
        if status is not TrackStatus.UNPROVEN or len(tracker.lines) == known:
            break
    if best is None and tracker.lines:
        best = lowest(tracker)
    if best is None:
        status = status if tracker.lines else TrackStatus.NO_RESPONSE
        return LeastPeak(
            status=status, at=math.nan, peak=math.nan, active=(), sweeps=len(tracker.looks),
            seconds=time.perf_counter() - begun,
        )  # fmt: skip
    active = tuple(
        _active(tracker, row) for row in best.rows.values() if row[HEIGHT] >= best.height * (1.0 - EQUAL)
    )
    return LeastPeak(
        status=status, at=tracker.scale.outside(best.z), peak=best.height, active=active,
        sweeps=len(tracker.looks), seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _judge(look: Look, best: Lowest) -> TrackStatus:
    """Compare a sweep at the least point with the lines there."""
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


def _active(tracker: Tracker, row: Real) -> ActivePeak:
    p = np.array([tracker.scale.outside(float(row[Z]))])
    return ActivePeak(
        frequency=float(row[OMEGA]) / (2.0 * math.pi), value=float(row[HEIGHT]),
        slope=float(row[DHEIGHT] / tracker.scale.by_z(p)[0]),
    )  # fmt: skip


def _result(tracker: Tracker, best: LeastPeak, status: TrackStatus, forward: bool, begun: float) -> PeakTrack:
    """Read the highest line at every row of every line where it is the highest."""
    rows, exchanges = _highest(tracker)
    if not forward:
        rows, exchanges = rows[::-1], exchanges[::-1]
    parameter, peak, frequency, slope = _columns(tracker, rows)
    balance = tracker.balance
    return PeakTrack(
        scene=balance.scene.name, parameter_path=balance.parameter.path, unit=balance.parameter.unit,
        parameter=parameter, peak=peak, frequency=frequency, slope=slope, optimum=best,
        competing=tuple(_competing(tracker, line, forward) for line in tracker.lines), exchanges=exchanges,
        n_harmonics=balance.n_harmonics, sweeps=len(tracker.looks), status=status,
        seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _highest(tracker: Tracker) -> tuple[Real, tuple[tuple[float, float], ...]]:
    """Return the rows of the highest line, ascending, with both rows where lines change places."""
    columns = tracker.lines[0].rows.shape[1] if tracker.lines else 0
    picked: list[tuple[float, int, Real]] = []
    for index, line in enumerate(tracker.lines):
        tops = tracker.envelope(line.rows[:, Z])
        picked += [
            (float(row[Z]), index, row)
            for row, top in zip(line.rows, tops, strict=True)
            if row[HEIGHT] >= top * (1.0 - 1e-12)
        ]
    picked.sort(key=lambda item: item[:2])
    rows: list[Real] = []
    exchanges: list[tuple[float, float]] = []
    for at, (z, index, row) in enumerate(picked):
        if rows and picked[at - 1][1] != index:
            for meeting in _exchange(tracker, picked[at - 1][1], index, picked[at - 1][0], z):
                rows.extend(meeting)
                exchanges.append((tracker.scale.outside(float(meeting[0][Z])), float(meeting[0][HEIGHT])))
        rows.append(row)
    return (np.array(rows) if rows else np.zeros((0, columns))), tuple(exchanges)


def _exchange(tracker: Tracker, one: int, other: int, low: float, high: float) -> list[tuple[Real, Real]]:
    """Return the rows of two lines where they are equally high between two places, if they are."""
    first, second = tracker.lines[one], tracker.lines[other]
    low, high = max(low, second.low), min(high, first.high)
    if not low < high:
        return []
    found = None
    begin, end = low, high
    for _ in range(60):
        z = np.array([0.5 * (begin + end)])
        if first.heights(z)[0] > second.heights(z)[0]:
            begin = float(z[0])
        else:
            end = float(z[0])
    here = 0.5 * (begin + end)
    for _ in range(8):
        a, b = tracker.exact(first, here), tracker.exact(second, here)
        if a is None or b is None:
            return []
        found = (a, b)
        closing = float(b[DHEIGHT] - a[DHEIGHT])
        move = float(a[HEIGHT] - b[HEIGHT]) / closing if closing != 0.0 else 0.0
        if abs(move) <= 1e-12 * tracker.scale.span or not low < here + move < high:
            break
        here += move
    return [] if found is None or abs(found[0][HEIGHT] / found[1][HEIGHT] - 1.0) > EQUAL else [found]


def _columns(tracker: Tracker, rows: Real) -> tuple[Real, Real, Real, Real]:
    """Return parameter, height, frequency [Hz] and slope by the parameter of some rows."""
    if not len(rows):
        nothing = np.zeros(0)
        return nothing, nothing, nothing, nothing
    parameter = np.array([tracker.scale.outside(float(z)) for z in rows[:, Z]])
    slope = rows[:, DHEIGHT] / tracker.scale.by_z(parameter)
    return parameter, rows[:, HEIGHT].copy(), rows[:, OMEGA] / (2.0 * math.pi), slope


def _competing(tracker: Tracker, line: Line, forward: bool) -> CompetingPeak:
    parameter, peak, frequency, slope = _columns(tracker, line.rows if forward else line.rows[::-1])
    ends: tuple[LineEnd, LineEnd] = line.ends if forward else line.ends[::-1]
    return CompetingPeak(
        parameter=parameter, peak=peak, frequency=frequency, slope=slope,
        ends=(ends[0].value, ends[1].value), at_band_end=line.fixed,
    )  # fmt: skip
