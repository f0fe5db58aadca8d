"""``/v1/results``, ``/v1/sweeps`` and ``/v1/designs``: what was computed, to be queried."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Response

from service.http.dependencies import (
    BINARY,
    LISTED,
    TEXT,
    UNCHANGED,
    Context,
    InContext,
    listing,
    media,
    tagged,
)
from service.http.in_lane import drawing, reading, writing_files
from service.jobs.stored_figures import SweepRecord
from service.rendering.representations import (
    BY_FORMAT,
    JSON,
    SUFFIXES,
    SWEEP_MEDIA,
    chosen,
    sweep_body,
    sweep_picture,
)
from service.schemas.answers import DesignDetail, DesignPage, ResultPage, SweepDetail, SweepPage
from service.schemas.result_queries import (
    DesignQuery,
    ResultQuery,
    SweepQuery,
    design_page,
    result_page,
    sweep_page,
)

sweeps = APIRouter(prefix="/v1/sweeps", tags=["sweeps"])

SWEEP_FORMS: dict[int | str, dict[str, Any]] = {
    200: media({form: TEXT if form.startswith("text/") else BINARY for form in SWEEP_MEDIA if form != JSON}),
    **UNCHANGED,
}


SweepForm = Annotated[
    Literal["json", "csv", "npz", "parquet"] | None,
    Query(alias="format", description="In place of `Accept`, for links."),
]


@sweeps.get("", response_model=SweepPage, responses=LISTED)
@reading
def list_sweeps(context: InContext, query: Annotated[SweepQuery, Query()]) -> Response:
    """Stored sweeps that meet every filter, newest first unless `sort` says otherwise."""
    return listing(context, sweep_page(context.service.stored, query, context.service.settings, context.sees))


@sweeps.get("/{sweep_id}", response_model=SweepDetail, responses=SWEEP_FORMS)
@writing_files
def get_sweep(sweep_id: str, context: InContext, form: SweepForm = None) -> Response:
    """A stored sweep with its arrays, in the form that `Accept` prefers.

    `text/csv` has a row for each point and a column for each array of one number a point. All arrays are in
    `application/x-npz` (also as `application/zip`), which `numpy.load` reads, and in
    `application/vnd.apache.parquet`.
    """
    return sweep_answer(context.service.sweep(sweep_id, context.caller), form, context)


def sweep_answer(sweep: SweepRecord, form: str | None, context: Context) -> Response:
    """A stored sweep in the form of `form`, or the one that `Accept` prefers."""
    service, request = context.service, context.request
    accept = request.headers.get("accept") if form is None else BY_FORMAT[form]
    kind = chosen(accept, SWEEP_MEDIA)
    headers = {"Vary": "Accept"}
    if kind in SUFFIXES:
        headers["Content-Disposition"] = f'attachment; filename="sweep-{sweep.id}.{SUFFIXES[kind]}"'
    scene = None if kind == "application/json" else service.jobs.spec(sweep.job_id).get("scene")
    return tagged(request, sweep_body(sweep, kind, service.stored, scene), kind, headers)


def _draw_as(suffix: str, form: str, schema: dict[str, Any]) -> None:
    """Add the route of pictures in a form."""

    def plot(sweep_id: str, context: InContext) -> Response:
        """The curve of a stored sweep, its peak marked, its band shaded."""
        sweep = context.service.sweep(sweep_id, context.caller)
        scene = context.service.jobs.spec(sweep.job_id).get("scene")
        picture = sweep_picture(sweep, suffix, context.service.stored, scene)
        return tagged(context.request, picture, form)

    sweeps.add_api_route(
        f"/{{sweep_id}}/plot.{suffix}", drawing(plot), name=f"plot_{suffix}", response_class=Response,
        responses={200: media({form: schema}), **UNCHANGED},
    )  # fmt: skip


_draw_as("svg", "image/svg+xml", TEXT)
_draw_as("png", "image/png", BINARY)


designs = APIRouter(prefix="/v1/designs", tags=["designs"])


@designs.get("", response_model=DesignPage, responses=LISTED)
@reading
def list_designs(context: InContext, query: Annotated[DesignQuery, Query()]) -> Response:
    """Stored designs that meet every filter, newest first unless `sort` says otherwise."""
    service = context.service
    return listing(context, design_page(service.stored, query, service.settings, context.sees))


@designs.get("/{design_id}", response_model=DesignDetail, responses=UNCHANGED)
@reading
def get_design(design_id: str, context: InContext) -> Response:
    """A stored design with the whole result of its job; its id is that of the job. Has a strong ETag."""
    answer = DesignDetail.whole(context.service.design(design_id, context.caller))
    return tagged(context.request, answer.model_dump_json().encode())


results = APIRouter(prefix="/v1/results", tags=["results"])


@results.get("", response_model=ResultPage, responses=LISTED)
@reading
def list_results(context: InContext, query: Annotated[ResultQuery, Query()]) -> Response:
    """Stored results of one kind that meet every filter, newest first unless `sort` says otherwise.

    Every number of the result is a filter, with `_min` and `_max` for a range, both inclusive, and so is
    every truth and every word: `/v1/results?of=sweep&peak_max=2e-3&completed=true&sort=peak`. `quantities` of
    the answer names them with their units.
    """
    service = context.service
    page = result_page(service.stored, query, service.registry, service.settings, context.sees)
    return listing(context, page)
