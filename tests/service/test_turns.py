"""Owners take turns in the queue, on both databases; and in the threads of a service."""

import asyncio
import random
import threading
from collections import Counter
from datetime import timedelta

import pytest
from service_helpers import new_job

from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import JobState
from service.db.repositories import Attempt, JobRepository
from service.errors import OverloadedError
from service.queue.lanes import Lane

LONG = timedelta(hours=1)


def owners_of(attempts: list[Attempt]) -> list[str]:
    return [attempt.owner for attempt in attempts]


def test_the_next_job_is_of_who_has_the_fewest_running(database: Database) -> None:
    """Against a model that looks at every job: no owner has two more running than another who waits."""
    generator = random.Random(3)
    jobs = JobRepository(database)
    names = ["ann", "bob", "cleo", ""]
    waiting: dict[str, list[tuple[int, str]]] = {name: [] for name in names}
    running: Counter[str] = Counter()
    for _ in range(60):
        owner, priority = generator.choice([*names, "ann", "ann", "ann"]), generator.randint(-2, 2)
        row, _ = jobs.submit(new_job(owner=owner, priority=priority), queue_limit=1000)
        waiting[owner].append((-priority, row.id))
    while any(waiting.values()):
        attempts = jobs.claim_several("here", utc_now() + LONG, generator.randint(1, 5))
        assert attempts
        for attempt in attempts:
            assert attempt.job_id == min(waiting[attempt.owner])[1], "the highest priority, then the oldest"
            least = min(running[name] for name in names if waiting[name])
            assert running[attempt.owner] == least
            waiting[attempt.owner].remove(min(waiting[attempt.owner]))
            running[attempt.owner] += 1
    assert jobs.claim("here", utc_now() + LONG) is None
    assert jobs.count()[JobState.RUNNING] == 60


def test_a_late_owner_is_next(database: Database) -> None:
    jobs = JobRepository(database)
    for _ in range(200):
        jobs.submit(new_job(owner="ann", priority=100), queue_limit=1000)
    first = jobs.claim_several("here", utc_now() + LONG, 2)
    jobs.submit(new_job(owner="bob", priority=-100), queue_limit=1000)
    assert owners_of(jobs.claim_several("here", utc_now() + LONG, 1)) == ["bob"]
    assert owners_of(first) == ["ann", "ann"]


def test_owners_alternate_where_one_job_runs_at_a_time(database: Database) -> None:
    jobs = JobRepository(database)
    for owner in ("ann", "ann", "ann", "bob", "bob"):
        jobs.submit(new_job(owner=owner), queue_limit=1000)
    order = []
    while (attempt := jobs.claim("here", utc_now() + LONG)) is not None:
        order.append(attempt.owner)
        jobs.lose(attempt, "killed") if attempt.attempt == attempt.max_attempts else jobs.cancel(
            attempt.job_id
        )
        assert jobs.dismiss(attempt)
    assert order[:4] in (["ann", "bob", "ann", "bob"], ["bob", "ann", "bob", "ann"])
    assert order[4] == "ann"


async def _in_a_lane() -> list[str]:
    lane, order, block = Lane(1, 30.0), [], threading.Event()

    def work(owner: str) -> None:
        block.wait(30.0)
        order.append(owner)

    asked = [asyncio.create_task(lane.run("ann", work, "ann")) for _ in range(5)]
    await asyncio.sleep(0.05)
    asked.append(asyncio.create_task(lane.run("bob", work, "bob")))
    await asyncio.sleep(0.05)
    block.set()
    await asyncio.gather(*asked)
    return order


def test_owners_take_turns_in_a_lane() -> None:
    order = asyncio.run(_in_a_lane())
    assert order.index("bob") <= 2
    assert Counter(order) == {"ann": 5, "bob": 1}


async def _behind_a_block() -> None:
    lane, block = Lane(1, 0.2), threading.Event()
    first = asyncio.create_task(lane.run("ann", block.wait, 30.0))
    await asyncio.sleep(0.01)
    with pytest.raises(OverloadedError, match=r"0\.2 s"):
        await lane.run("bob", int)
    cancelled = asyncio.create_task(lane.run("bob", int))
    await asyncio.sleep(0.01)
    cancelled.cancel()
    block.set()
    assert await first
    assert await lane.run("bob", int) == 0


def test_nobody_waits_for_ever_for_a_lane() -> None:
    asyncio.run(_behind_a_block())
