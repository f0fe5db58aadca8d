"""How long a proof is tried: its work is counted, so that it ends at the same place on every machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from flint import ctx

from stickslip.lab.proofs.checker import System

UNIT = 1e6  # products of balls
_BITS = 128.0  # of which a product counts as one
_EVERY = 0.1  # s between two questions to the caller


class ProofHaltedError(Exception):
    """The work allowed is used up, or the caller wants it to end (`stopped`)."""

    def __init__(self, *, stopped: bool) -> None:
        self.stopped = stopped
        super().__init__("stopped" if stopped else "the work allowed is used up")


class ProofAllowance:
    """The work allowed, and what of it is done, in millions of products of balls of 128 bits."""

    def __init__(self, most: float, should_stop: Callable[[], bool] | None) -> None:
        self.most, self.done, self._should_stop = most, 0.0, should_stop
        self.last: tuple[Any, System] | None = None
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
    """Count what systems do inside."""
    allowance = ProofAllowance(most, should_stop)
    token = _ALLOWED.set(allowance)
    try:
        yield allowance
    finally:
        _ALLOWED.reset(token)


def counted(raw: dict[str, Any], at: dict[str, str]) -> System:
    """Return a system whose work is counted, the last one again where it is asked for again."""
    allowance, key = _ALLOWED.get(), (id(raw), at, ctx.prec)
    if allowance.last is None or allowance.last[0] != key:
        allowance.last = key, System(raw, at, allowance)
    return allowance.last[1]


def allowance() -> ProofAllowance:
    """Return what is counted now."""
    return _ALLOWED.get()
