"""Owners take turns in the queue, on both databases; and in the threads of a service."""

import asyncio
import random
import threading
import time
from collections import Counter
from datetime import timedelta

import pytest
from service_helpers import new_job

from service.auth.callers import LINK_READERS
from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import JobState
from service.db.repositories import Attempt, JobRepository
from service.errors import OverloadedError, RetryLaterError, TooManyRequestsError
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


async def _flooded(flood: int, late: float) -> tuple[list[Exception], Counter[str], float]:
    """Who floods a lane of 16 threads with calls that last, what they are told, and what others wait [s]."""
    lane, block, most = Lane(16, late), threading.Event(), Counter[str]()

    async def asked(owner: str) -> Exception | None:
        try:
            await lane.run(owner, block.wait, 30.0)
        except RetryLaterError as error:
            return error
        return None

    floods = [
        asyncio.create_task(asked(owner)) for owner in ("ann", LINK_READERS.owner) for _ in range(flood)
    ]
    await asyncio.sleep(0.05)
    for owner in lane._running:
        most[owner] = lane._running[owner]
    begun = time.monotonic()
    for _ in range(20):
        assert await lane.run("bob", int) == 0
    waited = time.monotonic() - begun
    await asyncio.sleep(2.0 * late)
    block.set()
    told = await asyncio.gather(*floods)
    assert await lane.run("ann", int) == 0
    assert not lane._running
    assert not lane._waiting
    return [one for one in told if one is not None], most, waited


def test_who_floods_a_lane_has_a_quarter_of_it_and_is_told_so() -> None:
    told, most, waited = asyncio.run(_flooded(30, 0.3))
    assert most == {"ann": 4, LINK_READERS.owner: 2}
    assert waited < 0.3
    assert len(told) == 26 + 28
    assert all(isinstance(one, TooManyRequestsError) and one.retry_after >= 1 for one in told)


async def _at_random(seed: int) -> None:
    """Calls of many owners, some given up while they wait: no thread is lost, none has more than a share."""
    generator, lane, running = random.Random(seed), Lane(8, 30.0), Counter[str]()
    lock, worst, begun = threading.Lock(), Counter[str](), set[int]()

    def work(number: int, owner: str, seconds: float) -> None:
        with lock:
            begun.add(number)
            running[owner] += 1
            worst[owner] = max(worst[owner], running[owner])
            worst["all"] = max(worst["all"], running.total())
        time.sleep(seconds)
        with lock:
            running[owner] -= 1

    tasks = []
    for number in range(150):
        owner = generator.choice("aaaabcd")
        seconds = generator.random() * 0.004
        tasks.append(asyncio.create_task(lane.run(owner, work, number, owner, seconds)))
        if generator.random() < 0.3:
            await asyncio.sleep(generator.random() * 0.003)
            chosen = generator.randrange(number + 1)
            if chosen not in begun:
                tasks[chosen].cancel()
    done = await asyncio.gather(*tasks, return_exceptions=True)
    assert all(one is None or isinstance(one, asyncio.CancelledError) for one in done)
    assert worst["all"] <= 8
    assert max(worst[owner] for owner in "abcd") == 2
    assert lane._free == 8
    assert not lane._running
    assert not lane._waiting


@pytest.mark.parametrize("seed", range(3))
def test_no_thread_of_a_lane_is_lost(seed: int) -> None:
    asyncio.run(_at_random(seed))
