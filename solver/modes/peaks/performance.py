"""The damper performance curve from one nonlinear mode: peak over excitation against load over excitation.

Where one mode carries the resonance, its amplitude a under a harmonic force obeys

    |ω(a)² − Ω² + 2iζ(a)ω(a)Ω| a = |Qᴴ f|        (Q the mass-normalised mode),

of which the largest a is at Ω = ω √(1 − 2ζ²), with |Qᴴ f| = 2ζ √(1 − ζ²) ω² a: the force of every point of
the curve in closed form (synthesis of a single nonlinear mode, after M. Krack, L. Panning-von Scheidt,
J. Wallaschek). Coulomb friction is
homogeneous: forces, loads and motions grow together, so one curve serves every load and every excitation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np

from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.modes.mode_results import NonlinearMode
from solver.modes.mode_start import LinearMode, coordinates_of, linear_modes
from solver.modes.nonlinear_mode import nonlinear_mode, pose
from solver.results.base import Data, Drawn, Views
from solver.scene.scene import Scene

_SAME = 1e-9  # relative difference of forces that are proportional

_BELOW, _BEYOND = 0.5, 3.0  # of the amplitudes that the least and the largest excitation make
_LOOKS, _AGAIN, _LOWER, _HIGHER = 8, 3, 0.2, 30.0  # times that a range is widened, and by how much
_WEAK = 1e-6  # damping ratio that a mode without any is given: its peak is not bounded


class LeastOverLoads(NamedTuple):
    """Factor on the loads at which a peak is least, and that peak [m]."""

    load: float
    peak: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PerformanceCurve(Drawn):
    """Resonance peaks of one mode over the excitation, or over the loads; n points along the mode's curve."""

    VIEWS: ClassVar = Views("solver.views", "of_performance", "of_performance")
    DATA: ClassVar = Data(
        "performance", {"point": "excitation peak frequency=frequency_hz load peak_at_load"},
        "mode_number=mode.mode", status="mode.status", scene="mode.scene",
    )  # fmt: skip
    JSON: ClassVar = "excitation peak frequency=frequency_hz scales load peak_at_load least"

    mode: Annotated[NonlinearMode, "It is of."]
    excitation: Annotated[
        Real, "Factor on every force of the scene's excitation at which its response has this peak, (n,)."
    ]
    peak: Annotated[Real, "max|x| of the observed DOF there [m], (n,)."]
    frequency_hz: Annotated[Real, "Where the peak is [Hz], (n,)."]
    scales: Annotated[
        bool,
        "Whether forces, loads and motions grow together here; only then are `load` and `peak_at_load` "
        "known.",
    ]
    load: Annotated[
        Real,
        "Factor on every load, the excitation as it is, of the same performance; NaN if not known, (n,).",
    ]
    peak_at_load: Annotated[Real, "The peak then [m]. NaN if not known. (n,)."]

    def at_excitation(self, factor: float) -> tuple[float, float]:
        """Return the highest peak [m] and its frequency [Hz] at a factor on the excitation; NaN if beyond.

        Between points both go along straight lines over logarithms.
        """
        return self._highest(self.excitation, self.peak, factor)

    def at_load(self, factor: float) -> tuple[float, float]:
        """Return the same at a factor on every load, the excitation as it is; NaN where it is not known."""
        if not self.scales:
            return math.nan, math.nan
        return self._highest(self.load, self.peak_at_load, factor)

    def _highest(self, places: Real, heights: Real, at: float) -> tuple[float, float]:
        """Return the highest of the curve's crossings of a place, which it may pass several times."""
        found = crossing(places, heights, at)
        if found is None:
            return math.nan, math.nan
        i, share, height = found
        before, behind = self.frequency_hz[i : i + 2]
        return height, float((1.0 - share) * before + share * behind)

    @property
    def least(self) -> LeastOverLoads:
        """Factor on the loads at which the peak is least, and that peak [m]; NaN where it is not known."""
        if not self.scales or not self.load.size:
            return LeastOverLoads(math.nan, math.nan)
        tops = [self.at_load(float(load))[0] for load in self.load]
        best = int(np.nanargmin(tops))
        return LeastOverLoads(float(self.load[best]), float(tops[best]))

    def to_json(self) -> dict[str, Any]:
        """Return the curve as one JSON object."""
        if not self.scales:
            return self._json(load=None, peak_at_load=None, least=None)
        return self._json() if self.load.size else self._json(least=None)


