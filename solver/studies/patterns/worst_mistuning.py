"""The worst mistuning of a disk within bounds, and what intentional patterns make of it.

In a linear limit, all contacts stuck or all open, it is climbed to from many starts. With the contacts solved
the worst patterns of both limits are where the climb with exact gradients of the solved peak begins.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from solver.arrays import Real
from solver.errors import SettingError
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene
from solver.studies.blades import blade_rows, mistuned
from solver.studies.mistuning import without_mistuning
from solver.studies.patterns.bounds import martel, power_bound, whitehead
from solver.studies.patterns.climbing import Bounds, WorstPattern, alike, worst_patterns
from solver.studies.patterns.linear_disk import (
    TWO_PI,
    Contacts,
    DiskPeak,
    LinearDisk,
    linear_disk,
    with_factors,
)
from solver.studies.patterns.solved_disk import Climb, SolvedDisk, UnknownPeakError
from solver.studies.patterns.tuned_modes import TunedModes, reduced, tuned_modes
from solver.studies.patterns.worst_result import (
    IntentionalPattern,
    PatternPeak,
    WorstMistuning,
    WorstMistuningStatus,
)

LARGEST = 0.9  # deviation of a factor
MOST_STARTS = 100_000
LETTERS = re.compile(r"[A-Z]+")
_APART = 0.05  # of the bounds, by which two patterns to begin with differ
_CANDIDATES = 2  # worst patterns of each linear limit that are solved
_FEWER = 3  # of the climbs, that part is made on top of each intentional pattern


@dataclass(frozen=True, slots=True, kw_only=True)
class _Limit:
    """A linear limit of a disk: in all coordinates, and as it is searched."""

    whole: LinearDisk
    searched: LinearDisk
    modes: TunedModes
    tuned: DiskPeak

    of_pattern: Callable[[Real], LinearDisk]

    def exact(self, delta: Real, found: DiskPeak) -> DiskPeak:
        """Return the peak of a pattern in all coordinates, found in those that are searched."""
        if self.searched is self.whole and not self.whole.modal_damping:
            return found
        omega, value, _ = self.of_pattern(delta).summit(np.zeros(delta.size), found.blade, found.omega)
        return DiskPeak(value=math.exp(value), blade=found.blade, omega=omega)


@dataclass(slots=True, kw_only=True)
class _Search:
    """What is asked, who watches, and what came of it so far."""

    scene: Scene
    of: tuple[str, ...]
    band: tuple[float, float]
    dof: str
    within: float
    rms: float | None
    starts: int
    seed: int
    patterns: Annotated[dict[str, Real], "Deviations of the intentional ones."]
    steps: Annotated[float, "All that will be done, in climbs."]
    on_progress: OnProgress
    should_stop: ShouldStop
    done: int = 0
    stopped: bool = False
    alike: int = 0

    def go_on(self) -> bool:
        """Count a step; return whether to go on."""
        self.stopped = self.stopped or (self.should_stop is not None and self.should_stop())
        if self.on_progress is not None and not self.stopped:
            self.on_progress(min(self.done / self.steps, 1.0), self.done)
        self.done += 1
        return not self.stopped

    def limit(self, contacts: Contacts) -> _Limit | None:
        """Return a linear limit; None where its disk does not move."""
        whole = linear_disk(self.scene, self.of, contacts, self.band, self.dof)
        modes, nothing = tuned_modes(whole), np.zeros(whole.sectors)
        if not np.any(whole.amplitudes(nothing, whole.band[0])):
            return None
        searched = reduced(whole, modes)
        near = searched.peak(nothing)
        found = _Limit(
            whole=whole, searched=searched, modes=modes, tuned=near,
            of_pattern=partial(with_factors, whole, self.scene, self.of, contacts),
        )  # fmt: skip
        return replace(found, tuned=found.exact(nothing, near))

    def worst(self, limit: _Limit, middle: Real, starts: int) -> list[WorstPattern]:
        """Return the patterns that climbs end at, worst first."""
        return worst_patterns(
            limit.searched, self.around(middle), starts, self.seed, self.go_on, list(self.patterns.values())
        )

    def around(self, middle: Real) -> Bounds:
        """Return the bounds of the deviations around a pattern."""
        return Bounds(middle=middle, within=self.within, rms=self.rms)


@shows_progress("worst mistuning")
def worst_mistuning(
    scene: Scene,
    *,
    of: str | Sequence[str],
    within: float = 0.02,
    rms: float | None = None,
    contacts: str | Contacts = Contacts.SOLVED.value,
    patterns: Sequence[str] = (),
    detuning: float = 0.02,
    worst_of_patterns: bool = False,
    starts: int = 60,
    climbs: int = 4,
    climb: int = 30,
    seed: int = 1,
    start: float | None = None,
    stop: float | None = None,
    dof: str | None = None,
    harmonics: int = 11,
    on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> WorstMistuning:
    """Find the factors of the blades within bounds that make the highest peak of any blade largest.

    Parameters
    ----------
    scene : a cyclic scene; mistuning that it has is left out.
    of : names of springs (k), dashpots (c) and masses, or DOFs (their mass), see `solver.mistuned`.
    within : largest deviation of a factor from 1.
    rms : largest root mean square of the deviations; none if left out.
    contacts : ``solved``, or in a linear limit all ``stuck`` or all ``open``, in which a disk takes seconds.
        A disk without contacts is linear.
    patterns : intentional ones, a letter for each blade type, repeated round the disk: AB, ABB, AABB.
    detuning : deviation of the factor of type A, and negative of the last type; others lie evenly between.
    worst_of_patterns : find the worst mistuning on top of each pattern too, and rank by that.
    starts : climbs in each linear limit.
    climbs : with the contacts solved: half of them from the worst patterns of the linear limits and those of
        `patterns` that the bounds hold, the others from drawn ones.
    climb : responses computed on each of these, at most.
    seed : of the starts that are drawn.
    start, stop : frequencies [Hz], the scene's band if left out.
    dof : name of the DOF in one sector; the observed one if left out.
    harmonics : highest harmonic kept with the contacts solved.
    on_progress : called with (share done, climbs and responses so far).
    should_stop : asked between them.

    Returns
    -------
    The worst pattern found, with the bounds beside it: a search from many starts, so the worst is no less.

    Raises
    ------
    SettingError, SceneError
        The scene is not cyclic, a part or DOF it does not have, bounds that let a factor become 0, forces of
        several harmonics or a base that moves in a linear limit.
    """
    begun = time.perf_counter()
    names = (of,) if isinstance(of, str) else tuple(of)
    how = _contacts(scene, contacts)
    blades = check_bounds(scene, within, rms, detuning, patterns, starts, climbs, climb)
    band = _band(scene, start, stop)
    dof = scene.observe.dof.partition("@")[0] if dof is None else dof
    mistuned(scene, of=names, values=[1.0] * len(blades))  # refuses what is not there
    blade_rows(scene, dof)
    search = _Search(
        scene=without_mistuning(scene), of=names, band=band, dof=dof, within=within, rms=rms, starts=starts,
        seed=seed, patterns={name: pattern_deviations(name, len(blades), detuning) for name in patterns},
        steps=1.0, on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    told = {
        "scene": scene.name, "dof": dof, "of": names, "within": within, "rms": rms, "detuning": detuning,
        "contacts": how.value, "whitehead": whitehead(len(blades)), "starts": starts,
        "climbs": climbs if how is Contacts.SOLVED else 0,
        "n_harmonics": harmonics,
    }  # fmt: skip
    if how is Contacts.SOLVED:
        disk = SolvedDisk(search.scene, names, dof, band, harmonics, should_stop)
        found = _solved(search, disk, Climb(climbs=climbs, responses=climb), worst_of_patterns)
    else:
        found = _linear(search, how, worst_of_patterns)
    if on_progress is not None and not search.stopped:
        on_progress(1.0, search.done)
    return WorstMistuning(**told, **found, seconds=time.perf_counter() - begun)  # type: ignore[arg-type]


def _linear(search: _Search, how: Contacts, worst_of_patterns: bool) -> dict[str, object]:
    """Return what is found in a linear limit."""
    search.steps = search.starts + len(search.patterns) * (1 + worst_of_patterns * (search.starts // _FEWER))
    limit = search.limit(how)
    if limit is None:
        return _nothing()
    N, tuned = limit.whole.sectors, limit.tuned
    climbs = search.worst(limit, np.zeros(N), search.starts)

    def told(one: WorstPattern) -> PatternPeak:
        return _told(one.delta, limit.exact(one.delta, one.peak), tuned)

    def beneath(delta: Real) -> PatternPeak | None:
        on_top = search.worst(limit, delta, max(search.starts // _FEWER, 1))
        return told(on_top[0]) if on_top else None

    worst = told(climbs[0]) if climbs else None
    ranked = []
    for name, delta in search.patterns.items():
        if search.go_on():
            alone = told(WorstPattern(delta=delta, peak=limit.searched.peak(delta)))
            on_top = beneath(delta) if worst_of_patterns else None
            ranked.append(IntentionalPattern(pattern=name, disk=alone, worst=on_top))
    return {
        "tuned_peak": tuned.value, "tuned_at_hz": tuned.omega / TWO_PI, "worst": worst,
        "alike": alike(climbs), "patterns": tuple(sorted(ranked, key=lambda one: one.counts)),
        "martel": martel(limit.whole, limit.modes, tuned.omega),
        "power_bound": power_bound(limit.whole, TWO_PI * worst.at_hz, tuned.value) if worst else math.nan,
        "status": WorstMistuningStatus.STOPPED if search.stopped else WorstMistuningStatus.COMPLETED,
    }  # fmt: skip


def _solved(search: _Search, disk: SolvedDisk, climb: Climb, worst_of_patterns: bool) -> dict[str, object]:
    """Return what is found with the contacts solved."""
    nothing = np.zeros(search.scene.structure.sector_count)
    limits = [one for how in disk.linear_limits if (one := search.limit(how)) is not None]
    each = climb.climbs * climb.responses + 1 + _CANDIDATES * len(limits) + len(search.patterns)
    on_top = (
        len(search.patterns) * (each + len(limits) * (search.starts // _FEWER)) if worst_of_patterns else 0
    )
    search.steps = len(limits) * search.starts + each + 1 + len(search.patterns) + on_top
    try:
        tuned = disk.peak(nothing)
    except UnknownPeakError:
        return _nothing() | ({"status": WorstMistuningStatus.STOPPED} if not search.go_on() else {})
    if not tuned.value > 0.0:
        return _nothing()
    known = True

    def told(delta: Real) -> PatternPeak:
        return _told(delta, disk.peak(delta), tuned)

    def worst_around(middle: Real, starts: int) -> PatternPeak | None:
        nonlocal known
        bounds = search.around(middle)
        begins = [middle, *filter(bounds.hold, search.patterns.values())]
        begins += [delta for limit in limits for delta in _apart(search, limit, middle, starts)]
        rng = np.random.default_rng(search.seed)
        drawn = [bounds.drawn(rng) for _ in range(climb.climbs // 2)]
        found = disk.climbed(begins, drawn, bounds, climb, search.go_on)
        known = known and found.known
        if middle is nothing:
            search.alike = found.alike
        return None if found.worst is None else told(found.worst)

    worst = worst_around(nothing, search.starts)
    ranked = []
    for name, delta in search.patterns.items():
        if not search.go_on():
            break
        try:
            alone = told(delta)
        except UnknownPeakError:
            known = False
            continue
        more = worst_around(delta, max(search.starts // _FEWER, 1)) if worst_of_patterns else None
        ranked.append(IntentionalPattern(pattern=name, disk=alone, worst=more))
    status = WorstMistuningStatus.COMPLETED if known else WorstMistuningStatus.INCOMPLETE
    return {
        "tuned_peak": tuned.value, "tuned_at_hz": tuned.omega / TWO_PI, "worst": worst, "alike": search.alike,
        "climbed": disk.responses, "patterns": tuple(sorted(ranked, key=lambda one: one.counts)),
        "status": WorstMistuningStatus.STOPPED if search.stopped else status,
    }  # fmt: skip


def _apart(search: _Search, limit: _Limit, middle: Real, starts: int) -> list[Real]:
    """Return the worst patterns of a linear limit that differ from each other."""
    climbs = search.worst(limit, middle, starts)
    kept: list[Real] = []
    for one in climbs:
        if len(kept) < _CANDIDATES and all(
            np.abs(one.delta - other).max() > _APART * search.within for other in kept
        ):
            kept.append(one.delta)
    return kept


def _told(delta: Real, found: DiskPeak, tuned: DiskPeak) -> PatternPeak:
    return PatternPeak(
        factors=tuple((1.0 + delta).tolist()), magnification=found.value / tuned.value, peak=found.value,
        blade=found.blade, at_hz=found.omega / TWO_PI,
    )  # fmt: skip


def _nothing() -> dict[str, object]:
    return {
        "tuned_peak": math.nan, "tuned_at_hz": math.nan, "worst": None, "alike": 0,
        "status": WorstMistuningStatus.NO_RESPONSE,
    }  # fmt: skip


def _contacts(scene: Scene, contacts: str | Contacts) -> Contacts:
    known = [one.value for one in Contacts]
    if contacts not in known and not isinstance(contacts, Contacts):
        raise SettingError("contacts", contacts, f"must be one of {', '.join(known)}")
    found = Contacts(contacts)
    harmonics = {force.harmonic for force in scene.excitation}
    plain = not scene.contacts and len(harmonics) == 1 and 0 not in harmonics
    return Contacts.OPEN if found is Contacts.SOLVED and plain else found


def _band(scene: Scene, start: float | None, stop: float | None) -> tuple[float, float]:
    low, high = scene.observe.band
    for key, value in (("start", start), ("stop", stop)):
        if value is not None and not 0.0 < value <= 1e9:
            raise SettingError(key, value, "must be a number > 0 and <= 1e9 [Hz]")
    low, high = low if start is None else start, high if stop is None else stop
    if not low < high:
        raise SettingError("stop", high, f"must be above the start, {low:g} Hz")
    return low, high


def check_bounds(
    scene: Scene, within: float, rms: float | None, detuning: float, patterns: Sequence[str], starts: int,
    climbs: int, climb: int,
) -> range:  # fmt: skip
    """Return the sectors of a disk whose factors may be anywhere within bounds.

    Raises
    ------
    SettingError
        The scene is not cyclic, or bounds, patterns or counts that cannot be.
    """
    if not scene.structure.has_sectors:
        raise SettingError("scene", scene.name, "must have a cyclic structure to be mistuned")
    if not 0.0 < within <= LARGEST:
        raise SettingError("within", within, f"must be a number > 0 and <= {LARGEST}")
    if rms is not None and not 0.0 < rms <= LARGEST:
        raise SettingError("rms", rms, f"must be a number > 0 and <= {LARGEST}")
    if patterns and not 0.0 <= detuning <= LARGEST - within:
        wanted = f"must be a number from 0 to {LARGEST - within:g}, so that factors stay above 0"
        raise SettingError("detuning", detuning, wanted)
    blades = range(scene.structure.sector_count)
    for name in patterns:
        if not LETTERS.fullmatch(name) or len(name) > len(blades):
            wanted = f"must be capital letters, {len(blades)} at most, such as AB"
            raise SettingError("patterns", name, wanted)
    for key, value, least in (("starts", starts, 1), ("climbs", climbs, 0), ("climb", climb, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= MOST_STARTS:
            raise SettingError(key, value, f"must be a whole number from {least} to {MOST_STARTS}")
    return blades


def pattern_deviations(pattern: str, sectors: int, detuning: float) -> Real:
    """Return the deviations of the factors of all blades of a pattern, (sectors,).

    The first of its letters in the alphabet is a factor of 1 + detuning, the last 1 − detuning, those between
    lie evenly; the pattern is repeated and cut where the disk ends. Of one letter all are 1 + detuning.
    """
    types = sorted(set(pattern))
    deviations = dict(zip(types, np.linspace(detuning, -detuning, len(types)), strict=True))
    return np.array([deviations[pattern[j % len(pattern)]] for j in range(sectors)])
