"""Many small jobs of many clients on a real service: none lost, none twice."""

import sys
from pathlib import Path
from typing import Any

import pytest

from benchmarks.service_load import check_jobs, run_load
from benchmarks.service_process import serving

SCRIPT = Path(__file__).with_name("serve_private.py")


def words(database: str, port: int, _workers: int) -> tuple[str, ...]:
    return (sys.executable, str(SCRIPT), database, str(port))


def job(number: int) -> dict[str, Any]:
    return {"kind": "iteration", "seed": number, "sweeps": 1}


@pytest.mark.long
@pytest.mark.parametrize("number", [40, 96])
def test_every_job_of_many_clients_is_done_once(url: str, tmp_path: Path, number: int) -> None:
    with serving(url, workers=2, log=tmp_path / "log", command=words) as service:
        handed_in = run_load(service, number, 16, wait=False, job=job)
        waited_for = run_load(service, number, 16, wait=True, first=number, job=job)
    assert len(handed_in.latencies) == len(waited_for.latencies) == number
    check_jobs(url, 2 * number)


@pytest.mark.long
def test_every_shipped_job_of_many_clients_is_done_once(url: str, tmp_path: Path) -> None:
    with serving(url, workers=2, log=tmp_path / "log", queue_limit=5000) as service:
        run_load(service, 2000, 16, wait=False)
    check_jobs(url, 2000)
