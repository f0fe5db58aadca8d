"""One service a database file: an advisory lock the kernel drops when its holder dies, however it dies."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from typing import IO, Any, Self

from service.errors import DatabaseError, DatabaseInUseError

if sys.platform == "win32":
    import msvcrt

    # Windows locks are mandatory: one byte far behind the text leaves the holder's number readable.
    _LOCKED_BYTE = 1 << 20

    _TAKEN: type[OSError] = OSError

    def _lock(file: IO[Any]) -> None:
        file.seek(_LOCKED_BYTE)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    _TAKEN: type[OSError] = BlockingIOError

    def _lock(file: IO[Any]) -> None:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


def try_lock(file: IO[Any]) -> bool:
    """Lock an open file until it is closed, unless another process has: whether it is ours."""
    try:
        _lock(file)
    except _TAKEN:
        return False
    return True


# Files that this process has locked, by device and inode.
_held: set[tuple[int, int]] = set()
_guard = threading.Lock()
_OURS_ALONE = 0o600


def make_private(path: Path) -> None:
    """Make a file that its owner alone can read, if there is none; SQLite's other files take after it.

    DatabaseError if it cannot be made.
    """
    if path.exists():
        return  # opened and closed, it would lose SQLite's locks if this process had it open
    try:
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, _OURS_ALONE))
    except OSError as error:
        raise DatabaseError(f"cannot use {path}: {error}") from error


class FileLock:
    """The lock beside a database file (`<database>.lock`); a context manager.

    The file stays behind when the lock is released: removing it would let two services hold two
    different files of the same name.
    """

    def __init__(self, database: Path) -> None:
        self._database = database
        self._path = Path(os.path.realpath(database) + ".lock")
        self._file: IO[str] | None = None
        self._itself: IO[bytes] | None = None
        self._which = (0, 0)

    def acquire(self) -> None:
        """Take the lock.

        DatabaseInUseError if another process, or another service in this one, holds it; DatabaseError if the
        lock file cannot be made.
        """
        try:
            make_private(self._path)
            file = self._path.open("a+", encoding="utf-8")
        except OSError as error:
            raise DatabaseError(f"cannot use {self._database}: {error}") from error
        if not try_lock(file):
            file.seek(0)
            holder = file.read(32).strip() or "unknown"
            file.close()
            raise self._in_use(holder)
        try:
            self._lock_itself()
        except DatabaseError:
            file.close()
            raise
        file.truncate(0)
        file.write(f"{os.getpid()}\n")
        file.flush()
        self._file = file

    def _lock_itself(self) -> None:
        """Lock the database too: the file beside it can be deleted, a hard link has another one beside it.

        SQLite's own locks are of another kind (fcntl), but a process loses those of a file when it closes
        any descriptor of it: so this one stays open until the last connection is closed, and a file that
        this process has open already is not opened again to find out that it is locked.
        """
        if sys.platform == "win32":
            return  # locks are mandatory there: SQLite could not read its own file
        make_private(self._database)
        status = self._database.stat()
        which = (status.st_dev, status.st_ino)
        with _guard:
            if which in _held:
                raise self._in_use(str(os.getpid()))
            file = self._database.open("rb")
            if not try_lock(file):
                file.close()
                raise self._in_use("unknown")
            _held.add(which)
        self._itself, self._which = file, which

    def _in_use(self, holder: str) -> DatabaseInUseError:
        return DatabaseInUseError(
            f"{self._database} is in use by another stickslip service (process {holder}): stop that one, "
            "send the jobs to it (`stickslip submit`), or use another file (`--database`)"
        )

    def release(self) -> None:
        """Give the lock back; nothing happens if it is not held."""
        if self._itself is not None:
            self._itself.close()
            with _guard:
                _held.discard(self._which)
            self._itself = None
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> Self:
        self.acquire()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
