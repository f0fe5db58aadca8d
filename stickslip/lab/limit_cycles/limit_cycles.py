"""Flutter held by friction: limit cycles where a mode's damping and the aerodynamic one cancel.

Gas that feeds a mode acts as the damping matrix 2 ζ_aero ω M with ζ_aero < 0. The term −2ζωM of the extended
periodic motion is exactly that: where ζ(a) = −ζ_aero the motion is a periodic one of the autonomous system,
with its frequency and all harmonics, no approximation. It attracts where ζ(a) + ζ_aero grows with the
amplitude. A scene with aerodynamic terms of its own has its cycles where ζ(a) = 0. Floquet multipliers of the
whole structure say whether other modes grow.

Cycles are found between bracketing points, of which each maximum and minimum of ζ is one: a root lies on its
side of the most that friction can hold, however near.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np

from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from stickslip.lab.limit_cycles.curve_segment import CurveSegment, points_of, with_turns, zeta_of
from solver.modes.mode_curve import Corrected
from solver.modes.mode_curve import CurveEnd, follow
from solver.modes.mode_equations import Equations
from stickslip.lab.limit_cycles.more_harmonics_of_cycles import (
    PERIOD,
    SAFETY,
    Cycle,
    Ladder,
    cycle_at,
    multipliers_of,
)
from solver.modes.nonlinear_mode import MOST_POINTS, ModeProblem, pose
from solver.modes.peaks.performance import grows_together
from solver.modes.nonlinear_mode import PointRecord
from solver.modes.mode_results import NonlinearMode
from solver.modes.mode_start import begin
from solver.response.stability.cost import left_out
from solver.response.stability.multipliers import GROWS, growth_of
from solver.results.told import Piece
from solver.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LimitCycle(Piece):
    """A periodic motion that nothing drives."""

    JSON: ClassVar = (
        "amplitude frequency=frequency_hz max_abs amplitude_error frequency_error max_abs_error"
        " damping_slope attracts stable growth by_slope"
    )

    amplitude: Annotated[float, "Modal amplitude a [√kg m]."]
    frequency_hz: Annotated[float, "Its own frequency [Hz]."]
    max_abs: Annotated[float, "max|x| of the observed DOF [m]."]
    damping_slope: Annotated[float, "dζ / d ln a there: above 0 the mode returns to the cycle."]
    multipliers: Annotated[
        Complex | None,
        "Floquet multipliers of the whole structure, without that of a shift in time; None if `unknown`.",
    ]
    unknown: Annotated[str, "Why they are not known, empty if they are."]
    amplitude_error: Annotated[
        float,
        "Estimate of what more harmonics would change of `amplitude` [√kg m], by the cycle with twice and "
        "four times as many; NaN where that was not found, so that nothing is known.",
    ]
    frequency_error: Annotated[float, "The same of `frequency_hz` [Hz]."]
    max_abs_error: Annotated[float, "The same of `max_abs` [m]."]
    record: Annotated[
        PointRecord, "Motions of contacts and DOFs, and forces, as `solver.NonlinearMode` has them."
    ]

    @property
    def attracts(self) -> bool:
        """Whether the mode returns to the cycle, by the slope of its damping."""
        return self.damping_slope > 0.0

    @property
    def stable(self) -> bool | None:
        """Whether no small perturbation grows, by the multipliers; None where they are not known."""
        if self.multipliers is None:
            return None
        return bool(np.all(np.abs(self.multipliers) <= 1.0 + GROWS))

    def to_json(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        return self._json(growth=growth_from(self), by_slope=self.multipliers is None)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LimitCycles(Piece):
    """The limit cycles of a mode under aerodynamic excitation, in the order of its curve."""

    JSON: ClassVar = (
        "aero_damping mode_alone completed=reached most_damping most_at most_error most_at_end unsolved"
        " cycles"
    )

    aero_damping: Annotated[float, "ζ_aero; below 0 it feeds the mode."]
    cycles: Annotated[tuple[LimitCycle, ...], "Where ζ(a) + ζ_aero = 0 within the curve."]
    most_damping: Annotated[float, "The largest ζ(a): an excitation of −ζ_aero up to that is held."]
    most_at: Annotated[float, "Its amplitude [√kg m]."]
    most_error: Annotated[
        float, "Estimate of what more harmonics would change of `most_damping`; NaN where it is not known."
    ]
    most_at_end: Annotated[bool, "That is an end of the curve: beyond it more may be held."]
    unsolved: Annotated[
        tuple[tuple[float, float], ...],
        "Ranges of the amplitude [√kg m] within which ζ(a) + ζ_aero changes its sign and no cycle was found.",
    ]
    scales: Annotated[bool, "Whether amplitudes of cycles grow in proportion to the loads."]
    mode_alone: Annotated[bool, "Whether the gas acts on the one mode alone."]
    reached: Annotated[
        bool,
        "Whether the curve that they were looked for on reaches its largest amplitude: else there may be "
        "more.",
    ]

    def load_for(self, disturbance: float) -> float:
        """Return the least factor on every load with which a disturbance dies down to the stable cycle.

        The amplitudes of cycles are in proportion to the loads, so the widest range is that of the largest
        load, and the least load that holds a disturbance follows from the unstable cycle that bounds it.

        Parameters
        ----------
        disturbance : modal amplitude [√kg m].

        Raises
        ------
        SettingError
            Not a number above 0; or the forces of the scene do not grow in proportion to its loads.
        """
        if not (isinstance(disturbance, (int, float)) and 0.0 < disturbance < math.inf):
            raise SettingError("disturbance", disturbance, "must be an amplitude > 0 [√kg m]")
        if not self.scales:
            wanted = (
                "must be of a scene whose forces grow in proportion to its loads, without constant forces"
            )
            raise SettingError("scene", "these limit cycles", wanted)
        bounds = [cycle.amplitude for cycle in self.cycles if not cycle.attracts]
        held = any(cycle.attracts for cycle in self.cycles)
        if not held:
            return math.inf if self.aero_damping < 0.0 else 0.0
        return disturbance / max(bounds) if bounds else 0.0

    def held_by(self, disturbance: float) -> dict[str, Any]:
        """Return `load_for` as a JSON object: the factor, None for none that holds, and in words."""
        factor = self.load_for(disturbance)
        if factor == 0.0:
            words = "whatever the loads are"
        elif math.isfinite(factor):
            words = f"with {factor:.5g} times the loads"
        else:
            words = "with no load: no cycle attracts"
        load = factor if math.isfinite(factor) else None
        return {"disturbance": float(disturbance), "load": load, "words": words}

    def to_json(self, disturbance: float | None = None) -> dict[str, Any]:
        """Return them as one JSON object, with what holds a disturbance [√kg m] if that is given."""
        asked = {} if disturbance is None else {"load_for": self.held_by(disturbance)}
        return asked | self._json()


def check_loads(scene: Scene) -> None:
    """Raise SettingError if a load of a scene varies with a phase of its own: no cycle repeats then."""
    names = [one.name for one in scene.contacts if one.load is not None and one.load.orders]
    if names:
        raise SettingError("N1", names, "must be 0: a limit cycle has no phase that a load could follow")


def limit_cycles(
    found: NonlinearMode, aero_damping: float = 0.0, *, stability: bool | None = None,
    mode_alone: bool = False,
) -> LimitCycles:  # fmt: skip
    """Return the limit cycles of a mode that gas feeds, each solved with all harmonics.

    Parameters
    ----------
    found : of `solver.nonlinear_mode`.
    aero_damping : damping ratio ζ_aero of the gas, as the matrix 2 ζ_aero ω M; below 0 it feeds the mode. 0:
        what the scene itself says of the gas.
    stability : Floquet multipliers too; of a disk they are of all its sectors. Left out, they are computed of
        structures of at most 200 coordinates: of more they take minutes.
    mode_alone : the gas acts on the linear mode φ alone, contacts as at rest and φᴴ M φ = 1, as the matrix
        2 ζ_aero ω (M φ)(M φ)ᴴ; ζ(a) is followed anew with that.

    Raises
    ------
    SettingError
        Not a finite number; or a load of the scene varies with a phase of its own, so that nothing
        repeats without it.
    """
    if isinstance(aero_damping, bool) or not math.isfinite(aero_damping):
        raise SettingError("aero_damping", aero_damping, "must be a damping ratio, below 0 if it feeds")
    check_loads(found.scene)
    problem = pose(found.scene, found.mode, None, found.n_harmonics, whole=found.whole_matrices)
    missing = left_out(found.scene, stability)
    curve, ended = points_of(problem.equations, found), found.reached
    if mode_alone:
        problem = _alone(problem, found)
        curve, ended = _followed(problem, found)
        if found.scene.structure.has_sectors:
            missing = missing or "left out: of a disk whose gas feeds one mode alone they are not computed"
    equations, ladder = problem.equations, Ladder(problem.equations)
    points = with_turns(equations, curve, -aero_damping)
    cycles: list[LimitCycle] = []
    unsolved: list[tuple[float, float]] = []
    for one, other in pairwise(points):
        surplus = zeta_of(one) + aero_damping, zeta_of(other) + aero_damping
        if surplus[0] != 0.0 and not surplus[0] * surplus[1] < 0.0:
            continue
        at = CurveSegment(equations, one, other).root(lambda point: zeta_of(point) + aero_damping)
        if at is None:
            unsolved.append((math.exp(one.state.log_amplitude), math.exp(other.state.log_amplitude)))
        else:
            cycles.append(_cycle(ladder, cycle_at(equations, at), equations, aero_damping, missing))
    most = int(np.argmax([zeta_of(each) for each in points])) if points else -1
    return LimitCycles(
        aero_damping=float(aero_damping), cycles=tuple(cycles), unsolved=tuple(unsolved),
        most_damping=zeta_of(points[most]) if points else math.nan,
        most_at=math.exp(points[most].state.log_amplitude) if points else math.nan,
        most_error=ladder.most_damping_error(points, most) if points else math.nan,
        most_at_end=most in (0, len(points) - 1), reached=ended, mode_alone=mode_alone,
        scales=bool(points) and grows_together(found),
    )  # fmt: skip


def _alone(problem: ModeProblem, found: NonlinearMode) -> ModeProblem:
    """Return the problem with −2ζω on the linear mode alone."""
    whole = problem
    if problem.equations.structure.is_diagonal:
        whole = pose(found.scene, found.mode, None, found.n_harmonics, whole=True)
    shape = whole.all_modes[found.mode - 1].shape
    return replace(whole, equations=Equations(whole.equations.balance, shape))


def _followed(problem: ModeProblem, found: NonlinearMode) -> tuple[list[Corrected], bool]:
    """Return the points of a curve over the amplitudes of another, and whether it reaches the largest."""
    if not found.points:
        return [], False
    low, high = found.points[0].log_amplitude, found.points[-1].log_amplitude
    first = begin(problem.equations, problem.mode, problem.rest, low, turns=True)
    curve = follow(problem.equations, first, high, turns=True, most_points=MOST_POINTS)
    return curve.points, curve.end is CurveEnd.COMPLETED


def _cycle(
    ladder: Ladder, cycle: Cycle, equations: Equations, aero_damping: float, missing: str
) -> LimitCycle:  # fmt: skip
    """Return a cycle with its errors and multipliers."""
    finer = list(ladder.cycles(cycle))
    multipliers, unknown = None, missing
    if not missing:
        scene = equations.balance.scene
        multipliers, unknown = multipliers_of(scene, [cycle, *finer], 2.0 * aero_damping, equations.alone)
    here = _numbers(cycle)
    changes = [np.abs(_numbers(each) - here) for each in finer] or [np.full(3, math.nan)]
    errors = SAFETY * np.max(changes, axis=0)
    amplitude, frequency, size = here.tolist()
    return LimitCycle(
        amplitude=amplitude, frequency_hz=frequency, max_abs=size, damping_slope=cycle.slope,
        multipliers=multipliers, unknown=unknown, amplitude_error=float(errors[0]),
        frequency_error=float(errors[1]), max_abs_error=float(errors[2]), record=cycle.record,
    )  # fmt: skip


def _numbers(cycle: Cycle) -> Real:
    """Return amplitude [√kg m], frequency [Hz] and max|x| [m] of a cycle."""
    state = cycle.point.state
    return np.array([math.exp(state.log_amplitude), state.y[-2] / PERIOD, cycle.record.max_abs])


def growth_from(cycle: LimitCycle) -> str:
    """Return in words how a perturbation of a cycle grows."""
    return cycle.unknown if cycle.multipliers is None else growth_of(cycle.multipliers).value
