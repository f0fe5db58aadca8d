"""``/health``: whether the process lives, and whether it can work; ``/metrics`` for a monitor."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Request, Response

from service.auth.callers import Scope
from service.http.dependencies import TEXT, InContext, media
from service.http.metrics import CONTENT_TYPE, Metrics
from service.queue.health import Health, Probe, Readiness
from service.schemas.answers import AnswerModel

router = APIRouter(tags=["health"])


class Alive(AnswerModel):
    """The process answers."""

    status: Literal["live"] = "live"


@router.get("/health/live")
async def live() -> Alive:
    """The process answers."""
    return Alive()


@router.get("/health/ready", responses={503: {"model": Health, "description": "It cannot work now."}})
async def ready(context: InContext, response: Response) -> Health | Readiness:
    """Database, queue and workers are up; the details are for who may see them: where no key is needed, and
    with the scope `monitor`.
    """
    probe: Probe = context.request.app.state.probe
    health = await (probe.detailed() if context.caller.may(Scope.MONITOR) else probe.brief())
    response.status_code = 200 if health.ready else 503
    return health


@router.get("/metrics", response_class=Response, responses={200: media({"text/plain": TEXT})})
def metrics(request: Request) -> Response:
    """Requests, jobs and workers in Prometheus' text format."""
    held: Metrics = request.app.state.metrics
    return Response(held.text(), media_type=CONTENT_TYPE)
