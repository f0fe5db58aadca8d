"""Owners apart: what one of them hands in, uploads or draws does not keep another one waiting."""

from __future__ import annotations

import threading
from pathlib import Path

import httpx
import pytest
from besieged import Besieged, besieged, no_more_memory, others_are_served, running
from service_helpers import is_problem, new_job, until

from service.auth.callers import KeyLimits
from service.db.engine import Database
from service.db.repositories import JobRepository

EXIT_SECONDS = 10.0
QUICK = {"kind": "iteration", "fresh": True}


def matrix_market(size: int) -> str:
    """A diagonal matrix as MatrixMarket."""
    rows = "".join(f"{row} {row} {1.0 + row}\n" for row in range(1, size + 1))
    return f"%%MatrixMarket matrix coordinate real symmetric\n{size} {size} {size}\n{rows}"


@pytest.mark.parametrize("number", [1000, pytest.param(10_000, marks=pytest.mark.long)])
def test_a_long_queue_of_one_owner_keeps_nobody_waiting(tmp_path: Path, number: int) -> None:
    with besieged(tmp_path, "ann", "bob", workers=1, owner_waiting=0, queue_limit=2 * number) as service:
        url = f"sqlite:///{tmp_path}/jobs.db"
        other = Database(url)
        spec = {"size": 20, "seed": 0, "seconds": 0.05, "pid_file": None, "sweeps": 0, "tells": False}
        try:
            jobs = JobRepository(other)
            for _ in range(number):
                jobs.submit(new_job(owner="ann", priority=100, spec=spec), queue_limit=10 * number)
        finally:
            other.close()
        with service.client("bob") as client:
            answer = client.post("/v1/jobs", json=QUICK, headers={"Prefer": "wait=20"})
            assert answer.status_code == 200, answer.text
        with service.client("ann") as client:
            assert client.get("/v1/jobs", params={"status": "accepted"}).json()["items"]


def test_a_key_keeps_so_many_jobs_waiting(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", "bob", owner_waiting=2) as service:
        busy = {**QUICK, "seconds": 600.0}
        with service.client("ann") as client:
            assert client.post("/v1/jobs", json=busy).status_code == 202
            until(lambda: client.get("/v1/jobs", params={"status": "running"}).json()["items"])
            assert [client.post("/v1/jobs", json=busy).status_code for _ in range(2)] == [202, 202]
            is_problem(client.post("/v1/jobs", json=busy), 429)
        with service.client("bob") as client:
            assert client.post("/v1/jobs", json=busy).status_code == 202


def test_a_key_has_a_highest_priority(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", limits=KeyLimits(priority=3)) as service, service.client("ann") as client:
        assert client.post("/v1/jobs", json={**QUICK, "priority": 3}).status_code == 202
        body = is_problem(client.post("/v1/jobs", json={**QUICK, "priority": 4}), 422)
        assert body["errors"][0]["pointer"] == "/priority"


def test_a_key_stores_so_much(tmp_path: Path) -> None:
    file = matrix_market(40).encode()
    limits = KeyLimits(storage_bytes=len(file) + 100)
    with besieged(tmp_path, "ann", limits=limits) as service, service.client("ann") as client:
        first = client.post("/v1/uploads", content=file, params={"name": "K.mtx"})
        assert first.status_code == 201, first.text
        again = client.post("/v1/uploads", content=matrix_market(41).encode(), params={"name": "M.mtx"})
        assert "storage" in is_problem(again, 507)["detail"]
        job = client.post("/v1/jobs", json={**QUICK, "sweeps": 3}, headers={"Prefer": "wait=20"})
        assert job.status_code == 200, "what is stored was below the limit"
        # What a job stored is counted within some seconds.
        until(lambda: client.post("/v1/jobs", json=QUICK).status_code == 507)
        assert client.delete(first.headers["location"]).status_code == 204


def uploading(service: Besieged, owner: str) -> object:
    """An attacker that uploads one file after the other."""
    file = matrix_market(400).encode()

    def attack(over: threading.Event) -> None:
        with service.client(owner) as client:
            number = 0
            while not over.is_set():
                number += 1
                body = file.replace(b"\n", f"\n% {number} {threading.get_ident()}\n".encode(), 1)
                answer = client.post("/v1/uploads", content=body, params={"name": "K.mtx"})
                assert answer.status_code in (201, 429, 503), answer.text
                # The attack is on the service, not on the process of the test, which also measures.
                over.wait(0.0 if answer.is_success else 0.2)

    return attack


@pytest.mark.parametrize("number", [20, pytest.param(60, marks=pytest.mark.long)])
def test_uploads_in_parallel_leave_others_alone(tmp_path: Path, number: int) -> None:
    with besieged(tmp_path, "ann", "bob", owner_requests=0) as service:
        attack = uploading(service, "ann")
        with running(*[attack] * number):
            others_are_served(service, "/v1/scenes/two-dof", "bob")
            others_are_served(service, "/v1/jobs", "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS


@pytest.mark.parametrize("number", [20, pytest.param(60, marks=pytest.mark.long)])
def test_pictures_in_parallel_leave_others_alone(tmp_path: Path, number: int) -> None:
    with besieged(tmp_path, "ann", "bob", owner_requests=0) as service:
        with service.client("ann") as client:
            job = client.post("/v1/jobs", json={**QUICK, "sweeps": 1}, headers={"Prefer": "wait=20"}).json()
            picture = f"/v1/sweeps/{job['sweeps'][0]['id']}/plot.png"
            assert client.get(picture).status_code == 200
        service.idle = service.memory()

        def attack(over: threading.Event) -> None:
            with service.client("ann") as client:
                while not over.is_set():
                    assert client.get(picture).status_code in (200, 429)

        with running(*[attack] * number):
            others_are_served(service, "/v1/scenes/two-dof", "bob")
            others_are_served(service, "/v1/jobs", "bob")
        no_more_memory(service)
        assert service.terminate() < EXIT_SECONDS


def test_a_key_has_so_many_requests_at_a_time(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", "bob", owner_requests=2) as service:
        with service.client("ann") as client:
            assert client.post("/v1/jobs", json={**QUICK, "seconds": 600.0}).status_code == 202

        def waiting(over: threading.Event) -> None:
            with service.client("ann") as client:
                while not over.is_set():
                    client.post("/v1/jobs", json=QUICK, headers={"Prefer": "wait=2"})

        with running(waiting, waiting):
            until(
                lambda: (
                    httpx.get(f"{service.base}/v1/jobs", headers=service.headers("ann")).status_code == 429
                )
            )
            with service.client("bob") as client:
                assert client.get("/v1/jobs").status_code == 200
