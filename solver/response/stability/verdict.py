"""Whether a response is stable, as every answer says it: yes, no, or not known and why.

It is known without Floquet multipliers where loads are given, stiffnesses constant and everything takes out
power, and computed by them where that costs little; `forecast` says what it costs. What computes them is
loaded where it is needed: it brings SciPy's packages along, which an answer does without.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from solver.continuation.branch import Branch, Peak
from solver.errors import SettingError
from solver.lab import LAB, from_lab, is_there
from solver.linear.assembly import linear_model
from solver.response.stability.cost import forecast
from solver.response.stability.multipliers import verdict_of
from solver.response.stability.uniqueness import MONOTONE, monotone
from solver.results import units
from solver.results.known import TAKES_LONG, Stable, Verdict
from solver.scene.scene import Scene

if TYPE_CHECKING:
    from solver.response.solution import Solution

CHEAP = 1.0  # s, forecast, up to which an answer has its multipliers by itself
_STARTS = 8  # of the search for a stable response beside one that is not
# Of that search, how many of its parts run: starts, and branches that are followed both ways.
_PARTS, _UNKNOWNS = 20, 200  # with so many unknowns; with more fewer, by their square
_NO_SOLUTION = "there is no solution"
_LONG = TAKES_LONG + " {}: stability() computes them, --stability for a command"
_BELOW = Verdict(stable=Stable.NOT_KNOWN, ground="the peaks above it are as much as is judged by itself")
_ANOTHER = "; a stable response has half peak to peak {} there"
_NONE_FOUND = "; no stable response was found there"


def of_solution(solution: Solution) -> Verdict:
    """Return whether a solution is stable; of one that is not, name a stable one if it is found."""
    if not solution.converged:
        return Verdict(stable=Stable.NOT_KNOWN, ground=_NO_SOLUTION)
    known = _without_multipliers(solution.scene, solution.frequency_hz)
    if known is not None:
        return known
    from solver.response.stability.floquet import stability

    try:
        found = verdict_of(stability(solution))
    except SettingError as error:
        return Verdict(stable=Stable.NOT_KNOWN, ground=str(error))
    if found.stable is not Stable.NO:
        return found
    return Verdict(stable=found.stable, ground=found.ground + _stable_beside(solution))


def of_peaks(branch: Branch) -> tuple[Verdict, ...]:
    """Return whether the response at each peak of a branch is stable, in the order of `Branch.peaks`.

    As many as together are forecast to cost little are judged, the highest first, and at least one.
    """
    found: list[Verdict] = []
    left = CHEAP
    for peak in branch.peaks:
        scene, hertz = branch.scene_at(peak.at)
        known = _without_multipliers(scene, hertz)
        if known is None:
            left -= forecast(scene, hertz)
            known = _BELOW if found and left < 0.0 else _judged(branch, peak)
        found.append(known)
    return tuple(found)


def _judged(branch: Branch, peak: Peak) -> Verdict:
    """Return what the multipliers say at a peak."""
    from solver.response.stability.floquet import branch_stability

    try:
        return verdict_of(branch_stability(branch, at=[(peak.at, peak.solution)])[0])
    except SettingError as error:
        return Verdict(stable=Stable.NOT_KNOWN, ground=str(error))


def _without_multipliers(scene: Scene, frequency_hz: float) -> Verdict | None:
    """Return what is known of a scene's responses without multipliers; None where they cost little."""
    if monotone(scene, linear_model(scene)):
        return Verdict(stable=Stable.YES, ground=MONOTONE)
    seconds = forecast(scene, frequency_hz)
    if seconds > CHEAP:
        return Verdict(stable=Stable.NOT_KNOWN, ground=_LONG.format(units.duration(seconds)))
    return None


def _stable_beside(solution: Solution) -> str:
    """Return the words for the largest stable response of the same frequency, where it can be searched."""
    if not is_there(f"{LAB}.all_solutions"):
        return ""
    solve_all = from_lab("all_solutions.all_solutions:solve_all")
    unknowns = (2 * solution.n_harmonics + 1) * sum(solution.scene.port_counts)
    parts = iter(range(math.ceil(_PARTS * min((_UNKNOWNS / unknowns) ** 2, 1.0))))
    every = solve_all(
        solution.scene, frequency_hz=solution.frequency_hz, harmonics=solution.n_harmonics, starts=_STARTS,
        on_progress=lambda _share, _count: None, should_stop=lambda: next(parts, None) is None,
    )  # fmt: skip
    stable = [each.solution for each in every.solutions if each.solution.stability.stable is Stable.YES]
    largest = max((each.half_peak_to_peak for each in stable), default=math.nan)
    return _ANOTHER.format(units.length(largest)) if stable else _NONE_FOUND
