"""``/v1/jobs`` and ``/v1/designs``."""

from __future__ import annotations

from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool

from service.auth.callers import Caller
from service.db.models import JobState
from service.db.repositories import JobRow
from service.errors import InvalidRequestError
from service.http.dependencies import (
    CallerDependency,
    JsonBody,
    ServiceDependency,
    idempotency_key,
    listing,
    preferred_wait,
    wait_for_end,
)
from service.http.routes.described import LISTED
from service.queue import cursors
from service.queue.core import Service
from service.schemas.answers import FinishedJob, JobAnswer, JobPage, JobScene, ResultsAnswer, SweepAnswer
from solver.errors import Issue

router = APIRouter(prefix="/v1", tags=["jobs"])

_STOP_MARGIN_SECONDS = 1.0
_SUBMIT_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"model": FinishedJob, "description": "The job has ended: `Prefer: wait=N`, or a stored result."},
    202: {"model": JobAnswer, "description": "The job was accepted, `Location` is where it is."},
}


class JobQuery(BaseModel):
    """Which jobs to list."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    status: JobState | None = None
    kind: str | None = Field(default=None, max_length=32)
    scene: str | None = Field(default=None, max_length=200)
    limit: int = Field(default=100, ge=1, le=10_000)
    cursor: str | None = Field(default=None, max_length=500)


@router.post("/jobs", status_code=202, responses=_SUBMIT_ANSWERS, response_model=None)
async def submit(
    request: Request, body: JsonBody, service: ServiceDependency, caller: CallerDependency
) -> Response:
    """Accept a job. With `Prefer: wait=N` the answer waits up to N seconds for its end."""
    return await _submit(request, service, caller, body)


@router.post("/designs", status_code=202, responses=_SUBMIT_ANSWERS, response_model=None)
async def submit_design(
    request: Request, body: JsonBody, service: ServiceDependency, caller: CallerDependency
) -> Response:
    """Accept a design: a job of the kind `design`."""
    if body.get("kind", "design") != "design":
        message = f"`kind` must be design here or be left out, got {body['kind']!r}"
        raise InvalidRequestError([Issue(pointer="/kind", message=message)])
    return await _submit(request, service, caller, {**body, "kind": "design"})


@router.get("/jobs", response_model=JobPage, responses=LISTED)
def list_jobs(
    request: Request,
    service: ServiceDependency,
    caller: CallerDependency,
    query: Annotated[JobQuery, Query()],
) -> Response:
    """Jobs, newest first."""
    size = min(query.limit, service.settings.page_limit)
    before = None if query.cursor is None else cursors.decode(query.cursor)[1]
    rows = service.jobs.page(
        owner=caller.sees,
        state=query.status,
        kind=query.kind,
        scene=query.scene,
        before=before,
        limit=size + 1,
    )
    following = None
    if len(rows) > size:
        words = query.model_dump(exclude_none=True, exclude={"cursor"}, mode="json")
        following = "/v1/jobs?" + urlencode({**words, "cursor": cursors.encode(None, rows[size - 1].id)})
    items = [_answer(service, row) for row in rows[:size]]
    return listing(request, JobPage(items=items, next=following))


@router.get("/jobs/{job_id}")
def get_job(job_id: str, service: ServiceDependency, caller: CallerDependency) -> JobAnswer:
    """A job."""
    return _answer(service, service.job(job_id, caller))


@router.delete("/jobs/{job_id}")
async def dismiss(job_id: str, service: ServiceDependency, caller: CallerDependency) -> JobAnswer:
    """Dismiss a job. A running one is stopped within the grace; the answer waits for that."""
    row = await run_in_threadpool(service.dismiss, job_id, caller)
    if not row.state.finished:
        row = await wait_for_end(
            service, job_id, service.settings.grace_seconds + _STOP_MARGIN_SECONDS, caller
        )
    return _answer(service, row)


@router.get("/jobs/{job_id}/scene")
def scene_of(job_id: str, service: ServiceDependency, caller: CallerDependency) -> JobScene:
    """The scene of a job as it is computed: with its values set, and what its uploads held.

    It stays what it was when the stored scene or the upload it was made of is replaced or deleted.
    """
    return JobScene(job=job_id, scene=service.scene_of(job_id, caller))


@router.get("/jobs/{job_id}/results")
def results(job_id: str, service: ServiceDependency, caller: CallerDependency) -> ResultsAnswer:
    """What a job computed."""
    return ResultsAnswer.of(service.results(job_id, caller), service.sweeps)


async def _submit(request: Request, service: Service, caller: Caller, body: dict[str, Any]) -> Response:
    key = idempotency_key(request.headers)
    seconds = preferred_wait(request.headers, service.settings.max_wait_seconds)
    row, _ = await run_in_threadpool(service.submit, body, key, caller)
    headers = {"Location": f"/v1/jobs/{row.id}"}
    if seconds is not None:
        row = await wait_for_end(service, row.id, seconds, caller)
        headers["Preference-Applied"] = f"wait={seconds:g}"
    if not row.state.finished:
        return JSONResponse(_answer(service, row).model_dump(mode="json"), 202, headers)
    finished = await run_in_threadpool(_finished, service, row)
    return JSONResponse(finished.model_dump(mode="json"), 200, headers)


def _answer(service: Service, row: JobRow) -> JobAnswer:
    return JobAnswer.of(row, None if row.state.finished else service.queue.live_progress(row.id))


def _finished(service: Service, row: JobRow) -> FinishedJob:
    source = row.result_of or row.id
    return FinishedJob(
        **JobAnswer.of(row).model_dump(),
        result=service.jobs.result(source),
        sweeps=SweepAnswer.of_rows(service.sweeps.of_job(source), service.sweeps),
    )
