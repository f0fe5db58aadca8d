"""The jobs, which are the queue."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, and_, func, insert, select, update

from service.clock import Clock, utc_now
from service.db import Database
from service.errors import IdempotencyError, QueueFullError
from service.ids import new_id
from service.jobs import FailureKind, JobFailure, JobOutput
from service.models import Job, JobResult, JobState
from service.repository.designs import insert_design
from service.repository.rows import Attempt, JobRow, NewJob, Recovered
from service.repository.sweeps import insert_sweeps

__all__ = ["Attempt", "JobRepository", "JobRow", "NewJob", "Recovered"]

_COLUMNS = [getattr(Job, field.name) for field in fields(JobRow)]
_LISTED = [getattr(Job, field.name) for field in fields(JobRow) if field.name != "request"]
_FREE: dict[str, Any] = {"lease_owner": None, "lease_until": None}


def _guard(attempt: Attempt) -> ColumnElement[bool]:
    """True for the job's row only while this attempt owns it."""
    return and_(
        Job.id == attempt.job_id,
        Job.attempt == attempt.attempt,
        Job.lease_owner == attempt.lease_owner,
        Job.state == JobState.RUNNING,
    )


def _change(connection: Connection, condition: ColumnElement[bool], **values: Any) -> bool:
    """Update the rows of `condition`; whether there was one."""
    return connection.execute(update(Job).where(condition).values(**values)).rowcount > 0


def _one(connection: Connection, condition: ColumnElement[bool]) -> JobRow | None:
    query = select(*_COLUMNS).where(condition).order_by(Job.id.desc()).limit(1)
    row = connection.execute(query).mappings().one_or_none()
    return None if row is None else JobRow(**row)


