"""Attempts at jobs: the guard of every change, leases, what is kept for a later one, jobs taken back.

The statements of the busy methods of `JobRepository` stand here too: building one costs more than running it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Select,
    Table,
    Text,
    Update,
    and_,
    bindparam,
    case,
    cast,
    delete,
    func,
    insert,
    select,
    update,
)

from service.db.engine import Database
from service.db.models import NOBODY, Checkpoint, Job, JobResult, JobState
from service.db.repositories.run_repository import NO_WORDS, JobRow, RunWords, in_the_bin
from service.jobs.outputs import FailureKind, JobFailure, ResultPiece
from service.jobs.strict_json import JsonText


@dataclass(frozen=True, slots=True, kw_only=True)
class NewJob:
    """A job to be inserted."""

    kind: str
    request: dict[str, Any]
    spec: dict[str, Any] | JsonText
    spec_hash: str
    request_hash: str
    max_attempts: int
    scene_name: str | None = None
    scene_hash: str | None = None
    priority: int = 0
    fresh: bool = False
    idempotency_key: str | None = None
    owner: str = NOBODY
    seconds_limit: float | None = None
    words: RunWords = NO_WORDS
    trace: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """One attempt at a job: what a worker needs, and what guards the write of its outcome.

    Attributes
    ----------
    created : when its job was handed in.
    spec_hash : digest of what is computed, to which its checkpoints belong.
    seconds_limit : longest time it may take [s], if the job has a limit of its own.
    trace : the `traceparent` it is part of, if there are traces.
    progress, points : how far earlier attempts got, as far as `saved` goes; 0 without it.
    saved : what they kept.
    """

    job_id: str
    kind: str
    spec: dict[str, Any]
    attempt: int
    max_attempts: int
    lease_owner: str
    created: datetime
    spec_hash: str = ""
    owner: str = NOBODY
    seconds_limit: float | None = None
    trace: str | None = None
    progress: float = 0.0
    points: int = 0
    saved: tuple[ResultPiece, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveredJobs:
    """What became of running jobs whose owner is gone."""

    accepted: int = 0
    failed: int = 0
    dismissed: int = 0

    @property
    def total(self) -> int:
        """All of them."""
        return self.accepted + self.failed + self.dismissed


# Built once: it goes with the end of every job.
_DROP = delete(Checkpoint).where(Checkpoint.job_id == bindparam("job"))


def store_pieces(
    connection: Connection, attempt: Attempt, pieces: Sequence[ResultPiece], created: datetime, *, anew: bool
) -> None:
    """Add pieces to a job's checkpoint, or put them in place of it; its row is guarded by the caller."""
    condition = Checkpoint.job_id == attempt.job_id
    if not anew:
        condition &= Checkpoint.part.in_([piece.part for piece in pieces])
    connection.execute(delete(Checkpoint).where(condition))
    about = {"job_id": attempt.job_id, "attempt": attempt.attempt, "created": created}
    rows = [about | {"part": p.part, "sha256": p.sha256, "data": p.data} for p in pieces]
    if rows:
        connection.execute(insert(Checkpoint), rows)


def with_what_was_kept(database: Database, attempt: Attempt) -> Attempt:
    """The attempt with the checkpoint of those before.

    Its checksums are compared by who uses the pieces (`service.jobs.checkpoints.unpacked`): that finds what
    was damaged here and what was damaged on the way, and the thread that hands out jobs is not held up by the
    digest of a quarter of a gigabyte.
    """
    query = select(Checkpoint.part, Checkpoint.sha256, Checkpoint.data)
    query = query.where(Checkpoint.job_id == attempt.job_id).order_by(Checkpoint.part)
    with database.reading() as connection:
        saved = tuple(ResultPiece(**row) for row in connection.execute(query).mappings())
    return replace(attempt, saved=saved) if saved else replace(attempt, progress=0.0, points=0)


def drop_checkpoint(connection: Connection, job_id: str) -> None:
    """The job ended: what it kept for later attempts goes."""
    connection.execute(_DROP, {"job": job_id})


