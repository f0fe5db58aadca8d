"""Continuation of a nonlinear mode over the amplitude: pseudo-arc-length in (ln a, ln ω, ζ, shape).

The contact forces are piecewise smooth, so the tangent jumps where a contact begins to slip or to open. Where
no step over such a kink ends well though it is short, a leap to a given larger amplitude is tried.

Where a multiple of ω meets another frequency of the structure, the curve may lead over into that mode, which
then moves in a higher harmonic: the one ζ of all harmonics takes its damping away. That is no longer the mode
that was asked for, so points whose harmonic 1 has too little of a² are leapt over in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain
from typing import Annotated

import numpy as np

from solver.continuation.walk import Pace, walk
from solver.jit.fourier import Complex, Real
from solver.modes.kernels.mode_assembly import relative_residual as relative
from solver.modes.mode_equations import Equations, Evaluated

TOLERANCE = 1e-9  # of motions relative to the largest, and of the equations beside them
_FINE = 1e-13  # below it nothing is left but rounding; between the two, steps go on as long as they help
MOST_ITERATIONS = 20
_CANCELLED = 1e-3  # as in `solver.balance.kernels.residual`: a share of |A| |F| a residual is relative to
_LEAST_PART = 1.0 / 32.0  # of a Newton step, before it is given up
_PATIENCE, _HOPE = 8, 0.9  # Newton steps along an arc within which the residual has to fall to this share

_PACE = Pace(first=0.1, least=1e-4, largest=0.4, grow=1.6, shrink=0.4, easy=5, hard=9)  # by Newton steps
_SHARPNESS = 4.0  # weight of changes of ln ω and ζ beside those of ln a
_JUMPS = (0.02, 0.06, 0.15, 0.3, 0.6, 1.0)  # of ln a, over what no short step passes
LEAST_SHARE = 0.9  # of a² that harmonic 1 has
_RESOLVED = 0.05  # step over which a curve may bend as it will: a kink is no farther from a point
BENT = 0.1  # relative change of ζ off the tangent, over a longer step: chords are off by a quarter of it
_FAINT = 1e-4  # damping ratio below which changes of it are not looked at
_PURE = 0.99  # share of harmonic 1 in a shape that leaps begin with
_FARTHEST = 2.0  # ln a below the first amplitude, where a curve that turned back is left


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


class CurveEnd(Enum):
    """How a curve ended; a status of each kind of curve has these names."""

    COMPLETED = "completed"
    NOT_BEGUN = "not begun"
    STOPPED = "stopped"
    TURNED_BACK = "turned back"
    TOO_LONG = "too long"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowedCurve:
    """The points of a curve, how it ended, and how many steps were tried again."""

    points: list[Corrected]
    end: CurveEnd
    rejected: int = 0


def follow(
    equations: Equations, first: Corrected, high: float, *, turns: bool, most_points: int,
    least_share: float = LEAST_SHARE, least: float = -math.inf,
    done: Callable[[float], float] | None = None, on_progress: Callable[[float, int], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> FollowedCurve:  # fmt: skip
    """Follow a curve from a first point to ln a = `high`.

    Parameters
    ----------
    first : the curve is not begun where it has not converged.
    turns : the motion may begin at any instant; its phase is then fixed anew at every point.
    least_share : of a² that harmonic 1 has at every point; 0 follows the curve wherever it leads.
    least : ln a below which it has turned back.
    done : the share of the way at ln a; that of the logarithm if left out.
    on_progress : is told that share and the number of points.
    should_stop : is asked at every point whether to stop there.
    """
    points: list[Corrected] = []
    if not first.converged:
        return FollowedCurve(points=points, end=CurveEnd.NOT_BEGUN)
    curve, low, end = (
        _ModeCurve(equations, first, high, least_share, turns=turns),
        first.state.log_amplitude,
        None,
    )
    for point in chain([first], walk(curve, _PACE)):
        at = point.state.log_amplitude
        if at < least:
            end = CurveEnd.TURNED_BACK
            break
        points.append(point)
        if on_progress is not None:
            share = (at - low) / (high - low) if done is None else done(at)
            on_progress(min(max(share, 0.0), 1.0), len(points))
        if should_stop is not None and should_stop():
            end = CurveEnd.CANCELLED
        elif len(points) > most_points and not curve.ended:
            end = CurveEnd.TOO_LONG
        if end is not None:
            break
    return FollowedCurve(points=points, end=end or curve.end, rejected=curve.rejected)


def share_of_first(equations: Equations, found: Corrected) -> float:
    """Return the share of a² that harmonic 1 has."""
    if found.at is None:
        return 0.0
    s, x = equations.structure, found.at.x
    alone = np.zeros_like(x)
    alone[s.first] = x[s.first]
    return s.squared_amplitude(alone) / s.squared_amplitude(x)


class _ModeCurve:
    """A curve as it stands at its last point.

    Attributes
    ----------
    rejected : steps that were tried again.
    """

    def __init__(
        self, equations: Equations, first: Corrected, high: float, least_share: float, *, turns: bool
    ) -> None:
        self._equations, self._high, self._least_share, self._turns = equations, high, least_share, turns
        self._point = self._farthest = self._purest = first
        self._tangent = tangent_of(equations, first)
        self._left = first.state.log_amplitude - _FARTHEST  # where it has turned back
        self.rejected = 0

    @property
    def ended(self) -> bool:
        """Whether it has reached the largest amplitude."""
        return self._point.state.log_amplitude >= self._high

    @property
    def end(self) -> CurveEnd:
        """How it ends where it goes no further."""
        if self.ended:
            return CurveEnd.COMPLETED
        back = self._point.state.log_amplitude <= self._left
        return CurveEnd.TURNED_BACK if back else CurveEnd.STOPPED

    def tried(self, size: float) -> tuple[Corrected | None, float]:
        """Try a step along the tangent."""
        equations, tangent = self._equations, self._tangent
        if tangent is None or self._point.state.log_amplitude <= self._left:
            return None, 0.0
        here = self._in_phase(self._point)
        left = self._high - here.state.log_amplitude
        last = size * tangent[-1] >= left
        guess = _ahead(here.state, tangent, left / tangent[-1] if last else size, equations)
        if last:
            found = correct(equations, replace(guess, log_amplitude=self._high))
        else:
            found = correct(equations, guess, border_of(here.state, tangent, equations.size))
        followed = found.converged and equations.follows(here.state.y, found.state.y)
        if not followed or not is_near(here, found, size, equations.size):
            self.rejected += 1
            return None, _PACE.shorter(size)
        if size > _RESOLVED and _bends(guess, found.state):
            return None, _PACE.shorter(size, _RESOLVED)
        size = _PACE.after(size, found.iterations)
        found = carried_anew(equations, found)
        if share_of_first(equations, found) < self._least_share:
            return None, 0.0
        return self._taken(found, tangent), size

    def leapt(self) -> tuple[Corrected | None, float]:
        """Leap to a larger amplitude than any before, from the shape of one of three points.

        That is over a kink where no short step ends well, past another mode that moves in a higher harmonic,
        or where the branch of a sticking contact that once slipped leads back: its force depends on the
        history, and there is one for each. From there on the curve leads toward larger amplitudes.
        """
        equations = self._equations
        points = [self._in_phase(each) for each in (self._point, self._farthest, self._purest)]
        farthest = max(point.state.log_amplitude for point in points)
        for jump in _JUMPS:
            to = min(farthest + jump, self._high)
            for here in points:
                rise, y = to - here.state.log_amplitude, here.state.y.copy()
                y[: equations.size + 2] *= math.exp(rise)
                found = correct(equations, replace(here.state, y=y, log_amplitude=to), most=40)
                if not found.converged or share_of_first(equations, found) < self._least_share:
                    continue
                if not equations.follows(here.state.y, found.state.y):
                    continue
                if is_near(here, found, rise, equations.size):
                    return self._taken(carried_anew(equations, found), None), _RESOLVED
        return None, 0.0

    def _taken(self, found: Corrected, before: Real | None) -> Corrected:
        """Stand at a point, with its tangent onward from the one before."""
        self._tangent, self._point = tangent_of(self._equations, found, before), found
        if found.state.log_amplitude > self._farthest.state.log_amplitude:
            self._farthest = found
        if share_of_first(self._equations, found) > _PURE:
            self._purest = found
        return found

    def _in_phase(self, found: Corrected) -> Corrected:
        """Return a point with a phase in which its own motion is as it is, where the motion may turn."""
        if found.at is None or not self._turns:
            return found
        s = self._equations.structure
        phase = 1j * s.momentum(found.at.x[s.first])
        return replace(found, state=replace(found.state, phase=phase / np.linalg.norm(phase)))


def _bends(guess: ModeState, found: ModeState) -> bool:
    """Return whether damping or frequency left the tangent so far that the step should be a shorter one.

    Between points the curve is taken as straight, by `solver.performance_curve` and by the eye.
    """
    zeta, omega = float(found.y[-1]), float(found.y[-2])
    off = abs(zeta - float(guess.y[-1])) > BENT * max(abs(zeta), _FAINT)
    return off or abs(omega - float(guess.y[-2])) > 0.2 * BENT * omega


def _ahead(state: ModeState, tangent: Real, size: float, equations: Equations) -> ModeState:
    """Return where a tangent (see `tangent_of`) leads."""
    rise, n = size * tangent[-1], equations.size + 2
    y = state.y.copy()
    y[:n] = (y[:n] + size * math.exp(state.log_amplitude) * tangent[:n]) * math.exp(rise)
    y[n:] += size * tangent[n:-1]
    return replace(state, y=y, log_amplitude=state.log_amplitude + rise)


def border_of(state: ModeState, tangent: Real, size: int) -> Real:
    """Return the row over the unknowns and ln a whose product with a change is the arc along a tangent.

    The shape counts: where a short stick begins or ends it may turn round while the others hardly change.
    """
    w = state.y[:size]
    row = np.zeros(tangent.size)
    row[-3] = _SHARPNESS**2 * tangent[-3] / state.y[-2] ** 2
    row[-2] = _SHARPNESS**2 * tangent[-2]
    row[:size] = math.exp(state.log_amplitude) * tangent[:size] / max(float(w @ w), 1e-300)
    row[-1] = tangent[-1] - row[:size] @ w
    return row


def by_shape(state: ModeState, change: Real, size: int) -> Real:
    """Return a change of the unknowns and ln a with motions and q over the amplitude."""
    found = change.copy()
    n = size + 2
    found[:n] = (change[:n] - change[-1] * state.y[:n]) * math.exp(-state.log_amplitude)
    return found


def tangent_of(equations: Equations, found: Corrected, before: Real | None = None) -> Real | None:
    """Return the unit tangent, onward from `before` or toward larger amplitudes; None if it is not unique.

    It is that of the shape (motions and q over the amplitude), ω, ζ and ln a, in the order of the unknowns.
    """
    if found.at is None:
        return None
    rhs = np.zeros(found.state.y.size + 1)
    rhs[-1] = 1.0
    border = rhs if before is None else border_of(found.state, before, equations.size)
    t = found.at.step(rhs, scales(found.state.y, equations.size), border)
    if t is None:
        return None
    shape = by_shape(found.state, t, equations.size)
    squared = float(border_of(found.state, shape, equations.size) @ t)
    return shape / math.sqrt(squared) if squared > 0.0 else None


def is_near(here: Corrected, found: Corrected, size: float, motions: int) -> bool:
    """Return whether a point is on the same branch: no farther than some steps."""
    change = np.append(found.state.y - here.state.y, found.state.log_amplitude - here.state.log_amplitude)
    far = float(border_of(here.state, by_shape(here.state, change, motions), motions) @ change)
    return math.sqrt(max(far, 0.0)) <= 3.0 * size + 1e-9
