"""A full disk: nothing is written, readiness says so, what can be read is, and the service stops."""

import time
from pathlib import Path

import pytest
from besieged import besieged
from postgresql_cluster import Cluster
from private_kinds import PRIVATE
from service_helpers import is_problem, serving, until

from service.db.engine import Database

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
