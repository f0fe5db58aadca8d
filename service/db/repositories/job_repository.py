"""The jobs, which are the queue."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Executable, and_, func, select

from service.db.clock import Clock, SharedClock, new_id, utc_now
from service.db.engine import Database
from service.db.models import NOBODY, Job, JobState
from service.db.pagination import met, owner_condition, plain_conditions
from service.db.repositories import attempts
from service.db.repositories.attempts import (
    FREE,
    OWNED,
    Attempt,
    NewJob,
    RecoveredJobs,
    as_far_as_kept,
    change,
    change_owned,
    drop_checkpoint,
    of_attempt,
    recover,
    renew,
    store_pieces,
    with_what_was_kept,
)
from service.db.repositories.result_repository import insert_results
from service.db.repositories.run_repository import JobRow, in_the_bin, insert_words, require_project
from service.db.repositories.waiting import Room, Turns, require_share
from service.errors import IdempotencyError
from service.jobs.outputs import Best, JobFailure, JobOutput, ResultPiece
from service.jobs.stored_figures import alone
from service.jobs.strict_json import JsonText, encoded

__all__ = ["Attempt", "JobRepository", "JobRow", "NewJob", "RecoveredJobs"]

# Of the table itself: SQLAlchemy compares those of mapped classes at each answer, a quarter of a list's time.
_COLUMNS = [Job.__table__.c[field.name] for field in fields(JobRow)]
_LISTED = [column for column in _COLUMNS if column.name != "request"]


def _guarded(connection: Connection, statement: Executable, attempt: Attempt, values: dict[str, Any]) -> bool:
    """Execute a guarded change of the attempt's row; whether the attempt owned it."""
    return connection.execute(statement, of_attempt(attempt) | values).rowcount > 0


def _text_of(output: JobOutput) -> JsonText:
    """The result as it is stored."""
    return encoded(output.result) if output.encoded is None else JsonText(output.encoded)


def _bytes_of(output: JobOutput) -> int:
    """What a result and the arrays of its sweeps take."""
    arrays = (array for one in output.sweeps for array in one.arrays.values())
    return len(_text_of(output).encode()) + sum(len(array.data) for array in arrays)


def _attempt(row: Any, owner: str) -> Attempt:
    """The attempt that begins with a row as it waited."""
    values = row._asdict()
    job_id, number = values.pop("id"), values.pop("attempt") + 1
    return Attempt(job_id=job_id, attempt=number, lease_owner=owner, **values)


def _one(connection: Connection, condition: ColumnElement[bool]) -> JobRow | None:
    query = select(*_COLUMNS).where(condition).order_by(Job.id.desc()).limit(1)
    row = connection.execute(query).mappings().one_or_none()
    return None if row is None else JobRow(**row)


