"""``/v1/plan`` and ``/v1/previews``: what is computed at once, nothing stored."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import APIRouter, Body, Response

from service.auth.allowances import share
from service.http.dependencies import InContext, TypedRoute, takes_body
from service.http.in_lane import computed, prepared
from service.jobs.answering import PLAN, PREVIEW
from service.jobs.kinds.bodies import KIND, any_body, examples, request_of
from service.jobs.kinds.previews import PREVIEWS, PreviewRequest
from service.jobs.studies.plan import EXAMPLE, Plan, PlanResult
from service.schemas.preview_answers import LimitsPreview, PointPreview, SensitivitiesPreview, SweepPreview

plans = APIRouter(prefix="/v1/plan", tags=["scenes"], route_class=TypedRoute)


PlanBody = Annotated[Plan, Body(openapi_examples={"plan": {"value": EXAMPLE}})]


@plans.post("", response_model=PlanResult)
async def plan(body: PlanBody, context: InContext) -> Any:
    """The effects this scene calls for and those left out, each with the reason; sizes and cost."""
    return await computed(context, PLAN, {"request": body})


previews = APIRouter(prefix="/v1/previews", tags=["previews"], route_class=TypedRoute)


async def preview(body: PreviewRequest, context: InContext) -> Response:
    """Compute `sweep`, `sensitivities`, `limits` or `point` within seconds.

    Nothing is stored, and sizes are limited.

    Of a disk that is solved whole fewer harmonics are kept than asked for: the answer says how many. The
    limit `work` of a key holds here as for a job of the same points.

    Of several previews with the same `client` only the newest is computed: the others are answered 409.
    """
    service, caller = context.service, context.caller
    raw = await context.request.json()
    kind = service.previews.registry[raw[KIND]]
    found = await prepared(context, kind, request_of(kind, body), raw, PREVIEW)
    asking = f"{caller.owner} {body.client}" if body.client else ""
    most = share(caller, service.settings, "previews")
    spec = json.loads(found.spec)
    answer = await service.previews.compute(kind.name, spec, asking, caller.owner, most)
    return Response(answer, media_type="application/json", headers={"Cache-Control": "no-store"})


takes_body(preview, any_body(PREVIEWS), examples(PREVIEWS), by=KIND)
previews.add_api_route(
    "",
    preview,
    methods=["POST"],
    response_model=SweepPreview | SensitivitiesPreview | LimitsPreview | PointPreview,
)
