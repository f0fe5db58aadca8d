"""The peak of a performance curve at one excitation, with its gradient, and what it is off by.

Along a mode's curve, peak A(a, θ) and force p(a, θ) = 2ζ√(1 − ζ²) ω² a / |Qᴴ f| depend on the amplitude and
on the parameters θ. At a given force

    d ln A / dθ = ∂ ln A/∂θ − (∂ ln A/∂ ln a) (∂ ln p/∂θ) / (∂ ln p/∂ ln a).

Each derivative follows from the change dy of the unknowns of the extended periodic motion, J dy = −∂r, and
from that the change of the motion, dx = Z⁻¹ (dφ − Lᴴ dF − dZ x).

What it is off by, the whole balance tells, solved near the synthesised motion.
At a peak of the response to a held force |x| is stationary over the frequency. Where the amplitude is held
instead, so is the force: the response of the least force p(A) = min over Ω of p(A, Ω) is a peak of the
response to that force. p(A, Ω) is smooth and flat there whatever the peak over Ω looks like at a held force,
so Newton's method finds it from the motion that one mode alone would have, and the amplitude at which
p(A) is the force asked for follows by secants. That is the peak with all modes and harmonics of the balance,
next to the synthesised one; peaks elsewhere in the band it does not see.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, cast

import numpy as np

from solver.continuation.bracketing import least_between
from solver.errors import SettingError
from solver.jit.fourier import Complex, Real
from solver.modes.mode_curve import Corrected, ModeState, correct, scales
from solver.modes.mode_equations import Held
from solver.modes.mode_gradient import ModeSensitivities, changed_motion
from solver.modes.nonlinear_mode import Recorder, pose
from solver.modes.peaks.performance import PerformanceCurve, crossing
from solver.results.told import Piece

_EXACT = 1e-10  # ln of the force within which it is the one asked for
_CURVE_SECANTS = 30


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
        for _ in range(_CURVE_SECANTS):
            point = correct(self._equations, state, most=40)
            if not point.converged:
                return None
            off = self.read(point).log_force - log_force
            if abs(off) <= _EXACT:
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


_NEAREST, _FARTHEST = 2, 8  # half widths of the resonance looked at to both sides of it, at least and at most
_CLOSE = 0.02  # of a half width, to which the frequency of the least force is sought: 2e-4 of the force
_TRIES, _SECANTS, _HALVINGS = 12, 10, 3
_NEWTON, _FINE = 12, 1e-6  # steps, and the residual that an estimate of some per mille asks for
_SAME = 5e-4  # ln of the force within which it is the one asked for
_LONGEST = 0.3  # of ln A a secant step


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PeakCorrection(Piece):
    """The peak of a performance curve beside that of the whole balance next to it."""

    JSON: ClassVar = "synthesised peak frequency=frequency_hz error solves"

    synthesised: Annotated[float, "Peak of the curve [m]."]
    peak: Annotated[float, "With all modes and harmonics [m]; NaN if it was not found."]
    frequency_hz: Annotated[float, "Where that is [Hz]."]
    solves: Annotated[int, "Responses solved for."]

    @property
    def error(self) -> float:
        """Estimated error of the curve's peak, relative: (synthesised − peak) / peak; NaN if not known."""
        return self.synthesised / self.peak - 1.0

    def suffices(self, tolerance: float) -> bool:
        """Whether the curve is good to a relative tolerance, as far as is known."""
        return abs(self.error) <= tolerance


def corrected_peak(curve: PerformanceCurve, factor: float) -> PeakCorrection:
    """Return what the peak at a factor on the excitation is with the whole balance, next to the curve's.

    Raises
    ------
    SettingError
        An excitation beyond harmonic 1, which one mode's synthesis leaves out.
    """
    scene = curve.mode.scene
    if any(force.harmonic > 1 for force in scene.excitation):
        wanted = "must have no harmonic above the first to be corrected"
        raise SettingError("excitation", [force.place for force in scene.excitation], wanted)
    synthesised, _ = curve.at_excitation(factor)
    if not math.isfinite(synthesised):
        return PeakCorrection(synthesised=math.nan, peak=math.nan, frequency_hz=math.nan, solves=0)
    near = _Neighbourhood(curve)
    found = near.peak_under(factor, synthesised)
    peak, frequency = math.nan, math.nan
    if found is not None:
        peak = Recorder(near.equations, turns=False).of(found).max_abs
        frequency = math.exp(found.state.log_amplitude) / (2.0 * math.pi)
    return PeakCorrection(synthesised=synthesised, peak=peak, frequency_hz=frequency, solves=near.solves)


