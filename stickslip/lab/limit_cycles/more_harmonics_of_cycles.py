"""Limit cycles with more harmonics: what those would change, and multipliers of a motion that repeats.

A Floquet multiplier of a cycle is 1, that of a shift in time. How far the nearest is from 1 tells how good
the others are; where that is too far, or the largest of the others too close to 1 to tell, the cycle is
solved with more harmonics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from solver.errors import SettingError
from solver.jit.fourier import Complex
from stickslip.lab.limit_cycles.curve_segment import with_turns, zeta_of
from solver.modes.mode_curve import Corrected, ModeState, correct
from solver.modes.mode_curve import CurveEnd, follow, tangent_of
from solver.modes.mode_equations import Equations
from solver.modes.nonlinear_mode import PointRecord, Recorder, Wider
from solver.response.stability.floquet import scene_monodromy
from solver.scene.scene import Scene

PERIOD = 2.0 * math.pi
SAFETY = 1.5  # errors fall at least as 1/H, of which twice the harmonics show half, most fall as 1/H²
_NEUTRAL = 1e-3  # distance from 1 of the multiplier of a shift in time
_TOLD = 3.0  # of that distance, by which another has to differ from 1 in modulus
_FAR = 1.0  # ln a within which a cycle with more harmonics is the same one
_AROUND = 0.3  # ln a to either side of the most damping, where it is looked for with more harmonics
_MOST_POINTS = 200
_MUCH = 0.01  # relative change of the most damping by twice the harmonics, beyond which it takes more to tell


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """A motion that repeats without excitation: the point, dζ / d ln a, and its record."""

    point: Corrected
    slope: float
    record: PointRecord


def slope_of(equations: Equations, point: Corrected) -> float:
    """Return dζ / d ln a at a point."""
    tangent = tangent_of(equations, point)
    return math.nan if tangent is None else float(tangent[-2] / tangent[-1])


def cycle_at(equations: Equations, point: Corrected) -> Cycle:
    """Return a cycle with what is told of it."""
    record = Recorder(equations, turns=True).of(point)
    return Cycle(point=point, slope=slope_of(equations, point), record=record)


class Ladder:
    """The equations of a mode with ever more harmonics: those given, then twice as many, twice again."""

    def __init__(self, equations: Equations) -> None:
        self._rungs: list[Wider] = []
        self._given = equations

    def finer(self, i: int) -> Wider | None:
        """Return rung i of those above the given one; None where there are no more harmonics."""
        while len(self._rungs) <= i:
            below = self._rungs[-1].equations if self._rungs else self._given
            self._rungs.append(Wider(below))
        return self._rungs[i] if self._rungs[i].has_more else None

    def cycles(self, cycle: Cycle) -> Iterator[Cycle]:
        """Yield a cycle with twice the harmonics, and twice again, as far as it is found there."""
        for i in range(2):
            wider = self.finer(i)
            found = None if wider is None else _same_cycle(wider, cycle)
            if found is None:
                return
            cycle = found
            yield cycle

    def most_damping_error(self, points: Sequence[Corrected], most: int) -> float:
        """Return what more harmonics change of the largest ζ, that of point `most`; NaN if unknown."""
        zeta, change = zeta_of(points[most]), math.nan
        for i in range(2):
            wider = self.finer(i)
            if wider is None:
                break
            change = abs(_most_damping(wider.equations, points, most, partial(self._raised, i)) - zeta)
            if change <= _MUCH * abs(zeta):
                break
        return SAFETY * change

    def _raised(self, i: int, state: ModeState) -> ModeState:
        """Return a state with the harmonics of rung i."""
        for rung in self._rungs[: i + 1]:
            state = rung.spread(state)
        return state


def _most_damping(
    equations: Equations, points: Sequence[Corrected], most: int, raised: Callable[[ModeState], ModeState]
) -> float:
    """Return the largest ζ with more harmonics about point `most`; NaN if unknown."""
    low = points[most].state.log_amplitude - _AROUND
    high = min(points[most].state.log_amplitude + _AROUND, points[-1].state.log_amplitude)
    before = next((i for i in range(most, -1, -1) if points[i].state.log_amplitude <= low), 0)
    first = correct(equations, raised(points[before].state), most=40)
    if not first.converged or first.state.log_amplitude >= high:
        return zeta_of(first) if first.converged else math.nan
    curve = follow(equations, first, high, turns=True, most_points=_MOST_POINTS)
    found = with_turns(equations, curve.points, math.nan)
    return max(map(zeta_of, found)) if curve.end is CurveEnd.COMPLETED else math.nan


def _same_cycle(wider: Wider, cycle: Cycle) -> Cycle | None:
    """Return a cycle with more harmonics: at the same ζ, on the same side of its turn; None if not found."""
    equations, zeta = wider.equations, zeta_of(cycle.point)
    # Newton's method settles the new harmonics first: what it ends with is a better guess, solved or not.
    here = correct(equations, wider.spread(cycle.point.state), most=40)
    y = here.state.y.copy()
    y[-1] = zeta
    row = np.zeros(y.size + 1)
    row[-2] = 1.0
    start = ModeState(
        y=y, log_amplitude=here.state.log_amplitude, mode=here.state.mode, phase=here.state.phase
    )
    found = correct(equations, start, row, most=40)
    moved = abs(found.state.log_amplitude - cycle.point.state.log_amplitude)
    if not found.converged or moved > _FAR:
        return None
    same = cycle_at(equations, found)
    return same if same.slope * cycle.slope > 0.0 else None


def multipliers_of(
    scene: Scene, cycles: Sequence[Cycle], mass_damping: float, alone: Complex | None
) -> tuple[Complex | None, str]:
    """Return the multipliers of the first of the cycles that is good enough, or why there are none.

    Parameters
    ----------
    cycles : one and the same with ever more harmonics.
    mass_damping : damping of the gas over ω, 2 ζ_aero, in units of the mass.
    alone : the mode that it acts on alone.
    """
    unknown = ""
    for cycle in cycles:
        values, unknown = _multipliers(scene, cycle, mass_damping, alone)
        if values is not None:
            return values, ""
    return None, unknown


def _multipliers(
    scene: Scene, cycle: Cycle, mass_damping: float, alone: Complex | None
) -> tuple[Complex | None, str]:
    """Return the Floquet multipliers of a cycle without that of a shift in time, or why there are none."""
    omega = float(cycle.point.state.y[-2])
    ends = np.cumsum([len(contact.end_keys) for contact in scene.contacts])[:-1]
    motions = tuple(np.split(cycle.record.motions, ends))
    try:
        found = scene_monodromy(
            scene, omega / PERIOD, motions, mass_damping=mass_damping * omega, alone=alone
        )
    except SettingError as error:  # a law or a term without a motion in time
        return None, str(error)
    values = np.linalg.eigvals(found.reduced).astype(np.complex128)
    shift = int(np.argmin(np.abs(values - 1.0)))
    off = abs(values[shift] - 1.0)
    if off > _NEUTRAL:
        return None, "no multiplier is that of a shift in time: ask for more harmonics"
    rest = np.delete(values, shift)
    if abs(np.abs(rest).max(initial=0.0) - 1.0) <= _TOLD * off:
        return None, "the largest multiplier is too close to 1 to tell: ask for more harmonics"
    return rest[np.argsort(-np.abs(rest), kind="stable")], ""
