"""The runs: jobs with what is said of them, and the links that show one without a key."""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import (
    BindParameter,
    ColumnElement,
    Connection,
    Select,
    Text,
    and_,
    bindparam,
    delete,
    func,
    insert,
    literal,
    null,
    or_,
    select,
    tuple_,
)
from sqlalchemy.orm import InstrumentedAttribute

from service.db.clock import Clock, earliest_id
from service.db.engine import Database
from service.db.models import (
    ID_LENGTH,
    NOBODY,
    RUN_LETTERS,
    RUN_TEXT,
    Job,
    JobState,
    Project,
    Run,
    RunTag,
    Share,
)
from service.db.pagination import Condition, Position, met, owner_condition, plain_conditions, refused
from service.db.repositories.owned import Binned, Made, Rows, Tokens, digest_of, matches
from service.errors import ConflictError, InvalidRequestError, NotFoundError
from service.jobs.stored_figures import SWEEP
from solver.errors import Shown
from solver.first_use import on_demand


@dataclass(frozen=True, slots=True, kw_only=True)
class JobRow:
    """A job without its spec and its result; `request` is None in lists, it may hold a whole scene."""

    id: str
    kind: str
    state: JobState
    priority: int
    scene_name: str | None
    scene_hash: str | None
    spec_hash: str
    request_hash: str
    owner: str
    idempotency_key: str | None
    seconds_limit: float | None
    attempt: int
    max_attempts: int
    cancel_requested: bool
    progress: float
    points: int
    best: dict[str, Any] | None
    created: datetime
    started: datetime | None
    finished: datetime | None
    result_of: str | None
    error: dict[str, Any] | None
    request: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunWords:
    """What is said of a run: the id of its project, its name, its notes, the words it is marked with."""

    project: str | None = None
    name: str = ""
    notes: str = ""
    tags: tuple[str, ...] = ()


NO_WORDS = RunWords()

_TABLES = Run.metadata.tables
_RUN, _TAG = _TABLES["run"], _TABLES["run_tag"]
_INSERT, _INSERT_TAGS = insert(_RUN), insert(_TAG)
# Locked until the run refers to it, so that it is not deleted for good in between.
_PROJECT = (
    select(Project.id)
    .where(Project.id == bindparam("project"), Project.owner == bindparam("owner"))
    .where(Project.deleted.is_(None))
    .with_for_update(read=True)
)


def in_the_bin(job_id: InstrumentedAttribute[str]) -> ColumnElement[bool]:
    """Whether the run of a job is in the bin; for rows with such a column."""
    table: Any = job_id.class_
    return select(Run.job_id).where(Run.job_id == job_id, Run.deleted.is_not(None)).correlate(table).exists()


def require_project(connection: Connection, project: str | None, owner: str | None) -> None:
    """Refuse a project that is not there.

    InvalidRequestError if the owner has none of this id outside of the bin.
    """
    if project is None:
        return
    given = {"project": project[:ID_LENGTH], "owner": owner}
    if len(project) > ID_LENGTH or connection.execute(_PROJECT, given).one_or_none() is None:
        words = "must be the id of a project of the same owner, GET /v1/projects lists them"
        raise InvalidRequestError.of(("project",), words, Shown(f"{project!r:.80}"))


def insert_words(connection: Connection, job_id: str, words: RunWords, now: datetime) -> None:
    """Write what is said of a job that was inserted just now, if anything is; see `require_project`."""
    if words == NO_WORDS:
        return
    about = {"job_id": job_id, "project_id": words.project, "name": words.name, "notes": words.notes}
    connection.execute(_INSERT, about | {"changed": now, "revision": 1, "deleted": None})
    put_tags(connection, job_id, words.tags)


def put_tags(connection: Connection, job_id: str, tags: tuple[str, ...]) -> None:
    """Mark a run with these words and no others."""
    connection.execute(delete(_TAG).where(_TAG.c.job_id == job_id))
    if tags:
        connection.execute(_INSERT_TAGS, [{"job_id": job_id, "tag": tag} for tag in tags])


