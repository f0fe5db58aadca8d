"""What unfinished jobs keep for a later attempt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, bindparam, case, delete, insert, select

from service.db.engine import Database
from service.db.models import Checkpoint, Job
from service.db.repositories.rows import Attempt
from service.jobs.outputs import Piece

# Built once: it goes with the end of every job.
_DROP = delete(Checkpoint).where(Checkpoint.job_id == bindparam("job"))


def store_pieces(
    connection: Connection, attempt: Attempt, pieces: Sequence[Piece], created: datetime, *, anew: bool
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


def _pieces_of(connection: Connection, job_id: str) -> tuple[Piece, ...]:
    """The pieces of a job's checkpoint in their order."""
    query = select(Checkpoint.part, Checkpoint.sha256, Checkpoint.data)
    rows = connection.execute(query.where(Checkpoint.job_id == job_id).order_by(Checkpoint.part))
    return tuple(Piece(part=row.part, sha256=row.sha256, data=row.data) for row in rows)


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
