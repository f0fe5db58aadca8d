"""The leases of the jobs that a service runs, renewed all together."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import Connection, Select, Table, bindparam, select, update

from service.db.models import Job, JobState
from service.db.repositories.jobs.guards import OWNED, of_attempt
from service.db.repositories.rows import Attempt

_MOST = 5000
_JOB: Table = Job.metadata.tables["job"]
_C = _JOB.c
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
