"""Where a branch turns back: the parameter is stationary along the arc, dλ/ds = 0.

An interval in which the amplitude exceeds a limit may end there. Such an end moves with the fold, not with
the limit: with y the left null vector of dr/du at the fold,

    dλ/dp = −(yᵀ ∂r/∂p) / (yᵀ ∂r/∂λ)

(W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, 2000, chapter 3,
doi:10.1137/1.9780898719543). The adjoint of any quantity that is not stationary there points along y,
the more so the closer to the fold, so that dλ/dp is minus the ratio of its derivatives by p and by λ.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

from solver.continuation.between import closing_in
from solver.jit.fourier import Real

_STATIONARY = 1e-11  # dλ/dshare of a fold, relative to that at the points it lies between
_SMOOTH = 1e-6  # above: it jumps, the fold is a corner where a contact changes its state
_NARROW = 1e-13  # share of the way


class OnArc(Protocol):
    """A point between two others of a branch, with its tangent by the share of the way between them."""

    @property
    def tangent(self) -> Real:
        """Derivative by the share, λ last."""


class OnBranch(Protocol):
    """A point of a branch: solution and tangent, λ last."""

    @property
    def solution(self) -> Real:
        """Motions [m], λ last."""

    @property
    def tangent(self) -> Real:
        """Direction of the branch."""


_Point = TypeVar("_Point", bound=OnArc)


def fold_between(
    at_share: Callable[[float], _Point | None], left: OnBranch, right: OnBranch
) -> tuple[_Point, bool] | None:
    """Return the fold between two points of a branch, and whether it is smooth (no corner).

    Around a fold λ goes there and back, so that the motion alone tells how far it is: dλ/dshare is of the
    share of its chord, and 0 where the motion is the same at both points, which then are one but for
    rounding, with no fold between them.

    Parameters
    ----------
    at_share : the solution at a share of the way, None where there is none.
    left, right : the points, with dλ of opposite signs.
    """
    chord = right.solution[:-1] - left.solution[:-1]
    length, along = float(chord @ chord), [float(chord @ each.tangent[:-1]) for each in (left, right)]
    before, after = (
        float(each.tangent[-1] * (length / by if by != 0.0 else 0.0))
        for each, by in zip((left, right), along, strict=True)
    )
    size = max(abs(before), abs(after))
    if size == 0.0:
        return None
    best: tuple[_Point, float] | None = None
    for point, g, width in closing_in(at_share, lambda point: float(point.tangent[-1]), before, after):
        if best is None or abs(g) <= best[1]:
            best = point, abs(g)
        if abs(g) <= _STATIONARY * size or width <= _NARROW:
            break
    return None if best is None else (best[0], best[1] <= _SMOOTH * size)