class JobRepository:
    """Jobs of one database.

    Parameters
    ----------
    database : where they are.
    now : the clock that leases and times are read from: by default that of this machine where one service has
        the database for itself, that of the server where several share it.
    """

    def __init__(self, database: Database, now: Clock | None = None) -> None:
        self._db = database
        self.now: Clock = now or (utc_now if database.exclusive else SharedClock(database.time))
        self._room = Room()
        self._turns = Turns()

    def submit(self, new: NewJob, queue_limit: int, waiting_limit: int | None = None) -> tuple[JobRow, bool]:
        """Insert a job, or find the one this request made before; whether it was inserted.

        A job whose spec was computed before, and which is not `fresh`, is inserted as successful with
        `result_of` naming the job that has the result.

        Raises
        ------
        IdempotencyError
            The key was used for a different request.
        QueueFullError
            `queue_limit` jobs wait already.
        TooManyRequestsError
            `waiting_limit` jobs of this owner wait already.
        InvalidRequestError
            The owner has no such project.
        """
        return self._db.written(lambda connection: self._submit(connection, new, queue_limit, waiting_limit))

    def _submit(
        self, connection: Connection, new: NewJob, queue_limit: int, waiting_limit: int | None
    ) -> tuple[JobRow, bool]:
        known = self._by_key(connection, new)
        if known is not None:
            return known, False
        # Before anything is written: what others do in the same transaction is kept if this is refused.
        require_project(connection, new.words.project, new.owner)
        source, same = None, {"hash": new.spec_hash, "owner": new.owner}
        if not new.fresh:
            source = connection.execute(attempts.COMPUTED_BEFORE, same).scalar_one_or_none()
        if source is None:
            if waiting_limit is not None:
                require_share(connection, new.owner, waiting_limit)
            self._room.require(connection, queue_limit)
        return self._insert(connection, new, source), True

    def keep_time(self) -> None:
        """Look at the server's clock, if that is the one."""
        if isinstance(self.now, SharedClock):
            self.now.look()

    def get(self, job_id: str) -> JobRow | None:
        """The job, or None."""
        with self._db.looking() as connection:
            row = connection.execute(attempts.BY_ID, {"job": job_id}).mappings().one_or_none()
        return None if row is None else JobRow(**row)

    def several(self, job_ids: Sequence[str]) -> dict[str, JobRow]:
        """Those of the jobs that there are, by id."""
        with self._db.looking() as connection:
            rows = connection.execute(attempts.SEVERAL, {"jobs": job_ids}).mappings()
            return {row["id"]: JobRow(**row) for row in rows}

    def page(
        self, limit: int = 100, before: str | None = None, *, owner: str | None = NOBODY,
        state: JobState | None = None, kind: str | None = None, scene: str | None = None,
    ) -> list[JobRow]:  # fmt: skip
        """Jobs outside of the bin, of an owner or of everybody (None), newest first, older than `before`."""
        query = select(*_LISTED).where(~in_the_bin(Job.id)).order_by(Job.id.desc()).limit(limit)
        if before is not None:
            query = query.where(Job.id < before)
        equal = ((Job.state, state), (Job.kind, kind), (Job.scene_name, scene))
        conditions = plain_conditions(
            Job.id, [column == value for column, value in equal if value is not None]
        )
        leads = kind is None and scene is None
        with self._db.reading() as connection:
            conditions += owner_condition(connection, Job.id, Job.owner, owner, leads=leads)
            query = met(connection, query, Job.id, conditions)
            return [JobRow(**row) for row in connection.execute(query).mappings()]

    def result(self, job_id: str) -> dict[str, Any] | None:
        """The result of a job, or None if it has none."""
        with self._db.looking() as connection:
            return connection.execute(attempts.RESULT, {"job": job_id}).scalar_one_or_none()

    def result_text(self, job_id: str) -> str | None:
        """The result of a job as its JSON, None if it has none."""
        with self._db.looking() as connection:
            return connection.execute(attempts.RESULT_TEXT, {"job": job_id}).scalar_one_or_none()

    def figures(self, job_id: str) -> dict[str, Any]:
        """What of the result of a job is compared with another's; empty if it has none."""
        with self._db.looking() as connection:
            row = connection.execute(attempts.FIGURES, {"job": job_id}).one_or_none()
        if row is None:
            return {}
        # Of a result that an earlier version stored.
        return alone(self.result(job_id) or {}) if row.figures is None else dict(row.figures)

    def spec(self, job_id: str) -> dict[str, Any]:
        """What a job computes; empty if there is none of this id."""
        with self._db.reading() as connection:
            found: dict[str, Any] | None = connection.execute(
                select(Job.spec).where(Job.id == job_id)
            ).scalar_one_or_none()
        return found or {}

    def count(self) -> dict[JobState, int]:
        """How many jobs are in each state."""
        query = select(Job.state, func.count().label("number")).group_by(Job.state)
        with self._db.reading() as connection:
            found = {row.state: row.number for row in connection.execute(query)}
        return {state: found.get(state, 0) for state in JobState}

    def oldest_waiting(self) -> datetime | None:
        """When the job was handed in that waits for longest, None if none waits; ids ascend with time."""
        with self._db.looking() as connection:
            return connection.execute(attempts.OLDEST_WAITING).scalar_one_or_none()

    def claim(self, owner: str, lease_until: datetime) -> Attempt | None:
        """Take the next waiting job for `owner`; None if none waits."""
        return next(iter(self.claim_several(owner, lease_until, 1)), None)

    def claim_several(self, owner: str, lease_until: datetime, most: int) -> list[Attempt]:
        """Take the next waiting jobs for `owner`, in the order in which they are to run."""
        taken = self._db.written(lambda connection: self._claim(connection, owner, lease_until, most))
        return [with_what_was_kept(self._db, attempt) if attempt.points else attempt for attempt in taken]

    def _claim(self, connection: Connection, owner: str, lease_until: datetime, most: int) -> list[Attempt]:
        found = self._turns.next_jobs(connection, most)
        if not found:
            return []
        taken = {"holder": owner, "until": lease_until, "begun": self.now()}
        changes = [{"job": row.id, "number": row.attempt + 1, **taken} for row in found]
        connection.execute(attempts.TAKE, changes)
        return [_attempt(row, owner) for row in found]

    def report(
        self, attempt: Attempt, fraction: float, points: int, lease_until: datetime, best: Best | None = None
    ) -> bool:
        """Write progress and renew the lease; False if the attempt owns the job no more.

        In a transaction of its own: of two that each told of one job and concluded the other's, PostgreSQL
        would have to end one.
        """
        values = {"fraction": fraction, "counted": points, "until": lease_until, "told": best}
        with self._db.writing() as connection:
            return _guarded(connection, attempts.REPORT, attempt, values)

    def keep(
        self, attempt: Attempt, pieces: Sequence[ResultPiece], fraction: float, points: int,
        lease_until: datetime, *, anew: bool = False,
    ) -> bool:  # fmt: skip
        """Store pieces for a later attempt, with progress and lease; False if the job is owned no more.

        A waiting job with points is one with a checkpoint: there is at least one point then.
        """
        values = {"fraction": fraction, "counted": max(points, 1), "until": lease_until, "told": None}
        with self._db.writing() as connection:
            owned = _guarded(connection, attempts.REPORT, attempt, values)
            if owned:
                store_pieces(connection, attempt, pieces, self.now(), anew=anew)
            return owned

    def renew(self, attempts: Iterable[Attempt], lease_until: datetime) -> list[Attempt]:
        """Renew the leases; gives back the attempts that own their job no more."""
        with self._db.writing() as connection:
            return renew(connection, list(attempts), lease_until)

    def succeed(self, attempt: Attempt, output: JobOutput) -> bool:
        """Commit state, result and sweeps together, unless the job was lost or its cancel asked for."""
        finished = self.now()
        values = {"ended": finished, "more": _bytes_of(output)}
        placed = self._placed(attempt, output)

        def write(connection: Connection) -> bool:
            if not _guarded(connection, attempts.SUCCEED, attempt, values):
                return False
            drop_checkpoint(connection, attempt.job_id)
            self._store(connection, attempt, placed, finished)
            return True

        return self._db.written(write)

    def fail(self, attempt: Attempt, failure: JobFailure, output: JobOutput | None = None) -> bool:
        """Commit a failure for good, with what was computed all the same."""
        placed = None if output is None else self._placed(attempt, output)
        with self._db.writing() as connection:
            finished = self.now()
            changed = change_owned(
                connection, attempt, state=JobState.FAILED, finished=finished, error=failure.to_json(), **FREE
            )
            if changed:
                drop_checkpoint(connection, attempt.job_id)
            if changed and output is not None and placed is not None:
                more = {"job": attempt.job_id, "more": _bytes_of(output)}
                connection.execute(attempts.ADD_STORED, more)
                self._store(connection, attempt, placed, finished)
            return changed

    def lose(self, attempt: Attempt, reason: str) -> RecoveredJobs:
        """The attempt's worker died: the job waits again, or fails after its last attempt."""
        with self._db.writing() as connection:
            return recover(connection, OWNED, reason, self.now(), of_attempt(attempt))

    def release(self, attempt: Attempt) -> bool:
        """Give an unfinished job back to the queue, with its checkpoint, without costing it an attempt."""
        with self._db.writing() as connection:
            return change_owned(
                connection, attempt, state=JobState.ACCEPTED, attempt=attempt.attempt - 1, started=None,
                **as_far_as_kept(), **FREE,
            )  # fmt: skip

    def dismiss(self, attempt: Attempt) -> bool:
        """The running job was stopped because its cancel was asked for."""
        with self._db.writing() as connection:
            dismissed = change_owned(
                connection, attempt, state=JobState.DISMISSED, finished=self.now(), **FREE
            )
            if dismissed:
                drop_checkpoint(connection, attempt.job_id)
            return dismissed

    def cancel(self, job_id: str) -> JobRow | None:
        """Ask for the end of a job: a waiting one is dismissed at once, a running one is marked."""
        with self._db.writing() as connection:
            waiting = and_(Job.id == job_id, Job.state == JobState.ACCEPTED)
            if change(
                connection, waiting, state=JobState.DISMISSED, cancel_requested=True, finished=self.now()
            ):
                drop_checkpoint(connection, job_id)
            else:
                running = and_(Job.id == job_id, Job.state == JobState.RUNNING)
                change(connection, running, cancel_requested=True)
            return _one(connection, Job.id == job_id)

    def cancelled(self, owner: str) -> set[str]:
        """Ids of the jobs that `owner` runs and whose cancel was asked for, here or at another service."""
        query = select(Job.id).where(
            Job.state == JobState.RUNNING, Job.lease_owner == owner, Job.cancel_requested.is_(True)
        )
        with self._db.reading() as connection:
            return set(connection.execute(query).scalars())

    def recover_abandoned(self, owner: str) -> RecoveredJobs:
        """Take back what a dead owner left running, when `owner` starts.

        With SQLite's file locked there is no other service that could run them. On PostgreSQL there may be:
        a job is abandoned when its lease ran out.
        """
        if not self._db.exclusive:
            return self.recover_expired()
        with self._db.writing() as connection:
            condition = and_(Job.state == JobState.RUNNING, Job.lease_owner != owner)
            return recover(connection, condition, "the service ended while the job ran", self.now())

    def recover_expired(self, running_here: Iterable[str] = ()) -> RecoveredJobs:
        """Take back running jobs whose lease ran out; those that another service looks at are left to it.

        Those that run here are kept, whatever a clock that was set says of their leases.
        """
        with self._db.writing() as connection:
            condition = and_(
                Job.state == JobState.RUNNING, Job.lease_until < self.now(), Job.id.not_in(list(running_here))
            )
            return recover(
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

    def _insert(self, connection: Connection, new: NewJob, source: str | None) -> JobRow:
        """Insert a job; its row is what was written, not read again."""
        now = self.now()
        values = {name: getattr(new, name) for name in attempts.NEW_COLUMNS}
        values |= {"id": new_id(), "created": now, "result_of": source, "state": JobState.ACCEPTED}
        if source is not None:
            values |= {"state": JobState.SUCCESSFUL, "started": now, "finished": now, "progress": 1.0}
        written: dict[str, Any] = attempts.INITIAL | values
        request, spec = encoded(new.request), encoded(new.spec)
        stored = {"request": request, "spec": spec, "stored_bytes": len(request) + len(spec)}
        connection.execute(attempts.INSERT_JOB, written | stored)
        insert_words(connection, written["id"], new.words, now)
        return JobRow(**{name: written[name] for name in attempts.ROW})

    def _placed(self, attempt: Attempt, output: JobOutput) -> JobOutput:
        """The output with its large arrays outside of the database, if that is where they belong.

        If the row is not written after all, they stay for the attempt that writes it, and go with the job.
        """
        store = self._db.arrays
        if store is None:
            return output
        sweeps = (
            (one, {name: store.put(attempt.job_id, array) for name, array in one.arrays.items()})
            for one in output.sweeps
        )
        return replace(output, sweeps=tuple(replace(one, arrays=arrays) for one, arrays in sweeps))

    @staticmethod
    def _store(connection: Connection, attempt: Attempt, output: JobOutput, created: datetime) -> None:
        job_id, owner = attempt.job_id, attempt.owner
        body = _text_of(output)
        text = body.encode()
        written = {
            "job_id": job_id, "body": body, "sha256": hashlib.sha256(text).hexdigest(),
            "figures": encoded(output.alone or alone(output.result)),
        }  # fmt: skip
        connection.execute(attempts.INSERT_RESULT, written)
        insert_results(connection, job_id, output.sweeps, created, owner)
        about = connection.execute(attempts.SCENE, {"job": job_id}).one()
        insert_results(connection, job_id, output.records(attempt.kind, *about), created, owner)
