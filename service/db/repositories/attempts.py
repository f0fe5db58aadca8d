"""Attempts at jobs: the guard of every change, leases, what is kept for a later one, jobs taken back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Select,
    Table,
    and_,
    bindparam,
    case,
    delete,
    insert,
    select,
    update,
)

from service.db.engine import Database
from service.db.models import Checkpoint, Job, JobState
from service.db.repositories.stored_rows import Attempt, RecoveredJobs
from service.jobs.outputs import FailureKind, JobFailure, ResultPiece

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
    with database.reading() as connection:
        saved = _pieces_of(connection, attempt.job_id)
    return replace(attempt, saved=saved) if saved else replace(attempt, progress=0.0, points=0)


def _pieces_of(connection: Connection, job_id: str) -> tuple[ResultPiece, ...]:
    """The pieces of a job's checkpoint in their order."""
    query = select(Checkpoint.part, Checkpoint.sha256, Checkpoint.data)
    rows = connection.execute(query.where(Checkpoint.job_id == job_id).order_by(Checkpoint.part))
    return tuple(ResultPiece(part=row.part, sha256=row.sha256, data=row.data) for row in rows)


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
    connection: Connection,
    condition: ColumnElement[bool],
    reason: str,
    now: datetime,
    parameters: Mapping[str, Any] | None = None,
    *,
    skip_locked: bool = False,
) -> RecoveredJobs:
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
