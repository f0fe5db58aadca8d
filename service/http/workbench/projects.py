"""``/v1/projects``: names under which runs are gathered."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response

from service.http.dependencies import CallerDependency, ServiceDependency, TypedRoute, listing
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
def list_projects(
    request: Request,
    service: ServiceDependency,
    caller: CallerDependency,
    query: Annotated[ProjectQuery, Query()],
) -> Response:
    """Projects that meet every filter, newest first."""
    found = partial(service.projects.page, owner=caller.sees, text=query.text, deleted=query.deleted)
    rows, following = newest(query, service.settings, found)
    return listing(request, ProjectPage(items=[ProjectAnswer.of(row) for row in rows], next=following))


@router.post("", status_code=201, response_model=ProjectAnswer)
@writing
def make_project(body: Made, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Make a project. Two may have the same name."""
    made = ProjectAnswer.of(service.projects.add(caller.owner, body.name, body.notes))
    answer = revised(made, 201)
    answer.headers["Location"] = f"/v1/projects/{made.id}"
    return answer


@router.get("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@reading
def get_project(project_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """A project, in the bin or not."""
    return revised(ProjectAnswer.of(service.projects.seen(project_id, caller.sees)))


@router.patch("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def change_project(
    project_id: str,
    body: Changed,
    service: ServiceDependency,
    caller: CallerDependency,
    expected: ExpectedDependency,
) -> Response:
    """Change the name or the notes of a project; what is left out stays."""
    row = service.projects.change(project_id, changes_of(body), expected, caller.sees)
    return revised(ProjectAnswer.of(row))


@router.delete("/{project_id}", response_model=ProjectAnswer, responses=REVISED)
@writing
def delete_project(project_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Put a project in the bin, from which it is deleted after some days. Its runs stay where they are."""
    return revised(ProjectAnswer.of(service.projects.put_in_bin(project_id, caller.sees)))


@router.post("/{project_id}/restore", response_model=ProjectAnswer, responses=REVISED)
@writing
def restore_project(project_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Take a project out of the bin."""
    return revised(ProjectAnswer.of(service.projects.restore(project_id, caller.sees)))
