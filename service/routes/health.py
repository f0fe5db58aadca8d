"""``/health``: whether the process lives, and whether it can work."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Response

from service.answers import Answer
from service.health import Health, check
from service.http import ServiceDependency

router = APIRouter(prefix="/health", tags=["health"])


class Alive(Answer):
    """The process answers."""

    status: Literal["live"] = "live"


@router.get("/live")
async def live() -> Alive:
    """The process answers."""
    return Alive()


@router.get("/ready", responses={503: {"model": Health, "description": "It cannot work now."}})
def ready(service: ServiceDependency, response: Response) -> Health:
    """Database, queue and workers are up."""
    health = check(service)
    response.status_code = 200 if health.ready else 503
    return health
