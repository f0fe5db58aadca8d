"""What a monitor asks: ``/health``, whether it can work, and ``/metrics``, what it does."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Literal

from fastapi import APIRouter, Request, Response
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.auth import callers
from service.http.dependencies import TEXT, InContext, media
from service.http.middleware.admission import NO_KEY, OWNER
from service.queue.core import SOLVER_VERSION, Service
from service.queue.health import Health, Probe, Readiness
from service.queue.meters import REFUSALS
from service.schemas.answers import AnswerModel

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
_SECONDS = (0.001, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)


class Metrics:
    """The numbers of one service."""

    def __init__(self, service: Service) -> None:
        self._registry = CollectorRegistry()
        self._registry.register(_JobsCollector(service))
        for meter in service.meters:
            self._registry.register(meter)
        self.refused = service.meters.refused
        self.requests = Counter(
            "stickslip_http_requests", "Requests answered.", ("method", "route", "status"),
            registry=self._registry,
        )  # fmt: skip
        self.seconds = Histogram(
            "stickslip_http_request_seconds", "Time from a request to the end of its answer.",
            ("method", "route"), buckets=_SECONDS, registry=self._registry,
        )  # fmt: skip

    def text(self) -> bytes:
        """Return everything in Prometheus' text format."""
        return generate_latest(self._registry)


class _JobsCollector(Collector):
    """Jobs by state and workers, looked up when a monitor asks."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def collect(self) -> Iterable[Metric]:
        """Yield the gauges; those of a database that does not answer are left out, and `up` says so."""
        about = GaugeMetricFamily("stickslip_info", "Version of the service.", labels=("version",))
        about.add_metric((SOLVER_VERSION,), 1.0)
        yield about
        jobs = GaugeMetricFamily("stickslip_jobs", "Jobs in the database by state.", labels=("state",))
        try:
            for state, count in self._service.jobs.count().items():
                jobs.add_metric((state.value,), float(count))
            oldest = self._service.jobs.oldest_waiting()
            age = 0.0 if oldest is None else max((self._service.jobs.now() - oldest).total_seconds(), 0.0)
            yield GaugeMetricFamily(
                "stickslip_oldest_waiting_seconds", "Age of the oldest job that waits.", age
            )
            answers = 1.0
        except SQLAlchemyError:
            answers = 0.0
        yield jobs
        yield GaugeMetricFamily("stickslip_database_up", "Whether the database answers.", answers)
        queue = self._service.queue
        yield GaugeMetricFamily("stickslip_queue_up", "Whether the queue takes jobs.", float(queue.alive))
        status = queue.status()
        workers = GaugeMetricFamily("stickslip_workers", "Worker processes by state.", labels=("state",))
        for name, count in (("wanted", status.workers), ("ready", status.ready), ("busy", status.busy)):
            workers.add_metric((name,), float(count))
        yield workers
        pruned = CounterMetricFamily(
            "stickslip_pruned", "What retention deleted since the service began.", labels=("what",)
        )
        for what in ("jobs", "sweeps", "uploads", "projects"):
            pruned.add_metric((what,), float(getattr(self._service.retention.pruned, what)))
        yield pruned


class RequestMetrics:
    """Counts requests and times them, by the route they match and not by their path: ids are not names."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app, self._metrics = app, metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on and watch its answer."""
        begun, status = time.perf_counter(), 500

        async def watched(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, watched)
        finally:
            route = str(getattr(scope.get("route"), "path", "none"))  # the template of the one that answered
            method = scope["method"] if scope["method"] in _METHODS else "other"
            if status in REFUSALS:
                self._metrics.refused.count(scope["state"].get(OWNER, NO_KEY), status)
            self._metrics.requests.labels(method, route, str(status)).inc()
            self._metrics.seconds.labels(method, route).observe(time.perf_counter() - begun)


_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


router = APIRouter(tags=["health"])


class Alive(AnswerModel):
    """The process answers."""

    status: Literal["live"] = "live"


@router.get("/health/live")
async def live() -> Alive:
    """The process answers."""
    return Alive()


@router.get(
    "/health/ready", response_model_exclude_none=True,
    responses={503: {"model": Health, "description": "It cannot work now."}},
)  # fmt: skip
async def ready(context: InContext, response: Response) -> Health | Readiness:
    """Database, queue and workers are up; the details are for who may see them: where no key is needed, and
    with the scope `monitor`.
    """
    probe: Probe = context.request.app.state.probe
    health = await (probe.detailed() if context.caller.may(callers.Scope.MONITOR) else probe.brief())
    response.status_code = 200 if health.ready else 503
    return health


@router.get("/metrics", response_class=Response, responses={200: media({"text/plain": TEXT})})
def metrics(request: Request) -> Response:
    """Requests, jobs and workers in Prometheus' text format."""
    held: Metrics = request.app.state.metrics
    return Response(held.text(), media_type=CONTENT_TYPE)
