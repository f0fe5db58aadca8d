"""``/v1/projects`` and ``/v1/runs``: jobs with what is said of them, gathered, found, changed, compared.

The revision of what can be changed is the `ETag` of its answers and stands in `If-Match` of changes (RFC
9110).
"""

from __future__ import annotations

import re
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Header, Query, Response

from service.db.repositories.runs import RunRow
from service.http.dependencies import LISTED, Context, InContext, TypedRoute, as_json, listing
from service.http.in_lane import reading, writing
from service.schemas.comparisons import comparison
from service.schemas.pages import newest
from service.schemas.workbench_answers import Comparison, ProjectAnswer, ProjectPage, RunAnswer, RunPage
from service.schemas.workbench_queries import (
    NewProject,
    ProjectChanges,
    ProjectQuery,
    RunChanges,
    RunQuery,
    changes_of,
)

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
Made = Annotated[NewProject, Body(openapi_examples=_NEW_PROJECT)]
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
def make_project(body: Made, context: InContext) -> Response:
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
    items = [RunAnswer.of_run(row, context.service.queue.live_progress(row.id)) for row in rows]
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
    live = None if row.job.state.finished else context.service.queue.live_progress(row.id)
    return revised(RunAnswer.of_run(row, live))
