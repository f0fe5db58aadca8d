"""A full disk: nothing is written, readiness says so, what can be read is, and the service stops."""

import io
import itertools
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest
from besieged import besieged
from postgresql_cluster import Cluster
from private_kinds import PRIVATE
from service_helpers import is_problem, serving, until

from service.db.engine import Database
from service.db.repositories.integrity import check
from solver import load_scene

EXIT_SECONDS = 10.0


def fill(folder: Path) -> Path:
    """A file that leaves no room."""
    file = folder / "filler"
    with file.open("wb", buffering=0) as out:
        for size in (1 << 16, 1 << 12):
            try:
                while out.write(b"\0" * size) == size:
                    pass
            except OSError:
                continue
    return file


def test_a_full_disk_is_told_by_readiness_and_does_not_hold_up_the_end(
    tmp_path: Path, small_disk: Path
) -> None:
    job = {"kind": "iteration", "fresh": True}
    url = f"sqlite:///{small_disk}/jobs.db"
    with serving(tmp_path, PRIVATE, database=url, least_free_bytes=1_000_000, grace_seconds=1.0) as client:
        known = client.post("/v1/jobs", json=job).raise_for_status().json()["id"]
        filler = fill(small_disk)
        health = client.get("/health/ready")
        assert health.status_code == 503
        assert any("1000000" in words.replace(" ", "") for words in health.json()["trouble"]), health.text
        is_problem(client.post("/v1/jobs", json={**job, "seed": 1}), 503)
        assert client.get(f"/v1/jobs/{known}").status_code == 200
        filler.unlink()
        until(lambda: client.get("/health/ready").status_code == 200)
        assert client.post("/v1/jobs", json={**job, "seed": 2, "seconds": 600.0}).status_code == 202
        filler, begun = fill(small_disk), time.monotonic()
    assert time.monotonic() - begun < EXIT_SECONDS
    filler.unlink()


def test_the_disk_of_postgresql_is_asked_before_it_is_needed(cluster: Cluster) -> None:
    with cluster.small_disk("24m") as (url, disk):
        database = Database(url)
        try:
            assert database.trouble(0) is None
            tables = files_of(disk)
            filler = fill(disk)
            until(lambda: "No space left" in (database.trouble(0) or ""), seconds=10.0)
            filler.unlink()
            until(lambda: database.trouble(0) is None, seconds=10.0)
            assert files_of(disk) == tables, "looking leaves nothing behind"
        finally:
            database.close()


@pytest.mark.long
def test_a_full_disk_of_postgresql_is_told_by_readiness(tmp_path: Path, cluster: Cluster) -> None:
    job = {"kind": "iteration", "fresh": True}
    with (
        cluster.small_disk("24m") as (url, disk),
        besieged(tmp_path, url=url) as service,
        service.client() as client,
    ):
        known = client.post("/v1/jobs", json=job).raise_for_status().json()["id"]
        filler = fill(disk)
        until(lambda: client.get("/health/ready").status_code == 503, seconds=10.0)
        assert "No space left" in " ".join(client.get("/health/ready").json()["trouble"])
        assert client.get(f"/v1/jobs/{known}").status_code == 200
        filler.unlink()
        until(lambda: client.get("/health/ready").status_code == 200, seconds=10.0)
        assert client.post("/v1/jobs", json={**job, "seed": 2}).status_code == 202
        assert service.terminate() < EXIT_SECONDS


def files_of(disk: Path) -> set[Path]:
    """The files of tables and of what was spilled; PostgreSQL's own cache files come and go."""
    return {file for file in disk.rglob("*") if file.is_file() and not file.name.startswith("pg_internal")}


def written(client: httpx.Client, job: str, number: int) -> Iterator[tuple[str, httpx.Response]]:
    """Every kind of thing that is stored, each with its name and what was answered."""
    mine = {**load_scene("two-dof").to_dict(), "name": f"scene-{number}"}
    file = np.full((100, 100), 1.0 + number)
    begun = {"kind": "iteration", "sweeps": 1, "seed": number, "size": 200}
    yield "job", client.post("/v1/jobs", json=begun, headers={"Idempotency-Key": f"{number}"})
    data = io.BytesIO()
    np.save(data, file)
    yield "upload", client.post(f"/v1/uploads?name=M{number}.npy", content=data.getvalue())
    yield "scene", client.post("/v1/scenes", json=mine)
    yield "project", client.post("/v1/projects", json={"name": f"project {number}"})
    yield "words", client.patch(f"/v1/runs/{job}", json={"notes": f"{number} " + 4000 * "x"})
    yield "link", client.post(f"/v1/runs/{job}/shares", json={"days": 1.0})


@pytest.mark.long
def test_whatever_a_full_disk_of_sqlite_refuses_is_refused_whole(small_disk: Path, tmp_path: Path) -> None:
    told = refused_whole(f"sqlite:///{small_disk}/jobs.db", small_disk, tmp_path)
    assert all(told[name][503] for name in ("job", "upload")), "it was not full"


@pytest.mark.long
def test_whatever_a_full_disk_of_postgresql_refuses_is_refused_whole(
    cluster: Cluster, tmp_path: Path
) -> None:
    with cluster.small_disk("24m") as (url, disk):
        # Rows still find room in the pages that tables have; a file of 80 kB does not.
        assert refused_whole(url, disk, tmp_path)["upload"][503], "it was not full"


def refused_whole(url: str, disk: Path, tmp_path: Path) -> dict[str, Counter[int]]:
    """Each write is done or answered 503 with a problem; what was refused is not there, and is done later."""
    answers: dict[str, Counter[int]] = defaultdict(Counter)
    stored: dict[str, list[str]] = defaultdict(list)
    numbers = itertools.count()
    lists = {"job": "/v1/jobs", "upload": "/v1/uploads", "project": "/v1/projects"}
    with besieged(tmp_path, "ann", url=url, least_free_bytes=0) as service, service.client("ann") as client:
        first = {"kind": "iteration", "fresh": True}
        job = (
            client.post("/v1/jobs", json=first, headers={"Prefer": "wait=30"}).raise_for_status().json()["id"]
        )
        stored["job"].append(job)
        filler = fill(disk)

        def write() -> int:
            """Write each; how many were done."""
            done, number = 0, next(numbers)
            for name, answer in written(client, job, number):
                answers[name][answer.status_code] += 1
                if answer.is_success:
                    done += 1
                    stored[name].append(answer.json().get("id", ""))
                else:
                    assert is_problem(answer, 503)["detail"], answer.text
                    assert int(answer.headers["Retry-After"]) > 0
            return done

        for _ in range(15):
            write()
        assert client.get(f"/v1/jobs/{job}").status_code == 200
        told = {name: found.copy() for name, found in answers.items()}
        filler.unlink()
        until(lambda: write() == 6, seconds=30.0)
        until(lambda: client.get("/health/ready").status_code == 200)
        until(lambda: all(one["finished"] for one in client.get("/v1/jobs?limit=100").json()["items"]))
        for name, path in lists.items():
            there = {one["id"] for one in client.get(f"{path}?limit=100").json()["items"]}
            assert there == set(stored[name]), name
        jobs = client.get("/v1/jobs?limit=100").json()["items"]
        assert {one["status"] for one in jobs} == {"successful"}
        assert service.terminate() < EXIT_SECONDS
    print(told)  # noqa: T201
    assert check(url).trouble == ()
    return told
