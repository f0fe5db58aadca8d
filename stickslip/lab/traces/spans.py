"""OpenTelemetry traces: spans of requests, jobs and their computation.

A job carries the trace of the request that handed it in (`traceparent`, W3C Trace Context) through the
database to the service that takes it and to the process that computes it, each of which adds a span.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from service.errors import ConfigurationError

if TYPE_CHECKING:
    from opentelemetry.context import Context
    from opentelemetry.trace import Span

_NAME = "stickslip"
_HEADER = "traceparent"
_FLUSH_MILLISECONDS = 1000


def configure() -> None:
    """Send the spans of this process where `OTEL_EXPORTER_OTLP_ENDPOINT` says.

    A program that has a provider of its own keeps it.

    Raises
    ------
    ConfigurationError
        If the extra `traces` is not installed.
    """
    try:
        from opentelemetry import trace
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError as error:
        raise ConfigurationError(
            f"`traces` (STICKSLIP_TRACES) needs the extra `traces` of stickslip: {error}"
        ) from error
    if not isinstance(trace.get_tracer_provider(), TracerProvider):
        name = os.environ.get("OTEL_SERVICE_NAME", _NAME)
        provider = TracerProvider(resource=Resource.create({"service.name": name}))
        provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
        trace.set_tracer_provider(provider)


class Open:
    """A span that began; ended by whoever hears of the end."""

    def __init__(self, span: Span) -> None:
        self._span = span

    @property
    def carried(self) -> str | None:
        """What a job carries of it."""
        from opentelemetry.trace import set_span_in_context

        return _carried(set_span_in_context(self._span))

    def end(self, **attributes: Any) -> None:
        """It is over."""
        self._span.set_attributes(attributes)
        self._span.end()


def begin(name: str, carried: str | None, **attributes: Any) -> Open:
    """Begin a span below what a job carries."""
    from opentelemetry import trace

    # A job that carries nothing begins a trace of its own, whatever this thread does for others.
    context = _context(carried)
    return Open(trace.get_tracer(_NAME).start_span(name, context=context, attributes=attributes))


def current() -> str | None:
    """What a job is to carry that is handed in by the request under way."""
    return _carried(None)


def flush() -> None:
    """Send what was not sent yet, if that is quick: the process ends."""
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.trace import get_tracer_provider

    provider = get_tracer_provider()
    if isinstance(provider, TracerProvider):
        provider.force_flush(_FLUSH_MILLISECONDS)


def _context(carried: str | None) -> Context:
    from opentelemetry.context import Context
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    return TraceContextTextMapPropagator().extract({_HEADER: carried or ""}, Context())


def _carried(context: Context | None) -> str | None:
    from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

    found: dict[str, str] = {}
    TraceContextTextMapPropagator().inject(found, context)
    return found.get(_HEADER)
