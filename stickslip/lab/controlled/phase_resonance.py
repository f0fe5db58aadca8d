"""Phase resonance: the forced responses whose harmonic 1 lags the excitation by a quarter of a period.

The equations are those of the extended periodic motion (`mode_equations`) with the excitation f in
place of the artificial damping, Z_1 x_1 + Lᴴ F_1 = p f, at a given modal amplitude a: what a test with a
controlled phase and amplitude measures (S. Peter, R. I. Leine, Mech. Syst. Signal Process. 96 (2017) 139,
doi:10.1016/j.ymssp.2017.04.011).
The force is written as p = z c a with c = 2ω₀²/|φᴴ f| of the linear mode φ, so that the last unknown z is the
damping ratio that one mode alone would have.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from solver.balance.contact_hessian import check_no_line
from solver.errors import SettingError
from solver.jit.timer import clock
from solver.jit.fourier import Complex, Real
from solver.modes.mode_curve import follow
from solver.modes.mode_equations import Evaluated, Forced
from solver.modes.nonlinear_mode import MOST_POINTS, check_amplitudes, pose
from solver.modes.nonlinear_mode import Recorder, last_unknowns, curve_fields
from solver.modes.mode_results import NonlinearModeStatus, PhaseResonance
from solver.modes.mode_start import begin, coordinates_of

if TYPE_CHECKING:
    from solver.scene.scene import Scene

_FAINT = 1e-9  # share of the excitation along a mode below which it does not drive it


class Driven(Forced):
    """The responses to the excitation at a given amplitude; the last unknown is z, see the module.

    `unit` is c, set when the linear mode is known.
    """

    def evaluate(self, y: Real, log_amplitude: float, phase: Complex, mode: int) -> Evaluated | None:
        """Return the equations at y: the force grows with a."""
        at = super().evaluate(y, log_amplitude, phase, mode)
        if at is None:
            return None
        return replace(at, by_log_amplitude=at.by_log_amplitude + y[-1] * at.jacobian[:, -1])

    def by_force(self, log_amplitude: float = 0.0) -> Complex:
        """Return p f / z on the coordinates."""
        return math.exp(log_amplitude) * super().by_force()


def phase_resonance(
    scene: Scene, mode: int = 1, *, amplitudes: Sequence[float], nodal_diameter: int | None = None,
    harmonics: int = 11, most_points: int = MOST_POINTS,
    on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> PhaseResonance:  # fmt: skip
    """Follow the responses in phase resonance over their amplitude: frequency and force that they take.

    Every point is a response to the scene's excitation times a factor, exact but for the harmonics left out:
    |x| of harmonic 1 lags the excitation by 90°. Unlike `nonlinear_mode` nothing artificial is added.

    Parameters
    ----------
    scene, mode, amplitudes, nodal_diameter, harmonics, most_points : as of `nonlinear_mode`.
    on_progress, should_stop : as of `nonlinear_mode`.

    Raises
    ------
    SettingError
        As `nonlinear_mode`; or an excitation that does not drive the mode, has harmonics beyond the first,
        or follows the speed along an engine-order line.
    """
    begun = clock()
    low, high = (math.log(each) for each in check_amplitudes(amplitudes))
    check_no_line(scene)
    problem = pose(scene, mode, nodal_diameter, harmonics, kind=Driven)
    equations = cast(Driven, problem.equations)
    shape, force = coordinates_of(equations, problem.mode), equations.structure.force
    along = abs(complex(np.vdot(shape, force)))
    size = float(np.linalg.norm(shape) * np.linalg.norm(force))
    alone = all(each.harmonic in (0, 1) for each in scene.excitation)
    if not alone or not along > _FAINT * size:
        wanted = "must have a force of harmonic 1 that drives the mode, and none of a higher harmonic"
        raise SettingError("excitation", [each.place for each in scene.excitation], wanted)
    equations.unit = 2.0 * problem.mode.omega**2 / along
    first = begin(equations, problem.mode, problem.rest, low, turns=False)
    curve = follow(
        equations, first, high, turns=False, most_points=most_points, on_progress=on_progress,
        should_stop=should_stop,
    )  # fmt: skip
    points, recorder = curve.points, Recorder(equations, turns=False)
    amplitude = np.exp(np.array([point.state.log_amplitude for point in points], dtype=np.float64))
    frequency, z = last_unknowns(points)
    return PhaseResonance(
        **curve_fields(equations, points, [recorder.of(point) for point in points], begun), mode=int(mode),
        status=NonlinearModeStatus[curve.end.name], amplitude=amplitude, frequency_hz=frequency,
        excitation=z * equations.unit * amplitude,
    )  # fmt: skip
