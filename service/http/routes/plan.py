"""``/v1/plan``: which effects a scene calls for, before anything is computed."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Body
from pydantic import ConfigDict

from service.http.dependencies import InContext, TypedRoute
from service.http.in_lane import computed
from service.jobs.answering import PLAN
from service.jobs.common.scenes import HarmonicRequest
from service.schemas.answers import Answer
from solver.scene.descriptions import DISK_LOAD

_EXAMPLE: dict[str, Any] = {"scene": "bladed-disk", "set": {DISK_LOAD: 150}}

router = APIRouter(prefix="/v1/plan", tags=["scenes"], route_class=TypedRoute)


class PlanRequest(HarmonicRequest):
    """A scene to be looked at."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE]})


PlanBody = Annotated[PlanRequest, Body(openapi_examples={"plan": {"value": _EXAMPLE}})]


class EffectAnswer(Answer):
    """An effect that a scene calls for or does not."""

    name: str
    used: bool
    reason: str


class PlanAnswer(Answer):
    """The effects of a scene; sizes and cost."""

    scene: str
    effects: list[EffectAnswer]
    unknowns: int
    linear_dofs: int
    contacts: int
    n_harmonics: int
    estimated_seconds_a_point: float
    estimated_seconds_of_stability: float | None
    performance_curve: str
    estimated_dense_bytes: int


@router.post("")
async def plan(body: PlanBody, context: InContext) -> PlanAnswer:
    """The effects this scene calls for and those left out, each with the reason; sizes and cost."""
    return PlanAnswer.model_validate(await computed(context, PLAN, body.model_dump()))
