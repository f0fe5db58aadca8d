"""Which waiting jobs are run next, and how many may wait: owners take turns, then the highest priority.

An owner with ten thousand jobs and one with a single job wait for each other equally: the next job is that of
the owner of whom the fewest run, at all services together, and among those of the one who was served longest
ago by this one. Only owners of whom jobs wait are looked at, each found in the index by one step of a
recursion: their number costs time, that of the jobs does not.
"""

from __future__ import annotations

import heapq
import time
from collections import Counter, OrderedDict
from typing import Any

from sqlalchemy import Connection, bindparam, func, literal, select, text

from service.db import postgresql
from service.db.models import Job, JobState
from service.db.repositories.attempts import TAKEN
from service.errors import QueueFullError, TooManyRequestsError

_C = Job.metadata.tables["job"].c
_ABOVE_ALL = 1_000_000
_REMEMBERED = 10_000

# Recursion in place of DISTINCT, which would read every waiting job.
WAITING_OWNERS = text(
    """
    WITH RECURSIVE waiting(owner) AS (
        SELECT min(owner) FROM job WHERE state = 'accepted'
        UNION ALL
        SELECT (SELECT min(job.owner) FROM job WHERE job.state = 'accepted' AND job.owner > waiting.owner)
        FROM waiting WHERE waiting.owner IS NOT NULL
    )
    SELECT waiting.owner,
           (SELECT count(*) FROM job WHERE job.state = 'running' AND job.owner = waiting.owner) AS running
    FROM waiting WHERE waiting.owner IS NOT NULL
    """
)
NEXT_PRIORITY = select(func.max(_C.priority)).where(
    _C.state == JobState.ACCEPTED, _C.owner == bindparam("of"), _C.priority < bindparam("below")
)
NEXT_JOBS = (
    select(*(_C[name] for name in TAKEN))
    .where(_C.state == JobState.ACCEPTED, _C.owner == bindparam("of"), _C.priority == bindparam("priority"))
    .order_by(_C.id)
    .limit(bindparam("most"))
    .with_for_update(skip_locked=True)
)


class Turns:
    """Chooses the next jobs; remembers who was served when."""

    def __init__(self) -> None:
        self._served: OrderedDict[str, int] = OrderedDict()
        self._number = 0

    def next_jobs(self, connection: Connection, most: int) -> list[Any]:
        """Up to `most` rows of waiting jobs, locked, in the order in which they are to run."""
        owners = {row.owner: row.running for row in connection.execute(WAITING_OWNERS)}
        found: list[Any] = []
        had: Counter[str] = Counter()
        while owners and len(found) < most:
            turns = self._turns(owners, most - len(found))
            asked = Counter(turns)
            rows = {one: _of_owner(connection, one, had[one] + asked[one])[had[one] :] for one in asked}
            for one in turns:
                if rows[one]:
                    found.append(rows[one].pop(0))
                    owners[one] += 1
                    had[one] += 1
                else:
                    # No more wait, or another service takes them at this moment.
                    owners.pop(one, None)
        self._remember([row.owner for row in found])
        return found

    def _turns(self, running: dict[str, int], most: int) -> list[str]:
        """Whose turn it is `most` times."""
        heap = [(number, self._served.get(owner, -1), owner) for owner, number in running.items()]
        heapq.heapify(heap)
        turns = []
        for at in range(most):
            number, _, owner = heap[0]
            turns.append(owner)
            heapq.heapreplace(heap, (number + 1, self._number + at, owner))
        return turns

    def _remember(self, owners: list[str]) -> None:
        for owner in owners:
            self._number += 1
            self._served[owner] = self._number
            self._served.move_to_end(owner)
        while len(self._served) > _REMEMBERED:
            self._served.popitem(last=False)


def _of_owner(connection: Connection, owner: str, most: int) -> list[Any]:
    """The next waiting jobs of an owner.

    The index holds priorities and ids both ascending: one priority after the other is read from it in order,
    where "highest priority, then lowest id" would sort all that waits for every job taken.
    """
    found: list[Any] = []
    below: int | None = _ABOVE_ALL
    while len(found) < most:
        below = connection.execute(NEXT_PRIORITY, {"of": owner, "below": below}).scalar_one()
        if below is None:
            break
        asked = {"of": owner, "priority": below, "most": most - len(found)}
        found += connection.execute(NEXT_JOBS, asked).all()
    return found


_MARGIN = 5000
_COUNT_SECONDS = 1.0
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
        """Count one more job (QueueFullError if `limit` jobs wait already)."""
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
