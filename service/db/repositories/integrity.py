"""`stickslip db check`: what must hold of the rows of a database, read from end to end."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Engine, Select, Text, and_, cast, exists, func, select, text
from sqlalchemy.exc import DBAPIError

from service.db.engine import ArrayStore, array_store, database_name, database_path, is_sqlite, read_engine
from service.db.models import Job, JobResult, JobState, Project, Result, Run, SweepArray, Upload
from service.db.repositories.result_repository import whole
from service.db.revisions import head_revision, off_head
from service.db.upload_files import UploadFiles
from service.errors import DamagedDatabaseError, DatabaseError, WrongRevisionError
from service.jobs.stored_figures import SWEEP

# A job that ends as `successful` wrote its result with the same transaction, unless it repeats another's.
# One that failed may have kept what it computed short of its goal.
_WITHOUT_RESULT = (JobState.ACCEPTED, JobState.RUNNING, JobState.DISMISSED)
_UNFINISHED = (JobState.ACCEPTED, JobState.RUNNING)
_WITH_RESULT = exists().where(JobResult.job_id == Job.id)
_IS_SWEEP = Result.of == SWEEP
_WITH_SWEEPS = exists().where(Result.job_id == Job.id, _IS_SWEEP)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """How much a database holds: jobs by state, sweeps, arrays."""

    jobs: dict[str, int]
    sweeps: int
    arrays: int


def damage(connection: Connection) -> list[str]:
    """Return what the database itself finds wrong with its file; only SQLite has such a check."""
    if connection.dialect.name != "sqlite":
        return []
    found = [str(row[0]) for row in connection.execute(text("PRAGMA integrity_check"))]
    broken = connection.execute(text("PRAGMA foreign_key_check")).all()
    trouble = [line for line in found if line != "ok"]
    return trouble + [
        f"a row of `{row[0]}` refers to a row of `{row[2]}` that is not there" for row in broken
    ]


def contradictions(connection: Connection) -> list[str]:
    """Return what rows say against each other."""
    questions: dict[str, Select[Any]] = {
        "successful jobs without a result": _jobs(
            Job.state == JobState.SUCCESSFUL, Job.result_of.is_(None), ~_WITH_RESULT
        ),
        "results of jobs that computed none": _jobs(Job.state.in_(_WITHOUT_RESULT), _WITH_RESULT),
        "sweeps of jobs that computed none": _jobs(Job.state.in_(_WITHOUT_RESULT), _WITH_SWEEPS),
        "ended jobs without the time they ended": _jobs(
            Job.state.in_([JobState.SUCCESSFUL, JobState.FAILED, JobState.DISMISSED]), Job.finished.is_(None)
        ),
        "sweeps without their arrays": select(func.count())
        .select_from(Result)
        .where(_IS_SWEEP, ~exists().where(SweepArray.sweep_id == Result.id)),
        "runs in the bin whose job has not ended": _runs(
            Job.state.in_(_UNFINISHED), Run.deleted.is_not(None)
        ),
        "runs in a project of another owner": _runs(
            exists().where(Project.id == Run.project_id, Project.owner != Job.owner)
        ),
    }
    counts = {words: connection.execute(query).scalar_one() for words, query in questions.items()}
    return [f"{count} {words}" for words, count in counts.items() if count]


def _jobs(*conditions: ColumnElement[bool]) -> Select[Any]:
    return select(func.count()).select_from(Job).where(and_(*conditions))


def _runs(*conditions: ColumnElement[bool]) -> Select[Any]:
    return select(func.count()).select_from(Run).join(Job, Job.id == Run.job_id).where(and_(*conditions))


_ARRAYS = select(
    Result.job_id, SweepArray.sweep_id, SweepArray.name, SweepArray.sha256, SweepArray.data, SweepArray.size
).join(Result, Result.id == SweepArray.sweep_id)


def damaged_arrays(engine: Engine, store: ArrayStore | None) -> Iterator[str]:
    """Yield what is wrong with arrays, one at a time, wherever they are."""
    with engine.connect().execution_options(stream_results=True, max_row_buffer=16) as connection:
        for row in connection.execute(_ARRAYS):
            try:
                whole(store, row).array()
            except (DatabaseError, ValueError) as error:
                yield f"array `{row.name}` of sweep {row.sweep_id}: {error}"


def unneeded(connection: Connection, store: ArrayStore) -> list[str]:
    """Return what is said of arrays outside of the database whose job is gone; no harm but their space."""
    jobs = list(store.jobs())
    known = set[str]()
    for begin in range(0, len(jobs), _AT_ONCE):
        some = jobs[begin : begin + _AT_ONCE]
        known.update(connection.execute(select(Job.id).where(Job.id.in_(some))).scalars())
    gone = len(jobs) - len(known)
    return [f"{store.place} has arrays of {gone} jobs that are not there"] if gone else []


def damaged_uploads(engine: Engine, url: str) -> Iterator[str]:
    """Yield what is wrong with uploads, one at a time, wherever they are."""
    files = UploadFiles(url, engine.connect, engine.connect)
    with engine.connect() as connection:
        rows = connection.execute(select(Upload.id, Upload.sha256)).all()
    for upload_id, sha256 in rows:
        found = hashlib.sha256()
        for piece in files.pieces(upload_id):
            found.update(piece)
        if found.hexdigest() != sha256:
            yield f"upload {upload_id}: what it holds is gone or does not match its checksum"


def damaged_results(engine: Engine) -> Iterator[str]:
    """Yield what is wrong with results, one at a time; those of earlier versions have no checksum."""
    query = select(JobResult.job_id, JobResult.sha256, cast(JobResult.body, Text)).where(
        JobResult.sha256.is_not(None)
    )
    with engine.connect().execution_options(stream_results=True, max_row_buffer=16) as connection:
        for job_id, sha256, body in connection.execute(query):
            if hashlib.sha256(body.encode()).hexdigest() != sha256:
                yield f"result of job {job_id}: it does not match its checksum"


def contents(connection: Connection) -> Contents:
    """Return how much there is."""
    states = connection.execute(select(Job.state, func.count()).group_by(Job.state)).all()
    return Contents(
        jobs={state.value: count for state, count in states},
        sweeps=connection.execute(select(func.count()).select_from(Result).where(_IS_SWEEP)).scalar_one(),
        arrays=connection.execute(select(func.count()).select_from(SweepArray)).scalar_one(),
    )


_AT_ONCE = 500
MOST_NAMED = 20  # damaged arrays, results and uploads that are named one by one


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What a check found.

    Attributes
    ----------
    revision, wanted : the revision of the tables, and that of this version.
    trouble : what is wrong, in words; empty for a sound database.
    contents : how much it holds.
    """

    revision: str
    wanted: str
    trouble: tuple[str, ...]
    contents: Contents

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.trouble

    def to_json(self) -> dict[str, object]:
        """Return the findings as one JSON object."""
        return {
            "sound": self.sound, "revision": self.revision, "wanted": self.wanted,
            "trouble": list(self.trouble), "jobs": dict(self.contents.jobs),
            "sweeps": self.contents.sweeps, "arrays": self.contents.arrays,
        }  # fmt: skip


