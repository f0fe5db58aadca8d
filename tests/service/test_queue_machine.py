"""The queue as a state machine: whatever happens in whatever order, on both databases.

Two services, workers that die, leases that run out, clocks that jump, cancels at the wrong moment: after
every step the rows equal a model of a few lines, one attempt at a time owns a job, an ended job stays as it
is and its result exists if and only if it was successful (or failed with what it had computed).
"""

import importlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    invariant,
    multiple,
    rule,
    run_state_machine_as_test,
)
from sqlalchemy import Integer, String, bindparam, delete, select

from service.db import revisions
from service.db.engine import Database
from service.db.models import Job, JobResult, JobState
from service.db.repositories import Attempt, JobRepository, NewJob, attempts
from service.errors import IdempotencyError, QueueFullError
from service.jobs.outputs import FailureKind, JobFailure, JobOutput

LEASE = timedelta(seconds=60)
ROOM = 4
BEGIN = datetime(2026, 1, 1, tzinfo=UTC)


@dataclass
class Model:
    """What a job's row must say."""

    id: str
    request: str
    spec: str
    max_attempts: int
    priority: int
    state: JobState = JobState.ACCEPTED
    attempt: int = 0
    owner: str | None = None
    until: datetime = BEGIN
    cancelled: bool = False
    result: str | None = None
    result_of: str | None = None
    history: list[JobState] = field(default_factory=list)

    def owned_by(self, attempt: Attempt) -> bool:
        mine = (self.attempt, self.owner) == (attempt.attempt, attempt.lease_owner)
        return self.state is JobState.RUNNING and mine

    def free(self, state: JobState) -> None:
        self.state, self.owner = state, None

    def recovered(self) -> None:
        if self.cancelled:
            self.free(JobState.DISMISSED)
        elif self.attempt >= self.max_attempts:
            self.free(JobState.FAILED)
        else:
            self.free(JobState.ACCEPTED)


class QueueMachine(RuleBasedStateMachine):
    """Everything that may happen to the rows of the queue."""

    database: Database
    attempts = Bundle("attempts")

    def __init__(self) -> None:
        super().__init__()
        self.time = BEGIN
        self.repository = JobRepository(self.database, lambda: self.time)
        self.jobs: dict[str, Model] = {}
        self.keys: dict[str, Model] = {}
        self.written = 0
        with self.database.writing() as connection:
            connection.execute(delete(Job).where(Job.result_of.is_not(None)))
            connection.execute(delete(Job))

    def waiting(self) -> list[Model]:
        found = [job for job in self.jobs.values() if job.state is JobState.ACCEPTED]
        return sorted(found, key=lambda job: (-job.priority, job.id))

    @rule(
        priority=st.integers(-2, 2),
        spec=st.sampled_from("abc"),
        most=st.integers(1, 3),
        fresh=st.booleans(),
        key=st.sampled_from([None, None, "k1", "k2"]),
    )
    def submit(self, priority: int, spec: str, most: int, fresh: bool, key: str | None) -> None:
        new = NewJob(
            kind="iteration", request={"spec": spec}, spec={"spec": spec}, spec_hash=spec,
            request_hash=f"{spec}{fresh}", max_attempts=most, priority=priority, fresh=fresh,
            idempotency_key=key,
        )  # fmt: skip
        known = self.keys.get(key) if key else None
        done = [job for job in self.jobs.values() if (job.spec, job.state) == (spec, JobState.SUCCESSFUL)]
        stored = [job for job in done if job.result_of is None and not fresh]
        if known is not None and known.request != new.request_hash:
            with pytest.raises(IdempotencyError):
                self.repository.submit(new, ROOM)
            return
        if known is None and not stored and len(self.waiting()) >= ROOM:
            with pytest.raises(QueueFullError):
                self.repository.submit(new, ROOM)
            return
        row, inserted = self.repository.submit(new, ROOM)
        assert inserted == (known is None)
        if known is not None:
            assert row.id == known.id
            return
        job = Model(id=row.id, request=new.request_hash, spec=spec, max_attempts=most, priority=priority)
        if stored:
            job.state, job.result_of = JobState.SUCCESSFUL, max(stored, key=lambda one: one.id).id
        self.jobs[row.id] = job
        if key:
            self.keys[key] = job

    @rule(target=attempts, owner=st.sampled_from(["one", "two"]))
    def claim(self, owner: str) -> object:
        until = self.time + LEASE
        attempt = self.repository.claim(owner, until)
        waiting = self.waiting()
        if not waiting:
            assert attempt is None
            return multiple()
        first = waiting[0]
        assert attempt is not None
        assert (attempt.job_id, attempt.attempt, attempt.spec) == (
            first.id, first.attempt + 1, {"spec": first.spec},
        )  # fmt: skip
        first.state, first.attempt, first.owner, first.until = JobState.RUNNING, attempt.attempt, owner, until
        return attempt

    @rule(attempt=attempts, fraction=st.floats(0.0, 1.0), points=st.integers(0, 99))
    def report(self, attempt: Attempt, fraction: float, points: int) -> None:
        job, until = self.jobs[attempt.job_id], self.time + LEASE
        assert self.repository.report(attempt, fraction, points, until) == job.owned_by(attempt)
        if job.owned_by(attempt):
            job.until = until

    @rule(owner=st.sampled_from(["one", "two"]), seen=st.lists(attempts, max_size=4, unique_by=id))
    def renew(self, owner: str, seen: list[Attempt]) -> None:
        mine, until = [a for a in seen if a.lease_owner == owner], self.time + LEASE
        lost = self.repository.renew(mine, until)
        for attempt in mine:
            job = self.jobs[attempt.job_id]
            assert (attempt in lost) != job.owned_by(attempt)
            if job.owned_by(attempt):
                job.until = until

    @rule(attempt=attempts)
    def succeed(self, attempt: Attempt) -> None:
        job = self.jobs[attempt.job_id]
        self.written += 1
        words = f"{attempt.lease_owner} {attempt.attempt} {self.written}"
        may = job.owned_by(attempt) and not job.cancelled
        assert self.repository.succeed(attempt, JobOutput(result={"of": words})) == may
        if may:
            job.free(JobState.SUCCESSFUL)
            job.result = words

    @rule(attempt=attempts, kept=st.booleans())
    def fail(self, attempt: Attempt, kept: bool) -> None:
        job = self.jobs[attempt.job_id]
        failure = JobFailure(kind=FailureKind.GOAL, detail="not reached")
        may = job.owned_by(attempt)
        output = JobOutput(result={"of": "failed"}) if kept else None
        assert self.repository.fail(attempt, failure, output) == may
        if may:
            job.free(JobState.FAILED)
            job.result = "failed" if kept else None

    @rule(attempt=attempts)
    def worker_dies(self, attempt: Attempt) -> None:
        job = self.jobs[attempt.job_id]
        may = job.owned_by(attempt)
        assert self.repository.lose(attempt, "killed").total == may
        if may:
            job.recovered()

    @rule(attempt=attempts)
    def service_stops(self, attempt: Attempt) -> None:
        job = self.jobs[attempt.job_id]
        may = job.owned_by(attempt)
        assert self.repository.release(attempt) == may
        if may:
            job.free(JobState.ACCEPTED)
            job.attempt -= 1

    @rule(attempt=attempts)
    def stopped_for_a_cancel(self, attempt: Attempt) -> None:
        job = self.jobs[attempt.job_id]
        may = job.owned_by(attempt) and job.cancelled
        if may:
            assert self.repository.dismiss(attempt)
            job.free(JobState.DISMISSED)

    @rule(index=st.integers(0, 30))
    def cancel(self, index: int) -> None:
        if not self.jobs:
            assert self.repository.cancel("nobody") is None
            return
        job = list(self.jobs.values())[index % len(self.jobs)]
        row = self.repository.cancel(job.id)
        if job.state is JobState.ACCEPTED:
            job.state, job.cancelled = JobState.DISMISSED, True
        elif job.state is JobState.RUNNING:
            job.cancelled = True
        assert row is not None
        assert (row.state, row.cancel_requested) == (job.state, job.cancelled)

    @rule(seconds=st.sampled_from([-3600, -61, -1, 1, 30, 61, 86400]))
    def clock_jumps(self, seconds: int) -> None:
        self.time += timedelta(seconds=seconds)

    @rule()
    def leases_run_out(self) -> None:
        expired = [j for j in self.jobs.values() if j.state is JobState.RUNNING and j.until < self.time]
        assert self.repository.recover_expired().total == len(expired)
        for job in expired:
            job.recovered()

    @rule(owner=st.sampled_from(["one", "two"]))
    def service_starts(self, owner: str) -> None:
        def gone(job: Model) -> bool:
            return job.owner != owner if self.database.exclusive else job.until < self.time

        found = [job for job in self.jobs.values() if job.state is JobState.RUNNING and gone(job)]
        assert self.repository.recover_abandoned(owner).total == len(found)
        for job in found:
            job.recovered()

    @invariant()
    def the_rows_are_the_model(self) -> None:
        with self.database.reading() as connection:
            columns = (Job.id, Job.state, Job.attempt, Job.lease_owner, Job.cancel_requested, Job.result_of)
            rows = {row.id: row for row in connection.execute(select(*columns))}
            stored = connection.execute(select(JobResult.job_id, JobResult.body)).all()
        results = {row.job_id: row.body for row in stored}
        assert set(rows) == set(self.jobs)
        for job in self.jobs.values():
            row = rows[job.id]
            assert (row.state, row.attempt, row.lease_owner, row.cancel_requested, row.result_of) == (
                job.state, job.attempt, job.owner, job.cancelled, job.result_of,
            )  # fmt: skip
            assert results.get(job.id) == (None if job.result is None else {"of": job.result})
            if job.state is JobState.SUCCESSFUL:
                assert (job.id in results) != (job.result_of is not None)
            elif job.state is not JobState.FAILED:
                assert job.id not in results
            if job.history and job.history[-1].finished:
                assert job.state is job.history[-1], "an ended job has changed"
            job.history.append(job.state)
        for claimed in [job for job in self.jobs.values() if job.state is JobState.RUNNING]:
            assert 1 <= claimed.attempt <= claimed.max_attempts


def run(database: Database, examples: int, steps: int, phases: tuple[Phase, ...] = tuple(Phase)) -> None:
    machine = type("OnThisDatabase", (QueueMachine,), {"database": database})
    slow = [HealthCheck.too_slow, HealthCheck.data_too_large]
    how = settings(
        max_examples=examples, stateful_step_count=steps, phases=phases, deadline=None,
        suppress_health_check=slow, report_multiple_bugs=False, database=None,
    )  # fmt: skip
    run_state_machine_as_test(machine, settings=how)


@pytest.mark.few(2)
def test_the_queue_keeps_its_promises(module_database: Database) -> None:
    run(module_database, examples=40, steps=40)


@pytest.mark.long
def test_the_queue_keeps_its_promises_for_long(module_database: Database) -> None:
    run(module_database, examples=400, steps=80)


@pytest.fixture
def unguarded() -> Iterator[None]:
    """The condition of all guarded statements forgets attempt and owner, while the block lasts."""
    forgotten = (bindparam("number", type_=Integer) >= 0) & (bindparam("holder", type_=String) != "")
    with pytest.MonkeyPatch.context() as patch:
        weak = (Job.id == bindparam("job")) & (Job.state == JobState.RUNNING) & forgotten
        for module in ("attempts", "jobs"):
            patch.setattr(f"service.db.repositories.{module}.OWNED", weak)
        importlib.reload(attempts)
        yield
    importlib.reload(attempts)


@pytest.mark.long
@pytest.mark.usefixtures("unguarded")
def test_a_queue_that_forgets_the_guard_is_caught(tmp_path: Path) -> None:
    """The test can fail: a queue that lets a lost attempt write is found out."""
    url = f"sqlite:///{tmp_path}/jobs.db"
    revisions.upgrade(url)
    with pytest.raises(AssertionError):
        run(Database(url), examples=200, steps=50, phases=(Phase.generate,))
