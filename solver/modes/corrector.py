"""Newton's method for the extended periodic motion: at an amplitude, or along an arc."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from solver.jit.fourier import Complex, Real
from solver.modes.kernels.mode_assembly import relative_residual as relative
from solver.modes.mode_equations import Equations, Evaluated

TOLERANCE = 1e-9  # of motions relative to the largest, and of the equations beside them
_FINE = 1e-13  # below it nothing is left but rounding; between the two, steps go on as long as they help
MOST_ITERATIONS = 20
_CANCELLED = 1e-3  # as in `solver.balance.kernels.residual`: a share of |A| |F| a residual is relative to
_LEAST_PART = 1.0 / 32.0  # of a Newton step, before it is given up
_PATIENCE, _HOPE = 8, 0.9  # Newton steps along an arc within which the residual has to fall to this share


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeState:
    """A point of a nonlinear mode."""

    y: Annotated[Real, "(m,) unknowns of `solver.modes.mode_equations`."]
    log_amplitude: Annotated[float, "Ln a."]
    mode: Annotated[int, "Number of the mode of the structure that is carried in q."]
    phase: Annotated[Complex, "(N,) the force that harmonic 1 lags by a quarter of a period."]

    def towards(self, other: ModeState, share: float) -> ModeState:
        """Return a guess a share of the way to another point; q is of one mode alone."""
        y = self.y + share * (other.y - self.y) if self.mode == other.mode else self.y.copy()
        rise = other.log_amplitude - self.log_amplitude
        return replace(self, y=y, log_amplitude=self.log_amplitude + share * rise)

    def scaled(self, size: int, factor: float, rest: Real | float = 0.0) -> ModeState:
        """Return a guess with what moves about a rest, of `size` motions and q, times a factor."""
        y = self.y.copy()
        y[:size] = rest + factor * (y[:size] - rest)
        y[size : size + 2] *= factor
        return replace(self, y=y)


@dataclass(frozen=True, slots=True, kw_only=True)
class Corrected:
    """Where Newton's method ended."""

    state: Annotated[ModeState, "The last point; `at` the equations there (None where they have no value)."]
    at: Evaluated | None
    converged: bool
    iterations: int
    residual: Annotated[float, "Relative, see `relative_residual`."]


def scales(y: Real, size: int) -> Real:
    """Return what the unknowns are counted in, (m,): the largest motion, |q|, ω, and 1 of ζ."""
    found = np.ones(y.size)
    found[:size] = np.abs(y[:size]).max(initial=0.0) or 1.0
    found[size : size + 2] = math.hypot(y[size], y[size + 1]) or 1.0
    found[-2] = abs(y[-2])
    return found


def relative_residual(at: Evaluated, y: Real, a: float, size: int) -> float:
    """Return the largest residual, each relative to what it is a difference of."""
    return float(relative(at.residual, at.rough, y, size, a, at.lag, _CANCELLED))


def correct(
    equations: Equations, guess: ModeState, border: Real | None = None, *, most: int = MOST_ITERATIONS,
    fine: float = _FINE, good: float = TOLERANCE,
) -> Corrected:  # fmt: skip
    """Solve from a guess: at its amplitude, or along the plane through it whose normal is `border`.

    Parameters
    ----------
    border : (m + 1,) row over the unknowns and ln a; None: the amplitude is kept.
    fine : relative residual at which no further step is taken.
    good : relative residual that counts as solved.
    """
    start, size = guess, equations.size
    state, at = guess, equations.evaluate(guess.y, guess.log_amplitude, guess.phase, guess.mode)
    iterations, norm = 0, _left(at, state, size)
    norms = [norm]
    while at is not None:
        if norm <= fine or iterations >= most:
            break
        if border is not None and len(norms) > _PATIENCE and norm > _HOPE * norms[-1 - _PATIENCE]:
            break  # a shorter step costs less
        move = _newton_step(at, state, start, border, size)
        if move is None:
            break
        left, new, there = _damped(equations, state, move, norm)
        if norm <= good and left > 0.1 * norm:
            break
        state, at, norm, iterations = new, there, left, iterations + 1
        norms.append(norm)
    return Corrected(state=state, at=at, converged=norm <= good, iterations=iterations, residual=norm)


def _left(at: Evaluated | None, state: ModeState, size: int) -> float:
    """Return the relative residual; infinite where there is none."""
    if at is None:
        return math.inf
    return relative_residual(at, state.y, math.exp(state.log_amplitude), size)


def _newton_step(
    at: Evaluated, state: ModeState, start: ModeState, border: Real | None, size: int
) -> tuple[Real, float] | None:
    """Return the Newton step of the unknowns and of ln a."""
    columns, rhs = scales(state.y, size), -at.residual
    if border is None:
        found = at.step(rhs, columns)
        return None if found is None else (found, 0.0)
    m = state.y.size
    behind = border[:m] @ (start.y - state.y) + border[m] * (start.log_amplitude - state.log_amplitude)
    found = at.step(np.append(rhs, behind), columns, border)
    return None if found is None else (found[:m], float(found[m]))


def _damped(
    equations: Equations, state: ModeState, move: tuple[Real, float], norm: float
) -> tuple[float, ModeState, Evaluated | None]:
    """Return the point after the largest part of a step that does not make the residual grow much.

    At a change of state the residual has a kink, over which a whole step may lead to and fro.
    """
    best: tuple[float, ModeState, Evaluated | None] = (math.inf, state, None)
    part = 1.0
    while part >= _LEAST_PART:
        y = state.y + part * move[0]
        log_amplitude = state.log_amplitude + part * move[1]
        new = ModeState(y=y, log_amplitude=log_amplitude, mode=state.mode, phase=state.phase)
        at = equations.evaluate(y, log_amplitude, state.phase, state.mode)
        if at is not None:
            found = _left(at, new, equations.size)
            if found < best[0]:
                best = (found, new, at)
            if found <= (1.0 - 0.25 * part) * norm:
                break
            if norm <= TOLERANCE or (best[0] < norm and found > best[0]):
                break
        part *= 0.5
    return best


def carried_anew(equations: Equations, found: Corrected) -> Corrected:
    """Return the same point with q that of the mode nearest to singular there."""
    omega, zeta = found.state.y[-2:]
    return carried_as(equations, found, equations.structure.nearest(float(omega), float(zeta)))


def carried_as(equations: Equations, found: Corrected, mode: int) -> Corrected:
    """Return the same point with q that of a mode given."""
    state = found.state
    if found.at is None or mode == state.mode:
        return found
    y = state.y.copy()
    q = complex(np.vdot(equations.structure.carried[:, mode], found.at.x[equations.structure.first]))
    y[equations.size], y[equations.size + 1] = q.real, q.imag
    new = ModeState(y=y, log_amplitude=state.log_amplitude, mode=mode, phase=state.phase)
    at = equations.evaluate(y, new.log_amplitude, new.phase, mode)
    if at is None:
        return found
    return Corrected(state=new, at=at, converged=True, iterations=found.iterations, residual=found.residual)
