"""How a branch is followed: settings of the continuation, all with defaults that serve."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from solver.continuation.kernels import walk_state as walk_states


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
    peaks : bool
        Whether peaks and the band are looked for between the points; without them the branch has none.
    unfinished_peaks : bool
        Whether they are on a branch that does not reach its end, too.
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
    peaks: bool = True
    unfinished_peaks: bool = True
    errors: bool = True
