"""A search for the worst pattern of a disk as it goes on, and the linear limits that it is searched in."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from solver.arrays import Real
from solver.results.watch import OnProgress, ShouldStop
from solver.scene.scene import Scene
from solver.studies.patterns.climbing import Bounds, WorstPattern, WorstSearch, worst_patterns
from solver.studies.patterns.linear_disk import Contacts, DiskPeak, LinearDisk, linear_disk, with_factors
from solver.studies.patterns.tuned_modes import TunedModes, reduced, tuned_modes


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

    def limit(self, contacts: Contacts) -> LinearLimit | None:
        """Return a linear limit; None where its disk does not move."""
        whole = linear_disk(self.scene, self.of, contacts, self.band, self.dof)
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
