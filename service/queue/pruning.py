"""`stickslip db prune`: retention from the command."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

from sqlalchemy.exc import DBAPIError

from service.db.engine import Database, database_name, database_path, is_sqlite, shrink
from service.db.repositories.jobs.repository import JobRepository
from service.db.repositories.retention import Pruned, RetentionRepository
from service.db.revisions import off_head
from service.errors import DatabaseError
from service.queue.retention import empty_bin, prune, prune_uploads


def prune_database(
    url: str,
    seconds: float,
    *,
    keep_designs: bool,
    uploads: bool = False,
    dry_run: bool = False,
    vacuum: bool = False,
) -> Pruned:
    """Delete the jobs that ended longer ago than `seconds`, and uploads as old, or count them.

    What was put in the bin longer ago goes with them, designs too.

    Raises
    ------
    DatabaseInUseError
        An SQLite file is in use by a service.
    DatabaseError
        There is no such database, it cannot be used, or it is at another revision.
    """
    name = database_name(url)
    if vacuum and not is_sqlite(url):
        raise DatabaseError(
            f"{name} gives its space back by PostgreSQL's own autovacuum: leave out `--vacuum`"
        )
    if is_sqlite(url) and not database_path(url).exists():
        raise DatabaseError(f"there is no database {name}")
    wrong = off_head(url, "needs")
    if wrong is not None:
        raise DatabaseError(wrong)
    database = Database(url)
    try:
        before = JobRepository(database).now() - timedelta(seconds=seconds)
        if dry_run:
            repository = RetentionRepository(database)
            counted = repository.count(before, keep_designs=keep_designs)
            return replace(counted, uploads=len(repository.old_uploads(before)) if uploads else 0)
        database.acquire()
        found = prune(database, before, keep_designs=keep_designs, pause=_at_once)
        found += empty_bin(database, before, pause=_at_once)
        if uploads:
            found += prune_uploads(database, before, pause=_at_once)
        if vacuum:
            shrink(url)
        return found
    except DBAPIError as error:
        raise DatabaseError(f"{name} cannot be used: {error.orig}") from error
    finally:
        database.close()


def _at_once(_seconds: float) -> bool:
    """Without a pause: nobody else waits for the database."""
    return False
