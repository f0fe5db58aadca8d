"""The worst mistuning of a disk within bounds, and what intentional patterns make of it.

In a linear limit, all contacts stuck or all open, it is climbed to from many starts. With the contacts solved
the worst patterns of both limits are where the climb with exact gradients of the solved peak begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

import numpy as np

from solver.arrays import Real
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.response.plausibility import band_end_at
from solver.results.known import notes_of_all
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.scene import Scene
from solver.studies.blades import blade_rows, mistuned
from solver.studies.mistuning import without_mistuning
from stickslip.lab.worst_mistuning.bounds import martel, power_bound, whitehead
from stickslip.lab.worst_mistuning.climbing import (
    LARGEST,
    Bounds,
    WorstPattern,
    WorstSearch,
    alike,
    worst_patterns,
)
from stickslip.lab.worst_mistuning.intentional import IntentionalMistuning
from stickslip.lab.worst_mistuning.linear_disk import (
    TWO_PI,
    Contacts,
    DiskPeak,
    LinearDisk,
    linear_disk,
    with_factors,
)
from stickslip.lab.worst_mistuning.residual_peaks import ResidualSearch
from stickslip.lab.worst_mistuning.solved_disk import SolvedDisk, UnknownPeakError
from stickslip.lab.worst_mistuning.tuned_modes import TunedModes, reduced, tuned_modes
from stickslip.lab.worst_mistuning.worst_result import (
    IntentionalPattern,
    PatternPeak,
    ResidualPeak,
    WorstMistuning,
    WorstMistuningStatus,
)

_NO_PATTERNS, _SEARCH = IntentionalMistuning(), WorstSearch()
_SOLVED = (Contacts.SOLVED, Contacts.RESIDUAL)
_APART = 0.05  # of the bounds, by which two patterns to begin with differ
_CANDIDATES = 2  # worst patterns of each linear limit that are solved
_FEWER = 3  # of the climbs, that part is made on top of each intentional pattern


@shows_progress("worst mistuning")
def worst_mistuning(
    scene: Scene, *, of: str | Sequence[str], within: float = 0.02, rms: float | None = None,
    contacts: str | Contacts = Contacts.SOLVED.value, intentional: IntentionalMistuning = _NO_PATTERNS,
    search: WorstSearch = _SEARCH, start: float | None = None, stop: float | None = None,
    dof: str | None = None, harmonics: int = 11, on_progress: OnProgress = None,
    should_stop: ShouldStop = None,
) -> WorstMistuning:  # fmt: skip
    """Find the factors of the blades within bounds that make the highest peak of any blade largest.

    Parameters
    ----------
    scene : a cyclic scene; mistuning that it has is left out.
    of : names of springs (k), dashpots (c) and masses, or DOFs (their mass), see `solver.mistuned`.
    within : largest deviation of a factor from 1.
    rms : largest root mean square of the deviations; none if left out.
    contacts : ``solved``, or in a linear limit all ``stuck`` or all ``open``, in which a disk takes seconds.
        A disk without contacts is linear. ``residual`` is ``solved`` with the worst forces besides that
        contacts which stick may hold, jointly with the factors.
    intentional : patterns of blade types that are compared.
    search : how many climbs are made.
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
    begun = clock()
    names, how = (of,) if isinstance(of, str) else tuple(of), _contacts(scene, contacts)
    blades = check_bounds(scene, within, rms, intentional)
    dof = scene.observe.dof.partition("@")[0] if dof is None else dof
    band = _band(scene, start, stop)
    mistuned(scene, of=names, values=[1.0] * len(blades))  # refuses what is not there
    blade_rows(scene, dof)
    searched = DiskSearch(
        scene=without_mistuning(scene), of=names, band=band, dof=dof, within=within, rms=rms, asked=search,
        intentional=intentional.deviations(len(blades)), worst_of_patterns=intentional.worst_of_patterns,
        on_progress=on_progress, should_stop=should_stop,
    )  # fmt: skip
    if how in _SOLVED:
        disk = SolvedDisk(searched.scene, names, dof, band, harmonics, should_stop)
        if how is Contacts.RESIDUAL and not disk.differentiable:
            raise SettingError("contacts", how.value, "needs a structure of named parts: matrices have none")
        found = _solved(searched, disk)
        if how is Contacts.RESIDUAL and found["worst"] is not None:
            found["residual"] = _with_forces(ResidualSearch(disk, searched.go_on), searched, found)
    else:
        found = _linear(searched, how)
    if on_progress is not None and not searched.stopped:
        on_progress(1.0, searched.done)
    places = [found["tuned_at_hz"], *([] if found["worst"] is None else [found["worst"].at_hz])]
    return WorstMistuning(
        scene=scene.name, dof=dof, measured=replace(scene.measured, dof=dof), of=names, within=within,
        rms=rms, detuning=intentional.detuning,
        contacts=how.value, whitehead=whitehead(len(blades)), starts=search.starts,
        climbs=search.climbs if how in _SOLVED else 0, n_harmonics=harmonics, **found,
        notes=notes_of_all(band_end_at(searched.scene, at, band) for at in places),
        seconds=clock() - begun,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearLimit:
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
class DiskSearch:
    """A disk whose worst pattern is searched for, who watches, and what came of it so far."""

    scene: Scene
    of: tuple[str, ...]
    band: tuple[float, float]
    dof: str
    within: float
    rms: float | None
    asked: WorstSearch
    intentional: Annotated[dict[str, Real], "Deviations of the patterns."]
    worst_of_patterns: bool
    steps: Annotated[float, "All that will be done, in climbs."] = 1.0
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

    def disk(self, contacts: Contacts) -> LinearDisk:
        """Return the disk in a linear limit."""
        return linear_disk(self.scene, self.of, contacts, self.band, self.dof)

    def limit(self, contacts: Contacts) -> LinearLimit | None:
        """Return a linear limit; None where its disk does not move, or has a resonance without damping."""
        whole = self.disk(contacts)
        if whole.undamped:
            return None
        modes, nothing = tuned_modes(whole), np.zeros(whole.sectors)
        if not np.any(whole.amplitudes(nothing, whole.band[0])):
            return None
        searched = reduced(whole, modes)
        near = searched.peak(nothing)
        found = LinearLimit(
            whole=whole, searched=searched, modes=modes, tuned=near,
            of_pattern=partial(with_factors, whole, self.scene, self.of, contacts),
        )  # fmt: skip
        return replace(found, tuned=found.exact(nothing, near))

    def worst(self, limit: LinearLimit, middle: Real, starts: int) -> list[WorstPattern]:
        """Return the patterns that climbs end at, worst first."""
        return worst_patterns(
            limit.searched, self.around(middle), starts, self.asked.seed, self.go_on,
            list(self.intentional.values()),
        )  # fmt: skip

    def around(self, middle: Real) -> Bounds:
        """Return the bounds of the deviations around a pattern."""
        return Bounds(middle=middle, within=self.within, rms=self.rms)


def _linear(search: DiskSearch, how: Contacts) -> dict[str, Any]:
    """Return what is found in a linear limit."""
    starts, count = search.asked.starts, len(search.intentional)
    search.steps = starts + count * (1 + search.worst_of_patterns * (starts // _FEWER))
    limit = search.limit(how)
    if limit is None:
        return _nothing(undamped=search.disk(how).undamped)
    N, tuned = limit.whole.sectors, limit.tuned
    climbs = search.worst(limit, np.zeros(N), starts)

    def told(one: WorstPattern) -> PatternPeak:
        return _told(one.delta, limit.exact(one.delta, one.peak), tuned)

    def beneath(delta: Real) -> PatternPeak | None:
        on_top = search.worst(limit, delta, max(starts // _FEWER, 1))
        return told(on_top[0]) if on_top else None

    worst = told(climbs[0]) if climbs else None
    ranked = []
    for name, delta in search.intentional.items():
        if search.go_on():
            alone = told(WorstPattern(delta=delta, peak=limit.searched.peak(delta)))
            on_top = beneath(delta) if search.worst_of_patterns else None
            ranked.append(IntentionalPattern(pattern=name, disk=alone, worst=on_top))
    return {
        "tuned_peak": tuned.value, "tuned_at_hz": tuned.omega / TWO_PI, "worst": worst,
        "alike": alike(climbs), "patterns": tuple(sorted(ranked, key=lambda one: one.counts)),
        "martel": martel(limit.whole, limit.modes, tuned.omega),
        "power_bound": power_bound(limit.whole, TWO_PI * worst.at_hz, tuned.value) if worst else math.nan,
        "status": WorstMistuningStatus.STOPPED if search.stopped else WorstMistuningStatus.COMPLETED,
    }  # fmt: skip


def _solved(search: DiskSearch, disk: SolvedDisk) -> dict[str, Any]:
    """Return what is found with the contacts solved."""
    nothing = np.zeros(search.scene.structure.sector_count)
    limits = [one for how in disk.linear_limits if (one := search.limit(how)) is not None]
    asked, count = search.asked, len(search.intentional)
    each = asked.climbs * asked.climb + 1 + _CANDIDATES * len(limits) + count
    on_top = search.worst_of_patterns * count * (each + len(limits) * (asked.starts // _FEWER))
    search.steps = len(limits) * asked.starts + each + 1 + count + on_top
    try:
        tuned = disk.peak(nothing)
    except UnknownPeakError as unknown:
        return _nothing(undamped=unknown.undamped) | (
            {} if search.go_on() else {"status": WorstMistuningStatus.STOPPED}
        )
    if not tuned.value > 0.0:
        return _nothing()
    known = True

    def told(delta: Real) -> PatternPeak:
        return _told(delta, disk.peak(delta), tuned)

    def worst_around(middle: Real, starts: int) -> PatternPeak | None:
        nonlocal known
        bounds = search.around(middle)
        begins = [middle, *filter(bounds.hold, search.intentional.values())]
        begins += [delta for limit in limits for delta in _apart(search, limit, middle, starts)]
        rng = np.random.default_rng(asked.seed)
        drawn = [bounds.drawn(rng) for _ in range(asked.climbs // 2)]
        found = disk.climbed(begins, drawn, bounds, asked, search.go_on)
        known = known and found.known
        if middle is nothing:
            search.alike = found.alike
        return None if found.worst is None else told(found.worst)

    worst = worst_around(nothing, asked.starts)
    ranked = []
    for name, delta in search.intentional.items():
        if not search.go_on():
            break
        try:
            alone = told(delta)
        except UnknownPeakError:
            known = False
            continue
        more = worst_around(delta, max(asked.starts // _FEWER, 1)) if search.worst_of_patterns else None
        ranked.append(IntentionalPattern(pattern=name, disk=alone, worst=more))
    status = WorstMistuningStatus.COMPLETED if known else WorstMistuningStatus.INCOMPLETE
    return {
        "tuned_peak": tuned.value, "tuned_at_hz": tuned.omega / TWO_PI, "worst": worst, "alike": search.alike,
        "climbed": disk.responses, "patterns": tuple(sorted(ranked, key=lambda one: one.counts)),
        "status": WorstMistuningStatus.STOPPED if search.stopped else status,
    }  # fmt: skip


def _with_forces(residual: ResidualSearch, search: DiskSearch, found: dict[str, Any]) -> ResidualPeak | None:
    """Return the worst with forces left in contacts that stick, from the tuned disk and the worst pattern."""
    nothing, worst = np.zeros(search.scene.structure.sector_count), found["worst"]
    bounds, rng = search.around(nothing), np.random.default_rng(search.asked.seed)
    begins = [(nothing, found["tuned_at_hz"]), (np.array(worst.factors) - 1.0, worst.at_hz)]
    begins += [(bounds.drawn(rng), found["tuned_at_hz"]) for _ in range(search.asked.climbs)]
    return residual.worst(begins, bounds, found["tuned_peak"])


def _apart(search: DiskSearch, limit: LinearLimit, middle: Real, starts: int) -> list[Real]:
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


def _nothing(*, undamped: bool = False) -> dict[str, Any]:
    return {
        "tuned_peak": math.nan, "tuned_at_hz": math.nan, "worst": None, "alike": 0,
        "status": WorstMistuningStatus.UNDAMPED if undamped else WorstMistuningStatus.NO_RESPONSE,
    }  # fmt: skip


def _contacts(scene: Scene, contacts: str | Contacts) -> Contacts:
    known = [one.value for one in Contacts]
    if contacts not in known and not isinstance(contacts, Contacts):
        raise SettingError("contacts", contacts, f"must be one of {', '.join(known)}")
    found = Contacts(contacts)
    harmonics = {force.harmonic for force in scene.excitation}
    plain = not scene.contacts and len(harmonics) == 1 and 0 not in harmonics
    return Contacts.OPEN if found in _SOLVED and plain else found


def _band(scene: Scene, start: float | None, stop: float | None) -> tuple[float, float]:
    low, high = scene.observe.band
    for key, value in (("start", start), ("stop", stop)):
        if value is not None and not 0.0 < value <= 1e9:
            raise SettingError(key, value, "must be a number > 0 and <= 1e9 [Hz]")
    low, high = low if start is None else start, high if stop is None else stop
    if not low < high:
        raise SettingError("stop", high, f"must be above the start, {low:g} Hz")
    return low, high


def check_bounds(scene: Scene, within: float, rms: float | None, intentional: IntentionalMistuning) -> range:
    """Return the sectors of a disk; SettingError if it is none, or for bounds or patterns that cannot be."""
    if not scene.structure.has_sectors:
        raise SettingError("scene", scene.name, "must have a cyclic structure to be mistuned")
    for key, value in (("within", within), *(() if rms is None else (("rms", rms),))):
        if not 0.0 < value <= LARGEST:
            raise SettingError(key, value, f"must be a number > 0 and <= {LARGEST}")
    blades = range(scene.structure.sector_count)
    intentional.check(len(blades), within)
    return blades
