"""The threads of the service, apart by what they do and shared fairly among owners.

Pictures and uploads take long and look-ups do not: with threads of their own, those who want many of the
first keep nobody waiting for the second. Inside a lane owners take turns.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import Callable
from functools import partial
from typing import ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread

from service.errors import OverloadedError

_P = ParamSpec("_P")
_T = TypeVar("_T")
_READING, _WRITING, _FILES, _DRAWING, _UPLOADS = 16, 16, 4, 2, 2
_LONG = 3.0
_RETRY_SECONDS = 2


def _everybody(_owner: str) -> None:
    """Nobody is refused."""


class Lane:
    """Some threads. All but the work itself happens on one event loop, so nothing here needs a lock.

    Parameters
    ----------
    threads : int
        How many calls run at a time.
    seconds : float
        How long a call waits for its turn at most [s].
    """

    def __init__(self, threads: int, seconds: float) -> None:
        self.require: Callable[[str], None] = _everybody
        self._seconds = seconds
        self._free = threads
        self._threads = threads
        self._limiter: CapacityLimiter | None = None
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    async def run(self, owner: str, work: Callable[_P, _T], *args: _P.args, **values: _P.kwargs) -> _T:
        """Do `work` in a thread when it is the owner's turn.

        Raises
        ------
        OverloadedError
            If that is not in time.
        """
        await self._enter(owner)
        try:
            # Once more: many may have come before the first of them had its answer.
            self.require(owner)
            if self._limiter is None:
                self._limiter = CapacityLimiter(self._threads)
            return await to_thread.run_sync(partial(work, *args, **values), limiter=self._limiter)
        finally:
            self._leave()

    async def _enter(self, owner: str) -> None:
        if self._free:
            self._free -= 1
            return
        turn = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(owner, deque()).append(turn)
        try:
            async with asyncio.timeout(self._seconds):
                await turn
        except (TimeoutError, asyncio.CancelledError) as error:
            if turn.done() and not turn.cancelled():
                self._leave()  # it had just got a thread
            else:
                self._forget(owner, turn)
            if isinstance(error, TimeoutError):
                words = f"the service did not get to it within {self._seconds:g} s: try again later"
                raise OverloadedError(words, _RETRY_SECONDS) from error
            raise

    def _leave(self) -> None:
        """Give the thread to the owner whose turn is longest ago."""
        while self._waiting:
            owner, turns = self._waiting.popitem(last=False)
            turn = turns.popleft()
            if turns:
                self._waiting[owner] = turns
            if not turn.done():
                turn.set_result(None)
                return
        self._free += 1

    def _forget(self, owner: str, turn: asyncio.Future[None]) -> None:
        turns = self._waiting.get(owner)
        if turns is not None and turn in turns:
            turns.remove(turn)
            if not turns:
                del self._waiting[owner]


class Lanes:
    """The lanes of a service: look-ups, changes of the database, stored arrays, pictures, uploaded files."""

    def __init__(self, seconds: float) -> None:
        self.reads = Lane(_READING, seconds)
        self.writes = Lane(_WRITING, seconds)
        # What takes long itself may wait longer.
        self.files = Lane(_FILES, _LONG * seconds)
        self.pictures = Lane(_DRAWING, _LONG * seconds)
        self.uploads = Lane(_UPLOADS, _LONG * seconds)

    def guard(self, require: Callable[[str], None]) -> None:
        """Have `require` refuse owners (by what it raises) before anything is done for them."""
        for lane in (self.reads, self.writes, self.files, self.pictures, self.uploads):
            lane.require = require
