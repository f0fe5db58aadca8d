"""``/health``: whether the process lives, and whether it can work."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Response

from service.auth.callers import Scope
from service.http.dependencies import InContext
from service.queue.health import Health, Probe, Readiness
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
async def ready(context: InContext, response: Response) -> Health | Readiness:
    """Database, queue and workers are up; the details are for who may see them: where no key is needed, and
    with the scope `monitor`.
    """
    probe: Probe = context.request.app.state.probe
    health = await (probe.detailed() if context.caller.may(Scope.MONITOR) else probe.brief())
    response.status_code = 200 if health.ready else 503
    return health
