"""The revision of a database: what it is, what it must be, and the way there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, inspect, text
from sqlalchemy.exc import DBAPIError

from service.db import postgresql
from service.db.engine import database_name, database_path, is_sqlite, migrating, read_engine, shown
from service.db.lock import FileLock
from service.errors import DamagedDatabaseError, DatabaseError, WrongRevisionError

if TYPE_CHECKING:
    from alembic.config import Config

# Beside this package, in the source tree and once installed; found by place, since another
# package of this common name may come first on the path.
_MIGRATIONS = Path(__file__).resolve().parent.parent.parent / "migrations"


def _config() -> Config:
    # Loaded here, as below: a service whose database has the right revision needs no Alembic.
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def head_revision() -> str:
    """The revision this version works with: the name of its file begins with it."""
    files = [file.name for file in (_MIGRATIONS / "versions").glob("[0-9]*.py")]
    if not files:
        raise DatabaseError("the package `migrations` has no revisions: the installation is damaged")
    return max(files).partition("_")[0]


def _current(connection: Connection) -> tuple[str | None, bool]:
    """The revision of a database, and whether it has no tables at all."""
    tables, asked = inspect(connection).get_table_names(), text("SELECT version_num FROM alembic_version")
    return connection.scalar(asked) if "alembic_version" in tables else None, not tables


def current_revision(url: str) -> str:
    """The revision of an existing database; ``none`` if it has never had one.

    DamagedDatabaseError if it cannot be used.
    """
    engine = read_engine(url)
    try:
        with engine.begin() as connection:
            return _current(connection)[0] or "none"
    except DBAPIError as error:
        raise DamagedDatabaseError(f"{database_name(url)} cannot be used: {error.orig}") from error
    finally:
        engine.dispose()


def _migrate(connection: Connection, target: str) -> None:
    from alembic import command

    config = _config()
    config.attributes["connection"] = connection
    command.upgrade(config, target)


@contextmanager
def _without_services(url: str) -> Iterator[Connection]:
    """A transaction for changes of the tables while no service runs."""
    name = database_name(url)
    if not is_sqlite(url):
        with migrating(url) as connection:
            postgresql.refuse_running(connection, name)
            yield connection
        return
    path = database_path(url)
    if not path.absolute().parent.is_dir():
        raise DatabaseError(f"there is no folder {path.absolute().parent} for the database {path.name}")
    with FileLock(path), migrating(url) as connection:
        yield connection


def upgrade(url: str, target: str = "head") -> str:
    """Bring a database to a revision (`stickslip db upgrade`); returns the revision it has then.

    DatabaseInUseError if a service is running on it; DatabaseError if it cannot be used, holds another
    program's tables, or is newer than this version.
    """
    with _without_services(url) as connection:
        revision, empty = _current(connection)
        _refuse_foreign(url, revision, empty=empty)
        _refuse_unknown(url, revision)
        _migrate(connection, target)
        now = _current(connection)[0]
    return now or "base"


def off_head(url: str, does: str) -> str | None:
    """Say that a database is at another revision than the one this version `does`; None if it is at that."""
    revision, wanted = current_revision(url), head_revision()
    if revision == wanted:
        return None
    return (
        f"{database_name(url)} is at revision {revision}, this version {does} {wanted}: "
        f"run `stickslip db upgrade --database {shown(url)}`"
    )


def prepare(url: str) -> None:
    """Make a new database's tables, or check those of an existing one.

    On SQLite the caller holds the lock of the file; on PostgreSQL services may run. WrongRevisionError with
    the command that brings the database to the right revision; DatabaseError if it cannot be used or holds
    another program's tables.
    """
    with migrating(url) as connection:
        revision, empty = _current(connection)
        if revision is None and empty:
            _migrate(connection, "head")
            return
    if revision == head_revision():
        return
    _refuse_foreign(url, revision, empty=empty)
    _refuse_unknown(url, revision)
    raise WrongRevisionError(
        f"{database_name(url)} is at revision {revision}, this version works with {head_revision()}: "
        f"back it up, then run `stickslip db upgrade --database {shown(url)}`"
    )


def _refuse_foreign(url: str, revision: str | None, *, empty: bool) -> None:
    if revision is None and not empty:
        raise DatabaseError(
            f"{database_name(url)} holds the tables of another program: use another database (`--database`)"
        )


def _refuse_unknown(url: str, revision: str | None) -> None:
    from alembic.script import ScriptDirectory

    known = {script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()}
    if revision is None or revision in known:
        return
    if revision in (f"{number:04}" for number in range(1, 13)):
        raise WrongRevisionError(
            f"{database_name(url)} is at revision {revision}, which was never released: bring it to "
            f"{min(known)} with a version of its time, or use another database (`--database`)"
        )
    raise WrongRevisionError(
        f"{database_name(url)} is at revision {revision}, which this version does not know: it was "
        "written by a newer stickslip. Install that one, or use another database (`--database`)"
    )
