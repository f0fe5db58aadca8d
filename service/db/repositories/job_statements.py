"""The statements of the busy methods of `JobRepository`; building one costs more than running it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from sqlalchemy import Table, Text, Update, bindparam, cast, func, insert, select, update
from sqlalchemy.sql.elements import ColumnElement

from service.db.models import Job, JobResult, JobState
from service.db.repositories.attempts import OWNED
from service.db.repositories.run_repository import in_the_bin
from service.db.repositories.stored_rows import Attempt, JobRow, NewJob

_JOB: Table = Job.metadata.tables["job"]
_RESULT: Table = JobResult.metadata.tables["job_result"]
_C = _JOB.c

ROW = [item.name for item in fields(JobRow)]
NEW_COLUMNS = [item.name for item in fields(NewJob) if item.name not in ("fresh", "words")]
INITIAL: dict[str, Any] = {
    "state": JobState.ACCEPTED, "attempt": 0, "cancel_requested": False, "progress": 0.0, "points": 0,
    "best": None,
    "started": None, "finished": None, "result_of": None, "error": None,
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
    state=JobState.SUCCESSFUL,
    finished=bindparam("ended"),
    stored_bytes=_C.stored_bytes + bindparam("more"),
    progress=1.0,
    lease_owner=None,
    lease_until=None,
)