def performance_curve(found: NonlinearMode) -> PerformanceCurve:
    """Return the resonance peaks that one nonlinear mode stands for, over excitation and load.

    An approximation: other modes and higher harmonics of the force are left out, and a response far from the
    mode's own frequency. `solver.track_peak` over ``excitation.amplitude`` is the exact answer.

    Raises
    ------
    SettingError
        The excitation's first harmonic does not drive the mode.
    """
    forcing = found.forcing
    if forcing.size and not np.all(forcing > 1e-12 * max(float(forcing.max()), 1e-300)):
        scene = found.scene
        wanted = "must have a force of harmonic 1 that drives the mode"
        raise SettingError("excitation", [force.place for force in scene.excitation], wanted)
    factor, damped = excitations_of(found)
    with np.errstate(divide="ignore"):
        load = 1.0 / factor
    scales = bool(found.points) and grows_together(found)
    unknown = np.full(load.size, math.nan)
    return PerformanceCurve(
        mode=found, excitation=factor, peak=found.max_abs,
        frequency_hz=found.frequency_hz * np.sqrt(np.maximum(1.0 - 2.0 * damped**2, 0.0)), scales=scales,
        load=load if scales else unknown, peak_at_load=found.max_abs * load if scales else unknown,
    )  # fmt: skip


def excitations_of(found: NonlinearMode) -> tuple[Real, Real]:
    """Return the factor on the excitation that each point of a mode is the peak of, and its damping ratio.

    Of ζ above 1/√2 there is no peak but at rest, of ζ ≤ 0 none is bounded.
    """
    omega = 2.0 * math.pi * found.frequency_hz
    damped = np.clip(found.damping_ratio, 0.0, math.sqrt(0.5))
    factor = 2.0 * damped * np.sqrt(1.0 - damped**2) * omega**2 * found.amplitude / found.forcing
    return factor, damped


def with_loads(scene: Scene, factor: float) -> Scene:
    """Return the scene with the given normal loads of all contacts times a factor."""
    changed = []
    for contact in scene.contacts:
        given = {key: getattr(contact, key, None) for key in ("N0", "N1")}
        scaled = {key: factor * value for key, value in given.items() if value is not None}
        higher = getattr(contact, "higher_load", None) or ()
        scaled["higher_load"] = tuple(each.times(factor) for each in higher) or None
        changed.append(contact.model_copy(update=scaled))
    return scene.model_copy(update={"contacts": tuple(changed)})


def grows_together(found: NonlinearMode) -> bool:
    """Return whether contact forces double where loads and motions do, at the last point of a mode."""
    if found.scene.constant_forces or any(force.harmonic == 0 for force in found.scene.excitation):
        return False
    state = found.points[-1]
    forces = []
    for factor in (1.0, 2.0):
        scene = with_loads(found.scene, factor)
        equations = pose(scene, found.mode, None, found.n_harmonics, whole=found.whole_matrices).equations
        w = factor * state.y[: equations.size].reshape(equations.r, equations.n)
        if not equations.contacts(w, float(state.y[-2])):
            return False
        forces.append(equations.point.F / factor)
    size = float(np.abs(forces[0]).max(initial=0.0))
    return bool(np.abs(forces[1] - forces[0]).max(initial=0.0) <= _SAME * size)


def crossing(places: Real, heights: Real, at: float) -> tuple[int, float, float] | None:
    """Return the number of the point before the highest crossing of a place, the share beyond it, its height.

    None where a curve does not pass the place.
    """
    found = []
    for i in range(places.size - 1 if at > 0.0 else 0):
        one, other = places[i], places[i + 1]
        if not (0.0 < one < math.inf and 0.0 < other < math.inf) or (one - at) * (other - at) > 0.0:
            continue
        share = 0.0 if one == other else math.log(at / one) / math.log(other / one)
        found.append((i, share, float(heights[i] ** (1.0 - share) * heights[i + 1] ** share)))
    return max(found, key=lambda each: each[2], default=None)


