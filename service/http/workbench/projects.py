"""``/v1/projects``: names under which runs are gathered."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query, Response

from service.http.dependencies import InContext, TypedRoute, listing
from service.http.in_lane import reading, writing
from service.http.routes.described import LISTED
from service.http.workbench.revisions import REVISED, ExpectedDependency, revised
from service.schemas.pages import newest
from service.schemas.workbench_answers import ProjectAnswer, ProjectPage
from service.schemas.workbench_queries import (
    NewProject,
    ProjectChanges,
    ProjectQuery,
    changes_of,
)

router = APIRouter(prefix="/v1/projects", tags=["projects"], route_class=TypedRoute)

_NEW = {"project": {"value": {"name": "Shroud of stage 3", "notes": "Loads from the test of May."}}}
_CHANGES = {"changes": {"value": {"name": "Shroud of stage 3, second try"}}}
Made = Annotated[NewProject, Body(openapi_examples=_NEW)]
Changed = Annotated[ProjectChanges, Body(openapi_examples=_CHANGES)]


@router.get("", response_model=ProjectPage, responses=LISTED)
@reading
def list_projects(context: InContext, query: Annotated[ProjectQuery, Query()]) -> Response:
    """Projects that meet every filter, newest first."""
    found = partial(context.service.projects.page, owner=context.sees, text=query.text, deleted=query.deleted)
    rows, following = newest(query, context.service.settings, found)
    return listing(context, ProjectPage(items=[ProjectAnswer.of(row) for row in rows], next=following))


@router.post("", status_code=201, response_model=ProjectAnswer)
@writing
def make_project(body: Made, context: InContext) -> Response:
    """Make a project. Two may have the same name."""
    made = ProjectAnswer.of(context.service.projects.add(context.caller.owner, body.name, body.notes))
    answer = revised(made, 201)
    answer.headers["Location"] = f"/v1/projects/{made.id}"
    return answer


@router.get("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@reading
def get_project(project_id: str, context: InContext) -> Response:
    """A project, in the bin or not."""
    return revised(ProjectAnswer.of(context.service.projects.seen(project_id, context.sees)))


@router.patch("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def change_project(
    project_id: str, body: Changed, context: InContext, expected: ExpectedDependency
) -> Response:
    """Change the name or the notes of a project; what is left out stays."""
    row = context.service.projects.change(project_id, changes_of(body), expected, context.sees)
    return revised(ProjectAnswer.of(row))


@router.delete("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def delete_project(project_id: str, context: InContext) -> Response:
    """Put a project in the bin, from which it is deleted after some days. Its runs stay where they are."""
    return revised(ProjectAnswer.of(context.service.projects.put_in_bin(project_id, context.sees)))


@router.post("/{project_id}/restore", response_model=ProjectAnswer, responses=REVISED)
@writing
def restore_project(project_id: str, context: InContext) -> Response:
    """Take a project out of the bin."""
    return revised(ProjectAnswer.of(context.service.projects.restore(project_id, context.sees)))
