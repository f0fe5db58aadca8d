"""The value of one parameter at which the highest peak of the frequency response is least.

Peaks are followed from a sweep over the parameter; the highest of them bounds the highest peak from below
everywhere, so a sweep at the least point of the bound that finds nothing higher proves the optimum over the
whole range; otherwise what it found is followed too, and so on. The least highest peak of a sweep bounds the
optimum from above: where a line is higher than that it only has to show that it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from solver.balance.simplifications import Effects
from solver.continuation.branch import BranchStatus
from solver.continuation.branches.sweep import DEAR, with_error
from solver.continuation.extrema.kernels.peak_continuation import DHEIGHT, HEIGHT, OMEGA, Z
from solver.continuation.walk import Pace
from solver.errors import SettingError, check_count
from solver.first_use import renamed
from solver.jit.fourier import Real
from solver.jit.timer import clock
from solver.results.watch import shows_progress
from solver.scene.scene import Scene
from solver.studies.peaks.envelope_minimum import DOUBT, NEAR, Lowest, flat, minima, rows_at, with_further
from solver.studies.peaks.peak_plateau import Plateau, all_level, choose, dips, interval, look_at
from solver.studies.peaks.survey import RESPONSES, Allowance, HaltedError, Look, OnLook, TrackingPace
from solver.studies.peaks.track_results import ActivePeak, Basin, ChosenBy, LeastPeak, TrackStatus
from solver.studies.peaks.tracker import Tracker, tighten

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
        basins=tuple(_basin(tracker, one) for one in found),
        branch=None if look is None else with_error(look.branch), sweeps=tracker.sweeps,
        work=_work(tracker, look), seconds=clock() - begun,
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


COMPETES = 0.6  # share of the highest peak of a sweep from which a peak is followed
CLOSE = 0.97  # the same once the least highest peak is being closed in on
RIVAL = 0.9  # the same for a peak of max x or −min x that the other of the two hides
MOST_LOOKS = 40
LOWER = 1e-3  # relative height by which a minimum of the lines must be below all sweeps to be swept early
GAP = 2e-3  # share of the range below which a gap between lines is no gap
WIDE = 1.3  # times the best peak: how high other basins may be that are looked for thoroughly
COARSE = 0.08  # share of the range: sweeps closer than that do not look for other basins between them
REOPENED = 5  # times a proven optimum is given up because of what lies beside it
SHORT = 5e-3  # share of the range: a line in a gap that is shorter is followed again with shorter steps
THOROUGHLY = 3.0  # times the work allowed, where other basins are looked for thoroughly
_STARTS = (0.5, 0.25, 0.75, 0.0, 1.0)  # shares of the range where the first sweep is tried
_PACE = TrackingPace(
    steps=Pace(first=0.02, least=1e-3, largest=0.25), height_error=6e-3, omega_error=2e-3, above=1.005,
    slack=0.2, climb_from=4e-3,
)  # fmt: skip


@renamed(low="start", high="stop")
@shows_progress("least peak")
def least_peak(
    scene: Scene,
    parameter: str,
    start: float,
    stop: float,
    *,
    harmonics: int = 11,
    first: float | None = None,
    basins: int = 1,
    thorough: bool = False,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    on_look: OnLook = None,
) -> LeastPeak:
    """Find the value of one parameter at which the highest peak over the scene's band is least.

    Parameters
    ----------
    scene : what vibrates, with the values that stay fixed.
    parameter : path of the parameter, for example ``shroud.N0``.
    start, stop : its range in user units.
    harmonics : highest harmonic kept.
    first : where the first sweep is made; if left out the middle of the range, and of a scene whose responses
        are dear where the highest peak with one harmonic is least.
    basins : how many local minima are looked for. With more than one, a coarse stage follows the proof of the
        optimum, which stays as it is: a response with half the harmonics in the middle of every stretch that
        no sweep was made in and that the lines leave lower than 1.05 times the optimum (three at most), and
        one at a further basin that nothing was looked at near. Further basins are the minima of the lines
        met, solved for; only where a sweep happened to be made are they proven, and there may be others.
    thorough : look for further basins by sweeps in steps over the range, wherever no line is known to be 1.3
        times as high as the optimum, and check as many of them as are asked for by a sweep each.
    effects : what is paid for though the scene does not call for it.
    on_progress : called after every sweep with (share done, as far as that is known; sweeps so far).
    should_stop : asked several times a second; once the optimum is proven it only ends the coarse stage.
    on_look : called with the value of the parameter and the branch of every response over the whole band.

    Raises
    ------
    SettingError
        A bad path, range or number of harmonics or basins, or a first sweep outside the range.
    """
    begun = clock()
    check_count("basins", basins, 1)
    pace = replace(_PACE, above=WIDE) if thorough and basins > 1 else _PACE
    allowance = Allowance(should_stop, RESPONSES * (THOROUGHLY if thorough else 1.0))
    tracker = Tracker(scene, parameter, start, stop, harmonics, effects, pace, allowance)
    tracker.on_look = on_look
    scale = tracker.scale
    places = [scale.low + share * scale.span for share in _STARTS]
    if first is not None:
        z = scale.inside(tracker.balance.parameter.check("first", first))
        if not scale.low <= z <= scale.high:
            raise SettingError("first", first, f"must be from {min(start, stop)} to {max(start, stop)}")
        places.insert(0, z)
    try:
        if first is None and tracker.balance.n_unknowns >= DEAR:
            rough = Tracker(scene, parameter, start, stop, 1, effects, pace, Allowance(should_stop))
            places[:0] = _roughly(rough, places)
            tracker.before = rough.sweeps
        _begin(tracker, places, on_progress)
    except HaltedError as halt:
        best = halted(tracker, halt.status, begun)
    else:
        best = prove(tracker, CLOSE, begun, basins=basins, thorough=thorough, on_progress=on_progress)
    if on_progress is not None:
        on_progress(1.0, best.sweeps)
    return best


def _begin(tracker: Tracker, places: list[float], on_progress: Callable[[float, int], None] | None) -> None:
    """Sweep at the first of some places that shows a peak, and follow what competes there."""
    for z in places:
        if tracker.lines:
            break
        tracker.ask()
        look = tracker.look(z)
        tracker.follow(look, COMPETES)
        tracker.follow_rivals(look, RIVAL)
        if on_progress is not None:
            on_progress(_share_done(tracker), len(tracker.looks))


def _roughly(tracker: Tracker, places: list[float]) -> list[float]:
    """Return about where the highest line is least once the lines cover the range; nothing without lines."""
    _begin(tracker, places, None)
    while (gap := _gap(tracker)) is not None and len(tracker.lines) > 0 and len(tracker.looks) < MOST_LOOKS:
        if not _narrowed(tracker, gap, CLOSE):
            break
    at = tracker.places()
    heights = tracker.envelope(at)
    known = np.flatnonzero(np.isfinite(heights))
    return [float(at[known[np.argmin(heights[known])]])] if known.size else []


def prove(
    tracker: Tracker,
    share: float,
    begun: float,
    *,
    basins: int = 1,
    thorough: bool = False,
    on_progress: Callable[[float, int], None] | None = None,
    nested: bool = False,
) -> LeastPeak:
    """Sweep at the least point of the lines until nothing higher is found there, and where no line is.

    Parameters
    ----------
    tracker : with what is followed already.
    share : of the highest peak of a sweep from which another peak of it is followed.
    begun : when the work began, for the time it took.
    basins, thorough, on_progress : as for `least_peak`.
    nested : whether a search of the highest peak has led to this one of other peaks.

    Raises
    ------
    HaltedError
        A nested search, if the end came before the proof.
    """
    try:
        status, found, plateau = _search(tracker, share, basins, thorough, nested, on_progress)
    except HaltedError as halt:
        if nested:
            raise
        return halted(tracker, halt.status, begun)
    return result_of(tracker, found, status, begun, plateau)


def _search(
    tracker: Tracker, share: float, basins: int, thorough: bool, nested: bool,
    on_progress: Callable[[float, int], None] | None,
) -> tuple[TrackStatus, list[Lowest], Plateau | None]:  # fmt: skip
    """Return how the search of `prove` ended, the minima of the lines, and the interval of the first."""
    doubt = WIDE - 1.0 if thorough and basins > 1 else DOUBT
    checked = basins if thorough else 1
    status: TrackStatus | None = None
    found: list[Lowest] | None = None
    settled: list[float] = []
    plateau: Plateau | None = None
    reopened = 0
    while status is None:
        found = None
        tracker.ask()
        if not tracker.lines:
            undamped = any(look.branch.status is BranchStatus.UNDAMPED for look in tracker.looks)
            status = TrackStatus.UNDAMPED if undamped else TrackStatus.NO_RESPONSE
        elif len(tracker.looks) >= MOST_LOOKS:
            status = TrackStatus.UNPROVEN
        else:
            before = tracker.sweeps
            status, found = _next_step(tracker, share, checked, doubt, settled)
            if status is TrackStatus.TRACKED and found and basins > checked:
                found, standing = with_further(tracker, found, basins)
                if not standing:
                    status, doubt = None, NEAR - 1.0
            if status is TrackStatus.TRACKED and found and reopened < REOPENED:
                plateau, standing = _settle(tracker, found[0], share, nested)
                status, reopened = (status, reopened) if standing else (None, reopened + 1)
            if on_progress is not None and tracker.sweeps > before:
                on_progress(_share_done(tracker), tracker.sweeps)
    found = minima(tracker, doubt) if found is None else found
    return status, found if plateau is None else [plateau.chosen, *found[1:]], plateau


def _settle(tracker: Tracker, best: Lowest, share: float, nested: bool) -> tuple[Plateau | None, bool]:
    """Choose a place where the highest peak is the same over an interval.

    Returns
    -------
    The interval with the place (None: the optimum is sharp), and whether the proof stands: the sweeps that
    are made to choose may find something higher.
    """
    low, high = tracker.scale.low, tracker.scale.high
    if tracker.allowance.ended:
        return None, True
    if flat(tracker):
        look = seen(tracker, best.z)
        if look is None or all_level(tracker, look):
            return Plateau(low=low, high=high, chosen=best, by=ChosenBy.NOTHING), True
    ends = interval(tracker, best)
    if ends is None:
        return None, True
    if dips(tracker, ends, best.height):
        return None, False
    looks = look_at(tracker, *ends)
    for look in looks:
        verdict = judge(look, best)
        if verdict is not TrackStatus.TRACKED:
            return None, not (verdict is TrackStatus.UNPROVEN and tracker.follow(look, share))
    z, by = choose(tracker, looks, None if nested else _prove_nested)
    look, rows = seen(tracker, z) or tracker.look(z), rows_at(tracker, z)
    verdict = judge(look, best)
    if verdict is not TrackStatus.TRACKED or not rows:
        return None, not (verdict is TrackStatus.UNPROVEN and tracker.follow(look, share))
    chosen = replace(best, z=z, rows=rows)
    return Plateau(low=ends[0], high=ends[1], chosen=chosen, by=by), True


def _prove_nested(tracker: Tracker, begun: float) -> LeastPeak:
    """Return the least of the peaks that count in a part of the range."""
    return prove(tracker, CLOSE, begun, nested=True)


def halted(tracker: Tracker, status: TrackStatus, begun: float) -> LeastPeak:
    """Return what is known where the end came before the proof."""
    tracker.allowance.end(status)
    return result_of(tracker, minima(tracker) if tracker.lines else [], status, begun)


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
        return (None if _narrowed(tracker, gap, share) else TrackStatus.GAPS), None
    if tighten(tracker, doubt):
        return None, None
    found = minima(tracker, doubt)
    if not found[0].solved:
        at = found[0].z
        new = seen(tracker, at) is None and tracker.follow(tracker.look(at), share, careful=True)
        return (None, None) if new else (TrackStatus.GAPS, found)
    for rank, one in enumerate(found[:basins]):
        if not one.solved or one.z in settled:
            continue
        look = seen(tracker, one.z) or tracker.look(one.z)
        verdict = judge(look, one)
        if verdict is TrackStatus.UNPROVEN and tracker.follow(look, share, one.rows, careful=True):
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


def _filled(tracker: Tracker, gap: float, share: float) -> bool:
    """Follow what a sweep in a gap between lines shows; return whether there is a new line."""
    look, before = tracker.look(gap), len(tracker.lines)
    share = 1.0 if look.top > tracker.enough else share
    for careful in (False, True):
        for enough in (share, COMPETES):
            if tracker.follow(look, enough, careful=careful):
                break
        longest = max((line.high - line.low for line in tracker.lines[before:]), default=0.0)
        if careful or longest > SHORT * tracker.scale.span:
            break
        # Lines ended here before: what is between may change fast, and is followed again with short steps.
        del tracker.lines[before:]
    return len(tracker.lines) > before


def _unseen(tracker: Tracker, height: float) -> float | None:
    """Return the middle of the widest stretch without a sweep where the lines are lower than `height`."""
    scale = tracker.scale
    taken = np.unique([scale.low, *(look.z for look in tracker.looks), scale.high])
    middles, widths = 0.5 * (taken[1:] + taken[:-1]), np.diff(taken)
    widths[(tracker.envelope(middles) >= height) | (widths <= COARSE * scale.span)] = 0.0
    return float(middles[np.argmax(widths)]) if widths.max() > 0.0 else None


def _share_done(tracker: Tracker) -> float:
    """Return a guess of the share done: how many sweeps are to come is not known."""
    sweeps = tracker.sweeps
    return sweeps / (sweeps + 1.0)


def _gap(tracker: Tracker) -> tuple[float, float] | None:
    """Return the widest stretch that no line covers; None if there is none to speak of."""
    widest, found, reached = GAP * tracker.scale.span, None, tracker.scale.low
    end = tracker.scale.high
    for low, high in [*sorted((line.low, line.high) for line in tracker.lines), (end, end)]:
        if low - reached > widest:
            widest, found = low - reached, (reached, low)
        reached = max(reached, high)
    return found


def _narrowed(tracker: Tracker, gap: tuple[float, float], share: float) -> bool:
    """Cover a part of a gap, or make it easier to cover; return whether either succeeded."""
    return tracker.hold(*gap) or _bounded(tracker, share) or _filled(tracker, 0.5 * sum(gap), share)


def _bounded(tracker: Tracker, share: float) -> bool:
    """Sweep at a minimum of the lines that is lower than every sweep; return whether there is such a one.

    What stands beside it, in a gap, then only has to be higher than that.
    """
    found = minima(tracker, 0.0, 1)[0]
    lower = found.bracketed and found.height < tracker.least * (1.0 - LOWER)
    if not lower or seen(tracker, found.z) is not None:
        return False
    tracker.follow(tracker.look(found.z), share, found.rows, careful=True)
    return True
