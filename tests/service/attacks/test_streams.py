"""Event streams: limited in total and for each key, and so cheap that nobody else notices them."""

from __future__ import annotations

from pathlib import Path

import pytest
from besieged import Besieged, besieged, no_more_memory, others_are_served
from service_helpers import is_problem, until

JOB = {"kind": "iteration", "seconds": 600.0, "fresh": True}
EXIT_SECONDS = 10.0


def submitted(service: Besieged, owner: str) -> str:
    with service.client(owner) as client:
        return str(client.post("/v1/jobs", json=JOB).raise_for_status().json()["id"])


@pytest.mark.parametrize("number", [200, pytest.param(1000, marks=pytest.mark.long)])
def test_many_streams_leave_others_alone(tmp_path: Path, number: int) -> None:
    with besieged(tmp_path, "ann", "bob", owner_streams=0, streams=0, connections=4000) as service:
        job, other = submitted(service, "ann"), submitted(service, "bob")
        streams = [service.ask(f"/v1/jobs/{job}/events", "ann") for _ in range(number)]
        begun = [stream.recv(4096) for stream in streams]
        assert all(first.startswith(b"HTTP/1.1 200") for first in begun)
        others_are_served(service, f"/v1/jobs/{other}", "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS


def test_a_key_has_so_many_streams(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", "bob", owner_streams=3) as service:
        job, other = submitted(service, "ann"), submitted(service, "bob")
        streams = [service.ask(f"/v1/jobs/{job}/events", "ann") for _ in range(3)]
        assert all(stream.recv(12) == b"HTTP/1.1 200" for stream in streams)
        with service.client("ann") as client:
            refused = client.get(f"/v1/jobs/{job}/events")
            body = is_problem(refused, 429)
            assert "3" in body["detail"]
            assert int(refused.headers["retry-after"]) >= 1
        assert service.ask(f"/v1/jobs/{other}/events", "bob").recv(12) == b"HTTP/1.1 200"
        streams[0].close()
        until(lambda: service.ask(f"/v1/jobs/{job}/events", "ann").recv(12) == b"HTTP/1.1 200")


def test_a_service_has_so_many_streams(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", "bob", streams=2) as service:
        job, other = submitted(service, "ann"), submitted(service, "bob")
        streams = [service.ask(f"/v1/jobs/{job}/events", "ann") for _ in range(2)]
        assert all(stream.recv(12) == b"HTTP/1.1 200" for stream in streams)
        with service.client("bob") as client:
            is_problem(client.get(f"/v1/jobs/{other}/events"), 503)
