"""The designer's diagram: stress over the excitation for several dampers, and what excitation they allow.

At each level one response gives the peak of the utilisation of every recovered stress with a material.
The allowed excitation is the first at which one of them is used up, U(level) = 1: between the two levels that
enclose it by Newton's method with the exact ∂U/∂level of the peak (envelope theorem), kept between them.
Where a mean is free, U is that of the worst mean (`solver.response.worst_mean`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from solver.balance.balance import check_harmonics
from solver.continuation.branch import Branch, BranchStatus, Peak
from solver.continuation.branches.observation import observing
from solver.continuation.branches.sweep import sweep
from solver.errors import SettingError, at
from solver.jit.timer import clock
from solver.response.worst_mean import WorstMeanSlopes, used_most
from solver.results.known import Known
from solver.results.units import STRESS_UNITS
from solver.results.watch import OnProgress, ShouldStop, shows_progress
from solver.scene.materials import haigh_of, utilisation_of
from solver.scene.parameter_paths import AMPLITUDE, parameter_of
from solver.scene.scene import Scene
from solver.sensitivity.gradient import Sensitivities
from solver.sensitivity.nonsmooth import peak_gradient
from solver.studies.study_results import AllowedExcitation, MarginDiagram, MarginStatus

AS_IT_IS = "as it is"
POINTS = 9
_SOLVED = 1e-9  # of |U − 1|
_MOST = 40  # responses to find an allowed excitation


class Used(NamedTuple):
    """What is used most of what is allowed in one response; inf where the mean stress leaves nothing."""

    used: float
    row: str
    peak: Peak
    branch: Branch
    stress: float
    flags: tuple[str, ...] = ()
    free: frozenset[int] | None = None

    def slopes(self, *paths: str) -> Sensitivities:
        """Return what gives its derivatives."""
        balance = self.branch.balance
        if self.free is None:
            return Sensitivities(balance, paths)
        return WorstMeanSlopes(balance, paths, self.free)


def judged_rows(scene: Scene) -> tuple[str, ...]:
    """Return the recovered stresses that have a material."""
    return tuple(one.name for one in scene.recovery if one.material is not None)


def most_used(branch: Branch) -> Used:
    """Return what is used most, of the stresses of a completed response that have a material.

    Its flags are those of all.
    """
    every = [_of_row(branch, row) for row in judged_rows(branch.balance.scene)]
    flags = tuple(dict.fromkeys(flag for one in every for flag in one.flags))
    return max(every, key=lambda one: one.peak.value)._replace(flags=flags)


def _of_row(branch: Branch, row: str) -> Used:
    """Return how much a recovered stress is used."""
    scene = branch.balance.scene
    seen = observing(branch, row, measure=haigh_of(scene, row), peaks_alone=True)
    most = used_most(seen)
    peak = most.highest
    stress = observing(branch, row, measure="half_peak_to_peak", peaks_alone=True).peaks[0].value
    unit = next(one.unit for one in scene.recovery if one.name == row)
    used, stress = utilisation_of(peak.value), stress * STRESS_UNITS[unit]
    return Used(used, row, peak, seen, stress, most.flags, most.free)


class _DamperResponses:
    """Responses of one damper at levels of the excitation."""

    def __init__(self, scene: Scene, limit: float | None, harmonics: int, should_stop: ShouldStop) -> None:
        self.scene, self._limit, self._harmonics, self._should_stop = scene, limit, harmonics, should_stop
        self._rows = judged_rows(scene)
        self.parts: list[Known] = []
        self.undamped = False  # one of them, so that it has no peak

    def used(self, level: float) -> Used | None:
        """Return what is used most at a level; None where the response does not cover the band."""
        there = self.scene.with_values({AMPLITUDE: level})
        branch = sweep(there, harmonics=self._harmonics, should_stop=self._should_stop)
        self.undamped = self.undamped or branch.status is BranchStatus.UNDAMPED
        if not branch.reached or branch.peak is None:
            return None
        if not self._rows:
            self.parts.append(branch.known)
            used = branch.peak.value / (self._limit or math.nan)
            return Used(used, self.scene.observe.dof, branch.peak, branch, branch.peak.value)
        most = most_used(branch)
        self.parts.append(replace(branch.known, flags=(*branch.known.flags, *most.flags)))
        return most

    def allowed(self, low: float, high: float) -> tuple[float, Used] | None:
        """Return the level between two at which U = 1 and what is used there; U is below 1 at the lower."""
        level = 0.5 * (low + high)
        for _ in range(_MOST):
            found = self.used(level)
            if found is None:
                return None
            if abs(found.used - 1.0) <= _SOLVED or high - low <= 1e-14 * high:
                return level, found
            low, high = (level, high) if found.used < 1.0 else (low, level)
            slope = peak_gradient(found.slopes(AMPLITUDE), found.peak).gradient[0]
            if not self._rows:
                slope /= self._limit or math.nan
            step = level + (1.0 - found.used) / slope if slope > 0.0 else math.nan
            level = step if low < step < high else 0.5 * (low + high)
        return None


@shows_progress("margin")
def margin_diagram(
    scene: Scene, *, start: float, stop: float, points: int = POINTS,
    dampers: Mapping[str, Mapping[str, float]] | None = None, limit: float | None = None,
    harmonics: int = 11, on_progress: OnProgress = None, should_stop: ShouldStop = None,
) -> MarginDiagram:  # fmt: skip
    """Compute the stress over the excitation for several dampers, and the excitation that each allows.

    Parameters
    ----------
    scene : with a `material` for at least one stress of its `recovery`; of another the amplitude of the
        observed DOF is looked at, against `limit`.
    start, stop : excitation amplitudes of both ends, in the unit of ``excitation.amplitude``.
    points : levels, in equal ratios.
    dampers : name to values of parameter paths that make it; the scene as it is if left out.
    limit : amplitude allowed [m] of a scene without strengths.
    harmonics : highest harmonic kept.
    on_progress : called with (share done, responses so far).
    should_stop : asked between responses and within them.

    Raises
    ------
    SettingError
        Bad ends, points or values, or a `limit` beside strengths.
    """
    begun = clock()
    every = checked_dampers(scene, dampers)
    levels = checked_levels(scene, start, stop, points, limit)
    check_harmonics(harmonics)
    stress, used = (np.full((len(every), points), math.nan) for _ in range(2))
    found: list[AllowedExcitation] = []
    parts: list[Known] = []
    done = holes = undamped = stopped = 0
    for d, (name, changed) in enumerate(every.items()):
        level = _DamperResponses(changed, limit, harmonics, should_stop)
        seen: list[Used | None] = []
        for i, amplitude in enumerate(levels):
            stopped = stopped or int(should_stop is not None and should_stop())
            here = None if stopped else level.used(float(amplitude))
            seen.append(here)
            if here is not None:
                stress[d, i], used[d, i] = here.stress, here.used
            done += 1
            if on_progress is not None:
                on_progress(done / (points * len(every)), done)
        holes += sum(one is None for one in seen)
        found.append(_allowed(name, level, levels, seen))
        parts += level.parts
        undamped += level.undamped
    strengths = any(one.material is not None for one in scene.recovery)
    status = MarginStatus.HOLES if holes else MarginStatus.COMPLETED
    status = MarginStatus.UNDAMPED if undamped else status
    if stopped or (should_stop is not None and should_stop()):
        status = MarginStatus.STOPPED
    return MarginDiagram(
        scene=scene.name, judged_by="utilisation" if strengths else "amplitude",
        unit="Pa" if strengths else scene.observed_unit, level=levels,
        level_unit=parameter_of(scene, AMPLITUDE).unit, stress=stress, used=used, allowed=tuple(found),
        n_harmonics=harmonics, highest=tuple(parts), status=status,
        seconds=clock() - begun,
    )  # fmt: skip


def _allowed(
    name: str, level: _DamperResponses, levels: np.ndarray, seen: list[Used | None]
) -> AllowedExcitation:  # fmt: skip
    """Return what a damper allows, by the first of its levels at which what is allowed is used up."""
    first = next((i for i, one in enumerate(seen) if one is not None and one.used >= 1.0), None)
    amplitude, there = math.nan, None
    if None in seen[: len(seen) if first is None else first]:
        end = "unknown"
    elif first is None:
        end = "above"
        there = max((one for one in seen if one is not None), key=lambda one: one.used, default=None)
    elif first == 0:
        end, there = "below", seen[0]
    else:
        end, solved = "within", level.allowed(float(levels[first - 1]), float(levels[first]))
        amplitude, there = solved or (amplitude, there)
    nothing = "", math.nan, math.nan
    row, hertz, value = nothing if there is None else (there.row, there.peak.at, there.stress)
    return AllowedExcitation(name=name, allowed=amplitude, end=end, row=row, at_hz=hertz, value=value)


def checked_dampers(scene: Scene, dampers: Mapping[str, Mapping[str, float]] | None) -> dict[str, Scene]:
    """Return the scene with each damper; raises SettingError as `margin_diagram`."""
    if dampers is None:
        return {AS_IT_IS: scene}
    if not dampers:
        raise SettingError("dampers", dict(dampers), "must have at least one name with values")
    found = {}
    for name, values in dampers.items():
        with at("dampers", name):
            found[name] = scene.with_values(values)
    return found


def checked_levels(scene: Scene, start: float, stop: float, points: int, limit: float | None) -> np.ndarray:
    """Return the levels of the excitation, (points,); raises SettingError as `margin_diagram`."""
    if not 0.0 < start < math.inf:
        raise SettingError("start", start, "must be an amplitude > 0")
    if not start < stop < math.inf:
        raise SettingError("stop", stop, f"must be above `start` = {start:g}")
    if points < 2:
        raise SettingError("points", points, "must be at least 2")
    strengths = any(one.material is not None for one in scene.recovery)
    if limit is not None and (strengths or not limit > 0.0):
        wanted = "is for a scene without strengths" if strengths else "must be an amplitude > 0"
        raise SettingError("limit", limit, wanted)
    return np.geomspace(start, stop, points)
