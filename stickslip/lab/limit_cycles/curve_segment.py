"""Between the points of a nonlinear mode: where its damping ratio has a given value, and where it turns.

Between two points a motion is solved for on the plane across the way from one to the other, so a curve may
fold in between; the share of the way tells where. Values and slopes at the ends bracket what is looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from solver.continuation.bracketing import closing_in
from solver.jit.fourier import Real
from solver.modes.mode_curve import Corrected, ModeState, carried_as, correct
from solver.modes.mode_curve import BENT, border_of, by_shape, is_near, tangent_of
from solver.modes.mode_equations import Equations
from solver.modes.mode_results import NonlinearMode

_CLOSE = 1e-14  # of the share of a way
_SHARES = (0.25, 0.5, 0.75)  # where a way is looked at that may hold what is looked for
_LEVEL = 1e-9  # slope of ζ relative to ζ that counts as none


class CurveSegment:
    """The curve from one point to the next."""

    def __init__(self, equations: Equations, one: Corrected, other: Corrected) -> None:
        self._equations, self._mode, self._phase = equations, other.state.mode, other.state.phase
        self._one, self._other = carried_as(equations, one, self._mode), other
        begin, end = self._one.state, other.state
        self._change = np.append(end.y - begin.y, end.log_amplitude - begin.log_amplitude)
        along = by_shape(begin, self._change, equations.size)
        self._row = border_of(begin, along, equations.size)
        self._length = math.sqrt(max(float(self._row @ self._change), 1e-300))
        self._along = along / self._length

    def at(self, share: float) -> Corrected | None:
        """Return the point that share of the way on; None if it was not found."""
        begin = self._one.state
        guess = ModeState(
            y=begin.y + share * self._change[:-1], mode=self._mode, phase=self._phase,
            log_amplitude=begin.log_amplitude + share * float(self._change[-1]),
        )  # fmt: skip
        found = correct(self._equations, guess, self._row, most=40)
        near = found.converged and is_near(self._one, found, self._length, self._equations.size)
        return found if near else None

    def tangent(self, point: Corrected) -> Real | None:
        """Return the unit tangent at a point of the way, onward."""
        return tangent_of(self._equations, point, self._along)

    def slope(self, point: Corrected) -> float:
        """Return dζ per arc at a point of the way, onward; NaN if there is no tangent."""
        tangent = self.tangent(point)
        return math.nan if tangent is None else float(tangent[-2])

    def root(self, of: Callable[[Corrected], float]) -> Corrected | None:
        """Return where a function of the points is 0; its signs differ at the ends. None if not found."""
        ends = of(self._one), of(self._other)
        if 0.0 in ends or math.isnan(ends[0] + ends[1]):
            return None if 0.0 not in ends else (self._one, self._other)[ends.index(0.0)]
        for point, value, width in closing_in(self.at, of, *ends):
            if math.isnan(value):
                return None
            if abs(value) <= _CLOSE * max(map(abs, ends)) or width <= _CLOSE:
                return point
        return None


def zeta_of(point: Corrected) -> float:
    """Return the damping ratio of a point."""
    return float(point.state.y[-1])


def points_of(equations: Equations, found: NonlinearMode) -> list[Corrected]:
    """Return the points of a curve with the equations there."""
    points = []
    for state, residual in zip(found.points, found.residual, strict=True):
        at = equations.evaluate(state.y, state.log_amplitude, state.phase, state.mode)
        points.append(Corrected(state=state, at=at, converged=True, iterations=0, residual=float(residual)))
    return points


def with_turns(equations: Equations, points: Sequence[Corrected], level: float) -> list[Corrected]:
    """Return the points of a curve with more between them: among these all at which ζ turns.

    That is where ζ may pass `level` or be the largest; between the others nothing is added.
    """
    most = max(map(zeta_of, points), default=math.nan)
    found = list(points[:1])
    for one, other in pairwise(points):
        low, high = sorted((zeta_of(one), zeta_of(other)))
        margin = BENT * max(abs(low), abs(high))
        if high + margin >= most or low - margin <= level <= high + margin:
            way = CurveSegment(equations, one, other)
            middle = [each for each in map(way.at, _SHARES) if each is not None]
            for begin, end in pairwise([one, *middle, other]):
                found += [begin] * (begin is not one) + _turns(equations, begin, end)
        found.append(other)
    return found


def _turns(equations: Equations, one: Corrected, other: Corrected) -> list[Corrected]:
    """Return the point between two at which ζ turns, if it does."""
    way = CurveSegment(equations, one, other)
    ends = way.slope(one), way.slope(other)
    least = _LEVEL * max(abs(zeta_of(one)), abs(zeta_of(other)))
    if not (min(abs(ends[0]), abs(ends[1])) > least and ends[0] * ends[1] < 0.0):
        return []
    found = way.root(way.slope)
    return [] if found is None else [found]
