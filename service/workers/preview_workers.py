"""Previews: computed at once by worker processes of their own, never stored.

The processes start with the first preview, or when the page is opened. Of the previews of one client only the
newest is computed; those of several clients wait for each other, a few at most.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from service.db.repositories import Attempt
from service.errors import (
    ConflictError,
    InvalidRequestError,
    JobFailedError,
    PreviewError,
    QueueFullError,
    TooManyRequestsError,
)
from service.jobs.ids import new_id
from service.jobs.kinds.previews import PREVIEWS
from service.jobs.outputs import FailureKind, Pace
from service.jobs.registry import Registry
from service.workers.base import Failed, Finished, Lost, Outcome, Unwatched
from service.workers.local import LocalExecutor
from service.workers.process_limits import ProcessLimits
from solver.errors import Issue

log = logging.getLogger("stickslip.previews")

MOST_WAITING = 16
WORKERS = 2
"""Processes: while one answer is put together and drawn, the next is computed."""
_RETRY_SECONDS = 1
_GRACE_SECONDS = 0.5
_LONGEST_WAIT_SECONDS = 120.0
_SILENT = Pace(progress_seconds=3600.0, checkpoint_seconds=3600.0, checkpoint_bytes=0)
_SUPERSEDED = "a newer preview of the same client took its place"


@dataclass(eq=False, slots=True)
class _Asked:
    """A preview somebody waits for."""

    attempt: Attempt
    client: str
    owner: str
    loop: asyncio.AbstractEventLoop
    answer: asyncio.Future[bytes]
    stopped: Exception | None = field(default=None)

    def settle(self, outcome: bytes | Exception) -> None:
        """Answer, from any thread; once the client's loop has closed nobody listens."""
        if not self.loop.is_closed():
            self.loop.call_soon_threadsafe(self._settle, outcome)

    def _settle(self, outcome: bytes | Exception) -> None:
        if self.answer.done():
            return
        if isinstance(outcome, Exception):
            self.answer.set_exception(outcome)
        else:
            self.answer.set_result(outcome)


class Previews(Unwatched):
    """Computes previews; a `Sink` of its executor.

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
        self.registry = registry
        self._workers = workers
        self._seconds = seconds
        self._limits = ProcessLimits(memory_bytes=memory_bytes, processor_seconds=seconds + _GRACE_SECONDS)
        self._lock = threading.RLock()
        self._waiting: deque[_Asked] = deque()
        self._running: dict[str, _Asked] = {}
        self._served: list[str] = []
        self._executor: LocalExecutor | None = None
        self._closed = False

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
        loop = asyncio.get_running_loop()
        attempt = Attempt(
            job_id=new_id(), kind=kind, spec=spec, attempt=1, max_attempts=1, lease_owner="preview"
        )
        asked = _Asked(attempt, client, owner, loop, loop.create_future())
        self._add(asked, most)
        try:
            return await asyncio.wait_for(asked.answer, _LONGEST_WAIT_SECONDS)
        except TimeoutError as error:
            raise PreviewError(f"no worker was free for it within {_LONGEST_WAIT_SECONDS:g} s") from error
        finally:
            self._drop(asked)

    def begin(self) -> None:
        """Start the workers if they do not run: for those who will want a preview in a moment."""
        with self._lock:
            if self._closed or self._executor is not None:
                return
            self._executor = LocalExecutor(
                self.registry.runs(),
                self.registry.warm_up,
                workers=self._workers,
                grace_seconds=_GRACE_SECONDS,
                pace=_SILENT,
                limits=self._limits,
            )
            self._executor.start(self)

    def close(self) -> None:
        """End the workers; whoever waits is told."""
        with self._lock:
            self._closed = True
            waiting, self._waiting = list(self._waiting), deque()
            executor, self._executor = self._executor, None
        for asked in waiting:
            asked.settle(PreviewError("the service stops"))
        if executor is not None:
            executor.close()

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        """Answer the one who waits for it."""
        with self._lock:
            asked = self._running.pop(attempt.job_id, None)
        if asked is not None:
            asked.settle(asked.stopped or _answer(outcome))
        self.room()

    def room(self) -> None:
        """Compute the next ones, one to a process."""
        with self._lock:
            while not self._closed and self._executor is not None and self._waiting:
                if not self._executor.free() or len(self._running) >= self._executor.status().ready:
                    return
                asked = self._next()
                self._running[asked.attempt.job_id] = asked
                asked.loop.call_soon_threadsafe(asked.loop.call_later, self._seconds, self._overtime, asked)
                self._executor.submit(asked.attempt)

    def _add(self, asked: _Asked, most: int | None) -> None:
        with self._lock:
            if self._closed:
                raise PreviewError("the service stops")
            if asked.client:
                self._supersede(asked.client)
            own = sum(other.owner == asked.owner for other in self._waiting)
            if most is not None and own >= most:
                raise TooManyRequestsError(f"{own} previews of yours wait already", _RETRY_SECONDS)
            if len(self._waiting) >= MOST_WAITING:
                raise QueueFullError(f"{MOST_WAITING} previews wait already", _RETRY_SECONDS)
            self._waiting.append(asked)
        self.begin()
        self.room()

    def _next(self) -> _Asked:
        """Owners take turns: the first one of the owner whose turn is longest ago."""
        turns = {owner: at for at, owner in enumerate(self._served)}
        found = min(self._waiting, key=lambda asked: turns.get(asked.owner, -1))
        self._waiting.remove(found)
        self._served = [*(owner for owner in self._served if owner != found.owner), found.owner]
        del self._served[:-MOST_WAITING]
        return found

    def _supersede(self, client: str) -> None:
        for other in [each for each in self._waiting if each.client == client]:
            self._waiting.remove(other)
            other.settle(ConflictError(_SUPERSEDED))
        for other in self._running.values():
            if other.client == client:
                self._stop(other, ConflictError(_SUPERSEDED))

    def _overtime(self, asked: _Asked) -> None:
        detail = f"the preview took longer than {self._seconds:g} s: submit it as a job"
        with self._lock:
            self._stop(asked, PreviewError(detail))

    def _drop(self, asked: _Asked) -> None:
        """Nobody waits for it any more."""
        with self._lock:
            if asked in self._waiting:
                self._waiting.remove(asked)
            self._stop(asked, PreviewError("nobody waits for it"))

    def _stop(self, asked: _Asked, reason: Exception) -> None:
        running = asked.attempt.job_id in self._running
        if running and asked.stopped is None and self._executor is not None:
            asked.stopped = reason
            self._executor.stop_attempt(asked.attempt)


def _answer(outcome: Outcome) -> bytes | Exception:
    if isinstance(outcome, Finished):
        return (outcome.output.encoded or "{}").encode()
    if isinstance(outcome, Lost):
        log.warning("a preview was lost: %s", outcome.reason)
        return PreviewError(outcome.reason)
    if isinstance(outcome, Failed):
        failure = outcome.failure
        if failure.kind is FailureKind.MEMORY_LIMIT:
            return InvalidRequestError([Issue(pointer="/scene", message=f"`scene`: {failure.detail}")])
        if failure.kind in (FailureKind.SCENE, FailureKind.SETTING):
            issues = failure.issues or (Issue(pointer="", message=failure.detail),)
            return InvalidRequestError(issues)
        return JobFailedError(failure.detail, failure.to_json())
    return PreviewError("the preview was stopped")
