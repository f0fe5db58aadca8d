"""One service a database file: an advisory lock the kernel drops when its holder dies, however it dies."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import IO, Self

from service.errors import DatabaseError, DatabaseInUseError

if sys.platform == "win32":
    import msvcrt

    # Windows locks are mandatory: one byte far behind the text leaves the holder's number readable.
    _LOCKED_BYTE = 1 << 20

    def _try_lock(file: IO[str]) -> bool:
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import fcntl

    def _try_lock(file: IO[str]) -> bool:
        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


class FileLock:
    """The lock beside a database file (`<database>.lock`); a context manager.

    The file stays behind when the lock is released: removing it would let two services hold two
    different files of the same name.
    """

    def __init__(self, database: Path) -> None:
        self._database = database
        self._path = Path(os.path.realpath(database) + ".lock")
        self._file: IO[str] | None = None

    def acquire(self) -> None:
        """Take the lock.

        Raises
        ------
        DatabaseInUseError
            If another process, or another service in this one, holds it.
        DatabaseError
            If the lock file cannot be made.
        """
        try:
            file = self._path.open("a+", encoding="utf-8")
        except OSError as error:
            raise DatabaseError(f"cannot use {self._database}: {error}") from error
        if not _try_lock(file):
            file.seek(0)
            holder = file.read(32).strip() or "unknown"
            file.close()
            raise DatabaseInUseError(
                f"{self._database} is in use by another stickslip service (process {holder}): stop that one, "
                "send the jobs to it (`stickslip submit`), or use another file (`--database`)"
            )
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
        self._file = file

    def release(self) -> None:
        """Give the lock back; nothing happens if it is not held."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
