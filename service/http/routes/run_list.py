"""``/v1/runs/events``, ``/v1/runs/{id}/summary``: what a list of runs shows, and what changes in it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.auth.callers import Caller
from service.db.models import NOBODY, JobState
from service.db.repositories.runs import RunFilter, RunRow
from service.http.dependencies import InContext, TypedRoute
from service.http.in_lane import reading
from service.http.middleware.every_answer import HEADERS_ONLY
from service.queue.core import Service
from service.queue.running import EVERY, Event
from service.schemas.run_summaries import run_summary
from service.schemas.workbench_answers import RunAnswer, RunSummary

router = APIRouter(prefix="/v1/runs", tags=["runs"], route_class=TypedRoute)

_RETRY_MILLISECONDS = 2000
_LEAST_SECONDS = 0.3
# Jobs that another service of the same database runs tell nothing here: those under way are looked at anew.
_LOOK_AGAIN_SECONDS = 5.0
_MOST_AT_ONCE = 100
_UNDER_WAY = (JobState.ACCEPTED, JobState.RUNNING)
_RUN = "run"


class _Changed:
    """The ids of jobs to which something happened, from the service's threads."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._woken = asyncio.Event()
        self._ids: set[str] = set()

    def listen(self, event: Event) -> None:
        """A listener of `Waiters`."""
        self._loop.call_soon_threadsafe(self._note, event.job_id)

    def _note(self, job_id: str) -> None:
        self._ids.add(job_id)
        self._woken.set()

    async def taken(self, patience: float) -> set[str]:
        """Wait so long [s] at most; which jobs they are."""
        try:
            await asyncio.wait_for(self._woken.wait(), patience)
        except TimeoutError:
            return set()
        self._woken.clear()
        taken, self._ids = self._ids, set()
        return taken


@dataclass(frozen=True, slots=True)
class _Listened:
    service: Service
    caller: Caller
    sees: str | None
    headers_only: bool


async def _listened(context: InContext) -> _Listened:
    """Who listens, known before the answer begins."""
    request = context.request
    return _Listened(context.service, context.caller, context.sees, HEADERS_ONLY in request.scope)


async def run_events(service: Service, sees: str | None) -> AsyncIterator[ServerSentEvent]:
    """Yield the runs to which something happens, until the service stops.

    Parameters
    ----------
    service : that runs the jobs, or shares its database with the one that does.
    sees : whose runs are told; None for everybody's.
    """
    changed, told = _Changed(), dict[str, str]()
    busy: set[str] = set()
    loop = asyncio.get_running_loop()
    looked = said = -_LOOK_AGAIN_SECONDS
    with service.waiters.listening(EVERY, changed.listen):
        yield ServerSentEvent(comment="runs", retry=_RETRY_MILLISECONDS)
        while not service.stopping.is_set():
            ids = await changed.taken(_LOOK_AGAIN_SECONDS)
            if service.stopping.is_set():
                return
            now = loop.time()
            if now - looked >= _LOOK_AGAIN_SECONDS:
                looked = now
                under_way = await service.lanes.reads.run(NOBODY, _under_way, service, sees)
                ids |= busy | under_way
                busy = under_way
            for answer in await service.lanes.reads.run(NOBODY, _answers, service, ids, sees):
                data = answer.model_dump_json()
                if told.get(answer.id) != data:
                    told[answer.id] = data
                    said = now
                    yield ServerSentEvent(event=_RUN, data=answer)
                if answer.status.finished:
                    told.pop(answer.id, None)
            if now - said >= service.settings.heartbeat_seconds:
                said = now
                yield ServerSentEvent(comment="still here")
            await asyncio.sleep(_LEAST_SECONDS)


def _under_way(service: Service, sees: str | None) -> set[str]:
    found = service.runs.page(RunFilter(sees=sees, status=_UNDER_WAY), _MOST_AT_ONCE)
    return {row.id for row in found}


def _answers(service: Service, ids: set[str], sees: str | None) -> list[RunAnswer]:
    rows = (service.runs.get(job_id) for job_id in sorted(ids) if job_id)
    seen: list[RunRow] = [row for row in rows if row is not None and (sees is None or row.owner == sees)]
    return [RunAnswer.of_run(row, service.queue.live_progress(row.id)) for row in seen]


@router.get("/events", response_class=EventSourceResponse)
async def run_updates(listened: Annotated[_Listened, Depends(_listened)]) -> AsyncIterator[ServerSentEvent]:
    """Follow all runs: an event `run` with the run whenever one is handed in, goes on or ends.

    At most three times a second, a comment after a long silence. What is said of a run, and the bin, are not
    told: whoever changes these knows it.
    """
    if listened.headers_only:
        return
    async for event in run_events(listened.service, listened.sees):
        yield event


Points = Annotated[int, Query(ge=8, le=2000, description="Of the curve, at most.")]


@router.get("/{job_id}/summary")
@reading
def summary(job_id: str, context: InContext, points: Points = 60) -> RunSummary:
    """What was asked of a run and what came out, in figures, with its response as a small curve."""
    with context.service.database.reading():
        row = context.service.runs.seen(job_id, context.sees)
        return run_summary(context.service, row, points)
