"""The revision of a database: what it is, what it must be, and the way there."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine, inspect
from sqlalchemy.exc import DBAPIError

from service.db import database_path, migration_engine, read_engine
from service.errors import DatabaseError, WrongRevisionError
from service.lock import FileLock

# Beside this package, in the source tree and once installed; found by place, since another
# package of this common name may come first on the path.
_MIGRATIONS = Path(__file__).resolve().parent.parent / "migrations"


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def head_revision() -> str:
    """The revision this version works with."""
    head = ScriptDirectory.from_config(_config()).get_current_head()
    if head is None:
        raise DatabaseError("the package `migrations` has no revisions: the installation is damaged")
    return head


def _current(engine: Engine) -> tuple[str | None, bool]:
    """The revision of a database, and whether it has no tables at all."""
    try:
        with engine.begin() as connection:
            revision = MigrationContext.configure(connection).get_current_revision()
            return revision, not inspect(connection).get_table_names()
    except DBAPIError as error:
        raise DatabaseError(f"{engine.url.database} cannot be used: {error.orig}") from error


def current_revision(url: str) -> str:
    """The revision of an existing database; ``none`` if it has never had one.

    Raises
    ------
    DatabaseError
        If the file cannot be used.
    """
    engine = read_engine(url)
    try:
        return _current(engine)[0] or "none"
    finally:
        engine.dispose()


def _migrate(engine: Engine, target: str) -> None:
    config = _config()
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, target)


def upgrade(url: str, target: str = "head") -> str:
    """Bring a database to a revision (`stickslip db upgrade`); returns the revision it has then.

    Raises
    ------
    DatabaseInUseError
        If a service is running on it.
    DatabaseError
        If the file cannot be used, holds another program's tables, or is newer than this version.
    """
    path = database_path(url)
    _require_folder(path)
    with FileLock(path):
        engine = migration_engine(url)
        try:
            revision, empty = _current(engine)
            _refuse_foreign(path, revision, empty=empty)
            _refuse_unknown(path, revision)
            _migrate(engine, target)
            now = _current(engine)[0]
        finally:
            engine.dispose()
    return now or "base"


def prepare(url: str) -> None:
    """Make a new database's tables, or check those of an existing one. The caller holds the lock.

    Raises
    ------
    WrongRevisionError
        With the command that brings the database to the right revision.
    DatabaseError
        If the file holds another program's tables.
    """
    path = database_path(url)
    engine = migration_engine(url)
    try:
        revision, empty = _current(engine)
        if revision is None and empty:
            _migrate(engine, "head")
            return
    finally:
        engine.dispose()
    _refuse_foreign(path, revision, empty=empty)
    _refuse_unknown(path, revision)
    if revision != head_revision():
        raise WrongRevisionError(
            f"{path} is at revision {revision}, this version works with {head_revision()}: "
            f"back it up, then run `stickslip db upgrade --database {url}`"
        )


def _require_folder(path: Path) -> None:
    if not path.absolute().parent.is_dir():
        raise DatabaseError(f"there is no folder {path.absolute().parent} for the database {path.name}")


def _refuse_foreign(path: Path, revision: str | None, *, empty: bool) -> None:
    if revision is None and not empty:
        raise DatabaseError(f"{path} holds the tables of another program: use another file (`--database`)")


def _refuse_unknown(path: Path, revision: str | None) -> None:
    known = {script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()}
    if revision is not None and revision not in known:
        raise WrongRevisionError(
            f"{path} is at revision {revision}, which this version does not know: it was written by a newer "
            "stickslip. Install that one, or use another file (`--database`)"
        )