class JobRepository:
    """Jobs of one database.

    Parameters
    ----------
    database : Database
        Where they are.
    now : callable
        The clock that leases and times are read from.
    """

    def __init__(self, database: Database, now: Clock = utc_now) -> None:
        self._db = database
        self.now = now

    def submit(self, new: NewJob, queue_limit: int) -> tuple[JobRow, bool]:
        """Insert a job, or find the one this request made before; whether it was inserted.

        A job whose spec was computed before, and which is not `fresh`, is inserted as successful with
        `result_of` naming the job that has the result.

        Raises
        ------
        IdempotencyError
            The key was used for a different request.
        QueueFullError
            `queue_limit` jobs wait already. Jobs that several services accept at the same moment may exceed
            it by their number.
        """
        return self._db.insert(lambda connection: self._submit(connection, new, queue_limit))

    def _submit(self, connection: Connection, new: NewJob, queue_limit: int) -> tuple[JobRow, bool]:
        known = self._by_key(connection, new)
        if known is not None:
            return known, False
        source = None if new.fresh else self._computed_before(connection, new)
        if source is None:
            self._require_room(connection, queue_limit)
        job_id = self._insert(connection, new, source)
        row = _one(connection, Job.id == job_id)
        if row is None:
            raise RuntimeError(f"job {job_id} vanished in its own transaction")
        return row, True

    def get(self, job_id: str) -> JobRow | None:
        """The job, or None."""
        with self._db.reading() as connection:
            return _one(connection, Job.id == job_id)

    def page(
        self,
        *,
        state: JobState | None = None,
        kind: str | None = None,
        scene: str | None = None,
        before: str | None = None,
        limit: int = 100,
    ) -> list[JobRow]:
        """Jobs, newest first, older than the job `before`."""
        query = select(*_LISTED).order_by(Job.id.desc()).limit(limit)
        for column, value in ((Job.state, state), (Job.kind, kind), (Job.scene_name, scene)):
            if value is not None:
                query = query.where(column == value)
        if before is not None:
            query = query.where(Job.id < before)
        with self._db.reading() as connection:
            return [JobRow(**row) for row in connection.execute(query).mappings()]

    def result(self, job_id: str) -> dict[str, Any] | None:
        """The result of a job, or None if it has none."""
        with self._db.reading() as connection:
            return connection.execute(
                select(JobResult.body).where(JobResult.job_id == job_id)
            ).scalar_one_or_none()

    def count(self) -> dict[JobState, int]:
        """How many jobs are in each state."""
        query = select(Job.state, func.count().label("number")).group_by(Job.state)
        with self._db.reading() as connection:
            found = {row.state: row.number for row in connection.execute(query)}
        return {state: found.get(state, 0) for state in JobState}

    def claim(self, owner: str, lease_until: datetime) -> Attempt | None:
        """Take the next waiting job for `owner`; None if none waits."""
        query = (
            select(Job.id, Job.kind, Job.spec, Job.attempt, Job.max_attempts)
            .where(Job.state == JobState.ACCEPTED)
            .order_by(Job.priority.desc(), Job.id)
            .limit(1)
            .with_for_update(skip_locked=True)
        )
        with self._db.writing() as connection:
            row = connection.execute(query).one_or_none()
            if row is None:
                return None
            attempt = row.attempt + 1
            _change(
                connection,
                and_(Job.id == row.id, Job.state == JobState.ACCEPTED),
                state=JobState.RUNNING,
                attempt=attempt,
                lease_owner=owner,
                lease_until=lease_until,
                started=self.now(),
                progress=0.0,
                points=0,
            )
        return Attempt(
            job_id=row.id,
            kind=row.kind,
            spec=row.spec,
            attempt=attempt,
            max_attempts=row.max_attempts,
            lease_owner=owner,
        )

    def report(self, attempt: Attempt, fraction: float, points: int, lease_until: datetime) -> bool:
        """Write progress and renew the lease; False if the attempt owns the job no more."""
        with self._db.writing() as connection:
            return _change(
                connection, _guard(attempt), progress=fraction, points=points, lease_until=lease_until
            )

    def renew(self, attempts: Iterable[Attempt], lease_until: datetime) -> list[Attempt]:
        """Renew the leases; gives back the attempts that own their job no more."""
        with self._db.writing() as connection:
            return [a for a in attempts if not _change(connection, _guard(a), lease_until=lease_until)]

    def succeed(self, attempt: Attempt, output: JobOutput) -> bool:
        """Commit state, result and sweeps together, unless the job was lost or its cancel asked for."""
        with self._db.writing() as connection:
            condition = and_(_guard(attempt), Job.cancel_requested.is_(False))
            finished = self.now()
            if not _change(
                connection, condition, state=JobState.SUCCESSFUL, finished=finished, progress=1.0, **_FREE
            ):
                return False
            self._store(connection, attempt.job_id, output, finished)
            return True

    def fail(self, attempt: Attempt, failure: JobFailure, output: JobOutput | None = None) -> bool:
        """Commit a failure for good, with what was computed all the same."""
        with self._db.writing() as connection:
            finished = self.now()
            changed = _change(
                connection,
                _guard(attempt),
                state=JobState.FAILED,
                finished=finished,
                error=failure.to_json(),
                **_FREE,
            )
            if changed and output is not None:
                self._store(connection, attempt.job_id, output, finished)
            return changed

    def lose(self, attempt: Attempt, reason: str) -> Recovered:
        """The attempt's worker died: the job waits again, or fails after its last attempt."""
        with self._db.writing() as connection:
            return _recover(connection, _guard(attempt), reason, self.now())

    def release(self, attempt: Attempt) -> bool:
        """Give an unfinished job back to the queue without costing it an attempt."""
        with self._db.writing() as connection:
            return _change(
                connection,
                _guard(attempt),
                state=JobState.ACCEPTED,
                attempt=attempt.attempt - 1,
                started=None,
                progress=0.0,
                points=0,
                **_FREE,
            )

    def dismiss(self, attempt: Attempt) -> bool:
        """The running job was stopped because its cancel was asked for."""
        with self._db.writing() as connection:
            return _change(
                connection, _guard(attempt), state=JobState.DISMISSED, finished=self.now(), **_FREE
            )

    def cancel(self, job_id: str) -> JobRow | None:
        """Ask for the end of a job: a waiting one is dismissed at once, a running one is marked."""
        with self._db.writing() as connection:
            waiting = and_(Job.id == job_id, Job.state == JobState.ACCEPTED)
            if not _change(
                connection, waiting, state=JobState.DISMISSED, cancel_requested=True, finished=self.now()
            ):
                running = and_(Job.id == job_id, Job.state == JobState.RUNNING)
                _change(connection, running, cancel_requested=True)
            return _one(connection, Job.id == job_id)

    def cancelled(self, owner: str) -> set[str]:
        """Ids of the jobs that `owner` runs and whose cancel was asked for, here or at another service."""
        query = select(Job.id).where(
            Job.state == JobState.RUNNING, Job.lease_owner == owner, Job.cancel_requested.is_(True)
        )
        with self._db.reading() as connection:
            return set(connection.execute(query).scalars())

    def recover_abandoned(self, owner: str) -> Recovered:
        """Take back what a dead owner left running, when `owner` starts.

        With SQLite's file locked there is no other service that could run them. On PostgreSQL there may be:
        a job is abandoned when its lease ran out.
        """
        if not self._db.exclusive:
            return self.recover_expired()
        with self._db.writing() as connection:
            condition = and_(Job.state == JobState.RUNNING, Job.lease_owner != owner)
            return _recover(connection, condition, "the service ended while the job ran", self.now())

    def recover_expired(self) -> Recovered:
        """Take back running jobs whose lease ran out; those that another service looks at are left to it."""
        with self._db.writing() as connection:
            condition = and_(Job.state == JobState.RUNNING, Job.lease_until < self.now())
            return _recover(
                connection, condition, "its owner gave no sign of life", self.now(), skip_locked=True
            )

    @staticmethod
    def _by_key(connection: Connection, new: NewJob) -> JobRow | None:
        if new.idempotency_key is None:
            return None
        known = _one(connection, and_(Job.owner == new.owner, Job.idempotency_key == new.idempotency_key))
        if known is not None and known.request_hash != new.request_hash:
            raise IdempotencyError(
                f"the Idempotency-Key {new.idempotency_key!r} was used for a different request, "
                f"job {known.id}: use a new key for a new request"
            )
        return known

    @staticmethod
    def _computed_before(connection: Connection, new: NewJob) -> str | None:
        query = (
            select(Job.id)
            .where(Job.spec_hash == new.spec_hash, Job.state == JobState.SUCCESSFUL, Job.result_of.is_(None))
            .order_by(Job.id.desc())
            .limit(1)
        )
        return connection.execute(query).scalar_one_or_none()

    @staticmethod
    def _require_room(connection: Connection, queue_limit: int) -> None:
        query = select(func.count()).select_from(Job).where(Job.state == JobState.ACCEPTED)
        waiting = connection.execute(query).scalar_one()
        if waiting >= queue_limit:
            raise QueueFullError(
                f"{waiting} jobs wait already, the queue takes {queue_limit}: try again later", retry_after=10
            )

    def _insert(self, connection: Connection, new: NewJob, source: str | None) -> str:
        now, job_id = self.now(), new_id()
        values = {
            field.name: getattr(new, field.name) for field in fields(NewJob) if field.name not in ("fresh",)
        }
        state = JobState.ACCEPTED
        if source is not None:
            state = JobState.SUCCESSFUL
            values |= {"result_of": source, "started": now, "finished": now, "progress": 1.0}
        connection.execute(insert(Job).values(id=job_id, state=state, created=now, **values))
        return job_id

    @staticmethod
    def _store(connection: Connection, job_id: str, output: JobOutput, created: datetime) -> None:
        connection.execute(insert(JobResult).values(job_id=job_id, body=output.result))
        insert_sweeps(connection, job_id, output.sweeps, created)
        if output.design is not None:
            insert_design(connection, job_id, output.design, created)


