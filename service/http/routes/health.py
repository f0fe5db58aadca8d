"""``/health``: whether the process lives, and whether it can work."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Response

from service.auth.callers import Scope
from service.http.dependencies import CallerDependency, ServiceDependency
from service.queue.health import Health, Readiness, check, readiness
from service.schemas.answers import Answer

router = APIRouter(prefix="/health", tags=["health"])


class Alive(Answer):
    """The process answers."""

    status: Literal["live"] = "live"


@router.get("/live")
async def live() -> Alive:
    """The process answers."""
    return Alive()


@router.get("/ready", responses={503: {"model": Health, "description": "It cannot work now."}})
def ready(service: ServiceDependency, caller: CallerDependency, response: Response) -> Health | Readiness:
    """Database, queue and workers are up; the details are for who may see them: where no key is needed, and
    with the scope `monitor`.
    """
    health = check(service) if caller.may(Scope.MONITOR) else readiness(service)
    response.status_code = 200 if health.ready else 503
    return health
