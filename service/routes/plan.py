"""``/v1/plan``: which effects a scene calls for, before anything is computed."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

import solver
from service.http import CallerDependency, JsonBody, ServiceDependency
from service.kinds.scenes import HarmonicRequest, resolve_scene
from service.validation import validated

router = APIRouter(prefix="/v1/plan", tags=["scenes"])


class PlanRequest(HarmonicRequest):
    """A scene to be looked at."""


@router.post("")
def plan(body: JsonBody, service: ServiceDependency, caller: CallerDependency) -> dict[str, Any]:
    """The effects this scene calls for and those left out, each with the reason; sizes and cost."""
    request = validated(PlanRequest, body)
    scene = resolve_scene(request, service.scenes.of(caller))
    return solver.plan(scene, harmonics=request.harmonics).to_json()
