"""The leases by which attempts own their jobs: the guard of every change, renewal, jobs taken back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, Table, and_, bindparam, select, update

from service.db.models import Job, JobState
from service.db.repositories.jobs.checkpoints import as_far_as_kept, drop_checkpoint
from service.db.repositories.rows import Attempt, Recovered
from service.jobs.outputs import FailureKind, JobFailure

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
) -> Recovered:
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
    return Recovered(**counts)
