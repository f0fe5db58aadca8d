"""``/v1/jobs/{id}/events``: a job as server-sent events."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Header, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.auth.callers import Caller
from service.db.models import NOBODY, JobState
from service.db.repositories import JobRow
from service.db.repositories.owned import visible
from service.http.dependencies import InContext
from service.http.middleware.every_answer import HEADERS_ONLY
from service.queue.core import Service
from service.queue.running import Event, Live
from service.schemas.answers import END, PARTIAL, PROGRESS, JobAnswer, JobPoints, JobProgress

_LEAST_SECONDS = 0.1
_EVENTS_A_SECOND = 200.0
_LOOK_AGAIN_SECONDS = 5.0
_GATHER_SECONDS = 0.02
# Until another service has told how far the job is that it runs, its row is looked at.
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
                status=JobState.RUNNING, attempt=live.attempt, progress=live.fraction, points=live.points,
                best=None if live.best is None else dict(live.best),
            )  # fmt: skip
        else:
            now = JobProgress(
                status=row.state, attempt=row.attempt, progress=row.progress, points=row.points, best=row.best
            )
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


class _Wakeup:
    """Wakes a stream from the service's threads."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._changed = asyncio.Event()
        self._ended = asyncio.Event()

    def listen(self, event: Event) -> None:
        """A listener of `Waiters`."""
        self._loop.call_soon_threadsafe(self._wake, event.ended)

    async def news(self, least: float, patience: float) -> bool:
        """Wait for news, at least so long [s] unless the job ended; whether its row has changed."""
        await _within(self._ended, least)
        await _within(self._changed, patience)
        ended = self._ended.is_set()
        self._changed.clear()
        self._ended.clear()
        return ended

    def _wake(self, ended: bool) -> None:
        self._changed.set()
        if ended:
            self._ended.set()


async def _within(event: asyncio.Event, seconds: float) -> None:
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return


class Looks:
    """The rows of jobs for all streams: those that are asked for at about the same time in one look-up."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._asked: dict[str, asyncio.Future[JobRow | None]] = {}
        self._task: asyncio.Task[None] | None = None
        self.streams = 0

    @property
    def least_seconds(self) -> float:
        """Least time between two events of a stream [s]."""
        return max(_LEAST_SECONDS, self.streams / _EVENTS_A_SECOND)

    async def row(self, job_id: str, caller: Caller) -> JobRow:
        """The row of a job; `Service.job` lists the errors."""
        found = self._asked.get(job_id)
        if found is None:
            found = self._asked[job_id] = asyncio.get_running_loop().create_future()
            if self._task is None:
                self._task = asyncio.create_task(self._look())
        # Several streams wait for the same: one that ends must not end that of the others.
        return visible(await asyncio.shield(found), caller.sees, f"there is no job {job_id!r}")

    async def _look(self) -> None:
        await asyncio.sleep(_GATHER_SECONDS)
        asked, self._asked, self._task = self._asked, {}, None
        try:
            rows = await self._service.lanes.reads.run(NOBODY, self._service.jobs.several, list(asked))
        except Exception as error:  # noqa: BLE001 - told to each stream
            for waiting in asked.values():
                waiting.set_exception(error)
            return
        for job_id, waiting in asked.items():
            waiting.set_result(rows.get(job_id))


async def job_events(
    service: Service,
    job_id: str,
    caller: Caller,
    last_event_id: str | None = None,
    looks: Looks | None = None,
) -> AsyncIterator[ServerSentEvent]:
    """Yield the events of a job until it has ended or the service stops.

    Parameters
    ----------
    service : runs the job, or shares its database with the one that does.
    job_id : a job there is.
    caller : who may see it.
    last_event_id : what the client was told last: points it has are not sent again.
    looks : of all streams of the service; its own if it is the only one.
    """
    looks = looks or Looks(service)
    wakeup, story = _Wakeup(), _Story(last_event_id)
    loop = asyncio.get_running_loop()
    heartbeat = service.settings.heartbeat_seconds
    with service.waiters.listening(job_id, wakeup.listen):
        yield ServerSentEvent(comment=f"job {job_id}", retry=_RETRY_MILLISECONDS)
        row = await looks.row(job_id, caller)
        looked = said = loop.time()
        while not service.stopping.is_set():
            live = service.queue.live(job_id) if row.state.finished else service.live(job_id)
            for event in story.news(row, live):
                yield event
                said = loop.time()
            if row.state.finished:
                yield ServerSentEvent(event=END, data=JobAnswer.of(row), id=END)
                return
            elsewhere = live is None and not service.database.exclusive
            look_after = _LOOK_ELSEWHERE_SECONDS if elsewhere else _LOOK_AGAIN_SECONDS
            now = loop.time()
            changed = await wakeup.news(
                looks.least_seconds, max(min(looked + look_after, said + heartbeat) - now, 0.0)
            )
            now = loop.time()
            if changed or now - looked >= look_after:
                row = await looks.row(job_id, caller)
                looked = now
            if now - said >= heartbeat:
                yield ServerSentEvent(comment="still here")
                said = now


router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

LastEventId = Annotated[
    str | None,
    Header(max_length=200, description="`id` of the last event received; points since then are sent."),
]


class _AllSentError(Exception):
    """The client has had the end of this job."""


@dataclass(frozen=True, slots=True)
class _WatchedJob:
    service: Service
    looks: Looks
    caller: Caller
    job_id: str
    last_event_id: str | None
    headers_only: bool


async def _watched(job_id: str, context: InContext, last_event_id: LastEventId = None) -> _WatchedJob:
    """The job to follow; refused here, before the answer begins, if there is none."""
    request, service, caller = context.request, context.service, context.caller
    row = await service.lanes.reads.run(caller.owner, service.job, job_id, caller)
    if last_event_id == END and row.state.finished:
        raise _AllSentError
    return _WatchedJob(
        service, request.app.state.looks, caller, job_id, last_event_id, HEADERS_ONLY in request.scope
    )


@router.get(
    "/{job_id}/events",
    response_class=EventSourceResponse,
    responses={204: {"description": "`Last-Event-ID` is that of the end: do not connect again."}},
)
async def events(watched: Annotated[_WatchedJob, Depends(_watched)]) -> AsyncIterator[ServerSentEvent]:
    """Follow a job: events when there is news, ten times a second at most, a comment after a long silence.

    `progress` has status, attempt, progress, points; `partial`, for kinds that follow one branch, its new
    points as `[value, amplitude]` from number `start` on; `end`, the last one, the job. After a broken
    connection, `Last-Event-ID` goes on with the points not received.
    """
    if watched.headers_only:
        return
    looks = watched.looks
    looks.streams += 1
    try:
        async for event in job_events(
            watched.service, watched.job_id, watched.caller, watched.last_event_id, looks
        ):
            yield event
    finally:
        looks.streams -= 1


def install(app: FastAPI) -> None:
    """Have `app` answer 204 to clients that come back after the end: they then stay away."""

    async def nothing_more(_request: Request, _error: Exception) -> Response:
        return Response(status_code=204)

    app.add_exception_handler(_AllSentError, nothing_more)
