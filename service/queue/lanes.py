"""The threads of the service, apart by what they do and shared fairly among owners.

Pictures and uploads take long and look-ups do not: with threads of their own, those who want many of the
first keep nobody waiting for the second. Inside a lane owners take turns, and none has more than a quarter.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from functools import partial
from typing import ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread

from service.auth.callers import LINK_READERS
from service.errors import OverloadedError, RetryLaterError, TooManyRequestsError
from service.queue.meters import Meters

_P = ParamSpec("_P")
_T = TypeVar("_T")
_READING, _WRITING, _FILES, _DRAWING, _UPLOADS, _REPORTS = 16, 16, 4, 2, 4, 1
_LINKS = 2  # requests by links at a time
_LONG = 3.0
_RETRY_SECONDS = 2


class Lane:
    """Some threads. All but the work itself happens on one event loop, so nothing here needs a lock.

    One owner has at most a quarter of the threads at a time: the others find some free.

    Parameters
    ----------
    threads : how many calls run at a time.
    seconds : how long a call waits for its turn at most [s].
    waited : told how long each call waited [s].
    """

    def __init__(
        self, threads: int, seconds: float, waited: Callable[[float], object] = lambda _seconds: None
    ) -> None:
        self._waited = waited
        self.require: Callable[[str], None] = lambda _owner: None
        self._seconds = seconds
        self._free = threads
        self._threads = threads
        self._share = max(1, threads // 4)
        self._running: Counter[str] = Counter()
        self._limiter: CapacityLimiter | None = None
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    async def run(self, owner: str, work: Callable[_P, _T], *args: _P.args, **values: _P.kwargs) -> _T:
        """Do `work` in a thread when it is the owner's turn.

        TooManyRequestsError, OverloadedError if that is not in time: the owner has their share of the
        threads, or others have all of them.
        """
        begun = time.perf_counter()
        await self._enter(owner)
        self._waited(time.perf_counter() - begun)
        try:
            # Once more: many may have come before the first of them had its answer.
            self.require(owner)
            if self._limiter is None:
                self._limiter = CapacityLimiter(self._threads)
            return await to_thread.run_sync(partial(work, *args, **values), limiter=self._limiter)
        finally:
            self._leave(owner)

    def _most(self, owner: str) -> int:
        return min(self._share, _LINKS) if owner == LINK_READERS.owner else self._share

    async def _enter(self, owner: str) -> None:
        turn = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(owner, deque()).append(turn)
        self._give()
        if turn.done():
            return
        try:
            async with asyncio.timeout(self._seconds):
                await turn
        except (TimeoutError, asyncio.CancelledError) as error:
            if turn.done() and not turn.cancelled():
                self._leave(owner)  # it had just got a thread
            else:
                self._forget(owner, turn)
            if isinstance(error, TimeoutError):
                raise self._too_late(owner) from error
            raise

    def _too_late(self, owner: str) -> RetryLaterError:
        if self._running[owner] >= self._most(owner):
            words = f"the key has as many requests of this kind under way as one may: {self._most(owner)}"
            return TooManyRequestsError(words, _RETRY_SECONDS)
        words = f"the service did not get to it within {self._seconds:g} s: try again later"
        return OverloadedError(words, _RETRY_SECONDS)

    def _leave(self, owner: str) -> None:
        self._free += 1
        self._running[owner] -= 1
        if not self._running[owner]:
            del self._running[owner]
        self._give()

    def _give(self) -> None:
        """Give free threads to those owners with less than their share whose turn is longest ago."""
        while self._free:
            owner = next((one for one in self._waiting if self._running[one] < self._most(one)), None)
            if owner is None:
                return
            turns = self._waiting.pop(owner)
            turn = turns.popleft()
            if turns:
                self._waiting[owner] = turns
            if not turn.done():
                self._free -= 1
                self._running[owner] += 1
                turn.set_result(None)

    def _forget(self, owner: str, turn: asyncio.Future[None]) -> None:
        turns = self._waiting.get(owner)
        if turns is not None and turn in turns:
            turns.remove(turn)
            if not turns:
                del self._waiting[owner]


class Lanes:
    """The lanes of a service: look-ups, changes, stored arrays, pictures, uploaded files, reports."""

    def __init__(self, seconds: float, meters: Meters) -> None:
        def lane(name: str, threads: int, seconds: float) -> Lane:
            self._all[name] = Lane(threads, seconds, meters.lanes.labels(name).observe)
            return self._all[name]

        self._all: dict[str, Lane] = {}
        self.reads = lane("reads", _READING, seconds)
        self.writes = lane("writes", _WRITING, seconds)
        # What takes long itself may wait longer.
        self.files = lane("files", _FILES, _LONG * seconds)
        self.pictures = lane("pictures", _DRAWING, _LONG * seconds)
        self.uploads = lane("uploads", _UPLOADS, _LONG * seconds)
        self.reports = lane("reports", _REPORTS, _LONG * seconds)

    def guard(self, require: Callable[[str], None]) -> None:
        """Have `require` refuse owners (by what it raises) before anything is done for them."""
        for lane in self._all.values():
            lane.require = require
