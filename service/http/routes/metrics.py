"""``/metrics`` for a monitor."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.metrics import CONTENT_TYPE, Metrics
from service.http.routes.described import TEXT, media

router = APIRouter(tags=["health"])


@router.get("/metrics", response_class=Response, responses={200: media({"text/plain": TEXT})})
def metrics(request: Request) -> Response:
    """Requests, jobs and workers in Prometheus' text format."""
    held: Metrics = request.app.state.metrics
    return Response(held.text(), media_type=CONTENT_TYPE)
