"""The database: SQLite with the transactions and the lock it needs, or PostgreSQL (`service.db.postgresql`).

On SQLite, the standard driver's legacy transaction control does not begin a transaction before a SELECT,
and a deferred BEGIN cannot always become a write transaction later. Read-modify-writes of several
processes then lose updates or fail with "database is locked". Here the driver's own control is switched
off (`isolation_level=None`), and SQLAlchemy's `begin` event emits ``BEGIN IMMEDIATE`` on the write engine
and ``BEGIN`` on the read engine.
"""

from __future__ import annotations

import math
import shutil
import sqlite3
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol, TypeVar

from sqlalchemy import Connection, Engine, create_engine, event, func, select, text
from sqlalchemy.engine import make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from service.db import postgresql
from service.db.clock import utc_now
from service.db.lock import FileLock, make_private
from service.errors import DatabaseError
from service.jobs import strict_json
from service.jobs.stored_figures import StoredArray
from solver.lab import from_lab


class ArrayStore(Protocol):
    """Arrays in one folder of one store, whose place is as it was given."""

    place: str

    def put(self, job_id: str, array: StoredArray) -> StoredArray:
        """Write an array of a job, unless it is small; what its row is to hold."""

    def get(self, job_id: str, sha256: str) -> bytes:
        """Read an array; DatabaseError if it is not there or cannot be read."""

    def keep(self, job_id: str, digests: Collection[str]) -> None:
        """Delete all arrays of a job but these."""

    def jobs(self) -> Iterator[str]:
        """Yield the jobs that have files here."""


def array_store(place: str | None) -> ArrayStore | None:
    """Return the store at a folder or a URL of fsspec; None for none.

    ConfigurationError if it cannot be used.
    """
    made: ArrayStore | None = None if place is None else from_lab("stores.array_store:FsspecStore")(place)
    return made


BUSY_TIMEOUT_SECONDS = 30.0
SQLITE_WITHOUT_WAL_BUG = (3, 51, 3)
CONNECTIONS = 16
_PROBE_SECONDS = 1.0
_STEPS_BETWEEN_LOOKS = 100_000  # of SQLite's virtual machine: some thousandths of a second
_DEADLINE = "stickslip deadline"

_Written = TypeVar("_Written")


def is_sqlite(url: str) -> bool:
    """Whether a URL is of SQLite; else it is of PostgreSQL."""
    return make_url(url).get_backend_name() == "sqlite"


def database_name(url: str) -> str:
    """A database in a sentence: its file, or its URL without the password."""
    return str(database_path(url)) if is_sqlite(url) else shown(url)


def shown(url: str) -> str:
    """A URL as it may be printed: without the password."""
    return make_url(url).render_as_string()


def database_path(url: str) -> Path:
    """The file of an SQLite URL."""
    name = make_url(url).database
    if name is None:
        raise DatabaseError(f"`database` must name a file, got {url!r}")
    return Path(name)


def files_beside(path: Path) -> Path:
    """The folder of what uploads hold, beside the file of an SQLite database."""
    return path.with_name(f"{path.name}.files")


def sqlite_note() -> str | None:
    """What a reader of /health should know about this SQLite library, or None."""
    if sqlite3.sqlite_version_info >= SQLITE_WITHOUT_WAL_BUG:
        return None
    wanted = ".".join(map(str, SQLITE_WITHOUT_WAL_BUG))
    return f"SQLite {sqlite3.sqlite_version} has a rare bug in its write-ahead log that {wanted} mends"


def _on_connect(
    *, read_only: bool, foreign_keys: bool, seconds: float | None = None
) -> Callable[[DBAPIConnection, ConnectionPoolEntry], None]:
    """What every new SQLite connection is told, before SQLAlchemy uses it.

    With `seconds`, a transaction ends with an error when it takes longer [s].
    """

    def configure(connection: DBAPIConnection, record: ConnectionPoolEntry) -> None:
        connection.isolation_level = None
        if seconds is not None:
            info = record.info
            connection.set_progress_handler(
                lambda: time.monotonic() > info.get(_DEADLINE, math.inf), _STEPS_BETWEEN_LOOKS
            )
        cursor = connection.cursor()
        cursor.execute(f"PRAGMA busy_timeout = {int((seconds or BUSY_TIMEOUT_SECONDS) * 1000)}")
        cursor.execute("PRAGMA journal_mode = WAL")
        cursor.execute("PRAGMA synchronous = FULL")
        cursor.execute(f"PRAGMA foreign_keys = {'ON' if foreign_keys else 'OFF'}")
        if read_only:
            cursor.execute("PRAGMA query_only = ON")
        cursor.close()

    return configure


