"""The one loop that follows curves: a step is tried, taken or tried again shorter, and its size is adapted.

A curve is a response over a parameter, a nonlinear mode over its amplitude, a held amplitude over the
frequency, a peak over what it is tracked in. Each says in `Curve` how it predicts and corrects a step, by
what measure it takes one, and how it passes what no step is short enough for; the loop is the same
(E. L. Allgower, K. Georg, *Introduction to Numerical Continuation Methods*, SIAM 2003,
doi:10.1137/1.9780898719154). Where a point costs microseconds the steps of a stretch of the curve are
compiled (`solver.continuation.kernels.pseudo_arclength`): the loop then takes stretches, and adapts how many
points they have.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Annotated, Protocol, TypeVar

from solver.continuation.kernels import walk_state as walk_states

_Point = TypeVar("_Point", covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """How long steps are: they grow behind an easy point, and shrink behind a hard one or where a try failed.

    What effort a point takes each curve says: Newton steps, or a distance from what was foreseen.
    """

    first: Annotated[float, "Step to begin with."]
    least: Annotated[float, "Below it a try that failed is not made again."]
    largest: Annotated[float, "No step is longer."] = math.inf
    grow: Annotated[float, "Factor behind an easy point."] = 2.0
    shrink: Annotated[float, "Factor where a try failed."] = 0.5
    easy: Annotated[float, "Effort up to which a point is easy."] = 0.0
    hard: Annotated[float, "Effort from which it is hard, and the next step is half as long."] = math.inf

    def after(self, size: float, effort: float = 0.0) -> float:
        """Return the step behind a point that took such an effort."""
        if effort >= self.hard:
            return max(0.5 * size, self.least)
        return min(size * (self.grow if effort <= self.easy else 1.0), self.largest)

    def shorter(self, size: float, least: float = 0.0) -> float:
        """Return the step to try next where one failed that should not become shorter than a least one."""
        return max(self.shrink * size, least)

    def times(self, length: float) -> Pace:
        """Return the same of steps that are shares of a length."""
        ends = self.first * length, self.least * length, self.largest * length
        return replace(self, first=ends[0], least=ends[1], largest=ends[2])


class Curve(Protocol[_Point]):
    """What is followed, as it stands at its last point."""

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""

    def tried(self, size: float) -> tuple[_Point | None, float]:
        """Try a step; return the point behind it, None if it was not taken, and the size of the next try."""

    def leapt(self) -> tuple[_Point | None, float]:
        """Pass what no step is short enough for; return as `tried` does, None if the curve is lost there."""
        return None, 0.0


def walk(curve: Curve[_Point], pace: Pace) -> Iterator[_Point]:
    """Yield the points of a curve behind the one where it stands; whoever takes them may leave."""
    size = pace.first
    while not curve.ended:
        point, size = curve.tried(size)
        if point is None and size < pace.least:
            point, size = curve.leapt()
            if point is None:
                return
        if point is not None:
            yield point


class Predictor(IntEnum):
    """How the next point is guessed."""

    TANGENT = walk_states.TANGENT
    SECANT = walk_states.SECANT
    CUBIC = walk_states.CUBIC


@dataclass(frozen=True, slots=True, kw_only=True)
class ContinuationSettings:
    """Settings of a continuation; arc length is relative to the size of u and to a share of the range of λ.

    Attributes
    ----------
    predictor : Predictor
        How the next point is guessed.
    first_step, largest_step, smallest_step : float
        Arc length steps; the largest is 2.5 times this from 1000 unknowns on, where a point is dear, and
        so is the first where fewer motions lead those of the contacts.
    range_length : float
        Arc length of the whole range of λ if u did not change: more gives a finer branch.
    wanted_iterations : int
        Newton iterations of a step that is neither lengthened nor shortened.
    most_iterations : int
        Newton iterations after which a step is halved.
    largest_turn : float
        Distance from predicted to corrected point, relative to the step, beyond which a step is halved.
    most_points : int
        Points after which the branch ends with a status.
    highest : float
        Amplitude [m] of a point behind which the branch ends: it is compared with less.
    peaks : bool
        Whether peaks and the band are looked for between the points; without them the branch has none.
    unfinished_peaks : bool
        Whether they are on a branch that does not reach its end, too.
    competes : float
        Share of the highest point below which no peak is looked for, unless the limit of the band is lower.
    errors : bool
        Whether the error of the highest peak is estimated;
        `solver.continuation.branches.sweep.with_error` does it later if not.
    """

    predictor: Predictor = Predictor.CUBIC
    first_step: float = 0.02
    largest_step: float = 0.2
    smallest_step: float = 1e-8
    range_length: float = 14.0
    wanted_iterations: int = 6
    most_iterations: int = 8
    largest_turn: float = 1.0
    most_points: int = 20_000
    highest: float = math.inf
    peaks: bool = True
    unfinished_peaks: bool = True
    competes: float = 0.0
    errors: bool = True

    @property
    def pace(self) -> Pace:
        """Its steps; a point that takes more Newton iterations than are wanted is not easy."""
        return Pace(
            first=self.first_step, least=self.smallest_step, largest=self.largest_step,
            easy=self.wanted_iterations, hard=self.most_iterations,
        )  # fmt: skip
