"""A service that is killed with jobs of every kind: none is lost, none is done twice, each has its result.

``pytest -m long tests/service/test_kills.py -s`` prints what happened.
"""

import itertools
import random
import threading
import time
from collections import Counter, deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
from service_helpers import until
from sqlalchemy import func, select
from test_result_schemas import BODIES

from benchmarks.service_process import ServiceProcess, serving
from service.db.engine import Database
from service.db.models import Job, JobResult, JobState, Result
from service.db.repositories.integrity import check
from tests.golden.faces import rounded

KILLS = 30
SECONDS = 1800.0
"""For all of them to end."""
EACH = 10
"""Jobs handed in before a kill."""


@dataclass(frozen=True)
class Outcome:
    """What the database has of a job; of its results whatever no clock decides."""

    state: JobState
    attempt: int
    finished: Any
    result: Any
    stored: tuple[tuple[str, int], ...]


def outcomes(url: str) -> dict[str, Outcome]:
    """Every job of a database."""
    database = Database(url)
    with database.reading() as connection:
        jobs = connection.execute(select(Job.id, Job.state, Job.attempt, Job.finished)).all()
        results = connection.execute(select(JobResult.job_id, JobResult.body)).all()
        query = select(Result.job_id, Result.of, func.count()).group_by(Result.job_id, Result.of)
        stored: dict[str, list[tuple[str, int]]] = {}
        for job, *what in connection.execute(query):
            stored.setdefault(job, []).append(tuple(what))
    database.close()
    bodies = {job: rounded(body) for job, body in results}
    assert len(bodies) == len(results)
    return {
        job: Outcome(state, attempt, finished, bodies.get(job), tuple(sorted(stored.get(job, ()))))
        for job, state, attempt, finished in jobs
    }


def hand_in(service: ServiceProcess, waiting: deque[tuple[str, str]], accepted: dict[str, str]) -> None:
    """Hand in cases, each with its key, until the service is gone; what was not accepted is left waiting."""
    with httpx.Client(base_url=f"http://127.0.0.1:{service.port}", timeout=60.0) as client:
        while waiting:
            key, case = waiting[0]
            kind, body = BODIES[case]
            said = {"kind": kind, "fresh": True, **body}
            try:
                answer = client.post("/v1/jobs", json=said, headers={"Idempotency-Key": key})
            except httpx.TransportError:
                return
            assert answer.is_success, answer.text
            accepted[answer.json()["id"]] = case
            waiting.popleft()


def ended(service: ServiceProcess) -> bool:
    with service.client() as client:
        counts = client.get("/health/ready").json()["jobs"]
    return counts["accepted"] + counts["running"] == 0


@pytest.mark.long
def test_kills_with_jobs_of_every_kind(url: str, tmp_path: Path) -> None:
    """A job begins once, and once more for each kill that found it running; what has ended stays so."""
    calm = f"sqlite:///{tmp_path}/calm.db"
    with serving(calm, workers=2, log=tmp_path / "calm") as service:
        wanted: dict[str, str] = {}
        hand_in(service, deque((f"calm-{number}", case) for number, case in enumerate(BODIES)), wanted)
        until(lambda: ended(service), seconds=SECONDS)
    undisturbed = {wanted[job]: one for job, one in outcomes(calm).items()}
    assert {one.attempt for one in undisturbed.values()} == {1}

    generator, cases = random.Random(KILLS), itertools.cycle(BODIES)
    waiting: deque[tuple[str, str]] = deque()
    accepted: dict[str, str] = {}
    # On PostgreSQL others wait for the lease of a killed attempt, meanwhile the next ones are killed.
    interrupted: set[tuple[str, int]] = set()
    left = Counter[str]()
    settings = {"max_attempts": KILLS + 1}
    for kill in range(KILLS):
        waiting.extend((f"{kill}-{number}", next(cases)) for number in range(EACH))
        with serving(url, workers=2, log=tmp_path / "log", **settings) as service:
            clerk = threading.Thread(target=hand_in, args=(service, waiting, accepted))
            clerk.start()
            time.sleep(generator.uniform(0.2, 3.0))
            service.process.kill()
            service.process.wait()
            clerk.join()
        before = outcomes(url)
        assert set(accepted) <= set(before), "an accepted job was lost"
        interrupted.update((job, one.attempt) for job, one in before.items() if one.state == JobState.RUNNING)
        left.update(one.state.value for one in before.values() if not one.state.finished)
        done = {job: one for job, one in before.items() if one.state.finished}
    with serving(url, workers=2, log=tmp_path / "log", **settings) as service:
        hand_in(service, waiting, accepted)
        until(lambda: ended(service), seconds=SECONDS)
    found = outcomes(url)
    print(f"{KILLS} kills, {len(accepted)} jobs accepted, when they happened {dict(left)}, "  # noqa: T201
          f"{len(interrupted)} times anew")  # fmt: skip
    assert set(found) == set(accepted), "a request that was repeated made another job"
    assert {job: found[job] for job in done} == done, "what had ended was done once more"
    again = Counter(job for job, _ in interrupted)
    assert {job: one.attempt for job, one in found.items()} == {job: 1 + again[job] for job in found}
    for job, one in found.items():
        like = undisturbed[accepted[job]]
        assert (one.state, one.stored, one.result) == (like.state, like.stored, like.result), accepted[job]
    assert check(url).trouble == ()
