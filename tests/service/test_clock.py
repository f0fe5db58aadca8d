"""Clocks that jump or disagree cost no job an attempt."""

import random
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from email.utils import parsedate_to_datetime
from pathlib import Path

import httpx
import pytest
from besieged import besieged, running
from private_kinds import PRIVATE
from serve_private import CLOCK
from service_helpers import PATIENCE, settings_of, until
from sqlalchemy import select

from service.auth.callers import KeyLimits
from service.db.clock import SharedClock, utc_now
from service.db.engine import Database
from service.db.models import JobState, Result
from service.db.repositories import JobRepository
from service.queue.core import Service


class SteppedClock:
    """A wall clock that somebody sets."""

    def __init__(self) -> None:
        self.ahead = timedelta(0)

    def __call__(self) -> datetime:
        return utc_now() + self.ahead


def test_the_shared_clock_runs_on_between_two_looks() -> None:
    server, steady = [datetime(2026, 1, 1, tzinfo=UTC)], [10.0]
    clock = SharedClock(lambda: server[0], lambda: steady[0])
    assert clock() == datetime(2026, 1, 1, tzinfo=UTC)
    steady[0] += 2.5
    assert clock() == datetime(2026, 1, 1, 0, 0, 2, 500_000, tzinfo=UTC)
    server[0] += timedelta(hours=1)
    assert clock() == datetime(2026, 1, 1, 0, 0, 2, 500_000, tzinfo=UTC)
    clock.look()
    assert clock() == datetime(2026, 1, 1, 1, tzinfo=UTC)


def test_services_that_share_a_database_share_its_clock(database: Database) -> None:
    jobs = JobRepository(database)
    assert isinstance(jobs.now, SharedClock) == (database.backend == "postgresql")
    jobs.keep_time()
    assert abs(jobs.now() - database.time()) < timedelta(seconds=1)
    assert abs(jobs.now() - utc_now()) < timedelta(seconds=60)


@pytest.mark.few(keep=("postgresql",))
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_a_clock_that_is_stepped_costs_nothing(url: str, seed: int) -> None:
    """Hours forth and back while jobs run: every job is done once, at its first attempt."""
    clock, generator = SteppedClock(), random.Random(seed)
    service = Service(settings_of(url)(workers=2, lease_seconds=5.0, poll_seconds=0.1), PRIVATE, clock)
    service.start()
    try:
        bodies = [{"kind": "iteration", "seconds": 0.5, "seed": n, "sweeps": 1} for n in range(6)]
        jobs = [service.submit(body)[0].id for body in bodies]
        for _ in range(15):
            time.sleep(0.12)
            clock.ahead = timedelta(seconds=generator.choice([-86400, -3600, -10, 0, 10, 3600, 86400]))
        rows = [service.wait(job, PATIENCE) for job in jobs]
        assert [row.state for row in rows] == [JobState.SUCCESSFUL] * len(jobs)
        assert [row.attempt for row in rows] == [1] * len(jobs)
        assert all(len(service.results(job).sweeps) == 1 for job in jobs)
    finally:
        service.stop()


def test_machines_whose_clocks_disagree_leave_each_other_their_jobs(
    cluster: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine an hour ahead used to take every running job away, until it had no attempt left."""

    def an_hour_ahead() -> datetime:
        return datetime.now(UTC) + timedelta(hours=1)

    with cluster.database(empty=False) as url:
        make: Callable[..., object] = settings_of(url)
        first = Service(make(workers=1, lease_seconds=5.0, poll_seconds=0.1), PRIVATE)
        first.start()
        monkeypatch.setattr("service.db.clock.utc_now", an_hour_ahead)
        second = Service(make(workers=1, lease_seconds=5.0, poll_seconds=0.1), PRIVATE)
        second.start()
        try:
            jobs = [first.submit({"kind": "iteration", "seconds": 0.7, "seed": n})[0].id for n in range(4)]
            until(lambda: all(first.job(job).state.finished for job in jobs))
            assert [first.job(job).attempt for job in jobs] == [1] * 4
        finally:
            first.stop()
            second.stop()


class SetClock:
    """The clock of a process, which is set by hours while it runs."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.set(0)

    def set(self, hours: int) -> None:
        """Set it so many hours ahead of what is right."""
        new = self.file.with_suffix(".new")
        new.write_text(f"{hours}")
        new.replace(self.file)

    def jump(self, over: threading.Event) -> None:
        """Set it anew six times a second."""
        generator = random.Random(1)
        while not over.wait(0.15):
            self.set(generator.choice([-11, -3, -1, 0, 1, 3, 11]))


@pytest.mark.long
def test_the_clock_of_a_service_is_set_by_hours_while_it_works(
    url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Leases, limits of time, `Prefer: wait`, `Retry-After` and the order of jobs are as ever."""
    clock = SetClock(tmp_path / "clock")
    monkeypatch.setenv(CLOCK, str(clock.file))
    limits = {"bob": KeyLimits(requests_per_minute=30)}
    body = {"kind": "iteration", "sweeps": 1, "fresh": True}
    with (
        besieged(tmp_path, "ann", "bob", url=url, limits=limits, lease_seconds=3.0) as service,
        service.client("ann") as client,
    ):
        clock.set(5)
        until(lambda: abs(_ahead(client) - 5.0) < 0.1, seconds=10.0)
        with running(clock.jump):
            made = [client.post("/v1/jobs", json={**body, "seconds": 0.4, "seed": n}) for n in range(12)]
            jobs = [answer.raise_for_status().json()["id"] for answer in made]
            limited = {**body, "seconds": 60.0, "max_seconds": 1.0, "priority": 5}
            waited = {"Prefer": "wait=1"}
            begun = time.monotonic()
            last = client.post("/v1/jobs", json=limited, headers=waited).raise_for_status().json()
            assert 1.0 <= time.monotonic() - begun < 5.0
            until(lambda: client.get(f"/v1/jobs/{jobs[-1]}").json()["finished"], seconds=60.0)
            with service.client("bob") as other:
                while (refused := other.get("/v1/kinds")).status_code != 429:
                    assert refused.status_code == 200
                assert 1 <= int(refused.headers["Retry-After"]) <= 60
                time.sleep(int(refused.headers["Retry-After"]))
                assert other.get("/v1/kinds").status_code == 200
        late = client.get(f"/v1/jobs/{last['id']}").json()
        assert late["status"] == "failed"
        assert "1 s" in late["error"]["detail"], late
        told = [client.get(f"/v1/jobs/{job}").json() for job in jobs]
        assert [(one["status"], one["attempt"]) for one in told] == [("successful", 1)] * len(jobs)
        listed = [one["id"] for one in client.get("/v1/jobs?limit=100").json()["items"]]
        assert listed == [last["id"], *reversed(jobs)]
        service.terminate()
    database = Database(url)
    with database.reading() as connection:
        query = select(Result.job_id).where(Result.of == "sweep").order_by(Result.number)
        stored = connection.execute(query).scalars().all()
    database.close()
    assert stored == jobs, "by one worker, one after the other"


def _ahead(client: httpx.Client) -> float:
    """How far the clock of a service is ahead of this one [h]."""
    told = parsedate_to_datetime(client.get("/health/live").headers["Date"])
    return (told - utc_now()).total_seconds() / 3600.0
