"""The uploaded files."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from datetime import datetime

from sqlalchemy import delete, insert, select, update

from service.db.clock import utc_now
from service.db.engine import Database
from service.db.models import Upload
from service.errors import NotFoundError
from service.jobs.ids import new_id


@dataclass(frozen=True, slots=True, kw_only=True)
class UploadRow:
    """An upload without its bytes."""

    id: str
    owner: str
    name: str
    format: str
    size: int
    sha256: str
    created: datetime


_COLUMNS = [getattr(Upload, item.name) for item in fields(UploadRow)]


class UploadRepository:
    """Uploads of one database; what a stored one holds never changes."""

    def __init__(self, database: Database) -> None:
        self._db = database

    def add(
        self, *, owner: str, name: str, format: str, size: int, sha256: str, data: bytes
    ) -> tuple[UploadRow, bool]:
        """Store a file, or find the same one of the same owner and format; whether it was stored.

        One that is there already counts as new from now on: who sent it is about to use it.
        """
        same = (Upload.owner == owner, Upload.sha256 == sha256, Upload.format == format)
        query = select(*_COLUMNS).where(*same).order_by(Upload.id).limit(1)
        with self._db.writing() as connection:
            known = connection.execute(query).mappings().one_or_none()
            now = utc_now()
            if known is not None:
                connection.execute(update(Upload).where(Upload.id == known["id"]).values(created=now))
                return UploadRow(**{**known, "created": now}), False
            row = UploadRow(
                id=new_id(), owner=owner, name=name, format=format, size=size, sha256=sha256, created=now
            )
            connection.execute(insert(Upload).values(**asdict(row), data=data))
            return row, True

    def get(self, upload_id: str) -> UploadRow | None:
        """The upload, or None."""
        query = select(*_COLUMNS).where(Upload.id == upload_id)
        with self._db.reading() as connection:
            row = connection.execute(query).mappings().one_or_none()
        return None if row is None else UploadRow(**row)

    def data(self, upload_id: str) -> bytes:
        """The bytes of an upload.

        Raises
        ------
        NotFoundError
            If it was deleted.
        """
        with self._db.reading() as connection:
            data = connection.execute(select(Upload.data).where(Upload.id == upload_id)).scalar_one_or_none()
        if data is None:
            raise NotFoundError(f"there is no upload {upload_id!r}")
        return data

    def page(self, limit: int, before: str | None = None, owner: str | None = None) -> list[UploadRow]:
        """Uploads, newest first, older than the upload `before`; only those of `owner` if given."""
        query = select(*_COLUMNS).order_by(Upload.id.desc()).limit(limit)
        if before is not None:
            query = query.where(Upload.id < before)
        if owner is not None:
            query = query.where(Upload.owner == owner)
        with self._db.reading() as connection:
            return [UploadRow(**row) for row in connection.execute(query).mappings()]

    def delete(self, upload_id: str) -> None:
        """Forget an upload."""
        with self._db.writing() as connection:
            connection.execute(delete(Upload).where(Upload.id == upload_id))
