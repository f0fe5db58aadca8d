"""Clocks that jump or disagree cost no job an attempt."""

import random
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import pytest
from private_kinds import PRIVATE
from service_helpers import PATIENCE, settings_of, until

from service.db.clock import SharedClock, utc_now
from service.db.engine import Database
from service.db.models import JobState
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
            jobs = [first.submit({"kind": "iteration", "seconds": 1.5, "seed": n})[0].id for n in range(4)]
            until(lambda: all(first.job(job).state.finished for job in jobs))
            assert [first.job(job).attempt for job in jobs] == [1] * 4
        finally:
            first.stop()
            second.stop()
