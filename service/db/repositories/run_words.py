"""What is said of a run, written inside the transaction of another change, and whether it is in the bin."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, bindparam, delete, insert, select
from sqlalchemy.orm import InstrumentedAttribute

from service.db.models import ID_LENGTH, Project, Run
from service.db.repositories.rows import NO_WORDS, RunWords
from service.errors import InvalidRequestError
from solver.errors import Issue

_TABLES = Run.metadata.tables
_RUN, _TAG = _TABLES["run"], _TABLES["run_tag"]
_INSERT, _INSERT_TAGS = insert(_RUN), insert(_TAG)
# Locked until the run refers to it, so that it is not deleted for good in between.
_PROJECT = (
    select(Project.id)
    .where(Project.id == bindparam("project"), Project.owner == bindparam("owner"))
    .where(Project.deleted.is_(None))
    .with_for_update(read=True)
)


def in_the_bin(job_id: InstrumentedAttribute[str]) -> ColumnElement[bool]:
    """Whether the run of a job is in the bin; for rows with such a column."""
    table: Any = job_id.class_
    return select(Run.job_id).where(Run.job_id == job_id, Run.deleted.is_not(None)).correlate(table).exists()


def require_project(connection: Connection, project: str | None, owner: str | None) -> None:
    """Refuse a project that is not there.

    Raises
    ------
    InvalidRequestError
        If the owner has none of this id outside of the bin.
    """
    if project is None:
        return
    given = {"project": project[:ID_LENGTH], "owner": owner}
    if len(project) > ID_LENGTH or connection.execute(_PROJECT, given).one_or_none() is None:
        words = "must be the id of a project of the same owner, GET /v1/projects lists them"
        message = f"`project` {words}, got {project!r:.80}"
        raise InvalidRequestError([Issue(pointer="/project", message=message)])


def insert_words(connection: Connection, job_id: str, words: RunWords, now: datetime) -> None:
    """Write what is said of a job that was inserted just now, if anything is; see `require_project`."""
    if words == NO_WORDS:
        return
    about = {"job_id": job_id, "project_id": words.project, "name": words.name, "notes": words.notes}
    connection.execute(_INSERT, about | {"changed": now, "revision": 1, "deleted": None})
    put_tags(connection, job_id, words.tags)


def put_tags(connection: Connection, job_id: str, tags: tuple[str, ...]) -> None:
    """Mark a run with these words and no others."""
    connection.execute(delete(_TAG).where(_TAG.c.job_id == job_id))
    if tags:
        connection.execute(_INSERT_TAGS, [{"job_id": job_id, "tag": tag} for tag in tags])
