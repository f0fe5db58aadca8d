"""The one condition under which the row of a running job is changed: its attempt still owns it."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Connection, Table, and_, bindparam, update

from service.db.models import Job, JobState
from service.db.repositories.rows import Attempt

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
