"""What is deleted when it is old, piece by piece, so that nobody waits for it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, Connection, Text, and_, cast, delete, func, join, or_, select, update
from sqlalchemy.orm import aliased

from service.db.engine import Database
from service.db.models import Job, JobState, Project, Result, Run, Share, SweepArray, Upload
from service.db.repositories.attempts import ADD_STORED
from service.jobs.common.scene_requests import UPLOAD
from service.jobs.stored_figures import DESIGN, SWEEP

_ENDED = [state for state in JobState if state.finished]
_NO_ANSWER = ""
"""The spec hash of a job that is no answer any more to who asks for the same."""
_NAMED = re.compile(re.escape(UPLOAD) + r"([0-9a-f-]+)")
_later = aliased(Job)
_HAS_DESIGN, _HAS_SWEEPS = (
    select(Result.id).where(Result.job_id == Job.id, Result.of == of).correlate(Job).exists()
    for of in (DESIGN, SWEEP)
)
_SWEEPS = join(Result, Job, and_(Job.id == Result.job_id, Result.of == SWEEP))
_IS_AN_ANSWER = select(_later.id).where(_later.result_of == Job.id).correlate(Job).exists()


@dataclass(frozen=True, slots=True, kw_only=True)
class Pruned:
    """How much was, or would be, deleted: jobs with their results, sweeps with their arrays, and others."""

    jobs: int = 0
    sweeps: int = 0
    uploads: int = 0
    projects: int = 0
    links: int = 0

    def __add__(self, other: Pruned) -> Pruned:
        return Pruned(**{name: count + getattr(other, name) for name, count in asdict(self).items()})


class RetentionRepository:
    """Old jobs and uploads of one database.

    A job is deleted with all it computed; one that a younger job gives as its answer (`result_of`) is kept as
    long as that. Of designs that are kept, the sweeps are deleted. What is about to lose its sweeps is taken
    out of the store of results first: nobody gets it as an answer from then on.
    """

    def __init__(self, database: Database) -> None:
        self._db = database

    def count(self, before: datetime, *, keep_designs: bool) -> Pruned:
        """How much would be deleted of jobs that ended, or were put in the bin, before a time."""
        old = _old(before, keep_designs=keep_designs)
        gone = and_(old, ~_HAS_DESIGN) if keep_designs else old
        binned = _binned(before)
        old, gone = or_(old, binned), or_(gone, binned)
        jobs = select(func.count()).select_from(Job).where(gone)
        sweeps = select(func.count()).select_from(_SWEEPS).where(old)
        projects = select(func.count()).select_from(Project).where(Project.deleted < before)
        with self._db.reading() as connection:
            return Pruned(
                jobs=connection.execute(jobs).scalar_one(), sweeps=connection.execute(sweeps).scalar_one(),
                projects=connection.execute(projects).scalar_one(),
            )  # fmt: skip

    def take(self, before: datetime, most: int, *, keep_designs: bool, binned: bool = False) -> list[str]:
        """Take up to `most` old jobs out of the store of results; their ids, oldest first.

        `binned`: those that were put in the bin before the time, in place of those that ended before it.
        """
        old = _binned(before) if binned else _old(before, keep_designs=keep_designs)
        query = select(Job.id).where(old).order_by(Job.id).limit(most)
        with self._db.reading() as connection:
            ids = list(connection.execute(query).scalars())
        if ids:
            with self._db.writing() as connection:
                connection.execute(update(Job).where(Job.id.in_(ids)).values(spec_hash=_NO_ANSWER))
        return ids

    def delete_sweeps(self, jobs: Sequence[str], most: int, *, keep_designs: bool) -> int:
        """Delete up to `most` sweeps of these jobs; how many were."""
        free = or_(~_IS_AN_ANSWER, _HAS_DESIGN) if keep_designs else ~_IS_AN_ANSWER
        query = select(Result.id).select_from(_SWEEPS).where(Job.id.in_(jobs), free).limit(most)
        with self._db.writing() as connection:
            ids = list(connection.execute(query).scalars())
            outside = _outside(connection, ids) if ids else []
            if ids:
                _uncount(connection, ids)
                connection.execute(delete(Result).where(Result.id.in_(ids)))
        self._delete_outside(outside)
        return len(ids)

    def _delete_outside(self, jobs: Sequence[str]) -> None:
        """Delete what jobs have outside of the database and no row refers to any more."""
        if self._db.arrays is None:
            return
        for job in jobs:
            left = select(SweepArray.sha256).join(Result, Result.id == SweepArray.sweep_id)
            with self._db.reading() as connection:
                digests = connection.execute(left.where(Result.job_id == job)).scalars().all()
            self._db.arrays.keep(job, digests)

    def delete_jobs(self, jobs: Sequence[str], *, keep_designs: bool) -> int:
        """Delete these jobs, whose sweeps are deleted, with their results; how many were."""
        gone = and_(Job.id.in_(jobs), ~_HAS_SWEEPS, ~_IS_AN_ANSWER)
        query = select(Job.id).where(and_(gone, ~_HAS_DESIGN) if keep_designs else gone)
        with self._db.writing() as connection:
            ids = list(connection.execute(query).scalars())
            if ids:
                connection.execute(delete(Job).where(Job.id.in_(ids)))
        return len(ids)

    def delete_projects(self, before: datetime) -> int:
        """Delete the projects that were put in the bin before a time; how many were. Their runs stay."""
        return self._delete_any(Project, Project.deleted < before)

    def delete_links(self, now: datetime) -> int:
        """Delete the links to runs whose time is over; how many were."""
        return self._delete_any(Share, Share.expires < now)

    def _delete_any(self, table: type[Project | Share], condition: ColumnElement[bool]) -> int:
        """Delete the rows of a condition; nothing is written where there is none."""
        with self._db.reading() as connection:
            if connection.execute(select(table.id).where(condition).limit(1)).one_or_none() is None:
                return 0
        with self._db.writing() as connection:
            return connection.execute(delete(table).where(condition)).rowcount

    def old_uploads(self, before: datetime) -> list[str]:
        """Ids of the uploads that came before a time and that nobody uses, oldest first.

        A job holds what its uploads held from the moment it is accepted. One that a waiting or running job
        names is kept all the same, and one that a job named which came since: its client may go on with it.
        """
        old = select(Upload.id).where(Upload.created < before).order_by(Upload.id)
        request = cast(Job.request, Text)
        used = select(request).where(
            or_(Job.state.not_in(_ENDED), Job.created >= before), request.contains(UPLOAD)
        )
        with self._db.reading() as connection:
            found = list(connection.execute(old).scalars())
            requests = connection.execute(used).scalars() if found else ()
            named = {one for text in requests for one in _NAMED.findall(text)}
        return [one for one in found if one not in named]


def _outside(connection: Connection, sweeps: Sequence[str]) -> Sequence[str]:
    """The jobs of those sweeps that have arrays outside of the database."""
    query = select(Result.job_id).distinct().join(SweepArray, SweepArray.sweep_id == Result.id)
    return (
        connection.execute(query.where(Result.id.in_(sweeps), SweepArray.size.is_not(None))).scalars().all()
    )


def _uncount(connection: Connection, sweeps: Sequence[str]) -> None:
    """Take what sweeps store from what their jobs are said to."""
    freed = (
        select(
            Result.job_id,
            func.sum(func.coalesce(SweepArray.size, func.length(SweepArray.data))).label("bytes"),
        )
        .join(SweepArray, SweepArray.sweep_id == Result.id)
        .where(Result.id.in_(sweeps))
        .group_by(Result.job_id)
    )
    for row in connection.execute(freed).all():
        connection.execute(ADD_STORED, {"job": row.job_id, "more": -row.bytes})


def _old(before: datetime, *, keep_designs: bool) -> ColumnElement[bool]:
    """Jobs that ended before a time and have something to be deleted."""
    ended = and_(Job.state.in_(_ENDED), Job.finished < before)
    if not keep_designs:
        return and_(ended, ~_IS_AN_ANSWER)
    return and_(ended, or_(and_(~_HAS_DESIGN, ~_IS_AN_ANSWER), and_(_HAS_DESIGN, _HAS_SWEEPS)))


def _binned(before: datetime) -> ColumnElement[bool]:
    """Jobs that were put in the bin before a time, and that no younger one gives as its answer."""
    deleted = select(Run.job_id).where(Run.deleted < before)
    return and_(Job.id.in_(deleted), Job.state.in_(_ENDED), ~_IS_AN_ANSWER)
