"""Reports of a service: each is made once, in a lane of its own, and kept as long as there is room."""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict
from collections.abc import Callable

from service.errors import TooManyRequestsError
from service.queue.lanes import Lane

MOST_BYTES = 64 * 1024**2
"""Of all that is kept."""
MOST_UNDER_WAY = 4
"""Reports that one owner may have made at a time, or wait for."""
_RETRY_SECONDS = 5
_MOST_FAILED = 64


class Reports:
    """Reports that were made, and those that are being made. All happens on one event loop.

    Parameters
    ----------
    lane : Lane
        In which they are made.
    """

    def __init__(self, lane: Lane) -> None:
        self._lane = lane
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._size = 0
        self._making: dict[str, asyncio.Task[bytes]] = {}
        self._owners: Counter[str] = Counter()

    async def get(
        self,
        key: str,
        owner: str,
        make: Callable[[], bytes],
        seconds: float | None,
        made: Callable[[], None],
    ) -> bytes | None:
        """Return a report; None if it is not there after so long.

        Parameters
        ----------
        key : says everything that is in it.
        owner : whose turn it is.
        make : makes it, in a thread.
        seconds : how long is waited; None for as long as it takes [s].
        made : called once it is there, if somebody does not wait for it any more.

        Raises
        ------
        ServiceError
            What `make` raises; TooManyRequestsError if the owner has as many under way as one may.
        """
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        task = self._making.get(key)
        if task is None:
            if self._owners[owner] >= MOST_UNDER_WAY:
                words = f"the key has as many reports under way as one may: {MOST_UNDER_WAY}"
                raise TooManyRequestsError(words, _RETRY_SECONDS)
            self._owners[owner] += 1
            task = self._making[key] = asyncio.create_task(self._make(key, owner, make))
        await asyncio.wait({task}, timeout=seconds)
        if task.done():
            self._making.pop(key, None)
            return task.result()
        task.add_done_callback(lambda _: made())
        return None

    async def _make(self, key: str, owner: str, make: Callable[[], bytes]) -> bytes:
        try:
            report = await self._lane.run(owner, make)
        finally:
            self._owners[owner] -= 1
            if not self._owners[owner]:
                del self._owners[owner]
            self._forget_failed()
        self._keep(key, report)
        return report

    def _keep(self, key: str, report: bytes) -> None:
        self._making.pop(key, None)
        self._kept[key] = report
        self._size += len(report)
        while self._size > MOST_BYTES and self._kept:
            self._size -= len(self._kept.popitem(last=False)[1])

    def _forget_failed(self) -> None:
        """Of what failed and nobody asked for again, only the newest are remembered."""
        failed = [key for key, task in self._making.items() if task.done()]
        for key in failed[:-_MOST_FAILED]:
            self._making.pop(key).exception()