_NEVER_LEADS = -1
_CLOCKS_DIFFER = timedelta(days=1)  # of machines that make ids and of the database, at the most
_FEW_TEXTS = 5000
_FEW_TAGGED = 12_000  # of a million runs: to find a page of two such tags in order would read half of them
_LETTERS = 3  # of the pieces that the indexes of texts know
# Of the tables themselves, as in `jobs`.
_OF_JOBS = [Job.__table__.c[field.name] for field in fields(JobRow) if field.name != "request"]
_OF_RUNS = [
    Run.__table__.c[name] for name in ("project_id", "name", "notes", "revision", "changed", "deleted")
]
_LISTED = select(*_OF_JOBS, *_OF_RUNS).outerjoin(Run, Run.job_id == Job.id)
_WHOLE = select(*_OF_JOBS, Job.request, *_OF_RUNS).outerjoin(Run, Run.job_id == Job.id)
_OF_ROW = [field.name for field in fields(JobRow)]
# Built once: building a statement costs more than running it.
_BY_ID = _WHOLE.where(Job.id == bindparam("job"))
_JOBS: BindParameter[Any] = bindparam("jobs", expanding=True)
_TAGS = select(_TAG.c.job_id, _TAG.c.tag).where(_TAG.c.job_id.in_(_JOBS)).order_by(_TAG.c.tag)
_RESULT = _TABLES["result"]
_SWEEPS = (
    select(_RESULT.c.job_id, func.count())
    .where(_RESULT.c.job_id.in_(_JOBS), _RESULT.c.of == SWEEP)
    .group_by(_RESULT.c.job_id)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """A run: a job with what is said of it.

    Attributes
    ----------
    revision : counts the changes of its words; 0 if there was none.
    changed, deleted : when its words were changed last, when it was put in the bin.
    sweeps : how many sweeps are stored with it.
    """

    job: JobRow
    words: RunWords
    revision: int = 0
    changed: datetime | None = None
    deleted: datetime | None = None
    sweeps: int = 0

    @property
    def id(self) -> str:
        """Its id, that of the job."""
        return self.job.id

    @property
    def owner(self) -> str:
        """Whom it belongs to."""
        return self.job.owner


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFilter:
    """Which runs to list; every condition must hold.

    Attributes
    ----------
    sees : whose runs are there; None for everybody's.
    status : in one of them; any if empty.
    tag : marked with all of them.
    text : in the name or the notes, whatever its case.
    created_after, created_before : handed in at the earliest, and earlier than.
    deleted : those in the bin in place of those outside.
    """

    sees: str | None = NOBODY
    owner: str | None = None
    status: Sequence[JobState] = ()
    kind: str | None = None
    scene: str | None = None
    project: str | None = None
    tag: Sequence[str] = ()
    text: str | None = None
    created_after: datetime | None = None
    created_before: datetime | None = None
    deleted: bool = False


class Runs(Binned[RunRow]):
    """Runs of one database."""

    what, said = "run", Run

    def get(self, job_id: str) -> RunRow | None:
        """The run, in the bin or not, whoever owns it, or None."""
        with self._db.reading() as connection:
            return next(iter(_rows(connection, _BY_ID, {"job": job_id})), None)

    def several(self, job_ids: Sequence[str], owners: Sequence[str] | None) -> list[RunRow]:
        """Those of the runs that there are and that one of these owners has, or anybody (None)."""
        query = _WHOLE.where(Job.id.in_(job_ids))
        with self._db.reading() as connection:
            return _rows(connection, query if owners is None else query.where(Job.owner.in_(owners)))

    def page(self, wanted: RunFilter, limit: int, before: str | None = None) -> list[RunRow]:
        """Runs that meet every condition, newest first, older than the run `before`."""
        query = _LISTED.order_by(Job.id.desc()).limit(limit)
        if before is not None:
            query = query.where(Job.id < before)
        # Ids sort by the time at which they were made: beyond these none can have been handed in in time.
        if wanted.created_after is not None:
            query = query.where(Job.id >= earliest_id(_shifted(wanted.created_after, -_CLOCKS_DIFFER)))
        if wanted.created_before is not None:
            query = query.where(Job.id < earliest_id(_shifted(wanted.created_before, _CLOCKS_DIFFER)))
        conditions = _conditions(wanted, sqlite=self._db.backend == "sqlite")
        leads = wanted.kind is None and wanted.scene is None
        if not wanted.deleted:
            query = query.where(~in_the_bin(Job.id))
        with self._db.reading() as connection:
            conditions += owner_condition(connection, Job.id, Job.owner, wanted.sees, leads=leads)
            return _rows(connection, met(connection, query, Job.id, conditions))

    def put_in_bin(self, row_id: str, sees: str | None) -> RunRow:
        """Put a run in the bin (ConflictError if it has not ended); one that is there stays since then."""
        state = self.seen(row_id, sees).job.state
        if not state.finished:
            raise ConflictError(f"run {row_id} is {state.value}: dismiss it first, DELETE /v1/jobs/{row_id}")
        return super().put_in_bin(row_id, sees)

    def _lock(self, connection: Connection, row_id: str, expected: Collection[int] | None) -> None:
        """Make a row if there is none, lock it and compare its revision."""
        insert = on_demand(f"sqlalchemy.dialects.{connection.dialect.name}:insert")
        names = ["job_id", "project_id", "name", "notes", "changed", "revision", "deleted"]
        now = literal(self._now(), Run.changed.type)
        made = select(Job.id, null(), literal(""), literal(""), now, literal(0), null()).where(
            Job.id == row_id
        )
        connection.execute(insert(Run).from_select(names, made).on_conflict_do_nothing())
        super()._lock(connection, row_id, expected)

    def _write(self, connection: Connection, row_id: str, values: Mapping[str, Any]) -> None:
        """Write `name`, `notes`, `tags` and `project` (InvalidRequestError if its owner has none such)."""
        own = {key: value for key, value in values.items() if key not in ("project", "tags")}
        if "project" in values:
            owner = connection.execute(select(Job.owner).where(Job.id == row_id)).scalar_one_or_none()
            require_project(connection, values["project"], owner)
            own["project_id"] = values["project"]
        if "tags" in values:
            put_tags(connection, row_id, values["tags"])
        super()._write(connection, row_id, own)


def _conditions(wanted: RunFilter, *, sqlite: bool) -> list[Condition]:
    equal = ((Job.kind, wanted.kind), (Job.scene_name, wanted.scene), (Job.owner, wanted.owner))
    found = [column == value for column, value in equal if value is not None]
    if wanted.status:
        found.append(Job.state.in_(list(wanted.status)))
    conditions = plain_conditions(Job.id, found)
    after, before = wanted.created_after, wanted.created_before
    times = [Job.created >= after] if after is not None else []
    times += [Job.created < before] if before is not None else []
    conditions += [Condition(ids=select(Job.id), holds=holds, few=_NEVER_LEADS) for holds in times]
    if wanted.project is not None:
        conditions.append(_said(Run.project_id == wanted.project))
    if wanted.deleted:
        conditions.append(_said(Run.deleted.is_not(None)))
    if wanted.text is not None:
        conditions.append(_containing(wanted.text, sqlite=sqlite))
    for tag in wanted.tag:
        ids = select(RunTag.job_id).where(RunTag.tag == tag)
        holds = ids.where(RunTag.job_id == Job.id).correlate(Job).exists()
        conditions.append(Condition(ids=ids, holds=holds, apart=True, few=_FEW_TAGGED))
    return conditions


def _shifted(when: datetime, by: timedelta) -> datetime:
    """A time moved, no further than there are dates."""
    try:
        return when + by
    except OverflowError:
        return when


def _containing(text: str, *, sqlite: bool) -> Condition:
    """The condition that a text stands in the name or the notes of a run, in whatever case.

    PostgreSQL takes its index of triples of letters by itself. SQLite's is asked by name, and so are the
    letters and pairs of letters of both.
    """
    pattern = "%" + re.sub("([%_/])", r"/\1", text) + "%"
    # LIKE of SQLite takes capitals for small letters by itself, and ILIKE there folds each text first.
    alike = [one.like if sqlite else one.ilike for one in (Run.name, Run.notes)]
    holds = or_(*(one(pattern, escape="/") for one in alike))
    held, ids = holds, None
    if sqlite and len(text) < _LETTERS:
        term, begins = RUN_LETTERS.c.term, text.lower()
        there = and_(term >= begins, term < begins + chr(sys.maxunicode))
        held = Run.number.in_(select(RUN_LETTERS.c.doc).where(there))
        # Joined, not asked for among all that have them: as many are read as are counted.
        ids = select(Run.job_id).join(RUN_LETTERS, Run.number == RUN_LETTERS.c.doc).where(there)
    elif sqlite:
        phrase = '"{}"'.format(text.replace('"', '""'))
        held = Run.number.in_(select(RUN_TEXT.c.rowid).where(RUN_TEXT.c.run_text.match(phrase)))
    elif len(text) < _LETTERS:
        from sqlalchemy.dialects.postgresql import ARRAY, array

        letters = func.letters_of(Run.name, Run.notes, type_=ARRAY(Text))  # as the index says it
        held = letters.contains(array([func.lower(text)]))
    ids = select(Run.job_id).where(held) if ids is None else ids
    # Of what many runs have a page is soon found by looking at each; but LIKE of SQLite folds ASCII alone.
    return Condition(ids=ids, holds=holds if text.isascii() else held, apart=True, few=_FEW_TEXTS)


def _said(held: ColumnElement[bool]) -> Condition:
    """A condition on what is said of a run."""
    return Condition(ids=select(Run.job_id).where(held), holds=held, apart=True)


def _rows(
    connection: Connection, query: Select[Any], given: Mapping[str, object] | None = None
) -> list[RunRow]:
    rows = connection.execute(query, given).mappings().all()
    if not rows:
        return []
    jobs = [row["id"] for row in rows]
    tags = _tags(connection, jobs)
    sweeps = _sweeps(connection, [row["result_of"] or row["id"] for row in rows])
    return [
        RunRow(
            job=JobRow(**{name: row[name] for name in _OF_ROW if name in row}),
            words=RunWords(
                project=row["project_id"], name=row["name"] or "", notes=row["notes"] or "",
                tags=tuple(tags[row["id"]]),
            ),
            revision=row["revision"] or 0,
            changed=row["changed"],
            deleted=row["deleted"],
            sweeps=sweeps.get(row["result_of"] or row["id"], 0),
        )
        for row in rows
    ]  # fmt: skip


def _tags(connection: Connection, jobs: Sequence[str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = defaultdict(list)
    for job_id, tag in connection.execute(_TAGS, {"jobs": jobs}):
        found[job_id].append(tag)
    return found


def _sweeps(connection: Connection, jobs: Sequence[str]) -> dict[str, int]:
    """How many sweeps are stored with each of the jobs."""
    return {row[0]: row[1] for row in connection.execute(_SWEEPS, {"jobs": jobs})}


MOST_SHARES = 20
NO_LINK = "there is no such link, or it has ended"
_TOKENS = Tokens("share", id_bytes=8)


class Shares(Rows[Share]):
    """Links to the runs of one database."""

    table = Share

    def __init__(self, database: Database, runs: Runs, now: Clock) -> None:
        super().__init__(database, now)
        self._runs = runs

    def add(self, job_id: str, days: float | None, sees: str | None, most: int = MOST_SHARES) -> Made[Share]:
        """Make a link to a run.

        NotFoundError, ConflictError, StorageFullError if there is no such run, it is in the bin, it has
        `most` links. `days`: after which it ends; None for never.
        """
        self._runs.outside(job_id, sees)
        share_id, token = _TOKENS.new()
        now = self._now()
        expires = None if days is None else now + timedelta(days=days)
        row = Share(id=share_id, job_id=job_id, digest=digest_of(token), created=now, expires=expires)
        with self._db.writing() as connection:
            words = f"a run may have {most} links: end one of run {job_id}"
            self._require_room(connection, Share.job_id == job_id, most, words)
            return Made(self._insert(connection, row), token)

    def of_run(self, job_id: str, sees: str | None) -> list[Share]:
        """The links to a run, without their tokens, oldest first."""
        self._runs.seen(job_id, sees)
        return self._all(self._select.where(Share.job_id == job_id).order_by(Share.created, Share.id))

    def page(
        self, sees: str | None, limit: int, after: Position | None = None
    ) -> list[tuple[Share, Position]]:
        """The links to the runs of an owner, or to everybody's (None), newest first, each with its place."""
        query = self._select.order_by(Share.created.desc(), Share.id.desc()).limit(limit)
        if sees is not None:
            query = query.where(Share.job_id.in_(select(Job.id).where(Job.owner == sees)))
        if after is not None and after[0] is not None:
            try:
                created = datetime.fromtimestamp(after[0], UTC)
            except (OverflowError, ValueError, OSError) as error:
                raise refused(str(after[0])) from error
            place = (literal(created, Share.created.type), literal(after[1]))
            query = query.where(tuple_(Share.created, Share.id) < tuple_(*place))
        return [(row, (row.created.timestamp(), row.id)) for row in self._all(query)]

    def end(self, job_id: str, share_id: str, sees: str | None) -> None:
        """End a link to a run (NotFoundError if there is none)."""
        self._runs.seen(job_id, sees)
        if not self._updated(delete(Share).where(Share.id == share_id, Share.job_id == job_id)):
            raise NotFoundError(f"run {job_id} has no link {share_id!r:.80}")

    def run_of(self, token: str) -> RunRow:
        """The run that a link is to.

        NotFoundError if the link is none, has ended, or its run is in the bin.
        """
        share_id = _TOKENS.id_of(token)
        row = None if share_id is None else self.get(share_id)
        run = None
        if matches(token, row) and row is not None and (row.expires is None or row.expires > self._now()):
            run = self._runs.get(row.job_id)
        if run is None or run.deleted is not None:
            raise NotFoundError(NO_LINK)
        return run
