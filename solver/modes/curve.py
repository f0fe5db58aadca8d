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

import numpy as np

from solver.jit.fourier import Real
from solver.modes.corrector import Corrected, ModeState, carried_anew, correct, scales
from solver.modes.equations import Equations

FIRST_STEP, LARGEST_STEP, LEAST_STEP = 0.1, 0.4, 1e-4
_SHARPNESS = 4.0  # weight of changes of ln ω and ζ beside those of ln a
_EASY, _HARD = 5, 9  # Newton steps
_JUMPS = (0.02, 0.06, 0.15, 0.3, 0.6, 1.0)  # of ln a, over what no short step passes
LEAST_SHARE = 0.9  # of a² that harmonic 1 has
_RESOLVED = 0.05  # step over which a curve may bend as it will: a kink is no farther from a point
BENT = 0.1  # relative change of ζ off the tangent, over a longer step: chords are off by a quarter of it
_FAINT = 1e-4  # damping ratio below which changes of it are not looked at
_PURE = 0.99  # share of harmonic 1 in a shape that leaps begin with
_FARTHEST = 2.0  # ln a below the first amplitude, where a curve that turned back is left


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
    point, low = first, first.state.log_amplitude
    farthest = purest = first
    tangent, size, total = tangent_of(equations, point), FIRST_STEP, 0
    for count in range(most_points + 1):
        at = point.state.log_amplitude
        if at < least:
            return FollowedCurve(points=points, end=CurveEnd.TURNED_BACK, rejected=total)
        points.append(point)
        if on_progress is not None:
            share = (at - low) / (high - low) if done is None else done(at)
            on_progress(min(max(share, 0.0), 1.0), len(points))
        if should_stop is not None and should_stop():
            return FollowedCurve(points=points, end=CurveEnd.CANCELLED, rejected=total)
        if at >= high:
            return FollowedCurve(points=points, end=CurveEnd.COMPLETED, rejected=total)
        if count == most_points:
            break
        found, rejected, before = None, 0, tangent
        if tangent is not None and at > low - _FARTHEST:
            here = _with_phase(equations, point) if turns else point
            found, size, rejected = _advance(equations, here, tangent, size, high)
        if found is None or share_of_first(equations, found) < least_share:
            # From there on toward larger amplitudes.
            back = tuple(
                _with_phase(equations, each) if turns else each for each in (point, farthest, purest)
            )
            found, size, before = _leap(equations, back, high, least_share), _RESOLVED, None
        if found is None:
            end = CurveEnd.TURNED_BACK if at <= low - _FARTHEST else CurveEnd.STOPPED
            return FollowedCurve(points=points, end=end, rejected=total)
        tangent, point, total = tangent_of(equations, found, before), found, total + rejected
        if point.state.log_amplitude > farthest.state.log_amplitude:
            farthest = point
        if share_of_first(equations, point) > _PURE:
            purest = point
    return FollowedCurve(points=points, end=CurveEnd.TOO_LONG, rejected=total)


def share_of_first(equations: Equations, found: Corrected) -> float:
    """Return the share of a² that harmonic 1 has."""
    if found.at is None:
        return 0.0
    s, x = equations.structure, found.at.x
    alone = np.zeros_like(x)
    alone[s.first] = x[s.first]
    return s.squared_amplitude(alone) / s.squared_amplitude(x)


def _advance(
    equations: Equations, here: Corrected, tangent: Real, size: float, high: float
) -> tuple[Corrected | None, float, int]:
    """Return the next point (None if there is none), the next step size, and how many were rejected."""
    rejected = 0
    while size >= LEAST_STEP:
        left = high - here.state.log_amplitude
        last = size * tangent[-1] >= left
        guess = _ahead(here.state, tangent, left / tangent[-1] if last else size, equations)
        if last:
            found = correct(equations, replace(guess, log_amplitude=high))
        else:
            found = correct(equations, guess, border_of(here.state, tangent, equations.size))
        followed = found.converged and equations.follows(here.state.y, found.state.y)
        if followed and is_near(here, found, size, equations.size):
            if size > _RESOLVED and _bends(guess, found.state):
                size = max(0.4 * size, _RESOLVED)
                continue
            if found.iterations <= _EASY:
                size = min(1.6 * size, LARGEST_STEP)
            elif found.iterations >= _HARD:
                size = max(0.5 * size, LEAST_STEP)
            return carried_anew(equations, found), size, rejected
        rejected, size = rejected + 1, 0.4 * size
    return None, size, rejected


def _leap(
    equations: Equations, points: tuple[Corrected, ...], high: float, least_share: float
) -> Corrected | None:
    """Return a point at a larger amplitude than any of `points`, from the shape of one of them; None if none.

    That is over a kink where no short step ends well, past another mode that moves in a higher harmonic, or
    where the branch of a sticking contact that once slipped leads back: its force depends on the history, and
    there is one for each.
    """
    farthest = max(point.state.log_amplitude for point in points)
    for jump in _JUMPS:
        to = min(farthest + jump, high)
        for here in points:
            rise, y = to - here.state.log_amplitude, here.state.y.copy()
            y[: equations.size + 2] *= math.exp(rise)
            found = correct(equations, replace(here.state, y=y, log_amplitude=to), most=40)
            if not found.converged or share_of_first(equations, found) < least_share:
                continue
            if not equations.follows(here.state.y, found.state.y):
                continue
            if is_near(here, found, rise, equations.size):
                return carried_anew(equations, found)
    return None


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


def _with_phase(equations: Equations, found: Corrected) -> Corrected:
    """Return the point with a phase in which its own motion is as it is."""
    if found.at is None:
        return found
    s = equations.structure
    phase = 1j * s.momentum(found.at.x[s.first])
    return replace(found, state=replace(found.state, phase=phase / np.linalg.norm(phase)))
