"""What uploads hold: files in a folder beside a file of SQLite, pieces in a PostgreSQL, which services share.

It is there before the row of its upload and goes after it, outside of the row's transaction: a crash leaves
something too much and never too little, and `UploadFiles.sweep` removes that.
"""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from datetime import datetime, timedelta
from functools import partial
from itertools import count
from pathlib import Path

from sqlalchemy import Connection, delete, insert, select

from service.db.clock import earliest_id
from service.db.engine import database_path, files_beside, is_sqlite
from service.db.lock import try_lock
from service.db.models import Upload, UploadPiece
from service.errors import DatabaseAwayError, NotFoundError

PIECE_BYTES = 1 << 20
WORK = "stickslip-work-"
"""Begins the names of folders that `UploadFiles.work` makes."""
_HELD = "held"
"""A file in each of them, which is locked as long as who made it lives."""
_LEFT = timedelta(days=1)
"""Longer than anything takes to arrive and to be read."""


class UploadFiles:
    """The bytes of the uploads of one database.

    Parameters
    ----------
    url : the database.
    reading, writing : begin a transaction.
    """

    def __init__(
        self, url: str, reading: Callable[[], AbstractContextManager[Connection]],
        writing: Callable[[], AbstractContextManager[Connection]],
    ) -> None:  # fmt: skip
        self._folder = files_beside(database_path(url)) if is_sqlite(url) else None
        self._reading, self._writing = reading, writing

    @contextmanager
    def work(self) -> Iterator[Path]:
        """A folder for files that come in or are read, which goes at the end.

        DatabaseAwayError if there is no room for them.
        """
        try:
            if self._folder is not None:
                self._folder.mkdir(mode=0o700, exist_ok=True)
            with (
                tempfile.TemporaryDirectory(prefix=WORK, dir=self._folder) as folder,
                Path(folder, _HELD).open("w", encoding="utf-8") as held,
            ):
                try_lock(held)
                held.write(f"{os.getpid()}\n")  # what is not written yet may not be locked yet
                held.flush()
                try:
                    yield Path(folder)
                finally:
                    _empty(Path(folder))
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            raise DatabaseAwayError("the disk has no room for the file, nothing was stored", 5) from error

    def put(self, upload_id: str, file: Path) -> None:
        """Keep what a file of `work` holds, which may be moved."""
        if self._folder is not None:
            file.chmod(0o400)
            to_disk(file)
            file.replace(self._folder / upload_id)
            to_disk(self._folder)
            return
        with file.open("rb") as opened:
            for position, piece in enumerate(iter(partial(opened.read, PIECE_BYTES), b"")):
                values = {"upload_id": upload_id, "position": position, "data": piece}
                with self._writing() as connection:
                    connection.execute(insert(UploadPiece).values(values))

    def pieces(self, upload_id: str) -> Iterator[bytes]:
        """Yield what an upload holds, piece by piece; nothing if it is gone."""
        if self._folder is not None:
            if (file := self._folder / upload_id).exists():
                with file.open("rb") as opened:
                    yield from iter(partial(opened.read, PIECE_BYTES), b"")
            return
        for position in count():
            query = select(UploadPiece.data).where(
                UploadPiece.upload_id == upload_id, UploadPiece.position == position
            )
            with self._reading() as connection:
                data = connection.execute(query).scalar_one_or_none()
            if data is None:
                return
            yield data

    def place(self, row: Upload, file: Path) -> None:
        """Have what an upload holds in a file of `work`, to be read there (NotFoundError if it is gone)."""
        try:
            if self._folder is not None:
                os.link(self._folder / row.id, file)
            else:
                with file.open("wb") as opened:
                    opened.writelines(self.pieces(row.id))
            found = file.stat().st_size
        except FileNotFoundError:
            found = -1
        if found != row.size:
            raise NotFoundError(f"there is no upload {row.id!r}")

    def remove(self, uploads: Collection[str]) -> None:
        """Delete what uploads hold that have no row any more."""
        if self._folder is not None:
            for one in uploads:
                (self._folder / one).unlink(missing_ok=True)
        elif uploads:
            with self._writing() as connection:
                connection.execute(delete(UploadPiece).where(UploadPiece.upload_id.in_(uploads)))

    def sweep(self, now: datetime) -> None:
        """Delete what a crash left: whose maker has ended, or it is old and no row names it."""
        before = (now - _LEFT).timestamp()
        for path in (self._folder or Path(tempfile.gettempdir())).glob(f"{WORK}*"):
            with suppress(FileNotFoundError):  # it ends at this moment
                if _nobodys(path, before):
                    shutil.rmtree(path, ignore_errors=True)
        if self._folder is None:
            left = delete(UploadPiece).where(
                UploadPiece.upload_id < earliest_id(now - _LEFT),
                UploadPiece.upload_id.not_in(select(Upload.id)),
            )
            with self._writing() as connection:
                connection.execute(left)
        elif self._folder.exists():
            old = [path for path in self._folder.iterdir() if path.stat().st_mtime < before]
            with self._reading() as connection:
                named = set(connection.execute(select(Upload.id)).scalars()) if old else set()
            for path in old:
                if path.name not in named and not path.is_dir():
                    path.unlink(missing_ok=True)


def _empty(folder: Path) -> None:
    """Delete what a folder of `work` has; what holds it goes last, as it tells whose it is."""
    for path in folder.iterdir():
        if path.name == _HELD:
            continue
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def _nobodys(folder: Path, before: float) -> bool:
    """Whether who made a folder of `work` has ended; of one that does not tell, whether it is old."""
    with suppress(FileNotFoundError, PermissionError), (folder / _HELD).open("r+b") as held:
        if held.read():
            return try_lock(held)
    return folder.stat().st_mtime < before


def to_disk(path: str | Path) -> None:
    """Wait until a file, or what a folder names, has reached the disk."""
    if os.name != "posix":
        return
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
