"""A result of many megabytes, read by many at once: it is held once, and others are served meanwhile."""

import json
import sqlite3
import threading
import time
from collections.abc import Iterator

import pytest
from besieged import Besieged, besieged, others_are_served, running

MEGABYTES = 19
READERS = 16
ADDED_MB = 100.0
VICTIM = "/v1/scenes/two-dof"


def a_large_result(service: Besieged, owner: str, text: str) -> str:
    """The id of a job with this result."""
    with service.client(owner) as client:
        job = {"kind": "iteration", "seed": len(text), "fresh": True}
        answer = client.post("/v1/jobs", json=job, headers={"Prefer": "wait=60"})
        assert answer.json()["status"] == "successful", answer.text
        job_id = str(answer.json()["id"])
    with sqlite3.connect(service.folder / "jobs.db") as connection:
        connection.execute("UPDATE job_result SET body = ? WHERE job_id = ?", (text, job_id))
    return job_id


def numbers(first: float) -> str:
    """A result of `MEGABYTES`."""
    value = f"{first:.17f}"
    return json.dumps({"eigenvalue": first, "steps": 3, "curve": [float(value)] * (MEGABYTES * 10**6 // 20)})


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Besieged]:
    """A service of its own: what others left in the memory of one would count."""
    with besieged(tmp_path_factory.mktemp("large"), "ann", "bob") as service:
        yield service


@pytest.mark.long
def test_summaries_of_a_large_result_leave_others_alone(large: Besieged) -> None:
    job = a_large_result(large, "ann", numbers(1.25))
    told: list[int] = []

    def read(over: threading.Event) -> None:
        with large.client("ann") as client:
            while not over.is_set():
                told.append(client.get(f"/v1/runs/{job}/summary").status_code)

    large.idle = large.memory()
    with running(*[read] * READERS):
        others_are_served(large, VICTIM, "bob")
    assert set(told) <= {200, 429}
    assert 200 in told
    assert large.added() < ADDED_MB


def test_large_results_are_compared_by_their_figures(large: Besieged) -> None:
    a, b = (a_large_result(large, "ann", numbers(one)) for one in (1.5, 2.5))
    large.idle = large.memory()
    with large.client("ann") as client:
        begun = time.monotonic()
        answer = client.get("/v1/runs/compare", params={"a": a, "b": b})
        took = time.monotonic() - begun
    print(f"compared in {took:.2f} s, {large.added():.0f} MB")  # noqa: T201
    assert answer.status_code == 200, answer.text
    assert large.added() < ADDED_MB


def test_many_readers_hold_a_large_result_once(large: Besieged) -> None:
    job = a_large_result(large, "ann", numbers(1.2345678901234567))
    highest, lengths, ended = 0.0, [], threading.Event()

    def read(_over: threading.Event) -> None:
        """As a client behind a slow line."""
        with large.client("ann") as client, client.stream("GET", f"/v1/jobs/{job}/results") as answer:
            assert answer.status_code == 200
            length = 0
            for piece in answer.iter_bytes(1 << 20):
                length += len(piece)
                time.sleep(0.05)
        lengths.append(length)

    def watch(over: threading.Event) -> None:
        nonlocal highest
        while not over.is_set():
            highest = max(highest, large.added())
            ended.wait(0.005)

    large.idle = large.memory()
    with running(watch), running(*[read] * READERS):
        others_are_served(large, VICTIM, "bob")
    print(f"memory: {highest:.0f} MB more at most, {large.added():.0f} MB at the end")  # noqa: T201
    assert len(lengths) == READERS
    assert len(set(lengths)) == 1
    assert lengths[0] > 0.98e6 * MEGABYTES
    assert highest < ADDED_MB
