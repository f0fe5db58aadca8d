"""The performance curve of the mode that carries a scene's resonance, over a range of excitations."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from solver.errors import SettingError
from solver.jit.fourier import Real
from solver.modes.mode_start import LinearMode, coordinates_of, linear_modes
from solver.modes.nonlinear_mode import nonlinear_mode, pose
from solver.modes.peaks.performance import PerformanceCurve, excitations_of, performance_curve
from solver.scene.scene import Scene

_BELOW, _BEYOND = 0.5, 3.0  # of the amplitudes that the least and the largest excitation make
_LOOKS, _AGAIN, _LOWER, _HIGHER = 8, 3, 0.2, 30.0  # times that a range is widened, and by how much
_WEAK = 1e-6  # damping ratio that a mode without any is given: its peak is not bounded


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
