"""``/v1/runs``: jobs with what is said of them, found again, put in the bin, compared."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query, Request, Response

from service.db.repositories.runs import RunRow
from service.http.dependencies import CallerDependency, ServiceDependency, TypedRoute, listing
from service.http.in_lane import reading, writing
from service.http.routes.described import LISTED
from service.http.workbench.revisions import REVISED, ExpectedDependency, revised
from service.queue.core import Service
from service.schemas.comparisons import comparison
from service.schemas.pages import newest
from service.schemas.workbench_answers import Comparison, RunAnswer, RunPage
from service.schemas.workbench_queries import RunChanges, RunQuery, changes_of

router = APIRouter(prefix="/v1/runs", tags=["runs"], route_class=TypedRoute)

_CHANGES = {"changes": {"value": {"name": "Softer damper", "tags": ["shroud", "stage 3"]}}}
Changed = Annotated[RunChanges, Body(openapi_examples=_CHANGES)]
RunId = Annotated[str, Query(max_length=100)]


@router.get("", response_model=RunPage, responses=LISTED)
@reading
def list_runs(
    request: Request,
    service: ServiceDependency,
    caller: CallerDependency,
    query: Annotated[RunQuery, Query()],
) -> Response:
    """Runs that meet every filter, newest first, without those in the bin.

    `status=accepted&status=running` are all that are under way.
    """
    rows, following = newest(
        query, service.settings, partial(service.runs.page, query.to_filter(caller.sees))
    )
    items = [RunAnswer.of_run(row, service.queue.live_progress(row.id)) for row in rows]
    return listing(request, RunPage(items=items, next=following))


@router.get("/compare")
@reading
def compare(a: RunId, b: RunId, service: ServiceDependency, caller: CallerDependency) -> Comparison:
    """Two runs: what differs in what they computed, and the main figures of their results."""
    with service.database.reading():
        return comparison(service, a, b, caller)


@router.get("/{job_id}", response_model=RunAnswer, responses=REVISED)
@reading
def get_run(job_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """A run, in the bin or not; its id is that of its job."""
    return _answer(service, service.runs.seen(job_id, caller.sees))


@router.patch("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def change_run(
    job_id: str,
    body: Changed,
    service: ServiceDependency,
    caller: CallerDependency,
    expected: ExpectedDependency,
) -> Response:
    """Change project, name, notes or tags of a run; what is left out stays."""
    return _answer(service, service.runs.change(job_id, changes_of(body), expected, caller.sees))


@router.delete("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def delete_run(job_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Put a run that has ended in the bin, from which it is deleted after some days with what it computed."""
    return _answer(service, service.runs.put_in_bin(job_id, caller.sees))


@router.post("/{job_id}/restore", response_model=RunAnswer, responses=REVISED)
@writing
def restore_run(job_id: str, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Take a run out of the bin."""
    return _answer(service, service.runs.restore(job_id, caller.sees))


def _answer(service: Service, row: RunRow) -> Response:
    live = None if row.job.state.finished else service.queue.live_progress(row.job.id)
    return revised(RunAnswer.of_run(row, live))