def _recover(
    connection: Connection,
    condition: ColumnElement[bool],
    reason: str,
    now: datetime,
    *,
    skip_locked: bool = False,
) -> Recovered:
    """Running jobs without an owner: dismissed if asked for, failed after the last attempt, else waiting.

    PostgreSQL locks the rows as it reads them, so that nobody changes them before they are written.
    """
    columns = (Job.id, Job.attempt, Job.max_attempts, Job.cancel_requested)
    query = select(*columns).where(condition).with_for_update(skip_locked=skip_locked)
    counts = dict.fromkeys(("accepted", "failed", "dismissed"), 0)
    for row in connection.execute(query).all():
        values: dict[str, Any] = {"state": JobState.ACCEPTED, "started": None, "progress": 0.0, "points": 0}
        if row.cancel_requested:
            values = {"state": JobState.DISMISSED, "finished": now}
        elif row.attempt >= row.max_attempts:
            failure = JobFailure(
                kind=FailureKind.WORKER_LOST,
                detail=f"{reason}, in attempt {row.attempt} of {row.max_attempts}; it is not tried again",
            )
            values = {"state": JobState.FAILED, "finished": now, "error": failure.to_json()}
        _change(connection, Job.id == row.id, **values, **_FREE)
        counts[values["state"].value] += 1
    return Recovered(**counts)
