"""Previews: computed at once by worker processes of their own, never stored.

The processes start with the service, or with the first preview or page before. Of the previews of one client
only the newest is computed; those of several clients wait for each other, a few at most.
"""

from __future__ import annotations

import asyncio
import logging
from dataclasses import replace
from typing import Any

from service.errors import (
    ConflictError,
    InvalidRequestError,
    JobFailedError,
    PreviewError,
    QueueFullError,
    TooManyRequestsError,
)
from service.jobs.kind_registry import Registry
from service.jobs.kinds.previews import PREVIEWS
from service.jobs.outputs import FailureKind
from service.workers.executor import Failed, Finished, Lost, Outcome
from service.workers.process_limits import ProcessLimits
from service.workers.warm_pool import WarmPool, WarmTask
from solver.errors import Issue

log = logging.getLogger("stickslip.previews")

MOST_WAITING = 16
WORKERS = 2
"""Processes: while one answer is put together and drawn, the next is computed."""
_RETRY_SECONDS = 1
_GRACE_SECONDS = 0.5
_LONGEST_WAIT_SECONDS = 120.0
_INTERPRETED = 20.0  # times as long one may take while kernels are interpreted
_SUPERSEDED = "a newer preview of the same client took its place"


class Previews(WarmPool):
    """Computes previews.

    Parameters
    ----------
    seconds : float
        Longest time one may take [s].
    registry : Registry
        The kinds of preview.
    memory_bytes : int or None
        Most memory one may take.
    workers : int
        Processes.
    """

    def __init__(
        self,
        seconds: float,
        registry: Registry = PREVIEWS,
        memory_bytes: int | None = None,
        workers: int = WORKERS,
    ) -> None:
        limits = ProcessLimits(memory_bytes=memory_bytes)
        super().__init__(
            registry.runs(), registry.warm_up, workers=workers, grace_seconds=_GRACE_SECONDS, limits=limits
        )
        self.registry = registry
        self._given_seconds = seconds
        self._served: list[str] = []

    @property
    def _seconds(self) -> float:
        """Longest time one may take [s]: more of it while kernels are interpreted."""
        return self._given_seconds * (_INTERPRETED if self.interprets else 1.0)

    def _limits(self) -> ProcessLimits:
        return replace(super()._limits(), processor_seconds=self._seconds + _GRACE_SECONDS)

    async def compute(
        self, kind: str, spec: dict[str, Any], client: str = "", owner: str = "", most: int | None = None
    ) -> bytes:
        """The answer to a preview, as JSON; `most` of an owner may wait.

        Raises
        ------
        QueueFullError
            If too many wait.
        TooManyRequestsError
            If too many of the owner wait.
        ConflictError
            If a newer one of the same client took its place.
        PreviewError
            If it took too long, or its worker died.
        InvalidRequestError, JobFailedError
            If it cannot be computed.
        """
        asked = WarmTask.of(kind, spec, owner, client=client, most=most)
        with self._waited_for(asked):
            begun: asyncio.Future[Any] = asyncio.wrap_future(asked.begun)
            outcome: asyncio.Future[Any] = asyncio.wrap_future(asked.outcome)
            await asyncio.wait(
                [begun, outcome], timeout=_LONGEST_WAIT_SECONDS, return_when=asyncio.FIRST_COMPLETED
            )
            if not begun.done() and not outcome.done():
                raise PreviewError(f"no worker was free for it within {_LONGEST_WAIT_SECONDS:g} s")
            await asyncio.wait([outcome], timeout=self._seconds)
            if not outcome.done():
                raise PreviewError(f"the preview took longer than {self._seconds:g} s: submit it as a job")
            return _answer(outcome.result())

    def _admit(self, asked: WarmTask) -> None:
        if self._closed:
            raise PreviewError("the service stops")
        if asked.client:
            self._supersede(asked.client)
        own = sum(other.owner == asked.owner for other in self._waiting)
        if asked.most is not None and own >= asked.most:
            raise TooManyRequestsError(f"{own} previews of yours wait already", _RETRY_SECONDS)
        if len(self._waiting) >= MOST_WAITING:
            raise QueueFullError(f"{MOST_WAITING} previews wait already", _RETRY_SECONDS)

    def _next(self) -> WarmTask | None:
        """Owners take turns: the first one of the owner whose turn is longest ago."""
        turns = {owner: at for at, owner in enumerate(self._served)}
        found = min(self._waiting, key=lambda asked: turns.get(asked.owner, -1), default=None)
        if found is not None:
            self._served = [*(owner for owner in self._served if owner != found.owner), found.owner]
            del self._served[:-MOST_WAITING]
        return found

    def _supersede(self, client: str) -> None:
        for other in [*self._waiting, *self._running.values()]:
            if other.client == client:
                other.settle(ConflictError(_SUPERSEDED))
                self._drop(other)


def _answer(outcome: Outcome) -> bytes:
    if isinstance(outcome, Finished):
        return (outcome.output.encoded or "{}").encode()
    if isinstance(outcome, Lost):
        log.warning("a preview was lost: %s", outcome.reason)
        raise PreviewError(outcome.reason)
    if not isinstance(outcome, Failed):
        raise PreviewError("the service stops")
    failure = outcome.failure
    if failure.kind is FailureKind.MEMORY_LIMIT:
        raise InvalidRequestError.of(("scene",), f"`scene`: {failure.detail}", named=False)
    if failure.kind in (FailureKind.SCENE, FailureKind.SETTING):
        raise InvalidRequestError(failure.issues or (Issue((), failure.detail, named=False),))
    raise JobFailedError(failure.detail, failure.to_json())
