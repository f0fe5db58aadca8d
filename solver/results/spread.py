"""Calls that need nothing of each other, computed wherever who runs a study has room.

A study that has several at a time asks for the `spreader`: there is one inside a worker of the service.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Generic, Protocol, TypeVar


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


_Key = TypeVar("_Key")
_Found = TypeVar("_Found")


class Ahead(Generic[_Key, _Found]):
    """Results that are asked for one after the other, computed together before where somebody helps.

    Who asks does so as without: what is counted, and when, does not depend on who computed it.

    Parameters
    ----------
    should_stop : asked between calls.
    """

    def __init__(self, should_stop: Callable[[], bool] | None) -> None:
        self._should_stop = should_stop or (lambda: False)
        self._found: dict[_Key, _Found] = {}

    def compute(self, function: Callable[..., _Found], calls: Mapping[_Key, tuple[Any, ...]]) -> None:
        """Call ``function(*call, should_stop=…)`` for what is not there; nothing where nobody helps."""
        spread = _SPREAD.get()
        keys = [key for key in calls if key not in self._found]
        if spread is None or len(keys) < 2:
            return

        def done(index: int, found: _Found) -> bool:
            self._found[keys[index]] = found
            return False

        spread(function, [calls[key] for key in keys], done, should_stop=self._should_stop)

    def take(self, key: _Key) -> _Found | None:
        """Return a result, once; None if it was not computed."""
        return self._found.pop(key, None)


@contextmanager
def spreading(spread: Spread) -> Iterator[None]:
    """Have studies inside the block spread their calls."""
    token = _SPREAD.set(spread)
    try:
        yield
    finally:
        _SPREAD.reset(token)
