"""Responses at a held amplitude: the force that keeps harmonic 1 of one DOF at A, over the frequency.

Test rigs are run so, because the amplitude settles the state of the contacts: response by response hardly
anything changes but the phase, folds of the response to a held force vanish, and its unstable parts are
reached (T. Karaağaçlı, H. N. Özgüven, Mech. Syst. Signal Process. 146 (2021) 107023,
doi:10.1016/j.ymssp.2020.107023).

The equations are those of the balance under the force z c f, with z as one more unknown and

    ln (|o x_1| / A) = 0,   ln ω − λ = 0,                     o the row of the DOF,

in place of phase and modal amplitude (`solver.modes.mode_equations`); the curve is followed over λ = ln ω. In
place of |o x_1| it may be max|x| of the DOF that is held.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solver.balance.balance import Balance
from solver.continuation.bracketing import least_between
from solver.jit.fourier import Complex, Real, cosine_position
from solver.modes.corrector import Corrected, ModeState, correct
from solver.modes.mode_equations import Evaluated, Forced
from solver.modes.mode_start import slopes_at_rest
from solver.modes.mode_structure import Dynamics

_RUNGS = 24  # of amplitude, each `_RISE` times the one before, from which a start is walked up
_RISE = 1.6
_MOST_AT_FIRST = 60
_LEAST_RISE = 1.01
_CLOSE, _MOST_TRIES = 1e-9, 60  # of ln ω, where the force is least


class Held(Forced):
    """The responses with a given harmonic 1, or max|x|, of the observed DOF; the last unknown is z.

    Attributes
    ----------
    target : A [m].
    unit : c, the factor on the excitation that z counts in.
    whole : max|x| is held, not harmonic 1 alone.
    """

    def __init__(self, balance: Balance) -> None:
        super().__init__(balance)
        self.target, self.whole = 1.0, False

    def over(self, balance: Balance) -> Held:
        """Return the same question to another balance of the scene."""
        other = Held(balance)
        other.target, other.unit, other.whole = self.target, self.unit, self.whole
        return other

    def follows(self, before: Real, y: Real) -> bool:
        """Return whether z keeps its sign: it can not pass 0, where the force would feed nothing.

        Over a sharp resonance a long step would: the force that turns by half a period within it is the same
        with the other sign.
        """
        return bool(before[-1] * y[-1] > 0.0)

    def _seen(self, x: Complex) -> tuple[float, Complex]:
        """Return what is held [m], and c (nk, N) of its change Re Σ c_kᴴ dx_k."""
        s = self.structure
        if not self.whole:
            seen = complex(np.sum(s.observe[s.first] * x[s.first]))
            row = np.zeros_like(x)
            row[s.first] = s.observe[s.first].conj() * seen / max(abs(seen), 1e-300)
            return abs(seen), row
        return self.top(x)

    def _second_last(self, x: Complex, _turned: Complex) -> Complex:
        """Return c of the change of the logarithm of what is held."""
        size, row = self._seen(x)
        return row / max(size, 1e-300)

    def _assemble(
        self, w: Real, q: complex, forces: Real, x: Complex, by_omega: Complex, dynamics: Dynamics,
        log_amplitude: float, phase: Complex,
    ) -> Evaluated:  # fmt: skip
        """Put residual and Jacobian together; `log_amplitude` is λ."""
        s, size, omega = self.structure, self.size, math.exp(log_amplitude)
        at = super()._assemble(w, q, forces, x, by_omega, dynamics, log_amplitude, phase)
        residual, J = at.residual, at.jacobian
        residual[size + 2] = math.log(max(self._seen(x)[0], 1e-300) / self.target)
        # q is counted in what moves; `relative_residual` counts it in e^λ.
        unit = omega / max(math.sqrt(s.squared_amplitude(x)), 1e-300)
        residual[size : size + 2] *= unit
        J[size : size + 2] *= unit
        J[size + 3] = 0.0
        return replace(at, lag=1.0)

    def at_frequency(self, at: Evaluated, omega: float, log_omega: float) -> Evaluated:
        """Return the equations with ln ω − λ in their last row."""
        at.residual[-1] = math.log(omega) - log_omega
        at.jacobian[-1, -2] = 1.0 / omega
        return at

    def evaluate(self, y: Real, log_amplitude: float, phase: Complex, mode: int) -> Evaluated | None:
        """Return the equations at y, at λ = `log_amplitude`; None where a law failed or Z is singular."""
        at = super().evaluate(y, log_amplitude, phase, mode)
        return None if at is None else self.at_frequency(at, float(y[-2]), log_amplitude)


def first_held(equations: Held, rest: Real, omega: float) -> Corrected:
    """Return the response at ω with the amplitude asked for; from smaller ones upward where it must.

    Parameters
    ----------
    rest : (r, n) the equilibrium at the leading ports.
    """
    wanted = equations.target
    guess = _linear(equations, rest, omega)
    found = _solved(equations, guess)
    for rung in range(1, _RUNGS + 1):
        if found.converged:
            break
        equations.target = wanted / _RISE**rung
        found = _solved(equations, _scaled(equations, guess, rest, _RISE**-rung))
    spent, rise = found.iterations, _RISE
    while found.converged and equations.target < wanted:
        before = equations.target
        equations.target = min(before * rise, wanted)
        raised = _scaled(equations, found.state, rest, equations.target / before)
        there = _solved(equations, raised)
        spent += there.iterations
        if there.converged:
            found, rise = there, min(rise * rise, _RISE)
            continue
        equations.target, rise = before, math.sqrt(rise)
        if rise < _LEAST_RISE:
            found = replace(there, converged=False)
    equations.target = wanted
    return replace(found, iterations=spent)


def _solved(equations: Held, guess: ModeState) -> Corrected:
    """Return the solution from a guess; converged only with a force in its own phase, z > 0."""
    found = correct(equations, guess, most=_MOST_AT_FIRST)
    return found if found.state.y[-1] > 0.0 else replace(found, converged=False)


def least_force(equations: Held, points: Sequence[Corrected]) -> Corrected | None:
    """Return the point with the least force, solved for between points; None without a point.

    A force held instead has a peak there: |x| is stationary over the frequency where the force is.
    """
    if not points:
        return None
    i = int(np.argmin([point.state.y[-1] for point in points]))
    best = points[i]
    if not 0 < i < len(points) - 1:
        return best
    tried = [best]

    def at(log_omega: float) -> Corrected | None:
        near = min(tried, key=lambda each: abs(each.state.log_amplitude - log_omega))
        y = near.state.y.copy()
        y[-2] = math.exp(log_omega)
        found = correct(equations, replace(near.state, y=y, log_amplitude=log_omega), most=_MOST_AT_FIRST)
        if not found.converged or not found.state.y[-1] > 0.0:
            return None
        tried.append(found)
        return found

    def force(point: Corrected) -> float:
        return float(point.state.y[-1])

    low, high = sorted((points[i - 1].state.log_amplitude, points[i + 1].state.log_amplitude))
    least_between(at, force, low, high, _CLOSE, _MOST_TRIES, 2.0 * max(map(force, points)))
    return min(tried, key=force)


def _linear(equations: Held, rest: Real, omega: float) -> ModeState:
    """Return a guess: the response with the contacts as they are at rest, in the amplitude asked for."""
    s, first = equations.structure, equations.structure.first
    number = s.nearest(omega, 0.0)
    slopes = slopes_at_rest(equations, rest, omega)
    span = np.eye(equations.r) if equations.span is None else equations.span
    shift = np.diag(equations.balance.system.shift).astype(np.complex128)
    tied = np.zeros_like(shift) if slopes is None else slopes - shift
    K = s.back[first] @ (span.T @ tied @ span) @ s.contact[first]
    x = np.linalg.lstsq(s.stiffness(omega) + K, s.force, rcond=1e-14)[0]
    seen = abs(complex(np.sum(s.observe[first] * x)))
    factor = equations.target / max(seen, 1e-300)
    equations.unit = factor
    x = factor * x
    moved = s.contact[first] @ x
    w, here = rest.copy(), int(cosine_position(s.ks, first))
    if equations.size:
        w[:, here], w[:, here + 1] = moved.real, -moved.imag
    q = complex(np.vdot(s.carried[:, number], x))
    y = np.concatenate([w.reshape(-1), [q.real, q.imag, omega, 1.0]])
    return ModeState(
        y=y, log_amplitude=math.log(omega), mode=number, phase=np.zeros(s.force.size, np.complex128)
    )


def _scaled(equations: Held, state: ModeState, rest: Real, factor: float) -> ModeState:
    """Return a guess with what moves, and the force, times a factor."""
    guess = state.scaled(equations.size, factor, rest.reshape(-1))
    guess.y[-1] *= factor
    return guess
