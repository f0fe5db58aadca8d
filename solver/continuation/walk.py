"""The one loop that follows curves: a step is tried, taken or tried again shorter, and its size is adapted.

A curve is a response over a parameter, a nonlinear mode over its amplitude, a held amplitude over the
frequency, a peak over what it is tracked in. Each says in `Curve` how it predicts and corrects a step, by
what measure it takes one, and how it passes what no step is short enough for; the loop is the same
(E. L. Allgower, K. Georg, *Introduction to Numerical Continuation Methods*, SIAM 2003,
doi:10.1137/1.9780898719154). Where a point costs microseconds the steps of a stretch of the curve are
compiled (`solver.continuation.kernels.pseudo_arclength`): the loop then takes stretches, and adapts how many
points they have.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, TypeVar

_Point = TypeVar("_Point", covariant=True)


class Curve(Protocol[_Point]):
    """What is followed, as it stands at its last point."""

    @property
    def ended(self) -> bool:
        """Whether it goes no further."""

    def tried(self, size: float) -> tuple[_Point | None, float]:
        """Try a step; return the point behind it, None if it was not taken, and the size of the next try."""

    def leapt(self) -> tuple[_Point | None, float]:
        """Pass what no step is short enough for; return as `tried` does, None if the curve is lost there."""
        return None, 0.0


def walk(curve: Curve[_Point], size: float, least: float) -> Iterator[_Point]:
    """Yield the points of a curve behind the one where it stands; whoever takes them may leave.

    Parameters
    ----------
    size : of the first step.
    least : a step that was not taken is tried again as long as it is not shorter.
    """
    while not curve.ended:
        point, size = curve.tried(size)
        if point is None and size < least:
            point, size = curve.leapt()
            if point is None:
                return
        if point is not None:
            yield point
