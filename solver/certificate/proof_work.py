"""How long a proof is tried: its work is counted, so that it ends at the same place on every machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from flint import ctx

from solver.certificate.checker import System

UNIT = 1e6  # products of balls
_BITS = 128.0  # of which a product counts as one
_EVERY = 0.1  # s between two questions to the caller
_DIGITS = 24  # bits that a term gives beside a known exponential, about
_EXPONENTIAL, _BESIDE = 20, 5  # products of matrices, about, in that of one, in one near 1


class ProofHaltedError(Exception):
    """The work allowed is used up, or the caller wants it to end (`stopped`)."""

    def __init__(self, *, stopped: bool) -> None:
        self.stopped = stopped
        super().__init__("stopped" if stopped else "the work allowed is used up")


class ProofAllowance:
    """The work allowed, and what of it is done, in millions of products of balls of 128 bits."""

    def __init__(self, most: float, should_stop: Callable[[], bool] | None) -> None:
        self.most, self.done, self._should_stop = most, 0.0, should_stop
        self._asked = time.perf_counter()

    def spend(self, products: float) -> None:
        """Count products; raise `ProofHaltedError` where they are too many, or the caller wants it."""
        self.done += products * (ctx.prec / _BITS) / UNIT
        if self.done > self.most:
            raise ProofHaltedError(stopped=False)
        if self._should_stop is not None and time.perf_counter() - self._asked > _EVERY:
            self._asked = time.perf_counter()
            if self._should_stop():
                raise ProofHaltedError(stopped=True)


_ALLOWED: ContextVar[ProofAllowance] = ContextVar("work allowed to a proof")


@contextmanager
def allowed(most: float, should_stop: Callable[[], bool] | None) -> Iterator[ProofAllowance]:
    """Count what systems of the class `Counted` do inside."""
    allowance = ProofAllowance(most, should_stop)
    token = _ALLOWED.set(allowance)
    try:
        yield allowance
    finally:
        _ALLOWED.reset(token)


class Counted(System):
    """A system whose Taylor polynomials and matrix exponentials are counted, and found beside known ones."""

    def series(self, mode: tuple[int, ...], states: Any, h: Any, degree: int) -> Any:
        """As that of a system."""
        _ALLOWED.get().spend(self.d**2 * states.ncols() * (degree + 2))
        return super().series(mode, states, h, degree)

    def after(self, mode: tuple[int, ...], states: Any, length: Any, more: Any = 0) -> Any:
        """As that of a system; beside a known exponential one column needs no other."""
        middle = length.mid()
        near = mode, f"{float(middle):.8e}"
        if states.ncols() > 1 or (mode, middle.man_exp()) in self.made or near not in self.made:
            return super().after(mode, states, length, more)
        powers, there = self.made[near]
        terms, begun = self.series(mode, states, middle - there, ctx.prec // _DIGITS)
        for k, term in enumerate(terms):
            begun += term * (middle - there) ** k
        later = powers[0] * begun
        return later + self.series(mode, later, length - middle + more, 0)[1]

    def flow(self, mode: tuple[int, ...], length: Any) -> list[Any]:
        """As that of a system; beside a known one it is that times an exponential near 1."""
        middle = length.mid()
        key, near = (mode, middle.man_exp()), (mode, f"{float(middle):.8e}")
        if key not in self.made and near in self.made:
            (*others, last), there = self.made[near]
            powers = [last * (self.mode(mode)[0] * ((middle - there) / 2 ** len(others))).exp()]
            for _ in others:
                powers.insert(0, powers[0] * powers[0])
            self.made[key] = powers
            _ALLOWED.get().spend(self.d**3 * (_BESIDE + len(powers)))
        elif key not in self.made:
            self.made[near] = super().flow(mode, length), middle
            _ALLOWED.get().spend(self.d**3 * (_EXPONENTIAL + len(self.made[key])))
        return self.made[key]  # type: ignore[no-any-return]
