"""Calls that need nothing of each other, computed wherever who runs a study has room.

A study that has several at a time asks for the `spreader`: there is one inside a worker of the service.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol


class Spread(Protocol):
    """Computes calls in any order, here and elsewhere, with the same numbers."""

    def __call__(
        self,
        function: Callable[..., Any],
        calls: Sequence[tuple[Any, ...]],
        done: Callable[[int, Any], bool],
        *,
        should_stop: Callable[[], bool],
        here: Callable[[int], Any] | None = None,
        seconds: float | None = None,
    ) -> None:
        """Call ``function(*call, should_stop=…)`` for each of the calls.

        Parameters
        ----------
        function : sent by name, with what it is given; what cannot be sent is computed here.
        calls : the arguments of each.
        done : told of each result with the number of its call; True ends the rest.
        should_stop : asked between calls; True ends the rest.
        here : computes the call of a number in this process, in place of the function.
        seconds : what a call takes about, if that is known beforehand.
        """


def in_turn(
    function: Callable[..., Any],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[int, Any], bool],
    *,
    should_stop: Callable[[], bool],
    here: Callable[[int], Any] | None = None,
    seconds: float | None = None,
) -> None:
    """Compute the calls one after the other in this process, as `Spread` says."""
    del seconds
    compute = here or (lambda index: function(*calls[index], should_stop=should_stop))
    for index in range(len(calls)):
        if should_stop() or done(index, compute(index)):
            return


_SPREAD: ContextVar[Spread | None] = ContextVar("spread", default=None)


def spreader() -> Spread | None:
    """Return what computes calls elsewhere too; None if there is nothing but this process."""
    return _SPREAD.get()


@contextmanager
def spreading(spread: Spread) -> Iterator[None]:
    """Have studies inside the block spread their calls."""
    token = _SPREAD.set(spread)
    try:
        yield
    finally:
        _SPREAD.reset(token)
