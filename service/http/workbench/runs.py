"""``/v1/runs``: jobs with what is said of them, found again, put in the bin, compared."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Body, Query, Response

from service.db.repositories.runs import RunRow
from service.http.dependencies import Context, InContext, TypedRoute, listing
from service.http.in_lane import reading, writing
from service.http.routes.described import LISTED
from service.http.workbench.revisions import REVISED, ExpectedDependency, revised
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
def list_runs(context: InContext, query: Annotated[RunQuery, Query()]) -> Response:
    """Runs that meet every filter, newest first, without those in the bin.

    `status=accepted&status=running` are all that are under way.
    """
    rows, following = newest(
        query, context.service.settings, partial(context.service.runs.page, query.to_filter(context.sees))
    )
    items = [RunAnswer.of_run(row, context.service.queue.live_progress(row.id)) for row in rows]
    return listing(context, RunPage(items=items, next=following))


@router.get("/compare")
@reading
def compare(a: RunId, b: RunId, context: InContext) -> Comparison:
    """Two runs: what differs in what they computed, and the main figures of their results."""
    with context.service.database.reading():
        return comparison(context.service, a, b, context.caller)


@router.get("/{job_id}", response_model=RunAnswer, responses=REVISED)
@reading
def get_run(job_id: str, context: InContext) -> Response:
    """A run, in the bin or not; its id is that of its job."""
    return _answer(context, context.service.runs.seen(job_id, context.sees))


@router.patch("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def change_run(job_id: str, body: Changed, context: InContext, expected: ExpectedDependency) -> Response:
    """Change project, name, notes or tags of a run; what is left out stays."""
    return _answer(context, context.service.runs.change(job_id, changes_of(body), expected, context.sees))


@router.delete("/{job_id}", response_model=RunAnswer, responses=REVISED)
@writing
def delete_run(job_id: str, context: InContext) -> Response:
    """Put a run that has ended in the bin, from which it is deleted after some days with what it computed."""
    return _answer(context, context.service.runs.put_in_bin(job_id, context.sees))


@router.post("/{job_id}/restore", response_model=RunAnswer, responses=REVISED)
@writing
def restore_run(job_id: str, context: InContext) -> Response:
    """Take a run out of the bin."""
    return _answer(context, context.service.runs.restore(job_id, context.sees))


def _answer(context: Context, row: RunRow) -> Response:
    live = None if row.job.state.finished else context.service.queue.live_progress(row.id)
    return revised(RunAnswer.of_run(row, live))
