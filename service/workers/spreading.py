"""The calls of one attempt, computed by its worker and by those that have nothing else to do.

The worker begins with the first calls and sends batches of the last ones, two to each helper so that none
waits for the next. What calls take is measured as they are computed: where sending them costs more than it
gains, none is sent. A batch that does not come back is computed here; what is wrong with a call so shows
here, as it does without helpers.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

BATCH_SECONDS = 0.2
"""What a batch takes about: others wait no longer for a worker that helps [s]."""
_WORTH_SECONDS = 0.03  # less is not sent: that takes a few milliseconds, and perhaps as long to hear of it
_PATIENCE_SECONDS = 0.05


class BatchAnswer(NamedTuple):
    """Of a batch: its results, pickled; None if it was not computed."""

    number: int
    data: bytes | None


class Helpers(Protocol):
    """Where batches are sent to."""

    alone: bool
    """Whether the worker itself computes too while others help."""

    def room(self) -> int:
        """How many batches may be sent now."""

    def share(self) -> int:
        """Among how many the calls are divided."""

    def send(self, number: int, data: bytes) -> None:
        """Send a batch; an answer follows."""

    def answers(self, seconds: float) -> Sequence[BatchAnswer]:
        """What came back, after so long at most if there is nothing yet."""

    def end(self, *, recall: bool) -> None:
        """No more batches for now; with `recall` what is underway is not wanted any more."""


class Spreading:
    """A `solver.results.spread.Spread` with helpers.

    Parameters
    ----------
    helpers : who may help.
    unwanted : whether the attempt itself is not wanted any more: then nothing underway is waited for.
    """

    def __init__(self, helpers: Helpers, unwanted: Callable[[], bool]) -> None:
        self._helpers, self._unwanted = helpers, unwanted
        self._seconds: dict[object, float] = {}
        self._own: set[object] = set()
        self._numbers = 0

    def __call__(
        self, function: Callable[..., Any], calls: Sequence[tuple[Any, ...]],
        done: Callable[[int, Any], bool], *, should_stop: Callable[[], bool],
        here: Callable[[int], Any] | None = None, seconds: float | None = None,
    ) -> None:  # fmt: skip
        """Compute the calls; see `Spread`."""
        name = function.func if isinstance(function, partial) else function
        if seconds is not None:
            self._seconds.setdefault(name, seconds)
        pending, underway = deque(range(len(calls))), dict[int, list[int]]()
        compute = here or (lambda index: function(*calls[index], should_stop=should_stop))
        try:
            while pending or underway:
                if should_stop():
                    pending.clear()
                    if self._unwanted() or not underway:
                        return
                self._send(function, name, calls, pending, underway)
                wait = bool(underway) and not (pending and self._helpers.alone)
                for answer in self._helpers.answers(_PATIENCE_SECONDS if wait else 0.0) if underway else ():
                    back = underway.pop(answer.number, [])
                    if answer.data is None:
                        pending.extendleft(reversed(back))
                    elif _any_done(done, back, pickle.loads(answer.data)):
                        return
                if pending and (self._helpers.alone or not underway):
                    index, begun = pending.popleft(), time.perf_counter()
                    found = compute(index)
                    self._measured(name, time.perf_counter() - begun)
                    if done(index, found):
                        return
        finally:
            self._helpers.end(recall=bool(underway))

    def _measured(self, name: object, seconds: float) -> None:
        known = self._seconds.get(name)
        self._seconds[name] = seconds if known is None else 0.7 * known + 0.3 * seconds

    def _send(
        self, function: Callable[..., Any], name: object, calls: Sequence[tuple[Any, ...]],
        pending: deque[int], underway: dict[int, list[int]],
    ) -> None:  # fmt: skip
        """Send batches of the last calls while there is room and it is worth it."""
        each = self._seconds.get(name)
        if each is None or name in self._own or (each * len(pending) < _WORTH_SECONDS and not underway):
            return
        keep = 1 if self._helpers.alone else 0
        while len(pending) > keep and self._helpers.room() > 0:
            fair = (len(pending) - keep) // (2 * self._helpers.share())
            size = max(1, min(int(BATCH_SECONDS / max(each, 1e-6)), fair))
            batch = [pending.pop() for _ in range(size)]
            try:
                data = pickle.dumps((function, [calls[index] for index in batch]))
            except (pickle.PicklingError, TypeError, AttributeError):
                pending.extend(reversed(batch))
                self._own.add(name)  # something of a user's that has no name to be sent by
                return
            self._numbers += 1
            underway[self._numbers] = batch
            self._helpers.send(self._numbers, data)


def _any_done(done: Callable[[int, Any], bool], indices: Sequence[int], results: Sequence[Any]) -> bool:
    """Tell of all results; whether one of them ends the rest."""
    ends = [done(index, result) for index, result in zip(indices, results, strict=True)]
    return any(ends)


def helped(data: bytes, should_stop: Callable[[], bool]) -> bytes | None:
    """Compute a batch of another attempt; None if it is to be computed there, whatever is wrong."""
    function, calls = pickle.loads(data)
    results = []
    for call in calls:
        if should_stop():
            return None
        results.append(function(*call, should_stop=should_stop))
    return None if should_stop() else pickle.dumps(results)
