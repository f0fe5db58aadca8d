"""Flutter held by friction: limit cycles where a mode's damping and the aerodynamic one cancel.

Gas that feeds a mode acts as the damping matrix 2 ζ_aero ω M with ζ_aero < 0. The term −2ζωM of the extended
periodic motion is exactly that: where ζ(a) = −ζ_aero the motion is a periodic one of the autonomous system,
with its frequency and all harmonics, no approximation. It attracts where ζ(a) + ζ_aero grows with the
amplitude. A scene with aerodynamic terms of its own has its cycles where ζ(a) = 0. Floquet multipliers of the
whole structure say whether other modes grow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from solver.errors import SettingError
from solver.jit.fourier import Complex
from solver.modes.corrector import Corrected, State, correct
from solver.modes.curve import tangent_of
from solver.modes.equations import Equations
from solver.modes.nonlinear_mode import ModeProblem, pose
from solver.modes.peaks.performance import grows_together
from solver.modes.records import Record, Recorder
from solver.modes.results import NonlinearMode
from solver.response.stability.floquet import growth_of, scene_monodromy
from solver.results.told import Piece
from solver.scene.scene import Scene

PERIOD = 2.0 * math.pi
_NEUTRAL = 1e-3  # distance from 1 of the multiplier of a shift in time, which is rounding of the period
_MOST_COORDINATES = 200  # of a whole structure whose multipliers are computed unasked
_CLOSE = 1e-10  # of ln a, at the amplitude of most damping


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LimitCycle(Piece):
    """A periodic motion that nothing drives.

    Attributes
    ----------
    amplitude : float
        Modal amplitude a [√kg m].
    frequency_hz : float
        Its own frequency.
    max_abs : float
        max|x| of the observed DOF [m].
    damping_slope : float
        dζ / d ln a there: above 0 the mode returns to the cycle.
    multipliers : complex array or None
        Floquet multipliers of the whole structure, without that of a shift in time; None if `unknown`.
    unknown : str
        Why they are not known, empty if they are.
    record : Record
        Motions of contacts and DOFs, and forces, as `solver.NonlinearMode` has them.
    """

    UNITS: ClassVar = {"amplitude": "√kg m", "frequency_hz": "Hz", "max_abs": "m"}

    amplitude: float
    frequency_hz: float
    max_abs: float
    damping_slope: float
    multipliers: Complex | None
    unknown: str
    record: Record

    @property
    def attracts(self) -> bool:
        """Whether the mode returns to the cycle, by the slope of its damping."""
        return self.damping_slope > 0.0

    @property
    def stable(self) -> bool:
        """Whether no small perturbation grows: by the multipliers, or the slope where they are not known."""
        if self.multipliers is None:
            return self.attracts
        return bool(np.all(np.abs(self.multipliers) <= 1.0 + 1e-9))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LimitCycles(Piece):
    """The limit cycles of a mode under aerodynamic excitation, in the order of its curve.

    Attributes
    ----------
    aero_damping : float
        ζ_aero; below 0 it feeds the mode.
    cycles : tuple of LimitCycle
        Where ζ(a) + ζ_aero = 0 within the curve.
    most_damping : float
        The largest ζ(a): an excitation of −ζ_aero up to that is held.
    most_at : float
        Its amplitude [√kg m].
    scales : bool
        Whether amplitudes of cycles grow in proportion to the loads.
    """

    UNITS: ClassVar = {"most_at": "√kg m"}

    aero_damping: float
    cycles: tuple[LimitCycle, ...]
    most_damping: float
    most_at: float
    scales: bool

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
        return asked | {
            "aero_damping": self.aero_damping,
            "most_damping": self.most_damping if math.isfinite(self.most_damping) else None,
            "most_at": self.most_at if math.isfinite(self.most_at) else None,
            "cycles": [
                {
                    "amplitude": cycle.amplitude, "frequency": cycle.frequency_hz,
                    "max_abs": cycle.max_abs, "damping_slope": cycle.damping_slope,
                    "stable": cycle.stable, "growth": growth_from(cycle),
                    "by_slope": cycle.multipliers is None,
                }
                for cycle in self.cycles
            ],
        }  # fmt: skip


def limit_cycles(
    found: NonlinearMode, aero_damping: float = 0.0, *, stability: bool | None = None
) -> LimitCycles:  # fmt: skip
    """Return the limit cycles of a mode that gas feeds, each solved with all harmonics.

    Parameters
    ----------
    found : of `solver.nonlinear_mode`.
    aero_damping : damping ratio ζ_aero of the gas, as the matrix 2 ζ_aero ω M; below 0 it feeds the mode. 0:
        what the scene itself says of the gas.
    stability : Floquet multipliers too; of a disk they are of all its sectors. Left out, they are computed of
        structures of at most 200 coordinates: of more they take minutes.

    Raises
    ------
    SettingError
        Not a finite number; or a load of the scene varies with a phase of its own, so that nothing
        repeats without it.
    """
    if isinstance(aero_damping, bool) or not math.isfinite(aero_damping):
        raise SettingError("aero_damping", aero_damping, "must be a damping ratio, below 0 if it feeds")
    problem = pose(found.scene, found.mode, None, found.n_harmonics, whole=found.whole_matrices)
    if not problem.turns:
        names = [c.name for c in found.scene.contacts if c.load is not None and c.load.orders]
        raise SettingError("N1", names, "must be 0: a limit cycle has no phase that a load could follow")
    missing = stability_left_out(found.scene, stability)
    surplus = found.damping_ratio + aero_damping
    cycles = []
    for i in range(len(found.points) - 1):
        if surplus[i] == 0.0 or surplus[i] * surplus[i + 1] < 0.0:
            solved = _at_damping(problem.equations, found, i, -aero_damping)
            if solved is not None:
                cycles.append(_cycle(problem, solved, found.scene, aero_damping, missing))
    most, at = _most_damping(problem.equations, found)
    return LimitCycles(
        aero_damping=float(aero_damping), cycles=tuple(cycles), most_damping=most, most_at=at,
        scales=bool(found.points) and grows_together(found),
    )  # fmt: skip


def stability_left_out(scene: Scene, stability: bool | None) -> str:
    """Return why no multipliers are computed; empty if they are."""
    if stability is False:
        return "not asked for"
    sectors = scene.structure.sector_count if scene.structure.has_sectors else 1
    size = sectors * len(scene.dofs)
    if stability is None and size > _MOST_COORDINATES:
        return f"left out: {size} coordinates take minutes; `stability=True` computes them"
    return ""


def between(found: NonlinearMode, i: int, share: float) -> State:
    """Return a guess between points i and i + 1."""
    one, other = found.points[i], found.points[i + 1]
    # q is of one mode alone.
    y = one.y + share * (other.y - one.y) if one.mode == other.mode else one.y.copy()
    log_amplitude = one.log_amplitude + share * (other.log_amplitude - one.log_amplitude)
    return State(y=y, log_amplitude=log_amplitude, mode=one.mode, phase=one.phase)


def _at_damping(equations: Equations, found: NonlinearMode, i: int, zeta: float) -> Corrected | None:
    """Return the point between i and i + 1 whose damping ratio is given; None if it was not found."""
    one, other = float(found.damping_ratio[i]), float(found.damping_ratio[i + 1])
    border = np.zeros(found.points[i].y.size + 1)
    border[-2] = 1.0
    for share in ((zeta - one) / (other - one), 0.0, 1.0, 0.5):
        guess = between(found, i, share)
        y = guess.y.copy()
        y[-1] = zeta
        solved = correct(equations, replace(guess, y=y), border, most=40)
        near = abs(solved.state.log_amplitude - guess.log_amplitude) < 1.0
        if solved.converged and near:
            return solved
    return None


def _slope(equations: Equations, point: Corrected) -> float:
    """Return dζ / d ln a at a point."""
    tangent = tangent_of(equations, point)
    return math.nan if tangent is None else float(tangent[-2] / tangent[-1])


def _cycle(
    problem: ModeProblem, point: Corrected, scene: Scene, aero_damping: float, missing: str
) -> LimitCycle:
    record = Recorder(problem.equations, turns=True).of(point)
    omega = float(point.state.y[-2])
    multipliers, unknown = None, missing
    if not missing:
        multipliers, unknown = _multipliers(scene, omega, record, 2.0 * aero_damping * omega)
    return LimitCycle(
        amplitude=math.exp(point.state.log_amplitude), frequency_hz=omega / PERIOD, max_abs=record.max_abs,
        damping_slope=_slope(problem.equations, point), multipliers=multipliers, unknown=unknown,
        record=record,
    )  # fmt: skip


def _multipliers(
    scene: Scene, omega: float, record: Record, mass_damping: float
) -> tuple[Complex | None, str]:
    """Return the Floquet multipliers of a cycle without that of a shift in time, or why there are none."""
    ends = np.cumsum([len(contact.end_keys) for contact in scene.contacts])[:-1]
    motions = tuple(np.split(record.motions, ends))
    try:
        found = scene_monodromy(scene, omega / PERIOD, motions, mass_damping=mass_damping)
    except SettingError as error:  # a law or a term without a motion in time
        return None, str(error)
    values = np.linalg.eigvals(found.reduced).astype(np.complex128)
    shift = int(np.argmin(np.abs(values - 1.0)))
    if abs(values[shift] - 1.0) > _NEUTRAL:
        return None, "no multiplier is that of a shift in time: ask for more harmonics"
    rest = np.delete(values, shift)
    return rest[np.argsort(-np.abs(rest), kind="stable")], ""


def growth_from(cycle: LimitCycle) -> str:
    """Return in words how a perturbation of a cycle grows."""
    if cycle.multipliers is None:
        return cycle.unknown
    return growth_of(cycle.multipliers).value


def _most_damping(equations: Equations, found: NonlinearMode) -> tuple[float, float]:
    """Return the largest damping ratio of a curve and its amplitude, solved for between points."""
    if not found.points:
        return math.nan, math.nan
    i = int(np.argmax(found.damping_ratio))
    best = (float(found.damping_ratio[i]), float(found.amplitude[i]))
    if not 0 < i < len(found.points) - 1:
        return best
    logs = [found.points[j].log_amplitude for j in (i - 1, i, i + 1)]
    if not logs[0] < logs[1] < logs[2]:
        return best

    def at(log_amplitude: float) -> Corrected:
        j = i - 1 if log_amplitude < logs[1] else i
        share = (log_amplitude - found.points[j].log_amplitude) / (logs[j - i + 2] - logs[j - i + 1])
        return correct(equations, between(found, j, share), most=40)

    def slope(log_amplitude: float) -> float:
        point = at(log_amplitude)
        return _slope(equations, point) if point.converged else math.nan

    ends = slope(logs[0]), slope(logs[2])
    if not (ends[0] > 0.0 > ends[1]):
        return best
    top = float(brentq(slope, logs[0], logs[2], xtol=_CLOSE))
    point = at(top)
    if point.converged and float(point.state.y[-1]) >= best[0]:
        return float(point.state.y[-1]), math.exp(top)
    return best
