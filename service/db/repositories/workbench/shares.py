"""The links to runs that need no key."""

from __future__ import annotations

from dataclasses import asdict, fields

from sqlalchemy import delete, func, insert, select

from service.db.engine import Database
from service.db.repositories.workbench.rows import ShareRow
from service.db.run_models import Share
from service.errors import StorageFullError

_COLUMNS = [getattr(Share, item.name) for item in fields(ShareRow)]


class ShareRepository:
    """Links of one database."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add(self, row: ShareRow, most: int) -> None:
        """Store a link.

        Raises
        ------
        StorageFullError
            The run has `most`.
        """
        held = select(func.count()).select_from(Share).where(Share.job_id == row.job_id)
        with self._db.writing() as connection:
            if connection.execute(held).scalar_one() >= most:
                raise StorageFullError(f"a run may have {most} links: end one of run {row.job_id}")
            connection.execute(insert(Share).values(**asdict(row)))

    def get(self, share_id: str) -> ShareRow | None:
        """The link, or None."""
        with self._db.reading() as connection:
            row = connection.execute(select(*_COLUMNS).where(Share.id == share_id)).mappings().one_or_none()
        return None if row is None else ShareRow(**row)

    def of_run(self, job_id: str) -> list[ShareRow]:
        """The links to a run, oldest first."""
        query = select(*_COLUMNS).where(Share.job_id == job_id).order_by(Share.created, Share.id)
        with self._db.reading() as connection:
            return [ShareRow(**row) for row in connection.execute(query).mappings()]

    def delete(self, job_id: str, share_id: str) -> bool:
        """End a link to a run; whether there was one of this id."""
        with self._db.writing() as connection:
            statement = delete(Share).where(Share.id == share_id, Share.job_id == job_id)
            return connection.execute(statement).rowcount > 0
