"""Group commit: writes that wait for the database at the same moment are made in one transaction."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, TypeVar, cast

from sqlalchemy import Connection
from sqlalchemy.exc import IntegrityError

from service.errors import DatabaseAwayError, ServiceError

_MOST = 64
_RETRY_SECONDS = 5

_Written = TypeVar("_Written")
Work = Callable[[Connection], _Written]


class _Work:
    """A piece of work of one thread, and what became of it."""

    __slots__ = ("ended", "error", "result", "taken", "work")

    def __init__(self, work: Work[Any]) -> None:
        self.work = work
        self.taken = False
        self.ended = threading.Event()
        self.result: Any = None
        self.error: BaseException | None = None

    def attempt(self, connection: Connection) -> None:
        """Do the work; a refusal is for its caller alone and leaves the transaction of the others whole."""
        self.result = self.error = None
        try:
            self.result = self.work(connection)
        except ServiceError as error:
            self.error = error


class GroupedWrites:
    """Writes of many threads; those that wait while another is written are written together.

    The first thread that comes writes at once, for itself and for everybody who came by then: a lone write
    waits for nothing, and under load the cost of a commit is shared. If anything goes wrong in a common
    transaction it is rolled back and each piece of work is done again in one of its own, so that every
    caller has its own result or its own error.

    Parameters
    ----------
    writing : callable
        Begins a transaction that commits at its end.
    leaders : int
        Most transactions at a time.
    seconds : float
        Longest time a write waits for its turn, and after which what failed together is not tried again [s].
    """

    def __init__(
        self, writing: Callable[[], AbstractContextManager[Connection]], leaders: int, seconds: float
    ) -> None:
        self._writing = writing
        self._seconds = seconds
        self._leading = threading.BoundedSemaphore(leaders)
        self._lock = threading.Lock()
        self._pending: deque[_Work] = deque()

    def do(self, work: Work[_Written]) -> _Written:
        """Have `work` done and committed.

        It may be done more than once, in transactions of which one is committed; a `ServiceError` it raises
        must come before it writes anything.

        Raises
        ------
        DatabaseAwayError
            If it was not its turn in time; nothing was written.
        """
        entry = _Work(work)
        with self._lock:
            self._pending.append(entry)
        end = time.monotonic() + self._seconds
        while not entry.taken:
            if self._leading.acquire(timeout=max(0.0, end - time.monotonic())):
                try:
                    self._write(self._take())
                finally:
                    self._leading.release()
            elif self._withdrawn(entry):
                raise DatabaseAwayError(
                    f"the database took no write for {self._seconds:g} s; nothing was written", _RETRY_SECONDS
                )
        entry.ended.wait()
        if entry.error is not None:
            raise entry.error
        return cast(_Written, entry.result)

    def _withdrawn(self, entry: _Work) -> bool:
        """Take an entry back that waits; False if it is being written."""
        with self._lock:
            if entry.taken:
                return False
            self._pending.remove(entry)
            return True

    def _take(self) -> list[_Work]:
        with self._lock:
            batch = [self._pending.popleft() for _ in range(min(len(self._pending), _MOST))]
            for entry in batch:
                entry.taken = True
        return batch

    def _write(self, batch: list[_Work]) -> None:
        if not batch:
            return
        end = time.monotonic() + self._seconds
        try:
            failed = None if len(batch) == 1 else self._together(batch)
            if len(batch) == 1 or failed is not None:
                for entry in batch:
                    if failed is not None and time.monotonic() >= end:
                        # The database is away: each by itself would only wait as long as all together.
                        entry.error = failed
                    else:
                        self._alone(entry)
        finally:
            # Whatever happened, nobody is left waiting: what was not written has its error by now.
            for entry in batch:
                entry.ended.set()

    def _together(self, batch: list[_Work]) -> Exception | None:
        """Write all in one transaction; the error if that failed and nothing was written."""
        try:
            with self._writing() as connection:
                for entry in batch:
                    entry.attempt(connection)
        except Exception as error:  # noqa: BLE001 - each is tried again by itself and tells its own caller
            return error
        return None

    def _alone(self, entry: _Work) -> None:
        """Write one in its own transaction; again if another service wrote the same row meanwhile."""
        for last in (False, True):
            try:
                with self._writing() as connection:
                    entry.attempt(connection)
                return
            except IntegrityError as error:
                entry.error = error
                if last:
                    return
            except BaseException as error:
                entry.error = error
                if not isinstance(error, Exception):
                    raise
                return
