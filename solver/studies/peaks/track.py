"""Followed peaks and sweeps as data: lines over a parameter, looks at one value of it, how close to follow.

Between its rows a line is the cubic through exact values and slopes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.balance.workspace import Workspace
from solver.continuation.branch import Branch, Peak
from solver.continuation.branches.sweep import sweep, walk_branch
from solver.continuation.extrema.extrema import Rival, crests
from solver.continuation.stretches import Course, Stretch
from solver.continuation.walk import ContinuationSettings, Pace
from solver.jit.fourier import Integer
from solver.scene.scene import Scene
from solver.studies.peaks.track_results import TrackStatus
from solver.studies.peaks.work_limit import Allowance, HaltedError


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingPace:
    """How closely peaks are followed."""

    steps: Annotated[Pace, "Shares of the range; the error of each says how long the next is."]
    height_error: Annotated[float, "Relative error of the trapezoidal rule allowed in a step."]
    omega_error: Annotated[float, "Likewise."]
    above: Annotated[
        float,
        "Where a line is higher than this times the least highest peak of a sweep so far, it only has to "
        "show that it is; infinity: it is followed closely everywhere.",
    ]
    slack: Annotated[float, "Share of what it is higher by that its height may be wrong by then."]
    climb_from: Annotated[
        float,
        "Share of the range: step at which a peak that Newton's method does not find is looked for uphill.",
    ]


EVERYWHERE = TrackingPace(
    steps=Pace(first=0.02, least=1e-4, largest=0.125), height_error=3e-3, omega_error=1e-3, above=math.inf,
    slack=0.0, climb_from=math.inf,
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Glance:
    """One walk over the band at one z with fewer harmonics, its peaks as near as its points are."""

    z: Annotated[float, "Where."]
    crests: Annotated[tuple[Rival, ...], "Peaks of max|x|, highest first."]
    ks: Annotated[Integer, "The harmonics kept."]
    iterations: Annotated[int, "Newton iterations spent."]


def glance_at(
    z: float, scene: Scene, harmonics: int, effects: Effects | None, check: Callable[[], None]
) -> Glance:
    """Walk over the band of a scene; of a walk that does not reach its end the peaks met are returned.

    Parameters
    ----------
    z : what the scene stands for.
    check : called between stretches of the walk; it may raise to end it.
    """
    balance = build(scene, "frequency", harmonics=harmonics, frequency_hz=None, effects=effects)
    low, high = scene.observe.band
    stretches = []
    for stretch in walk_branch(Workspace.of(balance), low, high, ContinuationSettings()):
        stretches.append(stretch)
        check()
    return Glance(
        z=z,
        crests=tuple(
            crests(
                np.concatenate([stretch.solutions for stretch in stretches]),
                np.concatenate([stretch.measures for stretch in stretches]),
            )
        ),
        ks=balance.system.ks,
        iterations=stretches[-1].newton_iterations,
    )


class _TooLongError(Exception):
    """A sweep takes far longer than those before."""


def sweep_within(scene: Scene, harmonics: int, effects: Effects | None, allowance: Allowance) -> Branch:
    """Sweep over a band; HaltedError if the caller wants it to end. What takes far too long is given up.

    Of that one a beginning without peaks is returned, with all its Newton iterations: to look for peaks
    among its many points would cost several times what it has cost already.
    """
    spent = 0

    def watch(stretch: Stretch) -> None:
        nonlocal spent
        spent = stretch.newton_iterations

    def stop() -> bool:
        if allowance.due():
            raise HaltedError(TrackStatus.STOPPED)
        if spent > allowance.longest:
            raise _TooLongError
        return False

    try:
        return sweep(
            scene, harmonics=harmonics, effects=effects, course=Course(on_stretch=watch), should_stop=stop
        )
    except _TooLongError:
        settings = ContinuationSettings(peaks=False)
        begun = sweep(
            scene, harmonics=harmonics, effects=effects, settings=settings, should_stop=lambda: True
        )
        return replace(begun, newton_iterations=spent)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """One sweep over the band at one z; surprising if it found what no line had reached."""

    z: float
    branch: Branch
    surprising: bool
    peaks: Annotated[tuple[Peak, ...], "Those of the branch that count, highest first."]

    @property
    def top(self) -> float:
        """The highest peak [m]; −inf if there is none."""
        return self.peaks[0].value if self.peaks else -math.inf

    @property
    def seen(self) -> bool:
        """Whether the whole band was seen."""
        return self.branch.reached and bool(self.peaks)
