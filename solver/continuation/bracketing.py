"""What lies between two points of a curve, however they are solved for: roots, extrema, how it runs.

A slope that changes its sign is a root; where slopes are known an extremum is looked for as that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TypeVar

_Point = TypeVar("_Point")
_MOST = 120  # points on the way to a root
_ASIDE = 1e-3  # share of the bracket that a trial keeps from its ends


def closing_in(
    at: Callable[[float], _Point | None], of: Callable[[_Point], float], before: float, after: float
) -> Iterator[tuple[_Point, float, float]]:
    """Yield points ever nearer to where a function changes its sign on the way from one point to another.

    By bracketed secants (Illinois: M. Dowell, P. Jarratt, BIT 11 (1971) 168, doi:10.1007/BF01934364), and
    every third time in the middle: where the function jumps over 0 the bracket closes on that place.

    Parameters
    ----------
    at : the point at a share of the way; with None the search ends.
    of : the function.
    before, after : its values at the shares 0 and 1, of opposite signs.

    Yields
    ------
    Point, value, and the share of the way that is left between both signs; whoever takes them ends it.
    """
    low, high, g_low, g_high, side = 0.0, 1.0, before, after, 0
    for trial in range(_MOST):
        width = high - low
        share = g_low / (g_low - g_high) if g_low != g_high and trial % 3 != 2 else 0.5
        here = low + min(max(share, _ASIDE), 1.0 - _ASIDE) * width
        point = None if here in (low, high) else at(here)
        if point is None:
            return
        g = of(point)
        yield point, g, width
        if (g > 0.0) == (g_low > 0.0):
            low, g_low, g_high, side = here, g, g_high * (0.5 if side < 0 else 1.0), -1
        else:
            high, g_high, g_low, side = here, g, g_low * (0.5 if side > 0 else 1.0), 1


def least_between(
    at: Callable[[float], _Point | None], of: Callable[[_Point], float], low: float, high: float,
    close: float, most: int, nowhere: float,
) -> _Point | None:  # fmt: skip
    """Return the point at which a function without a slope is least of all that were tried.

    By golden section and parabolas (R. P. Brent, *Algorithms for Minimization without Derivatives*, 1973).

    Parameters
    ----------
    at : the point at a place between `low` and `high`; None where there is none.
    of : the function.
    close, most : how near the place is come to, and trials.
    nowhere : what stands for a value where there is no point: a finite one, parabolas are laid through it.
    """
    from scipy.optimize import minimize_scalar  # what needs no minimum starts without SciPy's packages

    found: list[_Point] = []

    def value(place: float) -> float:
        point = at(float(place))
        if point is None:
            return nowhere
        found.append(point)
        return of(point)

    minimize_scalar(value, bounds=(low, high), method="bounded", options={"xatol": close, "maxiter": most})
    return min(found, key=of, default=None)


def dense_between(
    left: _Point, right: _Point, depth: int,
    halve: Callable[[_Point, _Point, int], tuple[_Point | None, bool]],
) -> list[_Point]:  # fmt: skip
    """Return the points to be put between two, so that what is known of the rest predicts what lies there.

    Parameters
    ----------
    depth : how often what is left is halved.
    halve : the point between two, None for none, and whether that is enough; it is given the depth left.
    """
    middle, enough = halve(left, right, depth) if depth > 0 else (None, True)
    if middle is None or enough:
        return [] if middle is None else [middle]
    before = dense_between(left, middle, depth - 1, halve)
    return [*before, middle, *dense_between(middle, right, depth - 1, halve)]


def level_up_to(
    holds: Callable[[float], bool], inside: float, bound: float, step: float, close: float
) -> float:
    """Return how far from a place where something holds it does towards a bound: the last place where it did.

    By doubled steps, the first of which is `step`, and then halves, to `close`.
    """
    step, outside = math.copysign(step, bound - inside), bound
    while inside != bound:
        trial = inside + step if abs(step) < abs(bound - inside) else bound
        if not holds(trial):
            outside = trial
            break
        inside, step = trial, 2.0 * step
    while abs(outside - inside) > close:
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside
