"""``/v1/runs/{job_id}/shares`` and ``/v1/shared``: links that show one run to who has no key."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Query, Request, Response

from service.auth.authenticator import Doorkeeper
from service.auth.callers import KEYLESS, LINK_READERS, Caller, Scope
from service.db.repositories.runs import RunRow
from service.errors import NotFoundError
from service.http.dependencies import (
    CallerDependency,
    ServiceDependency,
    TypedRoute,
    as_json,
    raw_list,
    with_raw,
)
from service.http.in_lane import reading, writing, writing_files
from service.http.middleware.admission import address_of
from service.http.routes.sweeps import SWEEP_FORMS, SweepForm, sweep_answer
from service.schemas.answers import JobScene, ResultsAnswer, ResultsHead, SweepAnswer, SweepDetail
from service.schemas.workbench_answers import NewShareAnswer, ShareAnswer, SharedRun, ShareList
from service.schemas.workbench_queries import NewLink

router = APIRouter(prefix="/v1", tags=["links"], route_class=TypedRoute)

_NEW = {"link": {"value": {"days": 30.0}}}
Made = Annotated[NewLink, Body(openapi_examples=_NEW)]


@router.get("/runs/{job_id}/shares")
@reading
def list_shares(job_id: str, service: ServiceDependency, caller: CallerDependency) -> ShareList:
    """The links to a run, oldest first; their tokens are not kept."""
    rows = service.shares.of_run(job_id, caller.sees)
    return ShareList(items=[ShareAnswer.of(row) for row in rows])


@router.post("/runs/{job_id}/shares", status_code=201)
@writing
def share_run(
    job_id: str, body: Made, service: ServiceDependency, caller: CallerDependency
) -> NewShareAnswer:
    """Make a link to a run, which shows it with its results to whoever has it, without a key.

    The token is told this once. The link ends when it is deleted or `days` are over; while the run is in the
    bin it shows nothing.
    """
    made = service.shares.add(job_id, body.days, caller.sees)
    link = f"/v1/shared?token={made.token}"
    return NewShareAnswer.of(made.row, token=made.token, link=link)


@router.delete("/runs/{job_id}/shares/{share_id}", status_code=204)
@writing
def end_share(job_id: str, share_id: str, service: ServiceDependency, caller: CallerDependency) -> None:
    """End a link to a run."""
    service.shares.end(job_id, share_id, caller.sees)


async def _token(
    request: Request, token: Annotated[str, Query(max_length=200, description="Of the link.")]
) -> str:
    """The token of a link, while it may be asked."""
    doorkeeper: Doorkeeper = request.app.state.doorkeeper
    doorkeeper.count_link(token, address_of(request.scope))
    return token


TokenDependency = Annotated[str, Depends(_token)]


async def _reader() -> Caller:
    """Whoever has a link: all of them take turns as one."""
    return LINK_READERS


ReaderDependency = Annotated[Caller, Depends(_reader)]


def _whose(run: RunRow) -> Caller:
    """Who may read what the owner of a link's run owns: to be asked for nothing but this run."""
    return replace(KEYLESS, owner=run.owner, scopes=frozenset({Scope.READ}))


@router.get("/shared")
@reading
def shared_run(token: TokenDependency, service: ServiceDependency, caller: ReaderDependency) -> SharedRun:  # noqa: ARG001
    """The run of a link: what was asked, and how it ended."""
    return SharedRun.of(service.shares.run_of(token))


@router.get("/shared/scene", response_model=JobScene)
@reading
def shared_scene(token: TokenDependency, service: ServiceDependency, caller: ReaderDependency) -> Response:  # noqa: ARG001
    """The scene of a link's run, as it is computed."""
    run = service.shares.run_of(token)
    return as_json(JobScene(job=run.job.id, scene=service.scene_of(run.job.id, _whose(run))))


@router.get("/shared/results", response_model=ResultsAnswer)
@reading
def shared_results(token: TokenDependency, service: ServiceDependency, caller: ReaderDependency) -> Response:  # noqa: ARG001
    """What the run of a link computed."""
    run = service.shares.run_of(token)
    with service.database.reading():
        found = service.results(run.job.id, _whose(run))
        sweeps = SweepAnswer.of_rows(found.sweeps, service.sweeps)
    about = ResultsHead(job=found.job.id, status=found.job.state)
    body = with_raw(about, result=found.text.encode(), sweeps=raw_list(sweeps))
    return Response(body, media_type="application/json")


@router.get("/shared/sweeps/{sweep_id}", response_model=SweepDetail, responses=SWEEP_FORMS)
@writing_files
def shared_sweep(
    sweep_id: str,
    request: Request,
    token: TokenDependency,
    service: ServiceDependency,
    caller: ReaderDependency,  # noqa: ARG001
    form: SweepForm = None,
) -> Response:
    """A sweep stored with the run of a link, in the form that `Accept` prefers."""
    run = service.shares.run_of(token)
    sweep = service.sweep(sweep_id, _whose(run))
    if sweep.job_id != (run.job.result_of or run.job.id):
        raise NotFoundError(f"there is no sweep {sweep_id!r}", withheld=True)
    return sweep_answer(sweep, form, request, service)