def _begin_with(statement: str, seconds: float | None = None) -> Callable[[Connection], None]:
    def begin(connection: Connection) -> None:
        if seconds is not None:
            # The time for the lock, which the statement waits for, and the time to work.
            connection.info[_DEADLINE] = time.monotonic() + 2.0 * seconds
        connection.exec_driver_sql(statement)

    return begin


def write_engine(url: str, connections: int = CONNECTIONS, seconds: float = BUSY_TIMEOUT_SECONDS) -> Engine:
    """An engine whose transactions may write.

    Those of SQLite take the write lock when they begin, and the pool holds one connection: the threads of a
    process queue for it in memory, fairly and without the sleeps of SQLite's busy handler. `connections` is
    for PostgreSQL; `seconds` limits every wait.
    """
    if not is_sqlite(url):
        return postgresql.service_engine(url, connections, seconds)
    engine = create_engine(
        url, pool_size=1, max_overflow=0, pool_timeout=seconds, json_serializer=strict_json.stored,
        connect_args={"timeout": seconds},
    )  # fmt: skip
    event.listen(engine, "connect", _on_connect(read_only=False, foreign_keys=True, seconds=seconds))
    event.listen(engine, "begin", _begin_with("BEGIN IMMEDIATE", seconds))
    return engine


def read_engine(url: str, seconds: float | None = None) -> Engine:
    """An engine whose transactions read one snapshot and cannot write; on PostgreSQL not part of a service.

    `seconds` limits every wait and every transaction; without it they take what they take.
    """
    if not is_sqlite(url):
        return postgresql.reading(postgresql.migration_engine(url))
    patience = seconds or BUSY_TIMEOUT_SECONDS
    engine = create_engine(
        url, pool_size=8, max_overflow=32, pool_timeout=patience, connect_args={"timeout": patience}
    )
    event.listen(engine, "connect", _on_connect(read_only=True, foreign_keys=True, seconds=seconds))
    event.listen(engine, "begin", _begin_with("BEGIN", seconds))
    return engine


def migration_engine(url: str) -> Engine:
    """An engine for changes of the tables.

    Foreign keys of SQLite are off: a table rebuilt by Alembic is dropped on the way, which would delete the
    rows that refer to it. The keys are checked before the migration commits instead.
    """
    if not is_sqlite(url):
        return postgresql.migration_engine(url)
    engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": BUSY_TIMEOUT_SECONDS})
    event.listen(engine, "connect", _on_connect(read_only=False, foreign_keys=False))
    event.listen(engine, "begin", _begin_with("BEGIN IMMEDIATE"))
    return engine


@contextmanager
def migrating(url: str) -> Iterator[Connection]:
    """A transaction for changes of the tables; no other one of this kind runs beside it.

    DatabaseError if the database cannot be used.
    """
    if is_sqlite(url):
        make_private(database_path(url))
    engine = migration_engine(url)
    try:
        with engine.begin() as connection:
            if not is_sqlite(url):
                postgresql.lock_tables(connection)
            yield connection
    except DBAPIError as error:
        raise DatabaseError(f"{database_name(url)} cannot be used: {error.orig}") from error
    finally:
        engine.dispose()


