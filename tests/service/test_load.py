"""Many small jobs of many clients on a real service: none lost, none twice."""

import asyncio
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest
from besieged import make_keys
from service_helpers import until

from benchmarks.service_load import check_jobs, run_load
from benchmarks.service_process import serving
from benchmarks.users import Seen, User

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
    with serving(url, workers=2, log=tmp_path / "log", queue_limit=600) as service:
        run_load(service, 2000, 16, wait=False)
    check_jobs(url, 2000)


MOST_CLIENTS = 1600
ROUND_SECONDS = 6.0
ANSWERED_SECONDS = 60.0


@pytest.mark.long
def test_clients_are_doubled_until_the_service_says_that_they_are_too_many(tmp_path: Path) -> None:
    """It answers 503 then and does not hang, and goes on when they are fewer; nobody is told of an error."""
    url = f"sqlite:///{tmp_path}/jobs.db"
    owners = tuple(f"client-{number}" for number in range(MOST_CLIENTS))
    tokens = list(make_keys(url, owners, {}).values())

    async def at_once(port: int, clients: int, seen: Seen) -> None:
        end = asyncio.get_running_loop().time() + ROUND_SECONDS
        users = [User(number + clients, tokens[number], port, seen) for number in range(clients)]
        await asyncio.gather(*(user.live(end, pause=0.05) for user in users))

    clients, seen = 25, Seen()
    with serving(url, workers=1, log=tmp_path / "log", require_keys="true", queue_limit=60) as service:
        while clients <= MOST_CLIENTS and not seen.statuses[503]:
            seen = Seen()
            asyncio.run(at_once(service.port, clients, seen))
            slowest = max(*seen.reads, *seen.writes)
            print(clients, dict(seen.statuses), f"at most {slowest:.1f} s")  # noqa: T201
            assert set(seen.statuses) <= {200, 202, 429, 503}
            assert slowest < ANSWERED_SECONDS
            clients *= 2
        assert seen.statuses[503], "it took all of them"
        headers = {"Authorization": f"Bearer {tokens[0]}"}
        with httpx.Client(base_url=f"http://127.0.0.1:{service.port}", headers=headers) as client:
            until(lambda: client.get("/v1/jobs?limit=10").status_code == 200, seconds=10.0)