def check(url: str, arrays: str | None = None) -> Findings:
    """Read a database from end to end; a service may be using it.

    DatabaseError if there is no such database; DamagedDatabaseError, WrongRevisionError if it cannot be read,
    or it is at another revision. `arrays`: where large arrays are, if that is outside of the database.
    """
    name = database_name(url)
    if is_sqlite(url) and not database_path(url).exists():
        raise DatabaseError(f"there is no database {name} to check")
    wrong = off_head(url, "checks")
    if wrong is not None:
        raise WrongRevisionError(wrong)
    store = array_store(arrays)
    engine = read_engine(url)
    try:
        with engine.begin() as connection:
            trouble = [*damage(connection), *contradictions(connection)]
            held = contents(connection)
            trouble += [] if store is None else unneeded(connection, store)
        damaged = [*damaged_arrays(engine, store), *damaged_results(engine), *damaged_uploads(engine, url)]
    except DBAPIError as error:
        raise DamagedDatabaseError(f"{name} cannot be read: {error.orig}") from error
    finally:
        engine.dispose()
    unnamed = len(damaged) - MOST_NAMED
    more = [f"{unnamed} more arrays, results and uploads"] if unnamed > 0 else []
    head = head_revision()
    return Findings(
        revision=head, wanted=head, trouble=(*trouble, *damaged[:MOST_NAMED], *more), contents=held
    )
