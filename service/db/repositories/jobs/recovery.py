"""Jobs taken back from attempts that have no owner any more, and the change of rows all transitions are."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, select, update

from service.db.models import Job, JobState
from service.db.repositories.jobs.checkpoints import as_far_as_kept, drop_checkpoint
from service.db.repositories.rows import Recovered
from service.jobs.outputs import FailureKind, JobFailure

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
