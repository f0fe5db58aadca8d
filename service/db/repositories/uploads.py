"""The uploaded files."""

from __future__ import annotations

from sqlalchemy import delete, select, update

from service.db.models import Upload
from service.db.repositories.owned import Rows
from service.errors import NotFoundError
from service.jobs.ids import new_id


class UploadRepository(Rows[Upload]):
    """Uploads of one database; what a stored one holds never changes."""

    table = Upload

    def add(
        self, *, owner: str, name: str, format: str, size: int, sha256: str, data: bytes
    ) -> tuple[Upload, bool]:
        """Store a file, or find the same one of the same owner and format; whether it was stored.

        One that is there already counts as new from now on: who sent it is about to use it.
        """
        same = (Upload.owner == owner, Upload.sha256 == sha256, Upload.format == format)
        with self._db.writing() as connection:
            now = self._now()
            for known in self._read(connection, self._select.where(*same).order_by(Upload.id).limit(1)):
                known.created = now
                connection.execute(update(Upload).where(Upload.id == known.id).values(created=now))
                return known, False
            row = Upload(
                id=new_id(), owner=owner, name=name, format=format, size=size, sha256=sha256, created=now
            )
            return self._insert(connection, row, data=data), True

    def page(self, limit: int, before: str | None = None, owner: str | None = None) -> list[Upload]:
        """Uploads, newest first, older than the upload `before`; only those of `owner` if given."""
        return self._newest(limit, before, owner)

    def data(self, upload_id: str) -> bytes:
        """The bytes of an upload (NotFoundError if it was deleted)."""
        with self._db.reading() as connection:
            data = connection.execute(select(Upload.data).where(Upload.id == upload_id)).scalar_one_or_none()
        if data is None:
            raise NotFoundError(f"there is no upload {upload_id!r}")
        return data

    def delete(self, upload_id: str) -> None:
        """Forget an upload."""
        self._updated(delete(Upload).where(Upload.id == upload_id))
