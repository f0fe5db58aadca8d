"""Group commit: writes that wait for the database at the same moment are made in one transaction."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, TypeVar, cast

from sqlalchemy import Connection
from sqlalchemy.exc import IntegrityError

from service.errors import ServiceError

_MOST = 64

_Written = TypeVar("_Written")
Work = Callable[[Connection], _Written]


class _Entry:
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
    """

    def __init__(self, writing: Callable[[], AbstractContextManager[Connection]], leaders: int) -> None:
        self._writing = writing
        self._leading = threading.BoundedSemaphore(leaders)
        self._lock = threading.Lock()
        self._pending: deque[_Entry] = deque()

    def do(self, work: Work[_Written]) -> _Written:
        """Have `work` done and committed.

        It may be done more than once, in transactions of which one is committed; a `ServiceError` it raises
        must come before it writes anything.
        """
        entry = _Entry(work)
        with self._lock:
            self._pending.append(entry)
        while not entry.taken:
            with self._leading:
                self._write(self._take())
        entry.ended.wait()
        if entry.error is not None:
            raise entry.error
        return cast(_Written, entry.result)

    def _take(self) -> list[_Entry]:
        with self._lock:
            batch = [self._pending.popleft() for _ in range(min(len(self._pending), _MOST))]
            for entry in batch:
                entry.taken = True
        return batch

    def _write(self, batch: list[_Entry]) -> None:
        if not batch:
            return
        try:
            if len(batch) == 1 or not self._together(batch):
                for entry in batch:
                    self._alone(entry)
        finally:
            # Whatever happened, nobody is left waiting: what was not written has its error by now.
            for entry in batch:
                entry.ended.set()

    def _together(self, batch: list[_Entry]) -> bool:
        """Write all in one transaction; False if that failed and nothing was written."""
        try:
            with self._writing() as connection:
                for entry in batch:
                    entry.attempt(connection)
        except Exception:  # noqa: BLE001 - each is tried again by itself and then tells its own caller
            return False
        return True

    def _alone(self, entry: _Entry) -> None:
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
