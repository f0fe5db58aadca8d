"""``/v1/projects``, ``/v1/runs``: jobs with what is said of them; links that show one run, design reports.

The revision of what can be changed is the `ETag` of its answers and stands in `If-Match` of changes (RFC
9110).
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Header, Query, Request, Response

from service.auth.callers import KEYLESS, LINK_READERS, Caller, Scope
from service.db.models import JobState
from service.db.repositories.run_repository import RunRow
from service.errors import ConflictError, NotFoundError
from service.http.dependencies import (
    LISTED,
    TEXT,
    Context,
    InContext,
    TypedRoute,
    as_json,
    listing,
    media,
    preferred_wait,
    service_behind,
    wait_for_end,
)
from service.http.in_lane import reading, writing, writing_files
from service.http.made_once import Reports
from service.http.middleware.admission import LINKED
from service.http.routes.job_routes import results_answer, told_of
from service.http.routes.stored import SWEEP_FORMS, SweepForm, sweep_answer
from service.jobs.strict_json import digest
from service.rendering.representations import JSON, chosen
from service.schemas.answers import JobScene, ResultsAnswer, SweepAnswer, SweepDetail, newest, page_of
from service.schemas.run_figures import comparison
from service.schemas.workbench_answers import (
    Comparison,
    NewLink,
    NewProject,
    NewShareAnswer,
    PendingReport,
    ProjectAnswer,
    ProjectChanges,
    ProjectPage,
    ProjectQuery,
    RunAnswer,
    RunChanges,
    RunPage,
    RunQuery,
    ShareAnswer,
    SharedRun,
    ShareList,
    SharePage,
    ShareQuery,
    changes_of,
)
from solver.results.told import Block

_TAG = re.compile(r'"(\d{1,9})"')
_TOLD: dict[str, Any] = {"ETag": {"description": "The revision.", "schema": {"type": "string"}}}
REVISED: dict[int | str, dict[str, Any]] = {200: {"headers": _TOLD}}
"""Of an answer that has its revision as `ETag`, for the description of the API."""


async def expected(
    if_match: Annotated[
        str | None,
        Header(max_length=200, description="The `ETag` of what is to be changed; anything if left out."),
    ] = None,
) -> frozenset[int] | None:
    """The revisions of which it must have one; None for any."""
    if if_match is None or if_match.strip() == "*":
        return None
    found = (_TAG.fullmatch(one.strip()) for one in if_match.split(","))
    return frozenset(int(one[1]) for one in found if one is not None)


ExpectedDependency = Annotated[frozenset[int] | None, Depends(expected)]


def revised(answer: RunAnswer | ProjectAnswer, status: int = 200) -> Response:
    """An answer with its revision as `ETag`.

    Its words are what the tag is of: the progress of a run that computes changes without it, so the answer is
    not one to be kept by caches.
    """
    headers = {"ETag": f'"{answer.revision}"', "Cache-Control": "no-store"}
    return as_json(answer, status, headers)


projects = APIRouter(prefix="/v1/projects", tags=["projects"], route_class=TypedRoute)

_NEW_PROJECT = {"project": {"value": {"name": "Shroud of stage 3", "notes": "Loads from the test of May."}}}
_PROJECT_CHANGES = {"changes": {"value": {"name": "Shroud of stage 3, second try"}}}
MadeProject = Annotated[NewProject, Body(openapi_examples=_NEW_PROJECT)]
ChangedProject = Annotated[ProjectChanges, Body(openapi_examples=_PROJECT_CHANGES)]


@projects.get("", response_model=ProjectPage, responses=LISTED)
@reading
def list_projects(context: InContext, query: Annotated[ProjectQuery, Query()]) -> Response:
    """Projects that meet every filter, newest first."""
    found = partial(context.service.projects.page, owner=context.sees, text=query.text, deleted=query.deleted)
    rows, following = newest(query, context.service.settings, found)
    return listing(context, ProjectPage(items=[ProjectAnswer.of(row) for row in rows], next=following))


@projects.post("", status_code=201, response_model=ProjectAnswer)
@writing
def make_project(body: MadeProject, context: InContext) -> Response:
    """Make a project. Two may have the same name."""
    made = ProjectAnswer.of(context.service.projects.add(context.caller.owner, body.name, body.notes))
    answer = revised(made, 201)
    answer.headers["Location"] = f"/v1/projects/{made.id}"
    return answer


@projects.get("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@reading
def get_project(project_id: str, context: InContext) -> Response:
    """A project, in the bin or not."""
    return revised(ProjectAnswer.of(context.service.projects.seen(project_id, context.sees)))


@projects.patch("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def change_project(
    project_id: str, body: ChangedProject, context: InContext, expected: ExpectedDependency
) -> Response:
    """Change the name or the notes of a project; what is left out stays."""
    row = context.service.projects.change(project_id, changes_of(body), expected, context.sees)
    return revised(ProjectAnswer.of(row))


@projects.delete("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def delete_project(project_id: str, context: InContext) -> Response:
    """Put a project in the bin, from which it is deleted after some days. Its runs stay where they are."""
    return revised(ProjectAnswer.of(context.service.projects.put_in_bin(project_id, context.sees)))


@projects.post("/{project_id}/restore", response_model=ProjectAnswer, responses=REVISED)
@writing
def restore_project(project_id: str, context: InContext) -> Response:
    """Take a project out of the bin."""
    return revised(ProjectAnswer.of(context.service.projects.restore(project_id, context.sees)))


runs = APIRouter(prefix="/v1/runs", tags=["runs"], route_class=TypedRoute)

_RUN_CHANGES = {"changes": {"value": {"name": "Softer damper", "tags": ["shroud", "stage 3"]}}}
ChangedRun = Annotated[RunChanges, Body(openapi_examples=_RUN_CHANGES)]
RunId = Annotated[str, Query(max_length=100)]


@runs.get("", response_model=RunPage, responses=LISTED)
@reading
def list_runs(context: InContext, query: Annotated[RunQuery, Query()]) -> Response:
    """Runs that meet every filter, newest first, without those in the bin.

    `status=accepted&status=running` are all that are under way.
    """
    rows, following = newest(
        query, context.service.settings, partial(context.service.runs.page, query.to_filter(context.sees))
    )
    items = [RunAnswer.of_run(row, context.service.queue.live(row.id)) for row in rows]
    return listing(context, RunPage(items=items, next=following))


@runs.get("/compare")
@reading
def compare(a: RunId, b: RunId, context: InContext) -> Comparison:
    """Two runs: what differs in what they computed, and the main figures of their results."""
    with context.service.database.reading():
        return comparison(context.service, a, b, context.caller)


@runs.get("/{job_id}", response_model=RunAnswer, responses=REVISED)
@reading
def get_run(job_id: str, context: InContext) -> Response:
    """A run, in the bin or not; its id is that of its job."""
    return _answer(context, context.service.runs.seen(job_id, context.sees))


@runs.patch("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def change_run(job_id: str, body: ChangedRun, context: InContext, expected: ExpectedDependency) -> Response:
    """Change project, name, notes or tags of a run; what is left out stays."""
    return _answer(context, context.service.runs.change(job_id, changes_of(body), expected, context.sees))


@runs.delete("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def delete_run(job_id: str, context: InContext) -> Response:
    """Put a run that has ended in the bin, from which it is deleted after some days with what it computed."""
    return _answer(context, context.service.runs.put_in_bin(job_id, context.sees))


@runs.post("/{job_id}/restore", response_model=RunAnswer, responses=REVISED)
@writing
def restore_run(job_id: str, context: InContext) -> Response:
    """Take a run out of the bin."""
    return _answer(context, context.service.runs.restore(job_id, context.sees))


def _answer(context: Context, row: RunRow) -> Response:
    live = None if row.job.state.finished else context.service.queue.live(row.id)
    return revised(RunAnswer.of_run(row, live))


reports = APIRouter(prefix="/v1/jobs", tags=["jobs"])

Json = Mapping[str, Any]
_BINARY = {"type": "string", "format": "binary"}


_LATER: dict[str, Any] = {
    "model": PendingReport,
    "description": "With `Prefer`: it is not there yet, `/v1/runs/events` tells the run again when it is.",
    "headers": {
        "Location": {"description": "Where it will be.", "schema": {"type": "string"}},
        "Retry-After": {"description": "Seconds to wait.", "schema": {"type": "integer"}},
    },
}
_RETRY_SECONDS = 2


@reports.get(
    "/{job_id}/report",
    response_class=Response,
    responses={200: media({"text/html": TEXT, "application/pdf": _BINARY}), 202: _LATER},
)
async def report(
    job_id: str,
    context: InContext,
    form: Annotated[Literal["html", "pdf"] | None, Query(alias="format")] = None,
    accept: Annotated[str | None, Header(max_length=500)] = None,
    prefer: Annotated[
        str | None,
        Header(max_length=200, description="`respond-async`, or `wait=N`: how long is waited [s]."),
    ] = None,
) -> Response:
    """The design report of a job of the kind `design` or `pareto`: a page that needs nothing else, or a PDF.

    `format` goes before `Accept`. It is made once, in a process with limits, and kept. With `Prefer` the
    answer is 202 while the job is computed or its report made; without, it waits for the report.
    """
    from service.rendering.report.making import FORMS, report_apart

    service, owner = context.service, context.caller.owner
    wanted = FORMS[form] if form is not None else chosen(accept, tuple(FORMS.values()))
    suffix = next(name for name, kind in FORMS.items() if kind == wanted)
    seconds = _patience(prefer, service.settings.max_wait_seconds)
    begun = time.monotonic()
    if seconds is not None and not await wait_for_end(
        context, job_id, seconds, lambda row: row.state.finished
    ):
        return _not_yet(context, job_id, "computing")
    designed = await service.lanes.reads.run(owner, _designed, context, job_id)
    key = digest([*designed, suffix])
    left = None if seconds is None else max(seconds - (time.monotonic() - begun), 0.0)
    kept: Reports = context.request.app.state.reports
    made = await kept.get(
        key, owner, partial(report_apart, *designed, suffix, service.settings.report_seconds), left,
        partial(service.waiters.ended, job_id),
    )  # fmt: skip
    if made is None:
        return _not_yet(context, job_id, "making")
    name = f"report-{job_id}.{suffix}"
    return Response(
        made, media_type=wanted, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def _patience(prefer: str | None, longest: float) -> float | None:
    """How long a caller wants to wait; None for as long as it takes [s]."""
    said = prefer or ""
    seconds = preferred_wait({"prefer": said}, longest)
    return 0.0 if seconds is None and "respond-async" in said.lower() else seconds


def _not_yet(context: Context, job_id: str, status: Literal["computing", "making"]) -> Response:
    url = context.request.url
    where = f"{url.path}?{url.query}" if url.query else url.path
    headers = {"Location": where, "Retry-After": str(_RETRY_SECONDS)}
    return as_json(PendingReport(job_id=job_id, status=status), 202, headers=headers)


def _designed(context: Context, job_id: str) -> tuple[Json, Json, Json, Json]:
    """Scene, problem and result of a job that found an optimum, and what is known of its run."""
    from service.rendering.report.about import about_run
    from service.rendering.report.sections import KINDS, problem_of_request

    service, caller = context.service, context.caller
    with service.database.reading():
        row = service.job(job_id, caller)
        if row.kind not in KINDS:
            raise ConflictError(
                f"job {job_id} is of the kind {row.kind!r}, which has no report: only {', '.join(KINDS)} have"
            )
        found = service.results(job_id, caller)
        scene = service.scene_of(job_id, caller)
        run = service.runs.seen(job_id, caller.sees)
        project = None if run.words.project is None else service.projects.seen(run.words.project, caller.sees)
    about = about_run(RunAnswer.of_run(run), None if project is None else ProjectAnswer.of(project))
    return scene, problem_of_request(row.request or {}), found.result, about


shares = APIRouter(prefix="/v1", tags=["links"], route_class=TypedRoute)

_NEW_LINK = {"link": {"value": {"days": 30.0}}}
MadeLink = Annotated[NewLink, Body(openapi_examples=_NEW_LINK)]


@shares.get("/runs/{job_id}/shares")
@reading
def list_shares(job_id: str, context: InContext) -> ShareList:
    """The links to a run, oldest first; their tokens are not kept."""
    rows = context.service.shares.of_run(job_id, context.sees)
    return ShareList(items=[ShareAnswer.of(row) for row in rows])


@shares.get("/shares", response_model=SharePage, responses=LISTED)
@reading
def list_all_shares(context: InContext, query: Annotated[ShareQuery, Query()]) -> Response:
    """The links to all runs that the key sees, newest first; their tokens are not kept."""
    find = partial(context.service.shares.page, context.sees)
    rows, following = page_of(query, context.service.settings, find, itemgetter(1))
    return listing(context, SharePage(items=[ShareAnswer.of(row) for row, _ in rows], next=following))


@shares.post("/runs/{job_id}/shares", status_code=201)
@writing
def share_run(job_id: str, body: MadeLink, context: InContext) -> NewShareAnswer:
    """Make a link to a run, which shows it with its results to whoever has it, without a key.

    The token is told this once. The link ends when it is deleted or `days` are over; while the run is in the
    bin it shows nothing.
    """
    made = context.service.shares.add(job_id, body.days, context.sees)
    link = f"/v1/shared?token={made.token}"
    return NewShareAnswer.of(made.row, token=made.token, link=link)


@shares.delete("/runs/{job_id}/shares/{share_id}", status_code=204)
@writing
def end_share(job_id: str, share_id: str, context: InContext) -> None:
    """End a link to a run."""
    context.service.shares.end(job_id, share_id, context.sees)


async def _of_link(
    request: Request, token: Annotated[str, Query(max_length=200, description="Of the link.")]
) -> Context:
    """The context of a request by a link: all who have one take turns as one."""
    return Context(request, service_behind(request), LINK_READERS, token)


OfLink = Annotated[Context, Depends(_of_link)]


def _shared(context: Context) -> tuple[RunRow, Caller]:
    """The run of a link, and who may read what its owner owns: to be asked for nothing but this run."""
    run: RunRow = context.request.scope["state"][LINKED]  # found on admission
    return run, replace(KEYLESS, owner=run.owner, scopes=frozenset({Scope.READ}))


_PAGE = "text/html"


@shares.get("/shared", response_model=SharedRun, responses={200: media({_PAGE: TEXT})})
@reading
def shared_run(context: OfLink) -> Response:
    """The run of a link: what was asked, and how it ended; a page with what came out where a browser asks."""
    run, reader = _shared(context)
    told = SharedRun.of(run)
    kind = chosen(context.request.headers.get("accept"), (JSON, _PAGE))
    if kind == JSON:
        return as_json(told, headers={"Vary": "Accept"})
    from service.rendering.report.about import POLICY, shared_page

    blocks: Sequence[Block] = ()
    sweeps: list[SweepAnswer] = []
    if run.job.state is JobState.SUCCESSFUL:
        with context.service.database.reading():
            found = context.service.results(run.id, reader)
            blocks = told_of(context.service, found)
            sweeps = [SweepAnswer.of(one) for one in found.sweeps]
    headers = {"Vary": "Accept", "Content-Security-Policy": POLICY}
    return Response(shared_page(told, blocks, sweeps, context.token), media_type=_PAGE, headers=headers)


@shares.get("/shared/scene", response_model=JobScene)
@reading
def shared_scene(context: OfLink) -> Response:
    """The scene of a link's run, as it is computed."""
    run, reader = _shared(context)
    return as_json(JobScene(job=run.id, scene=context.service.scene_of(run.id, reader)))


@shares.get("/shared/results", response_model=ResultsAnswer)
@reading
def shared_results(context: OfLink) -> Response:
    """What the run of a link computed."""
    run, reader = _shared(context)
    return results_answer(context, run.id, reader)


@shares.get("/shared/sweeps/{sweep_id}", response_model=SweepDetail, responses=SWEEP_FORMS)
@writing_files
def shared_sweep(sweep_id: str, context: OfLink, form: SweepForm = None) -> Response:
    """A sweep stored with the run of a link, in the form that `Accept` prefers."""
    run, reader = _shared(context)
    sweep = context.service.sweep(sweep_id, reader)
    if sweep.job_id != (run.job.result_of or run.id):
        raise NotFoundError(f"there is no sweep {sweep_id!r}", withheld=True)
    return sweep_answer(sweep, form, context)
