"""The peak of a performance curve at one excitation, solved for between points, with its gradient.

Along a mode's curve, peak A(a, θ) and force p(a, θ) = 2ζ√(1 − ζ²) ω² a / |Qᴴ f| depend on the amplitude and
on the parameters θ. At a given force

    d ln A / dθ = ∂ ln A/∂θ − (∂ ln A/∂ ln a) (∂ ln p/∂θ) / (∂ ln p/∂ ln a).

Each derivative follows from the change dy of the unknowns of the extended periodic motion, J dy = −∂r, and
from that the change of the motion, dx = Z⁻¹ (dφ − Lᴴ dF − dZ x).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.jit.fourier import Complex, Real
from solver.modes.mode_curve import Corrected, correct, scales
from solver.modes.mode_gradient import ModeSensitivities, changed_motion
from solver.modes.nonlinear_mode import pose
from solver.modes.peaks.performance import PerformanceCurve, crossing
from solver.results.told import Piece

_SAME = 1e-10  # ln of the force within which it is the one asked for
_SECANTS = 30


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CurvePeak(Piece):
    """The peak of one mode at an excitation."""

    peak: Annotated[float, "max|x| of the observed DOF [m]; NaN where the curve lacks the excitation."]
    frequency_hz: Annotated[float, "Where that is [Hz]."]
    gradient: Annotated[
        Real,
        "Of the peak by parameter paths [m per unit of each]; NaN where the curve turns back in its force, "
        "(n_paths,).",
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """ln A, ln p and the frequency [Hz] at a point, with rows for their changes."""

    log_peak: float
    log_force: float
    frequency_hz: float
    top: Complex  # (nk, N): d ln A = Re Σ topᴴ dx
    drive: Complex  # (nk, N): d ln |Qᴴ f| + d ln a = Re Σ driveᴴ dx
    by_zeta: float  # of ln p


def peak_at_excitation(curve: PerformanceCurve, factor: float, paths: Sequence[str] = ()) -> CurvePeak:
    """Return the highest peak of a performance curve at a factor on the excitation, with its gradient.

    Parameters
    ----------
    curve : of `solver.performance_curve`.
    factor : on the scene's excitation.
    paths : parameter paths of the scene; groups too.

    Raises
    ------
    SettingError
        An unknown path.
    """
    nothing = np.full(len(paths), math.nan)
    at = crossing(curve.excitation, curve.peak, factor)
    if at is None:
        return CurvePeak(peak=math.nan, frequency_hz=math.nan, gradient=nothing)
    solver = _Solver(curve, paths)
    point = solver.solved(at[0], at[1], math.log(factor))
    if point is None:
        return CurvePeak(
            peak=curve.at_excitation(factor)[0], frequency_hz=curve.at_excitation(factor)[1], gradient=nothing
        )
    reading = solver.read(point)
    peak = math.exp(reading.log_peak)
    gradient = peak * solver.slopes(point) if len(paths) else nothing
    return CurvePeak(peak=peak, frequency_hz=reading.frequency_hz, gradient=gradient)


class _Solver:
    """Points of a mode's curve between those known."""

    def __init__(self, curve: PerformanceCurve, paths: Sequence[str]) -> None:
        self._found = curve.mode
        problem = pose(
            self._found.scene, self._found.mode, None, self._found.n_harmonics,
            whole=self._found.whole_matrices,
        )  # fmt: skip
        self._equations = problem.equations
        self._sensitivities = (
            ModeSensitivities(problem.equations, paths, turns=problem.turns) if len(paths) else None
        )

    def solved(self, i: int, share: float, log_force: float) -> Corrected | None:
        """Return the point between i and i + 1 of a given force; None if it was not found."""
        state = self._found.points[i].towards(self._found.points[i + 1], share)
        tried: list[tuple[float, float]] = []
        ends = sorted(self._found.points[j].log_amplitude for j in (i, i + 1))
        room = ends[1] - ends[0]
        for _ in range(_SECANTS):
            point = correct(self._equations, state, most=40)
            if not point.converged:
                return None
            off = self.read(point).log_force - log_force
            if abs(off) <= _SAME:
                return point
            here = point.state.log_amplitude
            tried.append((here, off))
            changes = self._changes(point, np.zeros((0, 0)))
            slope = math.nan if changes is None else float(changes[1][0])  # ∂ ln p/∂ ln a
            if len(tried) >= 2 and tried[-1][1] != tried[-2][1]:
                slope = (tried[-1][1] - tried[-2][1]) / (tried[-1][0] - tried[-2][0])
            if not slope or not math.isfinite(slope):
                return None
            move = min(max(-off / slope, -0.5 * room), 0.5 * room)
            to = min(max(here + move, ends[0] - room), ends[1] + room)
            if to == here:
                return None
            raised = point.state.scaled(self._equations.size, math.exp(to - here))
            state = replace(raised, log_amplitude=to)
        return None

    def read(self, point: Corrected) -> _Reading:
        """Return ln A, ln p and what changes them."""
        at, state, s = point.at, point.state, self._equations.structure
        if at is None:
            raise ValueError("a point without a value is none of a curve")
        x = at.x
        size, top = self._equations.top(x)
        seen = complex(np.vdot(s.force, x[s.first]))
        drive = np.zeros_like(x)
        drive[s.first] = s.force * seen / abs(seen) ** 2
        omega, zeta = float(state.y[-2]), min(max(float(state.y[-1]), 1e-12), math.sqrt(0.5))
        log_force = math.log(2.0 * zeta * math.sqrt(1.0 - zeta**2)) + 2.0 * math.log(omega)
        log_force += 2.0 * state.log_amplitude - math.log(abs(seen))
        return _Reading(
            log_peak=math.log(size), log_force=log_force, top=top / size, drive=drive,
            frequency_hz=omega * math.sqrt(max(1.0 - 2.0 * zeta**2, 0.0)) / (2.0 * math.pi),
            by_zeta=1.0 / zeta - zeta / (1.0 - zeta**2),
        )  # fmt: skip

    def slopes(self, point: Corrected) -> Real:
        """Return d ln A / dθ at the point's force."""
        sensitivities, at = self._sensitivities, point.at
        if sensitivities is None or at is None:
            return np.zeros(0)
        rows, pushes = sensitivities.changes(point.state, at)
        found = self._changes(point, rows, pushes)
        if found is None or found[1][0] == 0.0:
            return np.full(len(rows), math.nan)
        tops, forces = found
        return np.asarray(tops[1:] - tops[0] / forces[0] * forces[1:])

    def _changes(
        self, point: Corrected, rows: Real, pushes: Sequence[Complex] = ()
    ) -> tuple[Real, Real] | None:
        """Return the derivatives of ln A and ln p by ln a and then by each parameter; None if singular.

        Parameters
        ----------
        rows : (n, m) ∂r/∂θ; pushes : (nk, N) each, what θ pushes on the coordinates.
        """
        at, state = point.at, point.state
        if at is None:
            return None
        columns, reading = scales(state.y, self._equations.size), self.read(point)
        steps = [at.step(-change, columns) for change in (at.by_log_amplitude, *rows)]
        if any(dy is None for dy in steps):
            return None
        dy, pushed = np.array(steps), np.array([np.zeros_like(at.x), *pushes])
        dx = changed_motion(self._equations, state, at, dy, pushed)
        tops = np.einsum("kn,pkn->p", reading.top.conj(), dx).real
        forces = 2.0 * dy[:, -2] / float(state.y[-2]) + reading.by_zeta * dy[:, -1]
        forces -= np.einsum("kn,pkn->p", reading.drive.conj(), dx).real
        forces[0] += 2.0  # |Qᴴ f| is that of x / a
        return tops, forces