class _Neighbourhood:
    """Responses near the synthesised one, at held amplitudes."""

    def __init__(self, curve: PerformanceCurve) -> None:
        found = curve.mode
        self._curve, self._found = curve, found
        how = found.scene, found.mode, None, found.n_harmonics
        self._mode = pose(*how, whole=found.whole_matrices).equations
        problem = pose(*how, whole=found.whole_matrices, kind=Held)
        self.equations, self._turns = cast(Held, problem.equations), problem.turns
        self.equations.whole = True
        self.width, self.solves = 0.0, 0

    def peak_under(self, factor: float, synthesised: float) -> Corrected | None:
        """Return the peak of the response to the excitation times a factor; None if it was not found."""
        curve = self._curve
        i = int(
            np.argmin(np.abs(np.log(curve.excitation / factor)) + np.abs(np.log(curve.peak / synthesised)))
        )
        state = self._synthesised(i)
        log_peak = math.log(synthesised)
        tried: list[tuple[float, float]] = []
        for _ in range(_SECANTS):
            least = self._least_force(state, math.exp(log_peak))
            if least is None:
                return None
            state = least.state
            off = math.log(float(state.y[-1]) * self.equations.unit / factor)
            tried.append((log_peak, off))
            move = -self._slope(i, tried) * off
            if abs(off) <= _SAME and abs(move) <= 2.0 * _SAME:
                return least
            log_peak += min(max(move, -_LONGEST), _LONGEST)
        return None

    def _slope(self, i: int, tried: Sequence[tuple[float, float]]) -> float:
        """Return d ln A / d ln p: of the curve at first, then by secants."""
        if len(tried) >= 2 and tried[-1][1] != tried[-2][1]:
            return (tried[-1][0] - tried[-2][0]) / (tried[-1][1] - tried[-2][1])
        j = min(max(i, 1), self._curve.peak.size - 2)
        rise = math.log(self._curve.excitation[j + 1] / self._curve.excitation[j - 1])
        return math.log(self._curve.peak[j + 1] / self._curve.peak[j - 1]) / rise if rise else 1.0

    def _synthesised(self, i: int) -> ModeState:
        """Return the motion of point i turned as its force turns it: (ω² − Ω² + 2iζωΩ) a = Qᴴ f."""
        mode, held, curve = self._mode, self.equations, self._curve
        point, s = self._found.points[i], held.structure
        omega, zeta = float(point.y[-2]), float(point.y[-1])
        damped = min(max(zeta, 1e-9), 0.7)
        at = omega * math.sqrt(1.0 - 2.0 * damped**2)
        evaluated = mode.evaluate(point.y, point.log_amplitude, point.phase, point.mode)
        if evaluated is None:
            raise ValueError("a point without a value is none of a curve")
        x: Complex = evaluated.x
        turned = 0.0
        if self._turns:
            lag = omega**2 - at**2 + 2j * damped * omega * at
            turned = float(np.angle(complex(np.vdot(x[s.first], s.force)) / lag))
        turns = np.exp(1j * s.ks * turned)
        hat, n = held.amplitudes, mode.size
        w = hat.coefficients(hat.of(point.y[:n].reshape(mode.r, mode.n)) * turns)
        q = complex(point.y[n], point.y[n + 1]) * turns[s.first]
        self.width = damped * math.sqrt(1.0 - damped**2)
        held.unit, held.target = float(curve.excitation[i]), float(curve.peak[i])
        y = np.concatenate([w.reshape(-1), [q.real, q.imag, at, 1.0]])
        return ModeState(y=y, log_amplitude=math.log(at), mode=point.mode, phase=np.zeros_like(s.force))

    def _at(self, near: ModeState, log_omega: float, depth: int = 0) -> Corrected | None:
        """Return the response at ln Ω from one nearby, in smaller steps where it must; None if not found."""
        y = near.y.copy()
        y[-2] = math.exp(log_omega)
        self.solves += 1
        guess = replace(near, y=y, log_amplitude=log_omega)
        found = correct(self.equations, guess, most=_NEWTON, fine=_FINE, good=_FINE)
        if found.converged and found.state.y[-1] > 0.0:
            return found
        if depth == _HALVINGS or log_omega == near.log_amplitude:
            return None
        half = self._at(near, 0.5 * (near.log_amplitude + log_omega), depth + 1)
        return None if half is None else self._at(half.state, log_omega, depth + 1)

    def _scaled_to(self, state: ModeState, amplitude: float, depth: int = 0) -> Corrected | None:
        """Return the response of an amplitude at the same Ω, in smaller steps where it must."""
        held, before = self.equations, self.equations.target
        ratio, held.target = amplitude / before, amplitude
        found = self._at(state.scaled(held.size, ratio), state.log_amplitude)
        if found is not None or depth == _HALVINGS or ratio == 1.0:
            return found
        held.target = before
        half = self._scaled_to(state, math.sqrt(before * amplitude), depth + 1)
        return None if half is None else self._scaled_to(half.state, amplitude, depth + 1)

    def _least_force(self, state: ModeState, amplitude: float) -> Corrected | None:
        """Return the response of an amplitude with the least force, from one near it."""
        centre = self._scaled_to(state, amplitude)
        if centre is None:
            return None
        known = [centre]
        for way in (1.0, -1.0):
            near = centre
            for k in range(1, _FARTHEST + 1):
                there = centre.state.log_amplitude + way * k * self.width
                beside = self._at(near.state, there)
                if beside is None:
                    break
                known.append(beside)
                rises = beside.state.y[-1] > near.state.y[-1]
                near = beside
                if rises and k >= _NEAREST:
                    break
        known.sort(key=lambda one: one.state.log_amplitude)
        i = int(np.argmin([_force(one) for one in known]))
        if not 0 < i < len(known) - 1:
            return None  # the least force is not between places that were looked at
        ends = known[i - 1].state.log_amplitude, known[i + 1].state.log_amplitude

        def at(log_omega: float) -> Corrected | None:
            near = min(known, key=lambda one: abs(one.state.log_amplitude - log_omega))
            found = self._at(near.state, log_omega)
            known.extend([] if found is None else [found])
            return found

        least_between(at, _force, *ends, _CLOSE * self.width, _TRIES, 2.0 * max(map(_force, known)))
        return min(known, key=_force)


def _force(point: Corrected) -> float:
    return float(point.state.y[-1])
