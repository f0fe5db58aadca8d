"""A full disk: nothing is written, readiness says so, what can be read is, and the service stops."""

from __future__ import annotations

from pathlib import Path

import httpx
from besieged import besieged
from service_helpers import is_problem, until

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


def test_a_full_disk_is_told_by_readiness(tmp_path: Path, small_disk: Path) -> None:
    job = {"kind": "iteration", "fresh": True}
    url = f"sqlite:///{small_disk}/jobs.db"
    with besieged(tmp_path, url=url, least_free_bytes=1_000_000) as service, service.client() as client:
        known = client.post("/v1/jobs", json=job).raise_for_status().json()["id"]
        filler = fill(small_disk)
        health = client.get("/health/ready")
        assert health.status_code == 503
        assert any("1000000" in words.replace(" ", "") for words in health.json()["trouble"]), health.text
        is_problem(client.post("/v1/jobs", json={**job, "seed": 1}), 503)
        assert client.get(f"/v1/jobs/{known}").status_code == 200
        filler.unlink()
        until(lambda: httpx.get(f"{service.base}/health/ready").status_code == 200)
        assert client.post("/v1/jobs", json={**job, "seed": 2}).status_code == 202


def test_a_full_disk_does_not_hold_up_the_end(tmp_path: Path, small_disk: Path) -> None:
    url = f"sqlite:///{small_disk}/jobs.db"
    with besieged(tmp_path, url=url, least_free_bytes=1_000_000) as service:
        httpx.post(f"{service.base}/v1/jobs", json={"kind": "iteration", "seconds": 600.0})
        filler = fill(small_disk)
        assert service.terminate() < EXIT_SECONDS
        filler.unlink()
