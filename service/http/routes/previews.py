"""``/v1/previews``: small responses at once, nothing stored."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response
from starlette.concurrency import run_in_threadpool

from service.auth.callers import Caller
from service.http.dependencies import CallerDependency, JsonBody, ServiceDependency
from service.jobs.kinds.sizes import work_limited
from service.jobs.registry import Resolved
from service.jobs.validation import validated
from service.queue.core import Service
from service.schemas.preview_answers import LimitsPreview, PointPreview, SweepPreview

router = APIRouter(prefix="/v1/previews", tags=["previews"])


@router.post("", response_model=SweepPreview | LimitsPreview | PointPreview)
async def preview(body: JsonBody, service: ServiceDependency, caller: CallerDependency) -> Response:
    """Compute `sweep`, `limits` or `point` within seconds. Nothing is stored, and sizes are limited.

    Of a disk that is solved whole fewer harmonics are kept than asked for: the answer says how many. The
    limit `work` of a key holds here as for a job of the same points.

    Of several previews with the same `client` only the newest is computed: the others are answered 409.
    """
    kind = service.previews.registry.get(body.get("kind"))
    client = body.get("client") or ""
    resolved = await run_in_threadpool(_resolved, service, caller, kind.name, body)
    asking = f"{caller.owner} {client}" if client else ""
    answer = await service.previews.compute(kind.name, resolved.spec, asking)
    return Response(answer, media_type="application/json", headers={"Cache-Control": "no-store"})


def _resolved(service: Service, caller: Caller, name: str, body: dict[str, Any]) -> Resolved:
    kind = service.previews.registry[name]
    request = validated(kind.request, {key: value for key, value in body.items() if key != "kind"})
    with work_limited(caller.limits.work):
        return kind.resolve(request, service.scenes.of(caller))
