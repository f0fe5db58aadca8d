"""The statements of the busy methods of `JobRepository`; building one costs more than running it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from sqlalchemy import Table, Update, bindparam, func, insert, select, update
from sqlalchemy.sql.elements import ColumnElement

from service.db.models import Job, JobResult, JobState
from service.db.repositories.guards import OWNED
from service.db.repositories.rows import Attempt, JobRow, NewJob

_JOB: Table = Job.metadata.tables["job"]
_RESULT: Table = JobResult.metadata.tables["job_result"]
_C = _JOB.c

ABOVE_ALL = 1_000_000
"""A priority above every one a job can have."""
ROW = [item.name for item in fields(JobRow)]
NEW_COLUMNS = [item.name for item in fields(NewJob) if item.name != "fresh"]
INITIAL: dict[str, Any] = {
    "state": JobState.ACCEPTED, "attempt": 0, "cancel_requested": False, "progress": 0.0, "points": 0,
    "started": None, "finished": None, "result_of": None, "error": None,
}  # fmt: skip
"""What a job begins with."""

INSERT_JOB = insert(_JOB)
INSERT_RESULT = insert(_RESULT)

BY_ID = select(*(_C[name] for name in ROW)).where(_C.id == bindparam("job"))
RESULT = select(_RESULT.c.body).where(_RESULT.c.job_id == bindparam("job"))

# Not ordered by the bare `id`: SQLite would walk all jobs of an owner by the index (owner, id).
COMPUTED_BEFORE = (
    select(_C.id)
    .where(_C.spec_hash == bindparam("hash"), _C.state == JobState.SUCCESSFUL, _C.result_of.is_(None))
    .where(_C.owner == bindparam("owner"))
    .order_by(_C.id.concat("").desc())
    .limit(1)
)

NEXT_PRIORITY = select(func.max(_C.priority)).where(
    _C.state == JobState.ACCEPTED, _C.priority < bindparam("below")
)
_NOT_OF_THE_ROW = ("job_id", "lease_owner", "saved")
_TAKEN = ["id", *(item.name for item in fields(Attempt) if item.name not in _NOT_OF_THE_ROW)]
NEXT_JOBS = (
    select(*(_C[name] for name in _TAKEN))
    .where(_C.state == JobState.ACCEPTED, _C.priority == bindparam("priority"))
    .order_by(_C.id)
    .limit(bindparam("most"))
    .with_for_update(skip_locked=True)
)
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
    progress=bindparam("fraction"), points=bindparam("counted"), lease_until=bindparam("until")
)
SUCCEED = _guarded(_C.cancel_requested.is_(False)).values(
    state=JobState.SUCCESSFUL,
    finished=bindparam("ended"),
    progress=1.0,
    lease_owner=None,
    lease_until=None,
)
