"""``/v1/jobs`` and ``/v1/designs``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Depends, Query, Response
from pydantic import Field

from service.auth.callers import Caller
from service.db.models import JobState
from service.db.repositories import JobRow
from service.http.dependencies import (
    LISTED,
    Context,
    InContext,
    TypedRoute,
    as_json,
    idempotency_key,
    listing,
    preferred_wait,
    raw_list,
    takes_body,
    wait_for_end,
    with_raw,
)
from service.http.in_lane import prepared, reading
from service.http.made_once import LargeAnswers
from service.jobs.kind_registry import KIND, JobRequest, Json, Registry, asked_of
from service.jobs.kinds.bodies import DESIGN, any_body, design_body, examples, examples_of
from service.queue.core import Results, Service
from service.schemas import answers
from solver.results.told import Block

router = APIRouter(prefix="/v1", tags=["jobs"])

_STOP_MARGIN_SECONDS = 1.0
_SUBMITTED: dict[str, Any] = {
    "methods": ["POST"],
    "status_code": 202,
    "response_model": None,
    "responses": {
        200: {
            "model": answers.FinishedJob,
            "description": "The job has ended: `Prefer: wait=N`, or a stored result.",
        },
        202: {"model": answers.JobAnswer, "description": "The job was accepted, `Location` is where it is."},
    },
}


class JobQuery(answers.ListQuery):
    """Which jobs to list."""

    path: ClassVar[str] = "/v1/jobs"

    status: JobState | None = None
    kind: str | None = Field(default=None, max_length=32)
    scene: str | None = Field(default=None, max_length=200)
    limit: answers.Limit = 100
    cursor: answers.Cursor = None


@router.get("/jobs", response_model=answers.JobPage, responses=LISTED)
@reading
def list_jobs(context: InContext, query: Annotated[JobQuery, Query()]) -> Response:
    """Jobs, newest first."""
    found = partial(
        context.service.jobs.page, owner=context.sees, state=query.status, kind=query.kind, scene=query.scene
    )
    rows, following = answers.newest(query, context.service.settings, found)
    items = [_answer(context.service, row) for row in rows]
    return listing(context, answers.JobPage(items=items, next=following))


@router.get("/jobs/{job_id}", response_model=answers.JobAnswer)
@reading
def get_job(job_id: str, context: InContext) -> Response:
    """A job."""
    return as_json(_answer(context.service, context.service.job(job_id, context.caller)))


@router.delete("/jobs/{job_id}")
async def dismiss(job_id: str, context: InContext) -> answers.JobAnswer:
    """Dismiss a job. A running one is stopped within the grace; the answer waits for that."""
    service, caller = context.service, context.caller
    row = await service.lanes.writes.run(caller.owner, service.dismiss, job_id, caller)
    if not row.state.finished:
        patience = service.settings.grace_seconds + _STOP_MARGIN_SECONDS
        row = await wait_for_end(context, job_id, patience, lambda found: found)
    return _answer(service, row)


@router.get("/jobs/{job_id}/scene", response_model=answers.JobScene)
@reading
def scene_of(job_id: str, context: InContext) -> Response:
    """The scene of a job as it is computed: with its values set, and what its uploads held.

    It stays what it was when the stored scene or the upload it was made of is replaced or deleted.
    """
    return as_json(answers.JobScene(job=job_id, scene=context.service.scene_of(job_id, context.caller)))


@router.get("/jobs/{job_id}/results", response_model=answers.ResultsAnswer)
@reading
def results(job_id: str, context: InContext) -> Response:
    """What a job computed."""
    return results_answer(context, job_id, context.caller)


@router.get("/jobs/{job_id}/told", response_model=answers.ToldAnswer)
@reading
def told(job_id: str, context: InContext) -> Response:
    """What people read of what a job computed: numbers with their units, of every kind."""
    blocks = told_of(context.service, context.service.results(job_id, context.caller))
    return as_json(answers.ToldAnswer(blocks=list(blocks)))


def told_of(service: Service, found: Results) -> Sequence[Block]:
    """What people read of a result."""
    from service.rendering.text import told

    return told(found.job.kind, found.result, service.registry.tell_of(found.job.kind))


def results_answer(context: Context, job_id: str, caller: Caller) -> Response:
    """What a job computed, to a caller."""
    service = context.service
    service.job(job_id, caller)

    def body() -> bytes:
        with service.database.reading():
            found = service.results(job_id, caller)
            sweeps = [answers.SweepAnswer.of(one) for one in found.sweeps]
        about = answers.ResultsHead(job=found.job.id, status=found.job.state)
        return with_raw(about, result=found.text.encode(), sweeps=raw_list(sweeps))

    large: LargeAnswers = context.request.app.state.large
    return large.answer(job_id, body)


@dataclass(frozen=True, slots=True)
class SubmissionHeaders:
    """What the headers of a submission ask for: its idempotency key, and the seconds to wait for the end."""

    key: str | None
    seconds: float | None


async def asked(context: InContext) -> SubmissionHeaders:
    """Read the headers of a submission; `idempotency_key` lists the errors."""
    headers = context.request.headers
    return SubmissionHeaders(
        key=idempotency_key(headers),
        seconds=preferred_wait(headers, context.service.settings.max_wait_seconds),
    )


AskedDependency = Annotated[SubmissionHeaders, Depends(asked)]


def submissions(registry: Registry) -> APIRouter:
    """The routes that take jobs; their bodies are those of the kinds there are."""

    async def submit(body: JobRequest, context: InContext, asked: AskedDependency) -> Response:
        """Accept a job. With `Prefer: wait=N` the answer waits up to N seconds for its end."""
        return await _submit(context, asked, body, await context.request.json())

    async def submit_design(body: JobRequest, context: InContext, asked: AskedDependency) -> Response:
        """Accept a design: a job of the kind `design`."""
        return await _submit(context, asked, body, {**await context.request.json(), KIND: DESIGN})

    taking = APIRouter(prefix="/v1", tags=["jobs"], route_class=TypedRoute)
    takes_body(submit, any_body(registry), examples(registry), by=KIND if len(registry) > 1 else None)
    taking.add_api_route("/jobs", submit, **_SUBMITTED)
    takes_body(submit_design, design_body(registry), examples_of(registry, DESIGN, called="designs"))
    taking.add_api_route("/designs", submit_design, **_SUBMITTED)
    return taking


async def _submit(context: Context, asked: SubmissionHeaders, body: JobRequest, raw: Json) -> Response:
    service, caller = context.service, context.caller
    request = asked_of(body, service.registry.named_in(raw).request)  # a service may have no designs
    checked = request, await prepared(context, raw, request)
    row, _ = await service.lanes.writes.run(caller.owner, service.submit, raw, asked.key, caller, checked)
    headers = {"Location": f"/v1/jobs/{row.id}"}
    answer = partial(_job_or_result, service, headers)
    if asked.seconds is not None:
        headers["Preference-Applied"] = f"wait={asked.seconds:g}"
        return await wait_for_end(context, row.id, asked.seconds, answer, row)
    if row.state.finished:
        return await service.lanes.reads.run(caller.owner, answer, row)
    return answer(row)


def _job_or_result(service: Service, headers: Mapping[str, str], row: JobRow) -> Response:
    """A submitted job; with what it computed if it has ended."""
    if not row.state.finished:
        return as_json(_answer(service, row), 202, headers)
    with service.database.reading():
        source = row.result_of or row.id
        text = service.jobs.result_text(source)
        sweeps = [answers.SweepAnswer.of(one) for one in service.stored.of_job(source)]
    result = b"null" if text is None else text.encode()
    body = with_raw(answers.JobAnswer.of(row), result=result, sweeps=raw_list(sweeps))
    return Response(body, 200, headers, "application/json")


def _answer(service: Service, row: JobRow) -> answers.JobAnswer:
    return answers.JobAnswer.of(row, None if row.state.finished else service.queue.live(row.id))
