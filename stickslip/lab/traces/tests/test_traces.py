"""A trace from the client through request, queue and worker, as a collector on loopback receives it."""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest
from launch import served
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from service_helpers import until

from service.errors import ConfigurationError
from service.settings import traces

TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
ASKED = {"traceparent": f"00-{TRACE}-{SPAN}-01"}


@contextmanager
def collecting() -> Iterator[tuple[str, list[Any]]]:
    """The address of a collector, and the spans it has been sent."""
    found: list[Any] = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["content-length"]))
            told = ExportTraceServiceRequest.FromString(body).resource_spans
            found.extend(span for one in told for scope in one.scope_spans for span in scope.spans)
            self.send_response(200)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}", found
        server.shutdown()
        thread.join()


def test_a_job_is_part_of_the_trace_of_its_request(tmp_path: Path) -> None:
    with collecting() as (address, found):
        environment = {
            **os.environ, "STICKSLIP_TRACES": "true", "OTEL_EXPORTER_OTLP_ENDPOINT": address,
            "OTEL_BSP_SCHEDULE_DELAY": "100",
        }  # fmt: skip
        with served(tmp_path, environment) as service, httpx.Client(base_url=service) as client:
            body = {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.01}
            job = client.post("/v1/jobs", json=body, headers={**ASKED, "Prefer": "wait=60"}).json()
            assert client.get("/v1/shared?token=share_0_secret").status_code in (403, 404)
            until(lambda: {"attempt", "compute"} <= {one.name for one in found})
            until(lambda: any(one.name.startswith("POST") for one in found))
    named = {one.name.partition(" ")[0]: one for one in found if one.trace_id.hex() == TRACE}
    request, attempt, compute = named["POST"], named["attempt"], named["compute"]
    assert request.parent_span_id.hex() == SPAN
    assert attempt.parent_span_id == request.span_id
    assert compute.parent_span_id == attempt.span_id
    assert attempt.start_time_unix_nano <= compute.start_time_unix_nano
    assert compute.end_time_unix_nano <= attempt.end_time_unix_nano
    told = {one.key: one.value.string_value for one in attempt.attributes}
    assert (told["job"], told["kind"], told["outcome"]) == (job["id"], "solve", "finished")
    assert "secret" not in str(found)


@pytest.mark.long
def test_there_are_none_unless_they_are_wanted() -> None:
    """Nothing of OpenTelemetry but what FastAPI has is loaded, and nothing is carried."""
    code = (
        "import sys; from service.http.app import create_app; from service.settings import traces; "
        "from service.settings.settings import load_settings; create_app(load_settings()); "
        "assert traces.current() is None; assert traces.begin('attempt', None) is None; "
        "assert 'opentelemetry.sdk' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    with pytest.raises(ConfigurationError, match=r"STICKSLIP_TRACES.*the extra `traces`"):
        traces.configure(on=True)
    assert traces.current() is None
