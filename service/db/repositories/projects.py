"""The projects."""

from __future__ import annotations

from sqlalchemy import ColumnElement, or_

from service.db.repositories.owned import Binned, Rows
from service.db.run_models import Project
from service.jobs.ids import new_id

MOST_PROJECTS = 1000


class Projects(Binned[Project], Rows[Project]):
    """Projects of one database; a project in the bin keeps its runs."""

    what, table, said = "project", Project, Project

    def add(self, owner: str, name: str, notes: str, most: int = MOST_PROJECTS) -> Project:
        """Make a project (StorageFullError if the owner has `most`, with those in the bin)."""
        now = self._now()
        with self._db.writing() as connection:
            words = f"an owner may have {most} projects, with those in the bin"
            self._require_room(connection, Project.owner == owner, most, words)
            row = Project(
                id=new_id(), owner=owner, name=name, notes=notes, created=now, changed=now, revision=1, runs=0
            )
            return self._insert(connection, row)

    def page(
        self,
        limit: int,
        before: str | None = None,
        *,
        owner: str | None = None,
        text: str | None = None,
        deleted: bool = False,
    ) -> list[Project]:
        """Projects of an owner, or of everybody (None), newest first, older than the project `before`."""
        holds: list[ColumnElement[bool]] = [
            Project.deleted.is_not(None) if deleted else Project.deleted.is_(None)
        ]
        if text is not None:
            named = (one.icontains(text, autoescape=True) for one in (Project.name, Project.notes))
            holds.append(or_(*named))
        return self._newest(limit, before, owner, *holds)
