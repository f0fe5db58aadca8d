"""``/v1/jobs/{id}/events``: a job as server-sent events."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Depends, FastAPI, Header, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.auth.callers import Caller
from service.http.dependencies import InContext
from service.http.events import Looks, job_events
from service.http.middleware.head import HEADERS_ONLY
from service.queue.core import Service
from service.schemas.event_answers import END

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])

LastEventId = Annotated[
    str | None,
    Header(max_length=200, description="`id` of the last event received; points since then are sent."),
]


class _ToldEverything(Exception):  # noqa: N818 - no error: there is nothing more to say
    """The client has had the end of this job."""


@dataclass(frozen=True, slots=True)
class _Watched:
    service: Service
    looks: Looks
    caller: Caller
    job_id: str
    last_event_id: str | None
    headers_only: bool


async def _watched(
    job_id: str,
    context: InContext,
    last_event_id: LastEventId = None,
) -> _Watched:
    """The job to follow; refused here, before the answer begins, if there is none."""
    request, service, caller = context.request, context.service, context.caller
    row = await service.lanes.reads.run(caller.owner, service.job, job_id, caller)
    if last_event_id == END and row.state.finished:
        raise _ToldEverything
    return _Watched(
        service, request.app.state.looks, caller, job_id, last_event_id, HEADERS_ONLY in request.scope
    )


@router.get(
    "/{job_id}/events",
    response_class=EventSourceResponse,
    responses={204: {"description": "`Last-Event-ID` is that of the end: do not connect again."}},
)
async def events(watched: Annotated[_Watched, Depends(_watched)]) -> AsyncIterator[ServerSentEvent]:
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

    app.add_exception_handler(_ToldEverything, nothing_more)
