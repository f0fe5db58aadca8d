"""All periodic responses that can be found at one frequency, with their stability and what history may leave.

`stickslip.lab.all_solutions.solution_search` looks for them. Nothing finds every solution for certain: the
list is complete only where the response is proven to be the only one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from solver.balance.balance import build
from solver.balance.simplifications import Effects
from solver.continuation.from_nothing import solve_from_nothing
from solver.errors import SettingError, check_count
from solver.jit.timer import clock
from solver.response.solution import Solution
from solver.response.solve import describe
from solver.response.stability import MOST_STARTS
from solver.response.stability.floquet import stability
from solver.response.stability.multipliers import Stability, verdict_of
from stickslip.lab.all_solutions.residual_forces import AmplitudeRange, amplitude_range
from stickslip.lab.all_solutions.solution_search import SolutionSearch
from solver.response.stability.verdict import Uniqueness, uniqueness
from solver.results.known import Stable, Verdict
from solver.results.told import Piece
from solver.results.watch import shows_progress
from solver.scene.parameter_paths import check_frequency
from solver.scene.scene import Scene

INCOMPLETE = "The list may be incomplete: no search finds every solution for certain."
MISSING = (
    "By the signs of the determinants at least {} more should exist: more starts may find them. " + INCOMPLETE
)
COMPLETE = "The list is complete: the response is proven to be the only one."


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class FoundSolution(Piece):
    """One of the solutions found."""

    JSON: ClassVar = "stability sign found_by times residual_forces"

    solution: Annotated[Solution, "As `solve` gives it."]
    stability: Annotated[
        Stability | None, "Its Floquet multipliers; None where a law does not say how it is perturbed."
    ]
    sign: Annotated[int, "Of the determinant of dr/du: −1 where an odd number of real perturbations grows."]
    found_by: Annotated[
        str,
        "What led to it first: ``solve``, ``start`` (a random motion), ``deflation``, or ``branch`` (that "
        "of another solution, followed through its folds and branch points).",
    ]
    times: Annotated[int, "How often the search came to it."]
    residual_forces: Annotated[
        AmplitudeRange | None,
        "What forces left in contacts that stick all the time may do to it; None where none sticks.",
    ]

    def to_json(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        return self.solution.to_json() | self._json()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AllSolutions(Piece):
    """The distinct periodic responses found at one frequency."""

    JSON: ClassVar = (
        "solutions unique=uniqueness.unique unique_ground=uniqueness.ground complete"
        " missing_by_signs=missing note starts stopped seconds"
    )

    solutions: Annotated[tuple[FoundSolution, ...], "Largest half peak to peak first."]
    uniqueness: Annotated[Uniqueness, "Whether there is one alone, and why."]
    starts: Annotated[int, "How many random starts were made, with and without deflation."]
    stopped: Annotated[bool, "The caller ended the search."]
    seconds: Annotated[float, "What it took [s]."]

    @property
    def complete(self) -> bool:
        """Whether there is certainly no other, but for residual forces."""
        return self.uniqueness.proven and bool(self.solutions)

    @property
    def missing(self) -> int:
        """How many more there are at least, by the signs of those found.

        The signs of the determinants of all solutions add up to 1, the degree of the map, where forces of
        contacts are bounded or only resist and everything takes out power.
        """
        return abs(1 - sum(found.sign for found in self.solutions))

    @property
    def note(self) -> str:
        """What is to be known of the list."""
        if self.complete:
            return COMPLETE
        return INCOMPLETE if self.missing == 0 else MISSING.format(self.missing)


@shows_progress("all solutions")
def solve_all(
    scene: Scene,
    *,
    frequency_hz: float,
    harmonics: int = 11,
    starts: int = 40,
    seed: int = 0,
    effects: Effects | None = None,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> AllSolutions:
    """Look for all periodic responses at one frequency.

    Parameters
    ----------
    scene : what vibrates.
    frequency_hz : excitation frequency [Hz].
    harmonics : highest harmonic kept; even ones are kept unless the response is proven to be the only one.
    starts : random motions to start from, each without deflation and with.
    seed : of their random numbers.
    effects : what is paid for though the scene does not call for it.
    on_progress : called with the share done and the number of solutions so far.
    should_stop : asked between starts; True ends the search.

    Raises
    ------
    SettingError
        A bad frequency, number of harmonics, of starts or seed.
    """
    begun = clock()
    check_frequency("frequency_hz", frequency_hz)
    check_count("starts", starts, 0, MOST_STARTS)
    check_count("seed", seed, 0, 2**63 - 1)
    only = uniqueness(scene, frequency_hz)
    effects = effects or Effects()
    if not only.proven:
        effects = replace(effects, even_harmonics=True)
    balance = build(scene, harmonics=harmonics, effects=effects)
    search = SolutionSearch(balance, 2.0 * math.pi * frequency_hz)
    search.keep(solve_from_nothing(search.workspace, search.omega), "solve")
    stopped = False
    if not only.proven:
        stopped = search.everywhere(starts, np.random.default_rng(seed), on_progress, should_stop)
    found = tuple(_described(search, frequency_hz))
    ordered = sorted(found, key=lambda each: -each.solution.half_peak_to_peak)
    return AllSolutions(
        solutions=tuple(ordered), uniqueness=only, starts=0 if only.proven else search.starts,
        stopped=stopped, seconds=clock() - begun,
    )  # fmt: skip


def _described(search: SolutionSearch, frequency_hz: float) -> list[FoundSolution]:
    """Return what is known as solutions."""
    found = []
    for each in search.known:
        solution = describe(search.workspace, each.point, frequency_hz, clock())
        if not solution.converged:
            continue
        stable: Stability | None = None
        try:
            known = stability(solution)
        except SettingError as error:
            verdict = Verdict(stable=Stable.NOT_KNOWN, ground=str(error))
        else:
            stable, verdict = known, verdict_of(known)
        solution._judged.append(verdict)
        found.append(
            FoundSolution(
                solution=solution, stability=stable, sign=search.sign(each.point.u),
                found_by=each.found_by, times=each.times,
                residual_forces=amplitude_range(solution, search.balance.effects),
            )
        )  # fmt: skip
    return found
