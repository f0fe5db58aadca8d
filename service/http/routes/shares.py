"""``/v1/runs/{job_id}/shares`` and ``/v1/shared``: links that show one run to who has no key."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Query, Request, Response

from service.auth.authenticator import Doorkeeper
from service.auth.callers import KEYLESS, LINK_READERS, Caller, Scope
from service.db.repositories.runs import RunRow
from service.errors import NotFoundError
from service.http.dependencies import Context, InContext, TypedRoute, as_json, service_behind
from service.http.in_lane import reading, writing, writing_files
from service.http.middleware.admission import address_of
from service.http.routes.jobs import results_answer
from service.http.routes.stored import SWEEP_FORMS, SweepForm, sweep_answer
from service.schemas.answers import JobScene, ResultsAnswer, SweepDetail
from service.schemas.workbench_answers import NewShareAnswer, ShareAnswer, SharedRun, ShareList
from service.schemas.workbench_queries import NewLink

router = APIRouter(prefix="/v1", tags=["links"], route_class=TypedRoute)

_NEW = {"link": {"value": {"days": 30.0}}}
Made = Annotated[NewLink, Body(openapi_examples=_NEW)]


@router.get("/runs/{job_id}/shares")
@reading
def list_shares(job_id: str, context: InContext) -> ShareList:
    """The links to a run, oldest first; their tokens are not kept."""
    rows = context.service.shares.of_run(job_id, context.sees)
    return ShareList(items=[ShareAnswer.of(row) for row in rows])


@router.post("/runs/{job_id}/shares", status_code=201)
@writing
def share_run(job_id: str, body: Made, context: InContext) -> NewShareAnswer:
    """Make a link to a run, which shows it with its results to whoever has it, without a key.

    The token is told this once. The link ends when it is deleted or `days` are over; while the run is in the
    bin it shows nothing.
    """
    made = context.service.shares.add(job_id, body.days, context.sees)
    link = f"/v1/shared?token={made.token}"
    return NewShareAnswer.of(made.row, token=made.token, link=link)


@router.delete("/runs/{job_id}/shares/{share_id}", status_code=204)
@writing
def end_share(job_id: str, share_id: str, context: InContext) -> None:
    """End a link to a run."""
    context.service.shares.end(job_id, share_id, context.sees)


async def _of_link(
    request: Request, token: Annotated[str, Query(max_length=200, description="Of the link.")]
) -> Context:
    """The context of a request by a link, while it may be asked: all who have one take turns as one."""
    doorkeeper: Doorkeeper = request.app.state.doorkeeper
    doorkeeper.count_link(token, address_of(request.scope))
    return Context(request, service_behind(request), LINK_READERS, token)


OfLink = Annotated[Context, Depends(_of_link)]


def _shared(context: Context) -> tuple[RunRow, Caller]:
    """The run of a link, and who may read what its owner owns: to be asked for nothing but this run."""
    run = context.service.shares.run_of(context.token)
    return run, replace(KEYLESS, owner=run.owner, scopes=frozenset({Scope.READ}))


@router.get("/shared")
@reading
def shared_run(context: OfLink) -> SharedRun:
    """The run of a link: what was asked, and how it ended."""
    return SharedRun.of(_shared(context)[0])


@router.get("/shared/scene", response_model=JobScene)
@reading
def shared_scene(context: OfLink) -> Response:
    """The scene of a link's run, as it is computed."""
    run, reader = _shared(context)
    return as_json(JobScene(job=run.id, scene=context.service.scene_of(run.id, reader)))


@router.get("/shared/results", response_model=ResultsAnswer)
@reading
def shared_results(context: OfLink) -> Response:
    """What the run of a link computed."""
    run, reader = _shared(context)
    return results_answer(context.service, run.id, reader)


@router.get("/shared/sweeps/{sweep_id}", response_model=SweepDetail, responses=SWEEP_FORMS)
@writing_files
def shared_sweep(sweep_id: str, context: OfLink, form: SweepForm = None) -> Response:
    """A sweep stored with the run of a link, in the form that `Accept` prefers."""
    run, reader = _shared(context)
    sweep = context.service.sweep(sweep_id, reader)
    if sweep.job_id != (run.job.result_of or run.id):
        raise NotFoundError(f"there is no sweep {sweep_id!r}", withheld=True)
    return sweep_answer(sweep, form, context)
