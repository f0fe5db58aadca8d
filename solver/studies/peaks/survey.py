"""The responses of one scene over one parameter that were computed, and the work that went into them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.continuation.branch import Branch, Peak
from solver.continuation.parameter_scale import scale_of
from solver.jit.fourier import Real
from solver.scene.scene import Scene
from solver.studies.peaks.seeds import Line
from solver.studies.peaks.track import Glance, Look, TrackingPace, glance_at, sweep_within
from solver.studies.peaks.track_results import TrackStatus
from solver.studies.peaks.work_limit import Allowance, HaltedError

SAME = (
    1e-3  # relative distance, in height and a fifth of it in frequency, within which two peaks are the same
)
FEWEST = 3  # harmonics of a glance
Counting = Callable[[Branch], tuple[Peak, ...]]
OnLook = Callable[[float, Branch], None] | None


def all_peaks(branch: Branch) -> tuple[Peak, ...]:
    """Return all peaks of a branch, highest first."""
    return branch.peaks


class Looking(ABC):
    """Sweeps over the band at values of one parameter; the lines are added by
    `solver.studies.peaks.tracker.Tracker`."""

    def __init__(
        self, scene: Scene, parameter: str, start: float, stop: float, harmonics: int,
        effects: Effects | None, pace: TrackingPace, allowance: Allowance | None = None,
    ) -> None:  # fmt: skip
        self.scale = scale_of(scene, parameter, start, stop)
        self.balance = build(
            scene, parameter, harmonics=harmonics, frequency_hz=scene.observe.band[0], effects=effects
        )
        self.lines: list[Line] = []
        self.looks: list[Look] = []
        self.glances: list[Glance] = []
        self.allowance = allowance or Allowance(None)
        self.on_look: OnLook = None
        self._effects, self._pace = effects, pace
        self._scene, self._harmonics = self.balance.scene, harmonics
        self._counting: Counting = all_peaks
        self._parts: list[Self] = []  # of the range
        self._lent = 0  # looks taken over from the whole range

    @property
    @abstractmethod
    def spent(self) -> int:
        """Evaluations of the balance in following peaks so far."""

    def envelope(self, z: Real) -> Real:
        """Return the height of the highest line; −inf where there is none."""
        heights = [line.heights(z) for line in self.lines]
        return np.max(heights, axis=0) if heights else np.full(z.size, -np.inf)

    def within(self, low: float, high: float, counting: Counting, looks: Sequence[Look]) -> Self:
        """Return the same for a part of the range, and for some of the peaks only.

        Parameters
        ----------
        low, high : values of the parameter in user units.
        counting : the peaks of a branch that count, highest first.
        looks : of these, to be taken over.
        """
        part = type(self)(
            self._scene, self.balance.parameter.path, low, high, self._harmonics, self._effects, self._pace,
            self.allowance,
        )  # fmt: skip
        part._counting, part._lent = counting, len(looks)
        for look in looks:
            z = min(max(part.scale.inside(self.scale.outside(look.z)), part.scale.low), part.scale.high)
            part.looks.append(replace(look, z=z, surprising=False, peaks=counting(look.branch)))
        self._parts.append(part)
        return part

    @property
    def sweeps(self) -> int:
        """How many responses were computed, those with fewer harmonics included."""
        mine = len(self.looks) - self._lent + len(self.glances)
        return mine + sum(part.sweeps for part in self._parts)

    @property
    def work(self) -> int:
        """Newton iterations of everything so far."""
        swept = sum(look.branch.newton_iterations for look in self.looks[self._lent :])
        swept += sum(glance.iterations for glance in self.glances)
        return swept + self.spent + sum(part.work for part in self._parts)

    def ask(self) -> None:
        """Raise HaltedError if the caller wants it to end."""
        if self.allowance.ask():
            raise HaltedError(TrackStatus.STOPPED)

    def check(self) -> None:
        """Raise HaltedError if the caller wants it to end, or the work allowed is used up."""
        self.allowance.check(self.work)

    def look(self, z: float) -> Look:
        """Sweep at z; one that takes far longer than those before is given up. Raises as `check`."""
        self.check()
        scene = self._scene.with_values({self.balance.parameter.path: self.scale.outside(z)})
        branch = sweep_within(scene, self._harmonics, self._effects, self.allowance)
        peaks = self._counting(branch)
        top = peaks[0].value if peaks else -math.inf
        higher = bool(self.lines) and top > float(self.envelope(np.array([z]))[0]) * (1.0 + SAME)
        look = Look(z=z, branch=branch, surprising=higher, peaks=peaks)
        self.looks.append(look)
        if self.on_look is not None and look.seen:
            self.on_look(self.scale.outside(z), branch)
        self.allowance.measure([one.branch.newton_iterations for one in self.looks])
        return look

    def glance(self, z: float) -> Glance:
        """Look at z with fewer harmonics, in which peaks lie nearly where they are."""
        path, fewer = self.balance.parameter.path, max(FEWEST, self._harmonics // 2)
        scene = self._scene.with_values({path: self.scale.outside(z)})
        glance = glance_at(z, scene, min(fewer, self._harmonics), self._effects, self.check)
        self.glances.append(glance)
        return glance