def as_far_as_kept() -> dict[str, Any]:
    """Progress and points of a job that goes back to the queue: as they are with a checkpoint, else 0."""
    kept: ColumnElement[bool] = (
        select(Checkpoint.part).where(Checkpoint.job_id == Job.id).correlate(Job).exists()
    )
    return {
        "progress": case((kept, Job.progress), else_=0.0),
        "points": case((kept, Job.points), else_=0),
        "best": None,
    }


_JOB: Table = Job.metadata.tables["job"]
_C = _JOB.c

# With parameters in place of values, so that statements are built once; `of_attempt` gives their values.
OWNED: ColumnElement[bool] = and_(
    _C.id == bindparam("job"),
    _C.attempt == bindparam("number"),
    _C.lease_owner == bindparam("holder"),
    _C.state == JobState.RUNNING,
)


def of_attempt(attempt: Attempt) -> dict[str, Any]:
    """The parameters of OWNED for an attempt."""
    return {"job": attempt.job_id, "number": attempt.attempt, "holder": attempt.lease_owner}


def change_owned(connection: Connection, attempt: Attempt, /, **values: Any) -> bool:
    """Change the attempt's row if the attempt owns it; whether it did."""
    statement = update(_JOB).where(OWNED).values(**values)
    return connection.execute(statement, of_attempt(attempt)).rowcount > 0


_MOST = 5000
_HELD = select(_C.id, _C.attempt, _C.lease_owner).where(
    _C.id.in_(bindparam("jobs", expanding=True)), _C.state == JobState.RUNNING
)
_LOCK = _HELD.with_for_update(skip_locked=True)
_RENEW = update(_JOB).where(OWNED).values(lease_until=bindparam("until"))


def renew(connection: Connection, attempts: Sequence[Attempt], until: datetime) -> list[Attempt]:
    """Renew the leases of attempts; gives back those that own their job no more.

    Rows that another transaction is about to change are left to it and to the next time: to wait for them in
    the midst of so many rows would be a deadlock with every transaction that changes two of them.
    """
    lost: list[Attempt] = []
    for begin in range(0, len(attempts), _MOST):
        lost += _renew(connection, attempts[begin : begin + _MOST], until)
    return lost


def _renew(connection: Connection, attempts: Sequence[Attempt], until: datetime) -> list[Attempt]:
    locked = _held(connection, _LOCK, attempts)
    if locked:
        connection.execute(_RENEW, [of_attempt(attempt) | {"until": until} for attempt in locked])
    renewed = {id(attempt) for attempt in locked}
    left = [attempt for attempt in attempts if id(attempt) not in renewed]
    held = {id(attempt) for attempt in _held(connection, _HELD, left)} if left else set()
    return [attempt for attempt in left if id(attempt) not in held]


def _held(connection: Connection, query: Select[Any], attempts: Sequence[Attempt]) -> list[Attempt]:
    """Those of the attempts whose rows `query` finds as theirs."""
    rows = connection.execute(query, {"jobs": [attempt.job_id for attempt in attempts]})
    found = {row.id: (row.attempt, row.lease_owner) for row in rows}
    return [
        attempt for attempt in attempts if found.get(attempt.job_id) == (attempt.attempt, attempt.lease_owner)
    ]


FREE: dict[str, Any] = {"lease_owner": None, "lease_until": None}


def change(connection: Connection, condition: ColumnElement[bool], **values: Any) -> bool:
    """Update the rows of `condition`; whether there was one."""
    return connection.execute(update(Job).where(condition).values(**values)).rowcount > 0


