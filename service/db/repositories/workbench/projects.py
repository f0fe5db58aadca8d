"""The projects."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, fields
from typing import Any

from sqlalchemy import ColumnElement, func, insert, or_, select, update

from service.db.clock import Clock
from service.db.engine import Database
from service.db.repositories.workbench.rows import ProjectRow
from service.db.run_models import Project, Run
from service.errors import ChangedMeanwhileError, StorageFullError
from service.jobs.ids import new_id

_COLUMNS = [getattr(Project, item.name) for item in fields(ProjectRow) if item.name != "runs"]
# Of a page alone: an owner may have many runs.
_RUNS = (
    select(func.count()).where(Run.project_id == Project.id, Run.deleted.is_(None)).correlate(Project)
).scalar_subquery()
_SELECT = select(*_COLUMNS, _RUNS.label("runs"))


class ProjectRepository:
    """Projects of one database.

    Parameters
    ----------
    database : where they are.
    now : the clock of the database.
    """

    def __init__(self, database: Database, now: Clock) -> None:
        self._db = database
        self._now = now

    def add(self, owner: str, name: str, notes: str, most: int) -> ProjectRow:
        """Make a project.

        Raises
        ------
        StorageFullError
            The owner has `most`, with those in the bin.
        """
        held = select(func.count()).select_from(Project).where(Project.owner == owner)
        with self._db.writing() as connection:
            if connection.execute(held).scalar_one() >= most:
                raise StorageFullError(f"an owner may have {most} projects, with those in the bin")
            now = self._now()
            row = ProjectRow(
                id=new_id(), owner=owner, name=name, notes=notes, created=now, changed=now, revision=1
            )
            values = asdict(row)
            del values["runs"]
            connection.execute(insert(Project).values(**values))
            return row

    def get(self, project_id: str) -> ProjectRow | None:
        """The project, in the bin or not, or None."""
        with self._db.reading() as connection:
            row = connection.execute(_SELECT.where(Project.id == project_id)).mappings().one_or_none()
        return None if row is None else ProjectRow(**row)

    def page(
        self,
        limit: int,
        before: str | None = None,
        *,
        owner: str | None = None,
        text: str | None = None,
        deleted: bool = False,
    ) -> list[ProjectRow]:
        """Projects of an owner, or of everybody (None), newest first, older than the project `before`."""
        conditions: list[ColumnElement[bool]] = [
            Project.deleted.is_not(None) if deleted else Project.deleted.is_(None)
        ]
        if owner is not None:
            conditions.append(Project.owner == owner)
        if before is not None:
            conditions.append(Project.id < before)
        if text is not None:
            named = (one.icontains(text, autoescape=True) for one in (Project.name, Project.notes))
            conditions.append(or_(*named))
        query = _SELECT.where(*conditions).order_by(Project.id.desc()).limit(limit)
        with self._db.reading() as connection:
            return [ProjectRow(**row) for row in connection.execute(query).mappings()]

    def change(
        self, project_id: str, changes: Mapping[str, Any], expected: Collection[int] | None = None
    ) -> None:
        """Change `name`, `notes` or `deleted` of a project.

        Parameters
        ----------
        expected : the revisions of which it must have one; any if None.

        Raises
        ------
        ChangedMeanwhileError
            It has another one.
        """
        same = [Project.id == project_id]
        if expected is not None:
            same.append(Project.revision.in_(list(expected)))
        values = {**changes, "revision": Project.revision + 1, "changed": self._now()}
        with self._db.writing() as connection:
            changed = connection.execute(update(Project).where(*same).values(**values)).rowcount
        if expected is not None and not changed:
            raise ChangedMeanwhileError(
                f"project {project_id} was changed meanwhile: get it again, and change that"
            )
