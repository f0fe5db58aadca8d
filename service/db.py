"""The database: engines whose transactions begin the way SQLite needs, and the lock on the file.

The standard driver's legacy transaction control does not begin a transaction before a SELECT, and a
deferred BEGIN cannot always become a write transaction later. Read-modify-writes of several processes
then lose updates or fail with "database is locked". Here the driver's own control is switched off
(`isolation_level=None`), and SQLAlchemy's `begin` event emits ``BEGIN IMMEDIATE`` on the write engine
and ``BEGIN`` on the read engine.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.engine import make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from service.errors import DatabaseError
from service.lock import FileLock

BUSY_TIMEOUT_SECONDS = 30.0
SQLITE_WITHOUT_WAL_BUG = (3, 51, 3)


def database_path(url: str) -> Path:
    """The file of an SQLite URL."""
    name = make_url(url).database
    if name is None:
        raise DatabaseError(f"`database` must name a file, got {url!r}")
    return Path(name)


def sqlite_note() -> str | None:
    """What a reader of /health should know about this SQLite library, or None."""
    if sqlite3.sqlite_version_info >= SQLITE_WITHOUT_WAL_BUG:
        return None
    wanted = ".".join(map(str, SQLITE_WITHOUT_WAL_BUG))
    return f"SQLite {sqlite3.sqlite_version} has a rare bug in its write-ahead log that {wanted} mends"


def _on_connect(
    *, read_only: bool, foreign_keys: bool
) -> Callable[[DBAPIConnection, ConnectionPoolEntry], None]:
    """What every new SQLite connection is told, before SQLAlchemy uses it."""

    def configure(connection: DBAPIConnection, _record: ConnectionPoolEntry) -> None:
        connection.isolation_level = None
        cursor = connection.cursor()
        cursor.execute(f"PRAGMA busy_timeout = {int(BUSY_TIMEOUT_SECONDS * 1000)}")
        cursor.execute("PRAGMA journal_mode = WAL")
        cursor.execute("PRAGMA synchronous = FULL")
        cursor.execute(f"PRAGMA foreign_keys = {'ON' if foreign_keys else 'OFF'}")
        if read_only:
            cursor.execute("PRAGMA query_only = ON")
        cursor.close()

    return configure


def _begin_with(statement: str) -> Callable[[Connection], None]:
    def begin(connection: Connection) -> None:
        connection.exec_driver_sql(statement)

    return begin


def write_engine(url: str) -> Engine:
    """An engine whose transactions take the write lock when they begin.

    Its pool holds one connection: the threads of a process queue for it in memory, fairly and without
    the sleeps of SQLite's busy handler.
    """
    engine = create_engine(
        url,
        pool_size=1,
        max_overflow=0,
        pool_timeout=BUSY_TIMEOUT_SECONDS,
        connect_args={"timeout": BUSY_TIMEOUT_SECONDS},
    )
    event.listen(engine, "connect", _on_connect(read_only=False, foreign_keys=True))
    event.listen(engine, "begin", _begin_with("BEGIN IMMEDIATE"))
    return engine


def read_engine(url: str) -> Engine:
    """An engine whose transactions read one snapshot and cannot write."""
    engine = create_engine(
        url,
        pool_size=8,
        max_overflow=32,
        pool_timeout=BUSY_TIMEOUT_SECONDS,
        connect_args={"timeout": BUSY_TIMEOUT_SECONDS},
    )
    event.listen(engine, "connect", _on_connect(read_only=True, foreign_keys=True))
    event.listen(engine, "begin", _begin_with("BEGIN"))
    return engine


def migration_engine(url: str) -> Engine:
    """An engine for changes of the tables.

    Foreign keys are off: a table rebuilt by Alembic is dropped on the way, which would delete the rows
    that refer to it. The keys are checked before the migration commits instead.
    """
    engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": BUSY_TIMEOUT_SECONDS})
    event.listen(engine, "connect", _on_connect(read_only=False, foreign_keys=False))
    event.listen(engine, "begin", _begin_with("BEGIN IMMEDIATE"))
    return engine


class Database:
    """An open database: its lock, one engine to write and one to read.

    Parameters
    ----------
    url : str
        An SQLite URL.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.path = database_path(url)
        self._lock = FileLock(self.path)
        self._write = write_engine(url)
        self._read = read_engine(url)

    def acquire(self) -> None:
        """Lock the file for this process (see `FileLock.acquire` for the errors)."""
        self._lock.acquire()

    def close(self) -> None:
        """Close every connection and release the lock."""
        self._read.dispose()
        self._write.dispose()
        self._lock.release()

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that holds the write lock from its first statement; commits at the end."""
        with self._write.begin() as connection:
            yield connection

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees one snapshot of the database."""
        with self._read.begin() as connection:
            yield connection

    def ping(self) -> None:
        """Read something; raises what the database raises."""
        with self.reading() as connection:
            connection.execute(text("SELECT 1")).scalar_one()


def backup(url: str, target: Path) -> None:
    """Copy a database to a new file while it may be in use.

    Raises
    ------
    DatabaseError
        If `target` exists or the source does not.
    """
    source = database_path(url)
    if not source.exists():
        raise DatabaseError(f"there is no database {source} to back up")
    if target.exists():
        raise DatabaseError(f"{target} exists already: a backup does not overwrite")
    reader = sqlite3.connect(source, timeout=BUSY_TIMEOUT_SECONDS)
    try:
        writer = sqlite3.connect(target)
        try:
            reader.backup(writer)
        finally:
            writer.close()
    finally:
        reader.close()
