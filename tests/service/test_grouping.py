"""Writes that share a transaction: each caller has its own result, and one that fails harms no other."""

import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from service_helpers import PATIENCE, new_job, until
from sqlalchemy import Connection, event, func, insert, select, text
from sqlalchemy.exc import DBAPIError

from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Job, JobState, StoredScene
from service.db.repositories import JobRepository
from service.errors import QueueFullError
from service.jobs.outputs import JobOutput


def scene(connection: Connection, name: str) -> str:
    values = {"name": name, "scene_hash": "", "created": utc_now(), "body": {}}
    connection.execute(insert(StoredScene).values(**values))
    return name


def stored(database: Database) -> list[str]:
    with database.reading() as connection:
        return list(connection.execute(select(StoredScene.name).order_by(StoredScene.name)).scalars())


def held_up(database: Database, works: list) -> tuple[list, int]:
    """The outcomes of `works`, all of which wait while another transaction is open; and the commits."""
    free, commits = threading.Event(), []
    event.listen(database._write, "commit", lambda _connection: commits.append(1))
    blocked = [lambda _connection: free.wait(PATIENCE)] * database._grouped._leading._value

    def outcome(work: object) -> object:
        try:
            return database.grouped(work)
        except Exception as error:  # noqa: BLE001 - what it is, is what is looked at
            return type(error)

    with ThreadPoolExecutor(len(works) + len(blocked)) as threads:
        first = [threads.submit(outcome, work) for work in blocked]
        until(lambda: not database._grouped._pending)
        waiting = [threads.submit(outcome, work) for work in works]
        until(lambda: len(database._grouped._pending) == len(works))
        free.set()
        outcomes = [future.result() for future in waiting]
        assert all(future.result() for future in first)
    return outcomes, len(commits) - len(blocked)


def test_writes_that_wait_together_are_committed_together(database: Database) -> None:
    names = [f"scene-{number:02}" for number in range(20)]
    outcomes, commits = held_up(database, [lambda c, name=name: scene(c, name) for name in names])
    assert outcomes == names
    assert stored(database) == names
    assert commits <= database._grouped._leading._value


def test_a_write_that_fails_fails_alone(database: Database) -> None:
    scene_of = [lambda c, name=name: scene(c, name) for name in ("a", "b")]
    nonsense = [lambda c: c.execute(text("SELECT no_such_thing"))]
    refused = [lambda _c: (_ for _ in ()).throw(QueueFullError("full", retry_after=1))]
    outcomes, _ = held_up(database, [scene_of[0], *nonsense, *refused, scene_of[1]])
    assert outcomes[0] == "a"
    assert issubclass(outcomes[1], DBAPIError)
    assert outcomes[2:] == [QueueFullError, "b"]
    assert stored(database) == ["a", "b"]


def test_the_same_row_twice_is_an_error_of_the_second_alone(database: Database) -> None:
    outcomes, _ = held_up(
        database, [lambda c: scene(c, "a"), lambda c: scene(c, "a"), lambda c: scene(c, "b")]
    )
    assert [outcome for outcome in outcomes if isinstance(outcome, str)] in (["a", "b"], ["b", "a"])
    assert stored(database) == ["a", "b"]


def test_several_jobs_are_taken_in_order_of_priority_and_age(database: Database) -> None:
    jobs = JobRepository(database)
    ids = {
        (priority, number): jobs.submit(new_job(priority=priority), queue_limit=100)[0].id
        for number in range(3)
        for priority in (-5, 0, 7)
    }
    wanted = [ids[key] for key in sorted(ids, key=lambda key: (-key[0], key[1]))]
    until_then = utc_now() + timedelta(seconds=60.0)
    taken = [jobs.claim_several("me", until_then, most) for most in (1, 5, 10)]
    assert [len(several) for several in taken] == [1, 5, 3]
    assert [attempt.job_id for several in taken for attempt in several] == wanted
    assert jobs.claim_several("me", until_then, 2) == []
    assert all(jobs.succeed(attempt, JobOutput(result={})) for several in taken for attempt in several)
    assert jobs.count()[JobState.SUCCESSFUL] == 9


def test_jobs_accepted_at_the_same_moment_do_not_exceed_the_limit(database: Database) -> None:
    """Also by several services: each has a repository and, on PostgreSQL, a pool of its own."""
    services = [database] if database.exclusive else [Database(database.url) for _ in range(3)]
    repositories = [JobRepository(service) for service in services]

    def submit(number: int) -> bool:
        try:
            return repositories[number % len(repositories)].submit(new_job(), queue_limit=25)[1]
        except QueueFullError:
            return False

    with ThreadPoolExecutor(12) as threads:
        accepted = sum(threads.map(submit, range(60)))
    with database.reading() as connection:
        waiting = connection.execute(select(func.count()).where(Job.state == JobState.ACCEPTED)).scalar_one()
    assert accepted == waiting == 25
    for service in services:
        if service is not database:
            service.close()


@pytest.mark.parametrize("most", [1, 64])
def test_a_job_is_taken_once_by_threads_that_share_transactions(database: Database, most: int) -> None:
    jobs = JobRepository(database)
    for _ in range(40):
        jobs.submit(new_job(), queue_limit=100)
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(lambda n: jobs.claim_several(f"owner {n % 3}", utc_now(), most), range(48)))
    taken = [attempt.job_id for several in found for attempt in several]
    assert len(taken) == len(set(taken)) == 40
