"""Clients that read nothing, connections that say nothing, and event streams: each many, and all at once."""

import contextlib
import resource
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from besieged import MEMORY_MB, Besieged, besieged, follow, no_more_memory, others_are_served, submitted
from service_helpers import is_problem, until

EXIT_SECONDS = 10.0
LARGE = 3_000_000
VICTIM = "/v1/scenes/two-dof"


def with_a_large_job(service: Besieged, owner: str) -> str:
    """The address of an answer of some megabytes: a job with what was asked."""
    with service.client(owner) as client:
        job = {"kind": "iteration", "pid_file": "x" * LARGE}
        answer = client.post("/v1/jobs", json=job)
        assert answer.status_code == 202, answer.text[:2000]
        assert len(client.get(answer.headers["location"]).content) > LARGE
    return str(answer.headers["location"])


def ask_and_be_silent(service: Besieged, path: str, owner: str, number: int) -> list[socket.socket]:
    """Readers of an answer that take no more of it than their little room."""
    readers = []
    for _ in range(number):
        with contextlib.suppress(OSError):
            readers.append(service.ask(path, owner, receive_buffer=4096))
    return readers


@pytest.mark.long
@pytest.mark.parametrize("number", [10, 110, 200])
def test_all_of_them_at_once_leave_others_alone(tmp_path: Path, number: int) -> None:
    """Streams, as many silent readers, and half as many again of idle connections; some are too many.

    What more than a hundred readers do not take is more than the service may hold for all of them.
    """
    assert number == 10 or number * LARGE > 1e6 * MEMORY_MB
    limits = {
        "owner_requests": 0,
        "owner_streams": 0,
        "streams": number,
        "connections": 3 * number,
        "write_seconds": 1.0,
    }
    with besieged(tmp_path, "ann", "bob", header_seconds=60.0, **limits) as service:
        path, job = with_a_large_job(service, "ann"), submitted(service, "bob")
        service.idle = service.memory()
        follow(service, "ann", number)
        readers = ask_and_be_silent(service, path, "ann", number)
        for _ in range(3 * number // 2):
            service.connect()
        others_are_served(service, VICTIM, "bob")
        no_more_memory(service)
        with service.client("bob") as client:
            is_problem(client.get(f"/v1/jobs/{job}/events"), 503)
        answered = sum(map(is_answered, readers))
        until(lambda: service.log().count("took nothing of its answer") >= answered, seconds=30.0)
        assert is_answered(readers[0])
        assert received(readers[0]) < LARGE, "a silent reader is disconnected"
        assert service.terminate() < EXIT_SECONDS


def is_answered(client: socket.socket) -> bool:
    """Whether a reader got an answer, not a refusal; nothing of it is taken."""
    return b" 200 " in client.recv(16, socket.MSG_PEEK)


def received(client: socket.socket) -> int:
    """Bytes that a connection has still to give before it ends."""
    total = 0
    with contextlib.suppress(ConnectionResetError):
        while piece := client.recv(1 << 16):
            total += len(piece)
    return total


@pytest.mark.long
def test_a_thousand_silent_readers_hold_no_memory(tmp_path: Path) -> None:
    limits = {"owner_requests": 0, "connections": 4000, "write_seconds": 2.0}
    with besieged(tmp_path, "ann", "bob", **limits) as service:
        path = with_a_large_job(service, "ann")
        service.idle = service.memory()
        ask_and_be_silent(service, path, "ann", 1000)
        others_are_served(service, VICTIM, "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS


@pytest.mark.long
def test_thousands_of_idle_connections_keep_nobody_out(tmp_path: Path) -> None:
    """Also where a process may open few files unless it asks for more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    assert hard > 3500, "the test itself needs as many"
    with few_files(400), besieged(tmp_path, "ann", "bob", connections=1000, header_seconds=60.0) as service:
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 3500), hard))
        for _ in range(3000):
            service.connect()
        others_are_served(service, VICTIM, "bob")
        no_more_memory(service)
        assert f"may open {hard} files, 400 before" in service.log()
        assert service.terminate() < EXIT_SECONDS


@contextlib.contextmanager
def few_files(number: int) -> Iterator[None]:
    """A soft limit of open files for this process and those that it starts."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (number, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