def recover(
    connection: Connection, condition: ColumnElement[bool], reason: str, now: datetime,
    parameters: Mapping[str, Any] | None = None, *, skip_locked: bool = False,
) -> RecoveredJobs:  # fmt: skip
    """Running jobs without an owner: dismissed if asked for, failed after the last attempt, else waiting.

    PostgreSQL locks the rows as it reads them, so that nobody changes them before they are written.
    """
    columns = (Job.id, Job.attempt, Job.max_attempts, Job.cancel_requested)
    query = select(*columns).where(condition).with_for_update(skip_locked=skip_locked)
    counts = dict.fromkeys(("accepted", "failed", "dismissed"), 0)
    for row in connection.execute(query, parameters).all():
        values: dict[str, Any] = {"state": JobState.ACCEPTED, "started": None, **as_far_as_kept()}
        if row.cancel_requested:
            values = {"state": JobState.DISMISSED, "finished": now}
        elif row.attempt >= row.max_attempts:
            failure = JobFailure(
                kind=FailureKind.WORKER_LOST,
                detail=f"{reason}, in attempt {row.attempt} of {row.max_attempts}; it is not tried again",
            )
            values = {"state": JobState.FAILED, "finished": now, "error": failure.to_json()}
        change(connection, Job.id == row.id, **values, **FREE)
        if values["state"].finished:
            drop_checkpoint(connection, row.id)
        counts[values["state"].value] += 1
    return RecoveredJobs(**counts)


_RESULT: Table = JobResult.metadata.tables["job_result"]

ROW = [item.name for item in fields(JobRow)]
NEW_COLUMNS = [item.name for item in fields(NewJob) if item.name not in ("fresh", "words")]
INITIAL: dict[str, Any] = {
    "state": JobState.ACCEPTED, "attempt": 0, "cancel_requested": False, "progress": 0.0, "points": 0,
    "best": None, "started": None, "finished": None, "result_of": None, "error": None,
}  # fmt: skip
"""What a job begins with."""

INSERT_JOB = insert(_JOB)
INSERT_RESULT = insert(_RESULT)

BY_ID = select(*(_C[name] for name in ROW)).where(_C.id == bindparam("job"))
SEVERAL = select(*(_C[name] for name in ROW)).where(_C.id.in_(bindparam("jobs", expanding=True)))
SCENE = select(_C.scene_name, _C.scene_hash).where(_C.id == bindparam("job"))
RESULT = select(_RESULT.c.body).where(_RESULT.c.job_id == bindparam("job"))
FIGURES = select(_RESULT.c.figures).where(_RESULT.c.job_id == bindparam("job"))
RESULT_TEXT = select(cast(_RESULT.c.body, Text)).where(_RESULT.c.job_id == bindparam("job"))
ADD_STORED = (
    update(_JOB).where(_C.id == bindparam("job")).values(stored_bytes=_C.stored_bytes + bindparam("more"))
)

# Not ordered by the bare `id`: SQLite would walk all jobs of an owner by the index (owner, id).
COMPUTED_BEFORE = (
    select(_C.id)
    .where(_C.spec_hash == bindparam("hash"), _C.state == JobState.SUCCESSFUL, _C.result_of.is_(None))
    .where(_C.owner == bindparam("owner"), ~in_the_bin(Job.id))
    .order_by(_C.id.concat("").desc())
    .limit(1)
)

_FIRST = select(func.min(_C.id)).where(_C.state == JobState.ACCEPTED).scalar_subquery()
OLDEST_WAITING = select(_C.created).where(_C.id == _FIRST)

_NOT_OF_THE_ROW = ("job_id", "lease_owner", "saved")
TAKEN = ["id", *(item.name for item in fields(Attempt) if item.name not in _NOT_OF_THE_ROW)]
"""What of a waiting job makes an attempt."""
TAKE = (
    update(_JOB)
    .where(_C.id == bindparam("job"), _C.state == JobState.ACCEPTED)
    .values(
        state=JobState.RUNNING,
        attempt=bindparam("number"),
        lease_owner=bindparam("holder"),
        lease_until=bindparam("until"),
        started=bindparam("begun"),
    )
)


def _guarded(*conditions: ColumnElement[bool]) -> Update:
    """A change of the row of an attempt that still owns it."""
    return update(_JOB).where(OWNED, *conditions)


REPORT = _guarded().values(
    progress=bindparam("fraction"),
    points=bindparam("counted"),
    best=bindparam("told", type_=_C.best.type),
    lease_until=bindparam("until"),
)
SUCCEED = _guarded(_C.cancel_requested.is_(False)).values(
    state=JobState.SUCCESSFUL, finished=bindparam("ended"),
    stored_bytes=_C.stored_bytes + bindparam("more"), progress=1.0, lease_owner=None, lease_until=None,
)  # fmt: skip
