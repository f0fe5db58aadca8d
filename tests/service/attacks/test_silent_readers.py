"""Clients that read nothing, and connections that say nothing."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from besieged import Besieged, besieged, no_more_memory, others_are_served
from service_helpers import until

EXIT_SECONDS = 10.0
LARGE = 3_000_000


def with_a_large_job(service: Besieged, owner: str) -> str:
    """The address of an answer of some megabytes: a job with what was asked."""
    with service.client(owner) as client:
        job = {"kind": "iteration", "pid_file": "x" * LARGE}
        answer = client.post("/v1/jobs", json=job)
        assert answer.status_code == 202, answer.text[:2000]
        assert len(client.get(answer.headers["location"]).content) > LARGE
    return str(answer.headers["location"])


@pytest.mark.parametrize("number", [200, pytest.param(1000, marks=pytest.mark.long)])
def test_silent_readers_hold_no_memory(tmp_path: Path, number: int) -> None:
    limits = {"owner_requests": 0, "connections": 4000, "write_seconds": 2.0}
    with besieged(tmp_path, "ann", "bob", **limits) as service:
        path = with_a_large_job(service, "ann")
        service.idle = service.memory()
        for _ in range(number):
            with contextlib.suppress(OSError):
                service.ask(path, "ann", receive_buffer=4096)
        others_are_served(service, "/v1/scenes/two-dof", "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS


def test_a_silent_reader_is_disconnected(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", write_seconds=0.5) as service:
        silent = service.ask(with_a_large_job(service, "ann"), "ann", receive_buffer=4096)
        until(lambda: "took nothing of its answer" in service.log(), seconds=30.0)
        received = 0
        with contextlib.suppress(ConnectionResetError):
            while piece := silent.recv(1 << 16):
                received += len(piece)
        assert received < LARGE


@pytest.mark.parametrize("number", [300, pytest.param(3000, marks=pytest.mark.long)])
def test_idle_connections_keep_nobody_out(tmp_path: Path, number: int) -> None:
    with besieged(tmp_path, "ann", "bob", connections=number // 3, header_seconds=60.0) as service:
        for _ in range(number):
            service.connect()
        others_are_served(service, "/v1/scenes/two-dof", "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS
