"""``/v1/plan``: which effects a scene calls for, before anything is computed."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body

from service.http.dependencies import InContext, TypedRoute
from service.http.in_lane import computed
from service.jobs.answering import PLAN
from service.jobs.studies.plan import EXAMPLE, Plan, PlanResult

router = APIRouter(prefix="/v1/plan", tags=["scenes"], route_class=TypedRoute)


PlanBody = Annotated[Plan, Body(openapi_examples={"plan": {"value": EXAMPLE}})]


@router.post("")
async def plan(body: PlanBody, context: InContext) -> PlanResult:
    """The effects this scene calls for and those left out, each with the reason; sizes and cost."""
    return PlanResult.model_validate(await computed(context, PLAN, body.model_dump()))