def carrying_mode(scene: Scene, *, harmonics: int = 1) -> int:
    """Return the number of the mode with the highest resonance of the band, contacts as they are at rest.

    Raises
    ------
    SettingError
        No mode of the band is driven by the excitation and seen at the observed DOF.
    """
    problem = pose(scene, 1, None, harmonics)
    equations, s = problem.equations, problem.equations.structure
    low, high = scene.observe.band
    best, number = 0.0, 0
    for i, mode in enumerate(problem.all_modes):
        if not low <= mode.omega / (2.0 * math.pi) <= high:
            continue
        shape = coordinates_of(equations, mode)
        driven = abs(complex(np.vdot(shape, s.force)))
        seen = abs(complex(np.sum(s.observe[s.first] * shape)))
        height = driven * seen / (2.0 * max(mode.zeta, _WEAK) * mode.omega**2)
        if height > best:
            best, number = height, i + 1
    if number == 0:
        wanted = "must excite a mode of the band, contacts as they are at rest"
        raise SettingError("excitation", [force.place for force in scene.excitation], wanted)
    return number


def performance_over(
    scene: Scene, factors: tuple[float, float], mode: int | None = None, *, harmonics: int = 11,
    should_stop: Callable[[], bool] | None = None,
) -> PerformanceCurve:  # fmt: skip
    """Return the performance curve of a mode over a range of factors on the excitation.

    Parameters
    ----------
    scene : what vibrates, with its excitation.
    factors : smallest and largest factor on the excitation that the curve should reach.
    mode : its number; that with the highest resonance of the band if left out.
    harmonics, should_stop : as of `nonlinear_mode`.

    Returns
    -------
    The curve; it may reach less, where its mode says so.

    Raises
    ------
    SettingError
        As `nonlinear_mode`, `performance_curve` and `carrying_mode`.
    """
    number = carrying_mode(scene, harmonics=harmonics) if mode is None else mode
    low, high = _amplitudes(scene, number, factors, harmonics)
    for _ in range(_LOOKS):
        # Contacts that slip at once take more force for the same amplitude than those at rest.
        begun = nonlinear_mode(
            scene, number, amplitudes=(low, high), harmonics=harmonics, errors=False, most_points=1
        )
        if begun.points and begun.forcing[0] > 0.0 and excitations_of(begun)[0][0] <= factors[0]:
            break
        low *= _LOWER
    for again in range(_AGAIN):
        found = nonlinear_mode(
            scene, number, amplitudes=(low, high), harmonics=harmonics, errors=False, should_stop=should_stop
        )
        curve = performance_curve(found)
        if again == _AGAIN - 1 or not curve.excitation.size or (should_stop is not None and should_stop()):
            break
        short = curve.excitation[0] > factors[0], found.reached and curve.excitation[-1] < factors[1]
        if not any(short):
            break
        low, high = low * (_LOWER if short[0] else 1.0), high * (_HIGHER if short[1] else 1.0)
    return curve


def _amplitudes(
    scene: Scene, number: int, factors: tuple[float, float], harmonics: int
) -> tuple[float, float]:
    """Return modal amplitudes [√kg m] below and beyond those that the excitations make."""
    problem = pose(scene, number, None, harmonics)
    equations = problem.equations
    force = equations.structure.force
    mode = problem.mode

    def reached(one: LinearMode, factor: float) -> float:
        driven = abs(complex(np.vdot(coordinates_of(equations, one), force)))
        return factor * driven / (2.0 * max(one.zeta, _WEAK) * max(one.omega, 1e-300) ** 2)

    low = _BELOW * reached(mode, factors[0])
    nc = equations.balance.n_ports
    free = linear_modes(equations.balance, np.zeros((nc, nc), np.complex128))
    # With the contacts gone the mode that was stuck is one of the slower ones, with less damping mostly.
    ends: Real = np.array([reached(one, factors[1]) for one in free[:number] if one.omega > 0.0])
    high = _BEYOND * max(float(ends.max(initial=0.0)), reached(mode, factors[1]))
    if not low > 0.0:
        raise SettingError(
            "excitation", [each.place for each in scene.excitation], "must have a force that drives the mode"
        )
    return low, max(high, 10.0 * low)
