"""How many jobs wait, and whether the queue takes another one."""

from __future__ import annotations

import time

from sqlalchemy import Connection, bindparam, func, literal, select

from service.db import postgresql
from service.db.models import Job, JobState
from service.errors import QueueFullError, TooManyRequestsError

_MARGIN = 5000
_COUNT_SECONDS = 1.0
_C = Job.metadata.tables["job"].c
_WAITING = select(literal(1)).where(_C.state == JobState.ACCEPTED).limit(bindparam("most")).subquery()
_COUNT = select(func.count()).select_from(_WAITING)
_COUNT_OF_OWNER = select(func.count()).select_from(
    select(literal(1))
    .where(_C.state == JobState.ACCEPTED, _C.owner == bindparam("owner"))
    .limit(bindparam("most"))
    .subquery()
)


class Room:
    """Refuses jobs when as many wait as the queue takes.

    Far from the limit a count serves for a second, so that a long queue costs its clients nothing. Near it
    every job is counted, on PostgreSQL under a lock that all services share and hold until they commit: jobs
    that several of them accept at the same moment do not exceed it.
    """

    def __init__(self) -> None:
        self._waiting = 0
        self._counted = -_COUNT_SECONDS
        self._transaction: object = None

    def require(self, connection: Connection, limit: int) -> None:
        """Count one more job.

        Raises
        ------
        QueueFullError
            `limit` jobs wait already.
        """
        fresh = time.monotonic() - self._counted < _COUNT_SECONDS
        transaction = connection.get_transaction()
        counted_here = transaction is self._transaction
        if not counted_here and not (fresh and self._waiting + _MARGIN < limit):
            if connection.dialect.name != "sqlite":
                postgresql.lock_room(connection)
            self._waiting = connection.execute(_COUNT, {"most": limit}).scalar_one()
            self._counted, self._transaction = time.monotonic(), transaction
        if self._waiting >= limit:
            self._transaction = None
            raise QueueFullError(
                f"{self._waiting} jobs wait already, the queue takes {limit}: try again later", retry_after=10
            )
        self._waiting += 1


def require_share(connection: Connection, owner: str, limit: int) -> None:
    """Refuse an owner of whose jobs `limit` wait already.

    Raises
    ------
    TooManyRequestsError
        If it is so. Jobs that several services accept at the same moment may exceed it by their number.
    """
    waiting = connection.execute(_COUNT_OF_OWNER, {"owner": owner, "most": limit}).scalar_one()
    if waiting >= limit:
        raise TooManyRequestsError(
            f"{waiting} jobs of {owner} wait already, the key allows {limit}: try again later", retry_after=10
        )