class Database:
    """An open database: one engine to write and one to read and, on SQLite, the lock of the file.

    Parameters
    ----------
    url : an SQLite or PostgreSQL URL.
    connections : most connections to PostgreSQL at a time.
    seconds : longest time for a statement, for a lock, for a connection [s].
    arrays : where large arrays are, if that is outside of the database (see `service.db.engine`).
    """

    def __init__(
        self, url: str, connections: int = CONNECTIONS, seconds: float = BUSY_TIMEOUT_SECONDS,
        arrays: str | None = None,
    ) -> None:  # fmt: skip
        self.url = url
        self.arrays = array_store(arrays)
        self._seconds = seconds
        self._here = threading.local()
        self._wrote = -math.inf
        self._cannot_write: str | None = None
        self.name = database_name(url)
        self._lock = FileLock(database_path(url)) if is_sqlite(url) else None
        self._write = write_engine(url, connections, seconds)
        self._read = read_engine(url, seconds) if is_sqlite(url) else postgresql.reading(self._write)
        self._look = self._read if is_sqlite(url) else postgresql.looking(self._write)

    @property
    def backend(self) -> str:
        """``sqlite`` or ``postgresql``."""
        return self._write.dialect.name

    @property
    def exclusive(self) -> bool:
        """Whether one service has the database to itself: jobs that others left running are nobody's."""
        return self._lock is not None

    def acquire(self) -> None:
        """Lock the file of SQLite for this process (see `FileLock.acquire` for the errors)."""
        if self._lock is not None:
            self._lock.acquire()

    def close(self) -> None:
        """Close every connection and release the lock."""
        self._read.dispose()
        self._write.dispose()
        if self._lock is not None:
            self._lock.release()

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that may write; commits at the end. SQLite's holds the write lock from the start."""
        with self._write.begin() as connection:
            yield connection

    def written(self, work: Callable[[Connection], _Written]) -> _Written:
        """Have `work` done in a transaction; once more if another service wrote the same row meanwhile."""
        with suppress(IntegrityError), self.writing() as connection:
            return work(connection)
        with self.writing() as connection:
            return work(connection)

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees one snapshot; inside another one of the same thread, that one."""
        known: Connection | None = getattr(self._here, "connection", None)
        if known is not None:
            yield known
            return
        with self._read.begin() as connection:
            self._here.connection = connection
            try:
                yield connection
            finally:
                self._here.connection = None

    @contextmanager
    def looking(self) -> Iterator[Connection]:
        """For one statement that reads; inside a reading transaction of the same thread, that one.

        PostgreSQL answers it without being told of a transaction before and after, each an answer to wait
        for.
        """
        if self.exclusive or getattr(self._here, "connection", None) is not None:
            with self.reading() as connection:
                yield connection
            return
        with self._look.connect() as connection:
            yield connection

    def settle(self) -> None:
        """Move what was committed from the log of SQLite into its file; nobody waits for it."""
        if self.exclusive:
            with self._read.connect() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(PASSIVE)").all()

    def own_connection(self) -> Any:
        """A connection to PostgreSQL outside of the pool (`Notices`)."""
        return postgresql.own_connection(self._write, self._seconds)

    def time(self) -> datetime:
        """The time of the PostgreSQL server, for SQLite of this machine."""
        if self.exclusive:
            return utc_now()
        with self.reading() as connection:
            found: datetime = connection.execute(select(func.clock_timestamp())).scalar_one()
        return found.astimezone(UTC)

    def trouble(self, least_free_bytes: int) -> str | None:
        """Why nothing can be written now, or None; raises what the database raises.

        Of SQLite's file whether another program has locked it, and the room on its disk; of PostgreSQL
        whether it answers and can write (asked once a second at most, whoever asks how often).
        """
        if not self.exclusive:
            self.version()
            now = time.monotonic()
            if now - self._wrote >= _PROBE_SECONDS:
                self._cannot_write = postgresql.trouble(self._write, _PROBE_SECONDS)
                self._wrote = now
            return self._cannot_write
        path = database_path(self.url)
        disk = shutil.disk_usage(path.parent)
        if disk.free < least_free_bytes:
            return f"{disk.free} bytes are free on the disk of the database, {least_free_bytes} are needed"
        probe = sqlite3.connect(path, timeout=_PROBE_SECONDS, isolation_level=None)
        try:
            probe.execute("BEGIN IMMEDIATE")
            probe.rollback()
        except sqlite3.OperationalError as error:
            return f"the database cannot be written: {error}"
        finally:
            probe.close()
        return None

    def version(self) -> str:
        """The version of the SQLite library or the PostgreSQL server; raises what the database raises."""
        query = "SELECT sqlite_version()" if self.exclusive else "SHOW server_version"
        with self.reading() as connection:
            return str(connection.execute(text(query)).scalar_one())


def backup(url: str, target: Path) -> None:
    """Copy a database to a new file, and its uploads to the folder beside that, while it may be in use.

    DatabaseError if `target` exists, the source does not, or it is not SQLite.
    """
    if not is_sqlite(url):
        raise DatabaseError(f"{database_name(url)} is backed up with PostgreSQL's own pg_dump")
    source = database_path(url)
    if not source.exists():
        raise DatabaseError(f"there is no database {source} to back up")
    if target.exists():
        raise DatabaseError(f"{target} exists already: a backup does not overwrite")
    _copy_files(source, target)
    make_private(target)
    reader = sqlite3.connect(source, timeout=BUSY_TIMEOUT_SECONDS)
    try:
        writer = sqlite3.connect(target)
        try:
            reader.backup(writer)
        finally:
            writer.close()
    finally:
        reader.close()
    _copy_files(source, target)  # what came meanwhile


def _copy_files(source: Path, target: Path) -> None:
    """Copy the uploads of a database that are not in the copy yet; they never change."""
    if not (files := files_beside(source)).exists():
        return
    (copies := files_beside(target)).mkdir(mode=0o700, exist_ok=True)
    for file in files.iterdir():
        if file.is_file() and not (copies / file.name).exists():
            # One that is deleted at this moment has no row soon.
            with suppress(FileNotFoundError):
                shutil.copy2(file, copies / file.name)


def shrink(url: str) -> None:
    """Rewrite the file of SQLite without the pages that deleted rows left free; nobody may be using it."""
    connection = sqlite3.connect(database_path(url), timeout=BUSY_TIMEOUT_SECONDS, isolation_level=None)
    try:
        connection.execute("VACUUM")
    finally:
        connection.close()
