"""Where the highest peak is least and the same over an interval: its ends, and the place chosen in it.

A contact that sticks wherever the highest peak is no longer changes it, whatever its load. The interval is
where the highest line is level; its ends are closed in on by solving the lines. Within it the highest of the
other peaks that still depends on the parameter is made least, by the same search; where none does, the
resonance band; and where that does not change either, the least value of the parameter is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np

from solver.continuation.bracketing import least_between, level_up_to
from solver.continuation.branch import Branch, Peak
from solver.continuation.extrema.kernels.peak_continuation import DHEIGHT, HEIGHT, Z
from solver.jit.timer import clock
from solver.studies.peaks.envelope_minimum import Lowest, rows_at
from solver.studies.peaks.track_results import ChosenBy, LeastPeak

if TYPE_CHECKING:
    from solver.studies.peaks.survey import Look
    from solver.studies.peaks.tracker import Tracker

CONSTANT = 1e-7  # relative difference within which heights, frequencies and widths are the same
LEVEL = 1e-9  # relative change over the range by its slope up to which a peak is level
SHORTEST = 1e-3  # share of the range below which an interval is none
SHARP = 1e-12  # of the range: how exactly its ends are found
WORTH = 0.01  # share of the highest peak from which another one counts
_BANDS, _NEAR = (
    9,
    1e-5,
)  # places at which the width of the band is compared, and how near the least is come to
_FIRST_STEP = 1e-4  # of the range
BESIDE = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)  # of the range: how far beside an interval a dip is looked for
SHALLOW = 1e-8  # relative depth that is no dip
BEYOND = 2e-3  # of the range: how far beyond the end of a line a peak is gone

Prove = Callable[["Tracker", float], LeastPeak]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plateau:
    """An interval of the least highest peak, and the place chosen in it; z is the tracker's."""

    low: Annotated[float, "Its lower end."]
    high: Annotated[float, "Its upper one."]
    chosen: Annotated[Lowest, "The place."]
    by: Annotated[ChosenBy, "What decided."]


def interval(tracker: Tracker, best: Lowest) -> tuple[float, float] | None:
    """Return the interval around a proven optimum over which the highest peak is the same; None: a point."""
    span, places = tracker.scale.span, tracker.places()
    low = np.flatnonzero(tracker.envelope(places) > best.height * (1.0 + CONSTANT))
    left = low[places[low] < best.z]
    right = low[places[low] > best.z]
    begin = float(places[left[-1] + 1] if left.size else places[0])
    end = float(places[right[0] - 1] if right.size else places[-1])
    if end - begin < SHORTEST * span:
        return None
    middle = 0.5 * (begin + end)
    if not _level(tracker, middle, best.height):
        return None
    begin, end = (
        level_up_to(
            lambda z: _level(tracker, z, best.height), middle, bound, _FIRST_STEP * span, SHARP * span
        )
        for bound in (tracker.scale.low, tracker.scale.high)
    )
    return (begin, end) if end - begin >= SHORTEST * span else None


def _level(tracker: Tracker, z: float, height: float) -> bool:
    """Return whether the highest line at z is as high as that and level."""
    rows = list(rows_at(tracker, z).values())
    if not rows or abs(rows[0][HEIGHT] / height - 1.0) > CONSTANT:
        return False
    highest = [row for row in rows if row[HEIGHT] >= rows[0][HEIGHT] * (1.0 - CONSTANT)]
    return all(abs(row[DHEIGHT]) * tracker.scale.span <= LEVEL * height for row in highest)


def dips(tracker: Tracker, ends: tuple[float, float], height: float) -> bool:
    """Solve the lines close beside an interval; return whether they are lower there than in it.

    A dip beside the interval may be shallower than cubics between distant rows tell: what is solved is added.
    """
    span, lower = tracker.scale.span, False
    for end, way in zip(ends, (-1.0, 1.0), strict=True):
        for share in BESIDE:
            z = end + way * share * span
            if not tracker.scale.low < z < tracker.scale.high:
                break
            new = [_add(tracker, index, z) for index in range(len(tracker.lines))]
            lower = lower or (
                any(new) and bool(tracker.envelope(np.array([z]))[0] < height * (1.0 - SHALLOW))
            )
    return lower


def _add(tracker: Tracker, index: int, z: float) -> bool:
    """Add a row at z to a line; return whether there is a new one."""
    line = tracker.lines[index]
    if not line.low < z < line.high or z in line.rows[:, Z]:
        return False
    place = tracker.solved(line, z, fitting=False)
    if place is None:
        return False
    at = int(np.searchsorted(line.rows[:, Z], z))
    tracker.lines[index] = replace(
        line, rows=np.insert(line.rows, at, place[0], axis=0),
        solutions=np.insert(line.solutions, at, place[1], axis=0),
        tangents=np.insert(line.tangents, at, place[2], axis=0),
    )  # fmt: skip
    return True


