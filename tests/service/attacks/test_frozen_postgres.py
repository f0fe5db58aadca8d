"""PostgreSQL stands still, its connections open: requests end in time, and so does the service."""

import os
import signal
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import httpx
import pytest
from besieged import answered_in_time, besieged
from postgresql_cluster import Cluster
from service_helpers import until

DATABASE_SECONDS = 2.0
ANSWER_SECONDS = 5.0 * DATABASE_SECONDS
EXIT_SECONDS = 10.0


@contextmanager
def frozen(cluster: Cluster) -> Iterator[None]:
    """No process of the server runs: the first, so that it makes no more, then each that it made."""
    first = int((cluster.folder / "data" / "postmaster.pid").read_text().split()[0])
    stopped = [first]
    os.kill(first, signal.SIGSTOP)
    try:
        found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(first)], capture_output=True, check=True)
        for pid in map(int, found.stdout.split()):
            os.kill(pid, signal.SIGSTOP)
            stopped.append(pid)
        yield
    finally:
        for pid in stopped:
            os.kill(pid, signal.SIGCONT)


in_time = partial(answered_in_time, seconds=ANSWER_SECONDS)


@pytest.mark.long
def test_a_frozen_server_is_answered_in_time_and_does_not_hold_up_the_end(
    cluster: Cluster, tmp_path: Path
) -> None:
    job = {"kind": "iteration", "fresh": True}
    with (
        cluster.database() as url,
        besieged(tmp_path, url=url, database_seconds=DATABASE_SECONDS) as service,
    ):
        known = in_time(service, "POST", "/v1/jobs", 202, json=job).json()["id"]
        with frozen(cluster), ThreadPoolExecutor() as pool:
            asked = [
                pool.submit(in_time, service, "GET", f"/v1/jobs/{known}", 503),
                pool.submit(in_time, service, "POST", "/v1/jobs", 503, json=job),
                pool.submit(in_time, service, "GET", "/health/ready", 503),
                pool.submit(in_time, service, "GET", "/health/live", 200),
            ]
            for one in asked:
                one.result()
        until(lambda: httpx.get(f"{service.base}/health/ready").status_code == 200)
        in_time(service, "POST", "/v1/jobs", 202, json={**job, "seconds": 600.0})
        with frozen(cluster):
            assert service.terminate() < EXIT_SECONDS
