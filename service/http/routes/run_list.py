"""``/v1/runs/events``, ``/v1/runs/{id}/summary``: what a list of runs shows, and what changes in it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.sse import _SSE_EVENT_SCHEMA, EventSourceResponse, format_sse_event

from service.db.models import NOBODY, JobState
from service.db.repositories.run_repository import RunFilter
from service.http.dependencies import InContext, Responses, TypedRoute
from service.http.in_lane import reading
from service.http.middleware.every_answer import HEADERS_ONLY
from service.queue.core import Service
from service.queue.running import EVERY, Event
from service.schemas.run_figures import run_summary
from service.schemas.workbench_answers import RunAnswer, RunSummary

router = APIRouter(prefix="/v1/runs", tags=["runs"], route_class=TypedRoute)

_RETRY_MILLISECONDS = 2000
_LEAST_SECONDS = 0.3
_STREAMS_A_SECOND = 200.0
# Jobs that another service of the same database runs tell nothing here: those under way are looked at anew.
_LOOK_AGAIN_SECONDS = 5.0
_MOST_AT_ONCE = 100
_UNDER_WAY = (JobState.ACCEPTED, JobState.RUNNING)
_RUN = "run"


@dataclass(eq=False, slots=True)
class _Listener:
    """One stream: what it was told of runs that have not ended, and what it is to be told."""

    told: dict[str, bytes] = field(default_factory=dict)
    news: dict[str, bytes] = field(default_factory=dict)
    woken: asyncio.Event = field(default_factory=asyncio.Event)
    new: bool = True
    over: bool = False

    def tell(self, run: RunAnswer, event: bytes) -> None:
        """Note an event for it, if it does not know it."""
        if self.told.get(run.id) != event:
            self.news[run.id] = self.told[run.id] = event
            self.woken.set()
        if run.status.finished:
            self.told.pop(run.id, None)


class RunNews:
    """What happens to runs: read and written out once for all who listen, and told to whom may see it."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._heard: dict[str | None, set[_Listener]] = {}
        self._reader: asyncio.Task[None] | None = None
        self._changed: set[str] = set()

    async def stream(self, sees: str | None) -> AsyncIterator[bytes]:
        """Yield the events of the runs of an owner, or of everybody's (None), until the service stops."""
        one = _Listener()
        self._heard.setdefault(sees, set()).add(one)
        if self._reader is None:
            self._woken = asyncio.Event()
            self._reader = asyncio.create_task(self._read())
        self._woken.set()
        try:
            yield format_sse_event(comment="runs", retry=_RETRY_MILLISECONDS)
            while not one.over:
                try:
                    await asyncio.wait_for(one.woken.wait(), self._service.settings.heartbeat_seconds)
                except TimeoutError:
                    yield format_sse_event(comment="still here")
                    continue
                one.woken.clear()
                news, one.news = one.news, {}
                if news:
                    yield b"".join(news.values())
        finally:
            self._heard[sees].discard(one)
            if not self._heard[sees]:
                del self._heard[sees]

    def _note(self, job_id: str) -> None:
        self._changed.add(job_id)
        self._woken.set()

    async def _taken(self) -> set[str]:
        """Wait for a while; the jobs to which something happened."""
        try:
            await asyncio.wait_for(self._woken.wait(), _LOOK_AGAIN_SECONDS)
        except TimeoutError:
            return set()
        self._woken.clear()
        taken, self._changed = self._changed, set()
        return taken

    async def _read(self) -> None:
        """Tell all who listen, as long as there are some; when it ends, they do."""
        service, loop = self._service, asyncio.get_running_loop()
        busy, looked = set[str](), -_LOOK_AGAIN_SECONDS

        def listen(event: Event) -> None:
            loop.call_soon_threadsafe(self._note, event.job_id)

        try:
            with service.waiters.listening(EVERY, listen):
                while self._heard:
                    ids = await self._taken()
                    if service.stopping.is_set():
                        break
                    now, asked = loop.time(), set(self._heard)
                    if now - looked < _LOOK_AGAIN_SECONDS:
                        asked = {sees for sees in asked if any(one.new for one in self._heard[sees])}
                    else:
                        looked, ids, busy = now, ids | busy, set()
                    for one in (one for sees in asked for one in self._heard[sees]):
                        one.new = False
                    busy |= await service.lanes.reads.run(NOBODY, _under_way, service, asked)
                    await self._tell(ids | busy if asked else ids)
                    streams = sum(map(len, self._heard.values()))
                    await asyncio.sleep(max(_LEAST_SECONDS, streams / _STREAMS_A_SECOND))
        finally:
            self._reader = None
            for one in (one for several in self._heard.values() for one in several):
                one.over = True
                one.woken.set()

    async def _tell(self, ids: set[str]) -> None:
        told = await self._service.lanes.reads.run(NOBODY, _events, self._service, ids, set(self._heard))
        for run, event in told:
            for sees in (run.owner, None):
                for one in self._heard.get(sees, ()):
                    one.tell(run, event)


def _under_way(service: Service, asked: set[str | None]) -> set[str]:
    pages = (service.runs.page(RunFilter(sees=one, status=_UNDER_WAY), _MOST_AT_ONCE) for one in asked)
    return {row.id for page in pages for row in page}


def _events(service: Service, ids: set[str], heard: set[str | None]) -> list[tuple[RunAnswer, bytes]]:
    owners = None if None in heard else [one for one in heard if one is not None]
    rows = service.runs.several(sorted(ids), owners) if ids else []
    runs = [RunAnswer.of_run(row, service.queue.live(row.id)) for row in rows]
    return [(run, format_sse_event(event=_RUN, data_str=run.model_dump_json(by_alias=True))) for run in runs]


_EVENTS: Responses = {200: {"content": {EventSourceResponse.media_type: {"itemSchema": _SSE_EVENT_SCHEMA}}}}


@router.get("/events", response_class=Response, responses=_EVENTS)
async def run_updates(context: InContext) -> Response:
    """Follow all runs: an event `run` with the run whenever one is handed in, goes on or ends.

    At most three times a second, a comment after a long silence. What is said of a run, and the bin, are not
    told: whoever changes these knows it.
    """
    headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
    if HEADERS_ONLY in context.request.scope:
        return Response(headers=headers, media_type=EventSourceResponse.media_type)
    news: RunNews = context.request.app.state.news
    return EventSourceResponse(news.stream(context.sees), headers=headers)


Points = Annotated[int, Query(ge=8, le=2000, description="Of the curve, at most.")]


@router.get("/{job_id}/summary")
@reading
def summary(job_id: str, context: InContext, points: Points = 60) -> RunSummary:
    """What was asked of a run and what came out, in figures, with its response as a small curve."""
    with context.service.database.reading():
        row = context.service.runs.seen(job_id, context.sees)
        return run_summary(context.service, row, points)
