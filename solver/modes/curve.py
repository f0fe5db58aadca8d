"""Continuation of a nonlinear mode over the amplitude: pseudo-arc-length in (ln a, ln ω, ζ, shape).

The contact forces are piecewise smooth, so the tangent jumps where a contact begins to slip or to open. Where
no step over such a kink ends well though it is short, one at a given larger amplitude is tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from solver.jit.fourier import Real
from solver.modes.corrector import Corrected, State, carried_anew, correct, scales, step
from solver.modes.equations import Equations

FIRST_STEP, LARGEST_STEP, LEAST_STEP = 0.1, 0.4, 1e-4
_SHARPNESS = 4.0  # weight of changes of ln ω and ζ beside those of ln a
_EASY, _HARD = 5, 9  # Newton steps
_JUMPS = (0.02, 0.06, 0.15, 0.3)  # of ln a, over what no short step passes
_FARTHEST = 2.0  # ln a below the first amplitude, where a curve that turned back is left


class End(Enum):
    """How a curve ended."""

    REACHED = "reached"
    NOT_BEGUN = "not begun"
    STOPPED = "stopped"
    TURNED_BACK = "turned back"
    TOO_LONG = "too long"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Walked:
    """A point with what it cost to get there."""

    point: Corrected
    rejected: int


def walk(
    equations: Equations, first: Corrected, high: float, *, turns: bool, most_points: int,
    largest: float = LARGEST_STEP, ended: Callable[[End], None],
) -> Iterator[Walked]:  # fmt: skip
    """Yield the points of a curve from a converged first one to ln a = `high`.

    Parameters
    ----------
    turns : the motion may begin at any instant; its phase is then fixed anew at every point.
    ended : is told how the curve ended, before the last point is yielded or after it.
    """
    point, low = first, first.state.log_amplitude
    yield Walked(point=point, rejected=0)
    tangent = _tangent(equations, point, None)
    size = FIRST_STEP
    for _ in range(most_points):
        if point.state.log_amplitude >= high:
            ended(End.REACHED)
            return
        if tangent is None:
            ended(End.STOPPED)
            return
        here = _with_phase(equations, point) if turns else point
        found, size, rejected = _advance(equations, here, tangent, size, high, largest)
        if found is None:
            ended(End.STOPPED)
            return
        tangent = _tangent(equations, found, tangent)
        point = found
        if point.state.log_amplitude < low - _FARTHEST:
            ended(End.TURNED_BACK)
            return
        yield Walked(point=point, rejected=rejected)
    ended(End.REACHED if point.state.log_amplitude >= high else End.TOO_LONG)


def _advance(
    equations: Equations, here: Corrected, tangent: Real, size: float, high: float, largest: float
) -> tuple[Corrected | None, float, int]:
    """Return the next point (None if there is none), the next step size, and how many were rejected."""
    rejected = 0
    while size >= LEAST_STEP:
        left = high - here.state.log_amplitude
        if size * tangent[-1] >= left:
            found = _step(equations, here, tangent, left / tangent[-1], high)
        else:
            found = _step(equations, here, tangent, size, None)
        if found.converged and _is_near(here, found, size, equations.size):
            if found.iterations <= _EASY:
                size = min(1.6 * size, largest)
            elif found.iterations >= _HARD:
                size = max(0.5 * size, LEAST_STEP)
            return carried_anew(equations, found), size, rejected
        rejected, size = rejected + 1, 0.4 * size
    for jump in _JUMPS:
        to = min(here.state.log_amplitude + jump, high)
        found = correct(equations, _ahead(here.state, tangent, to - here.state.log_amplitude, equations))
        if found.converged and _is_near(here, found, jump, equations.size):
            return carried_anew(equations, found), 0.02, rejected
        rejected += 1
    return None, size, rejected


def _step(equations: Equations, here: Corrected, tangent: Real, size: float, to: float | None) -> Corrected:
    """Return the point a step along the tangent leads to, or that at the amplitude `to`."""
    guess = _ahead(here.state, tangent, size, equations)
    if to is not None:
        return correct(equations, replace(guess, log_amplitude=to))
    return correct(equations, guess, _border(here.state, tangent, equations.size))


def _ahead(state: State, tangent: Real, size: float, equations: Equations) -> State:
    """Return where a tangent (see `_tangent`) leads."""
    rise, n = size * tangent[-1], equations.size + 2
    y = state.y.copy()
    y[:n] = (y[:n] + size * math.exp(state.log_amplitude) * tangent[:n]) * math.exp(rise)
    y[n:] += size * tangent[n:-1]
    return replace(state, y=y, log_amplitude=state.log_amplitude + rise)


def _border(state: State, tangent: Real, size: int) -> Real:
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


def _by_shape(state: State, change: Real, size: int) -> Real:
    """Return a change of the unknowns and ln a with motions and q over the amplitude."""
    found = change.copy()
    n = size + 2
    found[:n] = (change[:n] - change[-1] * state.y[:n]) * math.exp(-state.log_amplitude)
    return found


def tangent_of(equations: Equations, point: Corrected) -> Real | None:
    """Return the tangent at a point toward larger amplitudes, as `_tangent`."""
    return _tangent(equations, point, None)


def _tangent(equations: Equations, found: Corrected, before: Real | None) -> Real | None:
    """Return the unit tangent, onward from `before`; None if it is not unique.

    It is that of the shape (motions and q over the amplitude), ω, ζ and ln a, in the order of the unknowns.
    """
    if found.at is None:
        return None
    y, m = found.state.y, found.state.y.size
    J = np.empty((m + 1, m + 1))
    J[:m, :m], J[:m, m] = found.at.jacobian, found.at.by_log_amplitude
    J[m] = 0.0
    J[m, m] = 1.0
    if before is not None:
        J[m] = _border(found.state, before, equations.size)
    rhs = np.zeros(m + 1)
    rhs[m] = 1.0
    columns = np.append(scales(y, equations.size), 1.0)
    t = step(J, rhs, columns, least_squares=found.at.unheld)
    if t is None:
        return None
    shape = _by_shape(found.state, t, equations.size)
    squared = float(_border(found.state, shape, equations.size) @ t)
    return shape / math.sqrt(squared) if squared > 0.0 else None


def _is_near(here: Corrected, found: Corrected, size: float, motions: int) -> bool:
    """Return whether a point is on the same branch: no farther than some steps."""
    change = np.append(found.state.y - here.state.y, found.state.log_amplitude - here.state.log_amplitude)
    far = float(_border(here.state, _by_shape(here.state, change, motions), motions) @ change)
    return math.sqrt(max(far, 0.0)) <= 3.0 * size + 1e-9


def _with_phase(equations: Equations, found: Corrected) -> Corrected:
    """Return the point with a phase in which its own motion is as it is."""
    if found.at is None:
        return found
    s = equations.structure
    x = found.at.x[s.first]
    phase = 1j * (s.mass[s.first] * x if s.is_diagonal else s.mass[s.first] @ x)
    return replace(found, state=replace(found.state, phase=phase / np.linalg.norm(phase)))
