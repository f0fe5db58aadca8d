"""Owners apart: what one of them hands in, uploads or draws does not keep another one waiting."""

import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import httpx
import pytest
from besieged import Besieged, besieged, no_more_memory, others_are_served, running
from matrix_texts import FILE, matrix_market
from service_helpers import is_problem, new_job, until

from service.db.engine import Database
from service.db.repositories import JobRepository

EXIT_SECONDS = 10.0
QUICK = {"kind": "iteration", "fresh": True}
BUSY = {**QUICK, "seconds": 600.0}
MANY = 60


@pytest.mark.long
@pytest.mark.parametrize("number", [60, pytest.param(10_000, marks=pytest.mark.long)])
def test_a_long_queue_of_one_owner_keeps_nobody_waiting(service: Besieged, number: int) -> None:
    other = Database(f"sqlite:///{service.folder}/jobs.db")
    spec = {"size": 20, "seed": 0, "seconds": 0.5, "pid_file": None, "sweeps": 0, "tells": False}
    try:
        jobs = JobRepository(other)
        for _ in range(number):
            jobs.submit(new_job(owner="ann", priority=100, spec=spec), queue_limit=10 * number)
        with service.client("bob") as client:
            answer = client.post("/v1/jobs", json=QUICK, headers={"Prefer": "wait=20"})
            assert answer.status_code == 200, answer.text
        with service.client("ann") as client:
            assert client.get("/v1/jobs", params={"status": "accepted"}).json()["items"]
    finally:
        other.close()


@pytest.mark.long
def test_a_key_keeps_so_many_jobs_waiting(service: Besieged) -> None:
    with service.client("few") as client:
        assert client.post("/v1/jobs", json=BUSY).status_code == 202
        until(lambda: client.get("/v1/jobs", params={"status": "running"}).json()["items"])
        assert [client.post("/v1/jobs", json=BUSY).status_code for _ in range(2)] == [202, 202]
        is_problem(client.post("/v1/jobs", json=BUSY), 429)
    with service.client("bob") as client:
        assert client.post("/v1/jobs", json=BUSY).status_code == 202


def test_a_key_has_a_highest_priority(service: Besieged) -> None:
    with service.client("few") as client:
        assert client.post("/v1/jobs", json={**QUICK, "priority": 3}).status_code == 202
        body = is_problem(client.post("/v1/jobs", json={**QUICK, "priority": 4}), 422)
        assert body["errors"][0]["pointer"] == "/priority"


def test_a_key_stores_so_much(service: Besieged) -> None:
    with service.client("small") as client:
        first = client.post("/v1/uploads", content=FILE, params={"name": "K.mtx"})
        assert first.status_code == 201, first.text
        again = client.post("/v1/uploads", content=matrix_market(41).encode(), params={"name": "M.mtx"})
        assert "storage" in is_problem(again, 507)["detail"]
        job = client.post("/v1/jobs", json={**QUICK, "sweeps": 3}, headers={"Prefer": "wait=20"})
        assert job.status_code == 200, "what is stored was below the limit"
        # What a job stored is counted within some seconds.
        until(lambda: client.post("/v1/jobs", json=QUICK).status_code == 507)
        assert client.delete(first.headers["location"]).status_code == 204


def test_a_key_has_so_many_requests_at_a_time(service: Besieged) -> None:
    with service.client("two") as client:
        assert client.post("/v1/jobs", json=BUSY).status_code == 202

    def waiting(over: threading.Event) -> None:
        with service.client("two") as client:
            while not over.is_set():
                client.post("/v1/jobs", json=QUICK, headers={"Prefer": "wait=1"})

    def refused() -> bool:
        return httpx.get(f"{service.base}/v1/jobs", headers=service.headers("two")).status_code == 429

    with running(waiting, waiting):
        until(refused)
        with service.client("bob") as client:
            assert client.get("/v1/jobs").status_code == 200


def uploads(service: Besieged, owner: str, number: int, paths: Sequence[str]) -> None:
    """Others are served while so many clients of an owner upload one file after the other."""
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

    with running(*[attack] * number):
        for path in paths:
            others_are_served(service, path, "bob")
    no_more_memory(service)


def pictures(service: Besieged, owner: str, number: int, paths: Sequence[str]) -> None:
    """The same while they have pictures drawn."""
    with service.client(owner) as client:
        job = client.post("/v1/jobs", json={**QUICK, "sweeps": 1}, headers={"Prefer": "wait=20"}).json()
        picture = f"/v1/sweeps/{job['sweeps'][0]['id']}/plot.png"
        assert client.get(picture).status_code == 200
    service.idle = service.memory()

    def attack(over: threading.Event) -> None:
        with service.client(owner) as client:
            while not over.is_set():
                assert client.get(picture).status_code in (200, 429)

    with running(*[attack] * number):
        for path in paths:
            others_are_served(service, path, "bob")
    no_more_memory(service)


Attack = Callable[[Besieged, str, int, Sequence[str]], None]


@pytest.mark.long
@pytest.mark.parametrize(("attack", "path"), [(uploads, "/v1/jobs"), (pictures, "/v1/scenes/two-dof")])
def test_uploads_and_pictures_leave_others_alone(service: Besieged, attack: Attack, path: str) -> None:
    attack(service, "ann", 12, [path])


@pytest.mark.long
@pytest.mark.parametrize("attack", [uploads, pictures])
def test_many_uploads_and_pictures_leave_others_alone(tmp_path: Path, attack: Attack) -> None:
    with besieged(tmp_path, "ann", "bob", owner_requests=0) as service:
        attack(service, "ann", MANY, ["/v1/scenes/two-dof", "/v1/jobs"])
        assert service.terminate() < EXIT_SECONDS