def look_at(tracker: Tracker, low: float, high: float) -> list[Look]:
    """Return sweeps at the ends and in the middle of an interval, those that were made already included."""
    near = SHARP * tracker.scale.span
    found = []
    for z in (low, 0.5 * (low + high), high):
        seen = next((look for look in tracker.looks if abs(look.z - z) <= near), None)
        found.append(seen or tracker.look(z))
    return found


def choose(tracker: Tracker, looks: list[Look], prove: Prove | None) -> tuple[float, ChosenBy]:
    """Return the place in an interval of the least highest peak, and what decided.

    Parameters
    ----------
    looks : of `look_at`, complete ones.
    prove : the search for the least of the peaks that count; None: that was made already.
    """
    low, high = looks[0].z, looks[-1].z
    if prove is not None:
        constant = _constant([look.branch for look in looks])
        if any(_depending(look.branch, constant) for look in looks):
            return _least_next(tracker, looks, constant, prove), ChosenBy.NEXT_PEAK
    widths = [_width(look.branch) for look in looks]
    if max(widths) - min(widths) > CONSTANT * max(widths):
        return _least_band(tracker, low, high), ChosenBy.BAND
    return low, ChosenBy.LEAST_VALUE


def _constant(branches: list[Branch]) -> list[Peak]:
    """Return the peaks of the first that all the others have too."""
    return [
        peak
        for peak in branches[0].peaks
        if all(any(_same(peak, other) for other in branch.peaks) for branch in branches[1:])
    ]


def _same(one: Peak, other: Peak) -> bool:
    """Return whether two peaks are the same."""
    return (
        abs(one.value - other.value) <= CONSTANT * one.value and abs(one.at - other.at) <= CONSTANT * one.at
    )


def _depending(branch: Branch, constant: list[Peak]) -> tuple[Peak, ...]:
    """Return the peaks worth counting that are not among those that do not depend on the parameter."""
    return tuple(
        peak
        for peak in branch.peaks
        if peak.value >= WORTH * branch.peaks[0].value and not any(_same(peak, one) for one in constant)
    )


def _least_next(tracker: Tracker, looks: list[Look], constant: list[Peak], prove: Prove) -> float:
    """Return where the highest peak that depends on the parameter is least between the looks."""
    low, high = (tracker.scale.outside(look.z) for look in (looks[0], looks[-1]))
    inner = tracker.within(low, high, lambda branch: _depending(branch, constant), looks)
    for look in inner.looks[:]:
        inner.follow(look, WORTH)
    free = _free(inner)
    if free is not None:
        return min(max(tracker.scale.inside(inner.scale.outside(free)), looks[0].z), looks[-1].z)
    best = prove(inner, clock())
    at = best.at if np.isfinite(best.at) else low
    return min(max(tracker.scale.inside(at), looks[0].z), looks[-1].z)


def _free(inner: Tracker) -> float | None:
    """Return the least place at which a sweep shows no peak that counts; None if every one shows some."""
    empty = [look.z for look in inner.looks if look.branch.reached and not look.peaks]
    if not empty:
        return None
    ends = [line.high for line in inner.lines if line.high < empty[0]]
    nearer = max(ends, default=inner.scale.low) + BEYOND * inner.scale.span
    if nearer < empty[0]:
        look = inner.look(nearer)
        if look.branch.reached and not look.peaks:
            return nearer
    return empty[0]


def _width(branch: Branch) -> float:
    """Return the width of the resonance band [Hz]; 0 without one."""
    return 0.0 if branch.band is None else float(branch.band.width)


def _least_band(tracker: Tracker, low: float, high: float) -> float:
    """Return where the band is narrowest, as far as a few sweeps and a search between them tell."""
    known: dict[float, float] = {}

    def width(z: float) -> float:
        if z not in known:
            known[z] = _width(tracker.look(z).branch)
        return known[z]

    places = [float(z) for z in np.linspace(low, high, _BANDS)]
    at = int(np.argmin([width(z) for z in places]))
    bounds = places[max(at - 1, 0)], places[min(at + 1, _BANDS - 1)]
    least_between(lambda z: z, width, *bounds, _NEAR, _BANDS, 0.0)
    least = min(known.values())
    return min(z for z, found in known.items() if found <= least * (1.0 + CONSTANT))


def all_level(tracker: Tracker, look: Look) -> bool:
    """Return whether no peak of a look worth counting depends on the parameter, by following all of them."""
    tracker.follow(look, WORTH)
    span = tracker.scale.span
    return all(
        line.low == tracker.scale.low
        and line.high == tracker.scale.high
        and bool((np.abs(line.rows[:, DHEIGHT]) * span <= LEVEL * line.rows[:, HEIGHT]).all())
        for line in tracker.lines
    )
