"""How long a proof is tried: its work is counted, so that it ends at the same place on every machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from flint import ctx

from solver.certificate.checker import System

UNIT = 1e6  # products of balls
_BITS = 128.0  # of which a product counts as one
_EXPONENTIAL = 30  # products of matrices, about, in that of one


class WorkUsedUpError(Exception):
    """The work allowed is used up."""


class Allowance:
    """The work allowed, and what of it is done, in millions of products of balls of 128 bits."""

    def __init__(self, most: float) -> None:
        self.most, self.done = most, 0.0

    def spend(self, products: float) -> None:
        """Count products; raise `WorkUsedUpError` where they are too many."""
        self.done += products * (ctx.prec / _BITS) / UNIT
        if self.done > self.most:
            raise WorkUsedUpError


_ALLOWED: ContextVar[Allowance] = ContextVar("work allowed to a proof")


@contextmanager
def allowed(most: float) -> Iterator[Allowance]:
    """Count what systems of the class `Counted` do inside."""
    allowance = Allowance(most)
    token = _ALLOWED.set(allowance)
    try:
        yield allowance
    finally:
        _ALLOWED.reset(token)


class Counted(System):
    """A system whose Taylor polynomials and matrix exponentials are counted."""

    def series(self, mode: tuple[int, ...], states: Any, length: Any, h: Any, degree: int) -> Any:
        """As that of a system."""
        _ALLOWED.get().spend(self.d**2 * states.ncols() * degree)
        return super().series(mode, states, length, h, degree)

    def flow(self, mode: tuple[int, ...], length: Any) -> Any:
        """As that of a system."""
        known = len(self.made)
        found = super().flow(mode, length)
        if len(self.made) > known:
            _ALLOWED.get().spend(self.d**3 * (_EXPONENTIAL + len(found[1])))
        return found
