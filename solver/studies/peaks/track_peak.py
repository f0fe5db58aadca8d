"""The highest peak of the frequency response over a parameter.

Peaks are followed by Newton's method on {r = 0, da/dω = 0} with exact second derivatives. The highest tracked
peak bounds the highest peak from below everywhere; sweeps look for what nothing has followed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from solver.balance.simplifications import Effects
from solver.continuation.branches.sweep import with_error
from solver.continuation.extrema.kernels.peak_continuation import DHEIGHT, HEIGHT, OMEGA, Z
from solver.errors import check_count
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.results.watch import shows_progress
from solver.scene.scene import Scene
from solver.studies.peaks.minimise_peak import COMPETES, EQUAL, MOST_LOOKS, THOROUGHLY, halted, prove
from solver.studies.peaks.peak_lines import Line, LineEnd
from solver.studies.peaks.survey import RESPONSES, Allowance, HaltedError
from solver.studies.peaks.track_results import CompetingPeak, Exchange, LeastPeak, PeakTrack, TrackStatus
from solver.studies.peaks.tracker import Tracker

BESIDE = 5e-3  # share of the range: how far beyond the end of a line is looked
NARROW = 1.0 / 64.0  # share of the range: sweeps closer than that are not halved further


@shows_progress("peaks")
def track_peak(
    scene: Scene, parameter: str, start: float, stop: float, *, harmonics: int = 11, checks: int = 3,
    effects: Effects | None = None, on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> PeakTrack:  # fmt: skip
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
    should_stop : asked several times a second.

    Returns
    -------
    The highest peak with its derivative, every peak that competes, and where the highest is least.

    Raises
    ------
    SettingError
        A bad path, range, number of harmonics or of checks.
    """
    begun = clock()
    check_count("checks", checks, 0)
    allowance = Allowance(should_stop, RESPONSES * (THOROUGHLY + checks / 20.0))
    tracker = Tracker(scene, parameter, start, stop, harmonics, effects, allowance=allowance)
    try:
        _look_around(tracker, checks, on_progress)
        _look_closer(tracker)
    except HaltedError as halt:
        best = halted(tracker, halt.status, begun)
    else:
        best = prove(tracker, COMPETES, begun)
    if on_progress is not None:
        on_progress(1.0, tracker.sweeps)
    # An optimum at an end, or everywhere, is proven like any other: the track is complete.
    status = TrackStatus.TRACKED if best.status.proven else best.status
    try:
        return _result(tracker, best, status, start <= stop, begun)
    except HaltedError as halt:
        allowance.end(halt.status)
        return _result(tracker, best, halt.status, start <= stop, begun)


def _look_around(tracker: Tracker, checks: int, on_progress: Callable[[float, int], None] | None) -> None:
    """Sweep at the ends and at places between, and follow what competes there."""
    for done, z in enumerate(np.linspace(tracker.scale.low, tracker.scale.high, checks + 2)):
        tracker.ask()
        tracker.follow(tracker.look(float(z)), COMPETES)
        if on_progress is not None:
            on_progress((done + 1.0) / (checks + 3.0), len(tracker.looks))


def _look_closer(tracker: Tracker) -> None:
    """Sweep beyond every end of a line, and halve what lies beside sweeps that found something new."""
    while len(tracker.looks) < MOST_LOOKS:
        place = _next_place(tracker)
        if place is None:
            return
        tracker.follow(tracker.look(place), COMPETES)


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
        branches=tuple(with_error(look.branch) for look in tracker.looks), n_harmonics=balance.n_harmonics,
        sweeps=tracker.sweeps, status=status,
        seconds=clock() - begun, given=balance.scene,
    )  # fmt: skip


def _highest(tracker: Tracker) -> tuple[Real, tuple[Exchange, ...]]:
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
    exchanges: list[Exchange] = []
    for at, (z, index, row) in enumerate(picked):
        if rows and picked[at - 1][1] != index:
            for meeting in _exchange(tracker, picked[at - 1][1], index, picked[at - 1][0], z):
                rows.extend(meeting)
                at_value = tracker.scale.outside(float(meeting[0][Z]))
                exchanges.append(Exchange(at_value, float(meeting[0][HEIGHT])))
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
        if tracker.allowance.over:
            return []
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
