"""The runs: jobs with what is said of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, func, literal, null, or_, select
from sqlalchemy.dialects import postgresql, sqlite

from service.db.models import NOBODY, Job, JobState, Run, RunTag, Sweep
from service.db.pagination import Condition, met, owner_condition, plain_conditions
from service.db.repositories.owned import Binned
from service.db.repositories.rows import JobRow, RunWords
from service.db.repositories.run_words import in_the_bin, put_tags, require_project
from service.errors import ConflictError

_NEVER_LEADS = -1
_OF_JOBS = [getattr(Job, field.name) for field in fields(JobRow) if field.name != "request"]
_OF_RUNS = (Run.project_id, Run.name, Run.notes, Run.revision, Run.changed, Run.deleted)
_LISTED = select(*_OF_JOBS, *_OF_RUNS).outerjoin(Run, Run.job_id == Job.id)
_WHOLE = select(*_OF_JOBS, Job.request, *_OF_RUNS).outerjoin(Run, Run.job_id == Job.id)
_OF_ROW = [field.name for field in fields(JobRow)]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """A run: a job with what is said of it.

    Attributes
    ----------
    revision : int
        Counts the changes of its words; 0 if there was none.
    changed, deleted : datetime or None
        When its words were changed last, when it was put in the bin.
    sweeps : int
        How many sweeps are stored with it.
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
    sees : str or None
        Whose runs are there; None for everybody's.
    status : sequence of JobState
        In one of them; any if empty.
    tag : sequence of str
        Marked with all of them.
    text : str or None
        In the name or the notes, whatever its case.
    created_after, created_before : datetime or None
        Handed in at the earliest, and earlier than.
    deleted : bool
        Those in the bin in place of those outside.
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
            return next(iter(_rows(connection, _WHOLE.where(Job.id == job_id))), None)

    def page(self, wanted: RunFilter, limit: int, before: str | None = None) -> list[RunRow]:
        """Runs that meet every condition, newest first, older than the run `before`."""
        query = _LISTED.order_by(Job.id.desc()).limit(limit)
        if before is not None:
            query = query.where(Job.id < before)
        conditions = _conditions(wanted)
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
        insert = sqlite.insert if connection.dialect.name == "sqlite" else postgresql.insert
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


def _conditions(wanted: RunFilter) -> list[Condition]:
    equal = (
        (Job.kind, wanted.kind),
        (Job.scene_name, wanted.scene),
        (Job.owner, wanted.owner),
    )
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
        text = or_(*(one.icontains(wanted.text, autoescape=True) for one in (Run.name, Run.notes)))
        conditions.append(_said(text, few=_NEVER_LEADS))
    for tag in wanted.tag:
        ids = select(RunTag.job_id).where(RunTag.tag == tag)
        holds = ids.where(RunTag.job_id == Job.id).correlate(Job).exists()
        conditions.append(Condition(ids=ids, holds=holds, apart=True))
    return conditions


def _said(holds: ColumnElement[bool], **values: Any) -> Condition:
    """A condition on what is said of a run."""
    ids = select(Run.job_id).where(holds)
    return Condition(ids=ids, holds=holds, apart="few" not in values, **values)


def _rows(connection: Connection, query: Select[Any]) -> list[RunRow]:
    rows = connection.execute(query).mappings().all()
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
    query = select(RunTag.job_id, RunTag.tag).where(RunTag.job_id.in_(jobs)).order_by(RunTag.tag)
    for row in connection.execute(query):
        found[row.job_id].append(row.tag)
    return found


def _sweeps(connection: Connection, jobs: Sequence[str]) -> dict[str, int]:
    """How many sweeps are stored with each of the jobs."""
    query = select(Sweep.job_id, func.count()).where(Sweep.job_id.in_(jobs)).group_by(Sweep.job_id)
    return {row[0]: row[1] for row in connection.execute(query)}
