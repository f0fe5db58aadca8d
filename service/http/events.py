"""A job as a stream of events: news of its progress, points of its branch as they come, its end.

A stream holds no thread and no database connection while it waits; it ends with the job, with its client
and with the service.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Iterator

from fastapi.sse import ServerSentEvent
from starlette.concurrency import run_in_threadpool

from service.auth.callers import Caller
from service.db.models import JobState
from service.db.repositories import JobRow
from service.queue.core import Service
from service.queue.queue import Live
from service.queue.subscriptions import Event
from service.schemas.answers import JobAnswer
from service.schemas.event_answers import END, PARTIAL, PROGRESS, JobPoints, JobProgress

_LEAST_SECONDS = 0.1
_LOOK_AGAIN_SECONDS = 2.0
# A job that another service runs tells nothing but what it writes.
_LOOK_ELSEWHERE_SECONDS = 0.5
_RETRY_MILLISECONDS = 1000
_POINTS_OF_AN_EVENT = 2000
_MARK = re.compile(r"([0-9a-f]{8})\.([0-9]{1,9})")


class _Story:
    """What one client has been told."""

    def __init__(self, last_event_id: str | None) -> None:
        known = _MARK.fullmatch(last_event_id or "")
        self._tag = known[1] if known else ""
        self._count = int(known[2]) if known else 0
        self._said: JobProgress | None = None

    def news(self, row: JobRow, live: Live | None) -> Iterator[ServerSentEvent]:
        """The points and the progress it has not been told yet."""
        if live is not None:
            yield from self._points(live)
            now = JobProgress(
                status=JobState.RUNNING, attempt=live.attempt, progress=live.fraction, points=live.points
            )
        else:
            now = JobProgress(status=row.state, attempt=row.attempt, progress=row.progress, points=row.points)
        if now != self._said and not now.status.finished:
            self._said = now
            yield ServerSentEvent(event=PROGRESS, data=now, id=self._mark())

    def _points(self, live: Live) -> Iterator[ServerSentEvent]:
        if live.tag != self._tag:
            self._tag, self._count = live.tag, 0
        for start in range(self._count, len(live.found), _POINTS_OF_AN_EVENT):
            points = list(live.found[start : start + _POINTS_OF_AN_EVENT])
            self._count = start + len(points)
            data = JobPoints(attempt=live.attempt, start=start, points=points)
            yield ServerSentEvent(event=PARTIAL, data=data, id=self._mark())

    def _mark(self) -> str | None:
        return f"{self._tag}.{self._count}" if self._tag else None


class _Bell:
    """Wakes a stream from the service's threads."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._changed = asyncio.Event()
        self._ended = asyncio.Event()

    def listen(self, event: Event) -> None:
        """A listener of `Waiters`."""
        self._loop.call_soon_threadsafe(self._ring, event.ended)

    async def rung(self, patience: float) -> bool:
        """Wait for news, at least `_LEAST_SECONDS` unless the job ended; whether its row has changed."""
        await _within(self._ended, _LEAST_SECONDS)
        await _within(self._changed, patience)
        ended = self._ended.is_set()
        self._changed.clear()
        self._ended.clear()
        return ended

    def _ring(self, ended: bool) -> None:
        self._changed.set()
        if ended:
            self._ended.set()


async def _within(event: asyncio.Event, seconds: float) -> None:
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return


async def job_events(
    service: Service, job_id: str, caller: Caller, last_event_id: str | None = None
) -> AsyncIterator[ServerSentEvent]:
    """Yield the events of a job until it has ended or the service stops.

    Parameters
    ----------
    service : Service
        Runs the job, or shares its database with the one that does.
    job_id : str
        A job there is.
    caller : Caller
        Who may see it.
    last_event_id : str or None
        What the client was told last: points it has are not sent again.
    """
    bell, story = _Bell(), _Story(last_event_id)
    loop = asyncio.get_running_loop()
    heartbeat = service.settings.heartbeat_seconds
    with service.waiters.listening(job_id, bell.listen):
        yield ServerSentEvent(comment=f"job {job_id}", retry=_RETRY_MILLISECONDS)
        row = await run_in_threadpool(service.job, job_id, caller)
        looked = said = loop.time()
        while not service.stopping.is_set():
            live = service.queue.live(job_id)
            for event in story.news(row, live):
                yield event
                said = loop.time()
            if row.state.finished:
                yield ServerSentEvent(event=END, data=JobAnswer.of(row), id=END)
                return
            elsewhere = live is None and not service.database.exclusive
            look_after = _LOOK_ELSEWHERE_SECONDS if elsewhere else _LOOK_AGAIN_SECONDS
            now = loop.time()
            changed = await bell.rung(max(min(looked + look_after, said + heartbeat) - now, 0.0))
            now = loop.time()
            if changed or now - looked >= look_after:
                row = await run_in_threadpool(service.job, job_id, caller)
                looked = now
            if now - said >= heartbeat:
                yield ServerSentEvent(comment="still here")
                said = now
