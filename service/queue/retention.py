"""Retention: old jobs, their sweeps and old uploads are deleted, a little at a time.

Nothing may hold the database for long: SQLite has one writer. Every transaction is as large as it can be
without taking longer than some thousandths of a second, and between two of them there is a pause as long as
the work was.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from functools import partial

from sqlalchemy.exc import DBAPIError

from service.db.engine import Database, database_name, database_path, is_sqlite, shrink
from service.db.repositories.job_repository import JobRepository
from service.db.repositories.owned import UploadRepository
from service.db.repositories.retention_repository import Pruned, RetentionRepository
from service.db.revisions import off_head
from service.errors import DatabaseError
from service.settings.settings import Settings

log = logging.getLogger("stickslip.retention")

_WANTED_SECONDS = 0.004
_MOST = 64
_WANTED_ALONE, _MOST_ALONE = 0.25, 1024  # where nobody else waits
_ROUND_SECONDS = 600.0


class _Paced:
    """Does work in steps whose size is chosen by how long the last one took.

    What a step changed is also moved from SQLite's log into its file here: else the request whose commit
    finds the log long does that for all before it, up to 0.1 s.
    """

    def __init__(self, database: Database, pause: Callable[[float], bool] | None) -> None:
        self._wanted, self.most = (_WANTED_ALONE, _MOST_ALONE) if pause is None else (_WANTED_SECONDS, _MOST)
        self._database = database
        self._pause = pause
        self._size = 4
        self.stopped = False

    def all(self, step: Callable[[int], int]) -> int:
        """Repeat `step`, which does up to a number of things and says how many, until nothing is left."""
        total, size, done = 0, 0, 0
        while done == size and not self.stopped:
            size = self._size
            done = self.once(partial(step, size))
            total += done
        return total

    def each(self, things: Sequence[str], step: Callable[[Sequence[str]], int]) -> int:
        """Do `step` for all things, some at a time; the sum of what it says."""
        total = 0
        while things and not self.stopped:
            some, things = things[: self._size], things[self._size :]
            total += self.once(partial(step, some))
        return total

    def once(self, step: Callable[[], int]) -> int:
        """Do one step, choose the size of the next, and pause."""
        if self.stopped:
            return 0
        begun = time.monotonic()
        done = step()
        took = time.monotonic() - begun
        if took > self._wanted:
            self._size = max(1, self._size // 2)
        elif took < 0.5 * self._wanted:
            self._size = min(self.most, 2 * self._size)
        self._database.settle()
        self.stopped = self._pause is not None and self._pause(time.monotonic() - begun)
        return done


def prune(
    database: Database, before: datetime, *, keep_designs: bool, binned: bool = False,
    pause: Callable[[float], bool] | None = None, on_progress: Callable[[Pruned], None] | None = None,
) -> Pruned:  # fmt: skip
    """Delete the jobs that ended before a time, with their results and sweeps.

    Parameters
    ----------
    keep_designs : of designs delete the sweeps alone.
    binned : those that were put in the bin before the time, in place of those that ended before it.
    pause : called between transactions with the time the last one took [s]; True ends the work. None where
        nobody else waits for the database: transactions are large then.
    on_progress : called with what was deleted in every round.
    """
    repository, paced = RetentionRepository(database), _Paced(database, pause)
    total = Pruned()
    while not paced.stopped:
        jobs = repository.take(before, paced.most, keep_designs=keep_designs, binned=binned)
        sweeps = paced.all(partial(repository.delete_sweeps, jobs, keep_designs=keep_designs))
        deleted = paced.each(jobs, partial(repository.delete_jobs, keep_designs=keep_designs))
        found = Pruned(jobs=deleted, sweeps=sweeps)
        total += found
        if on_progress is not None:
            on_progress(found)
        if found == Pruned():
            return total
    return total


def empty_bin(
    database: Database, before: datetime, *, pause: Callable[[float], bool] | None = None,
    on_progress: Callable[[Pruned], None] | None = None,
) -> Pruned:  # fmt: skip
    """Delete the runs and projects that were put in the bin before a time; arguments as of `prune`."""
    found = prune(
        database, before, keep_designs=False, binned=True, pause=pause, on_progress=on_progress
    )  # fmt: skip
    projects = Pruned(projects=RetentionRepository(database).delete_projects(before))
    if on_progress is not None:
        on_progress(projects)
    return found + projects


def prune_uploads(
    database: Database, before: datetime, *, pause: Callable[[float], bool] | None = None
) -> Pruned:
    """Delete the uploads that came before a time and are not used, one by one; arguments as of `prune`."""
    uploads, paced = UploadRepository(database), _Paced(database, pause)
    old = RetentionRepository(database).old_uploads(before)
    return Pruned(uploads=sum(paced.once(partial(uploads.delete, one, before)) for one in old))


class Retention:
    """Deletes what is older than the settings say, beside the work of a service.

    Parameters
    ----------
    database : where the jobs are.
    settings : `retention_days`, `retention_keep_designs` and `retention_upload_days`, without which no jobs
        and uploads are deleted but those in the bin; `bin_days`.
    now : the clock of the database.
    """

    def __init__(self, database: Database, settings: Settings, now: Callable[[], datetime]) -> None:
        self._database = database
        self._settings = settings
        self._now = now
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._loop, name="stickslip retention", daemon=True)
        self.pruned = Pruned()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End within the transaction that runs."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _loop(self) -> None:
        while not self._stop.is_set():
            try:
                found = self.once()
            except Exception:
                log.exception("what is old could not be deleted, it is tried again later")
            else:
                if found != Pruned():
                    words = "deleted %d old jobs, %d old sweeps, %d old uploads, %d projects and %d links"
                    log.info(words, found.jobs, found.sweeps, found.uploads, found.projects, found.links)
            self._stop.wait(_ROUND_SECONDS)

    def once(self) -> Pruned:
        """Delete what is too old now."""
        found, now = Pruned(), self._now()
        UploadRepository(self._database).files.sweep(now)
        days, upload_days = self._settings.retention_days, self._settings.retention_upload_days
        if days is not None:
            found += prune(
                self._database,
                now - timedelta(days=days),
                keep_designs=self._settings.retention_keep_designs,
                pause=self._stop.wait,
                on_progress=self._count,
            )
        if upload_days is not None and not self._stop.is_set():
            uploads = prune_uploads(self._database, now - timedelta(days=upload_days), pause=self._stop.wait)
            self._count(uploads)
            found += uploads
        return found + self._bin(now)

    def _bin(self, now: datetime) -> Pruned:
        """Delete what was in the bin for long enough, and links whose time is over."""
        if self._stop.is_set():
            return Pruned()
        found = empty_bin(
            self._database, now - timedelta(days=self._settings.bin_days), pause=self._stop.wait,
            on_progress=self._count,
        )  # fmt: skip
        links = Pruned(links=RetentionRepository(self._database).delete_links(now))
        self._count(links)
        return found + links

    def _count(self, found: Pruned) -> None:
        self.pruned += found


def prune_database(
    url: str, seconds: float, *, keep_designs: bool, uploads: bool = False, dry_run: bool = False,
    vacuum: bool = False, arrays: str | None = None,
) -> Pruned:  # fmt: skip
    """Delete the jobs that ended longer ago than `seconds`, and uploads as old, or count them.

    What was put in the bin longer ago goes with them, designs too. DatabaseInUseError if an SQLite file is in
    use by a service; DatabaseError if there is no such database, it cannot be used, or it is at another
    revision. `arrays`: where large arrays are, if that is outside of the database.
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
    database = Database(url, arrays=arrays)
    try:
        before = JobRepository(database).now() - timedelta(seconds=seconds)
        if dry_run:
            repository = RetentionRepository(database)
            counted = repository.count(before, keep_designs=keep_designs)
            return replace(counted, uploads=len(repository.old_uploads(before)) if uploads else 0)
        database.acquire()
        found = prune(database, before, keep_designs=keep_designs)
        found += empty_bin(database, before)
        if uploads:
            found += prune_uploads(database, before)
        if vacuum:
            shrink(url)
        return found
    except DBAPIError as error:
        raise DatabaseError(f"{name} cannot be used: {error.orig}") from error
    finally:
        database.close()
