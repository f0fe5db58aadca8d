"""A foreign program holds SQLite's file: requests end in time, readiness says so, and the service stops."""

import sqlite3
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import httpx
import pytest
from besieged import answered_in_time, besieged
from service_helpers import is_problem, until

DATABASE_SECONDS = 1.0
# A request waits for a connection, for the lock and for its statement, at most so long each.
# The rest is for a machine that has much else to do.
ANSWER_SECONDS = 3.0 * DATABASE_SECONDS + 5.0
EXIT_SECONDS = 10.0


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """A lock that keeps writers out."""
    connection = sqlite3.connect(file, isolation_level=None, timeout=30.0)
    try:
        connection.execute("BEGIN IMMEDIATE")
        yield
    finally:
        connection.rollback()
        connection.close()


in_time = partial(answered_in_time, seconds=ANSWER_SECONDS)


@pytest.mark.long
def test_a_foreign_lock_is_answered_in_time_and_does_not_hold_up_the_end(tmp_path: Path) -> None:
    job = {"kind": "iteration", "fresh": True}
    with besieged(tmp_path, database_seconds=DATABASE_SECONDS) as service:
        known = in_time(service, "POST", "/v1/jobs?", 202, json=job).json()["id"]
        with locked(tmp_path / "jobs.db"):
            is_problem(in_time(service, "POST", "/v1/jobs", 503, json=job), 503)
            in_time(service, "GET", f"/v1/jobs/{known}", 200)
            in_time(service, "GET", "/v1/sweeps", 200)
            assert not in_time(service, "GET", "/health/ready", 503).json()["ready"]
            in_time(service, "GET", "/health/live", 200)
            with ThreadPoolExecutor(32) as pool:
                # Those that did not get their turn among so many of the same key are told so.
                asked = [
                    pool.submit(in_time, service, "POST", "/v1/jobs", 429, 503, json=job) for _ in range(32)
                ]
                assert {one.result().status_code for one in asked} >= {503}
        until(lambda: httpx.get(f"{service.base}/health/ready").status_code == 200)
        in_time(service, "POST", "/v1/jobs", 202, json={**job, "seconds": 600.0})
        with locked(tmp_path / "jobs.db"):
            assert service.terminate() < EXIT_SECONDS


@pytest.mark.long
def test_a_lock_does_not_hold_up_the_end_of_an_idle_service(tmp_path: Path) -> None:
    with besieged(tmp_path, database_seconds=DATABASE_SECONDS) as service, locked(tmp_path / "jobs.db"):
        assert service.terminate() < EXIT_SECONDS
