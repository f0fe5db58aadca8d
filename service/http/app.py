"""The HTTP application."""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool
from starlette.types import Receive, Scope, Send

from service.auth.authenticator import Authenticator
from service.errors import ConfigurationError
from service.http import metrics, openapi
from service.http.dependencies import BodyTurns, HostCheck
from service.http.made_once import InPieces, LargeAnswers, Reports
from service.http.metrics import Metrics, RequestMetrics
from service.http.middleware.admission import Admission, ConcurrencyLimits, by_link
from service.http.middleware.connections import Connections
from service.http.middleware.every_answer import HeadAsGet, HeadersAndAudit, RequestLog
from service.http.routes import events, page, run_list, stored
from service.http.routes import form_routes as forms
from service.http.routes import job_routes as jobs
from service.http.routes import run_routes as runs
from service.http.routes import scene_routes as scenes
from service.http.routes import upload_routes as uploads
from service.http.routes.events import Looks
from service.jobs.kind_registry import Registry
from service.queue.core import SOLVER_VERSION, Service
from service.queue.health import Probe
from service.schemas import problems
from service.settings.settings import Settings, load_settings
from solver.lab import from_lab

log = logging.getLogger("stickslip.service")

_DESCRIPTION = "Designs friction dampers: jobs, their results, and every frequency response computed."


class _App(FastAPI):
    """An application whose layers see requests alone: its begin and end pass by them."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request through all layers."""
        await (super().__call__ if scope["type"] == "http" else self.router)(scope, receive, send)


def create_app(
    settings: Settings | None = None, registry: Registry | None = None, connections: Connections | None = None
) -> FastAPI:
    """The application of one service; its lifespan starts and stops database, queue and workers.

    Parameters are those of `EmbeddedService`, and the connections of the server it is behind.
    """
    service = Service(settings or load_settings(), registry)

    @asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        await run_in_threadpool(service.start)
        await run_in_threadpool(_say_if_nobody_can_come_in, service)
        try:
            yield
        finally:
            await run_in_threadpool(service.stop)

    app = _App(
        title="stickslip", description=_DESCRIPTION, version=SOLVER_VERSION, lifespan=lifespan, docs_url=None,
        openapi_url=None, redoc_url=None, generate_unique_id_function=lambda route: route.name,
        telemetry={
            "tracing": service.settings.traces, "operation_spans": False, "metrics": False, "logs": False,
            # One may have the secret of a link in its address, which no trace is to tell.
            "auto_configure": False, "exclude": lambda scope: by_link(scope.get("path", "")),
        },
    )  # fmt: skip
    _guard(app, service, connections or Connections.of(service.settings))
    events.install(app)
    # What a path that is a route's own may be asked by: a parameter of another route might fit it too.
    app.state.own = defaultdict(set)
    for router in (jobs.submissions(service.registry), *_ROUTERS):
        for route in router.routes:
            if isinstance(route, APIRoute):
                app.state.own[route.path] |= route.methods
        app.include_router(router)
    if service.settings.oidc_issuer is not None:
        _offer_login(app, service)
    openapi.install(app, service.registry)
    return app


_ROUTERS = (
    page.docs, page.router,  # the first are found fastest
    jobs.router, forms.kinds, forms.laws, events.router, stored.designs, stored.results,
    stored.sweeps, scenes.texts,
    forms.templates, scenes.router, uploads.router, uploads.matrices, uploads.measurements, scenes.plans,
    scenes.previews, runs.projects, runs.reports, run_list.router, runs.runs, runs.shares, metrics.router,
)  # fmt: skip


def _guard(app: FastAPI, service: Service, connections: Connections) -> None:
    """Put before the routes what admits, counts and logs requests, and where they find it."""
    settings = service.settings
    app.state.service = service
    app.state.metrics = Metrics(service)
    app.state.turns = BodyTurns()
    app.state.probe = Probe(service)
    app.state.looks = Looks(service)
    app.state.news = run_list.RunNews(service)
    app.state.large = LargeAnswers()
    app.state.reports = Reports(service.lanes.reports)
    app.state.authenticator = Authenticator(service.keys, service.shares, settings, service.jobs.now)
    app.state.connections = connections
    service.lanes.guard(app.state.connections.require_taken)
    concurrency = ConcurrencyLimits(settings)
    # The last one added is the outermost.
    app.add_middleware(HeadAsGet)
    app.add_middleware(
        Admission, authenticator=app.state.authenticator, concurrency=concurrency, reads=service.lanes.reads
    )
    app.add_middleware(HostCheck, hosts=settings.hosts)
    app.add_middleware(RequestMetrics, metrics=app.state.metrics)
    app.add_middleware(RequestLog)
    problems.install(app)
    app.add_middleware(HeadersAndAudit, settings=settings)
    app.add_middleware(InPieces)


def _offer_login(app: FastAPI, service: Service) -> None:
    """Let people log in at the provider that the settings name."""
    try:
        offer = from_lab("oidc.routes:offer")
    except ImportError as error:
        raise ConfigurationError(
            f"`oidc_issuer` (STICKSLIP_OIDC_ISSUER) needs the extra `oidc` of stickslip: {error}"
        ) from error
    offer(app, service)


def _say_if_nobody_can_come_in(service: Service) -> None:
    if service.settings.keys_required and not service.keys.usable(service.jobs.now()):
        log.warning("requests need a key and there is none: `stickslip keys create --owner NAME`")
