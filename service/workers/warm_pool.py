"""Warm worker processes for what somebody waits for: whose turn it is, and what becomes of it."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from service.db.clock import new_id, utc_now
from service.db.repositories import Attempt
from service.jobs.kind_registry import RunOn, WarmUp
from service.jobs.outputs import Pace
from service.workers.executor import Outcome, Stopped, Unwatched
from service.workers.executors import LocalExecutor
from service.workers.process_limits import ProcessLimits
from solver.jit.beside import missing

_SILENT = Pace(progress_seconds=3600.0, checkpoint_seconds=3600.0, checkpoint_bytes=0)


@dataclass(eq=False, slots=True)
class WarmTask:
    """A computation somebody waits for.

    Attributes
    ----------
    attempt : what is computed.
    owner : whose turn it is.
    client : of its computations only the newest counts; empty: each of them.
    most : so many of the owner may wait; None: any number.
    begun, outcome : done when it begins and when it ends.
    """

    attempt: Attempt
    owner: str
    client: str = ""
    most: int | None = None
    begun: Future[None] = field(default_factory=Future)
    outcome: Future[Outcome] = field(default_factory=Future)

    @classmethod
    def of(cls, task: str, spec: dict[str, Any], owner: str, **more: Any) -> WarmTask:
        """A task with what it is given."""
        attempt = Attempt(
            job_id=new_id(),
            kind=task,
            spec=spec,
            attempt=1,
            max_attempts=1,
            lease_owner="warm",
            created=utc_now(),
        )
        return cls(attempt, owner, **more)

    def settle(self, outcome: Outcome | Exception) -> None:
        """Tell who waits for it, who may have gone at this moment."""
        if self.outcome.done() or not self.outcome.set_running_or_notify_cancel():
            return
        if isinstance(outcome, Exception):
            self.outcome.set_exception(outcome)
        else:
            self.outcome.set_result(outcome)


class WarmPool(Unwatched, ABC):
    """Computes what somebody waits for; a `Sink` of its executor.

    Parameters
    ----------
    runs : mapping
        The function of each task; sent to the processes by name.
    warm_up : callable
        Called in every process before it takes a task; sent by name.
    workers : int
        Processes.
    grace_seconds : float
        Time between asking a computation to stop and killing its process [s].
    limits : ProcessLimits
        What each process may use.
    """

    def __init__(
        self, runs: Mapping[str, RunOn], warm_up: WarmUp, *, workers: int, grace_seconds: float,
        limits: ProcessLimits,
    ) -> None:  # fmt: skip
        self._runs = runs
        self._warm_up = warm_up
        self._workers = workers
        self._grace_seconds = grace_seconds
        self._process_limits = limits
        self._lock = threading.RLock()
        self._waiting: deque[WarmTask] = deque()
        self._running: dict[str, WarmTask] = {}
        self._executor: LocalExecutor | None = None
        self._closed = False
        self.interprets = False

    @abstractmethod
    def _admit(self, asked: WarmTask) -> None:
        """Raise an error if it may not wait; the pool's lock is held."""

    @abstractmethod
    def _next(self) -> WarmTask | None:
        """The one of those waiting whose turn it is, if one may begin; the pool's lock is held."""

    def _limits(self) -> ProcessLimits:
        """What each process that begins now may use."""
        return self._process_limits

    @property
    def ready(self) -> int:
        """How many processes are up."""
        executor = self._executor
        return 0 if executor is None else executor.status().ready

    def begin(self) -> None:
        """Start the processes if they do not run: for those who will want an answer in a moment."""
        with self._lock:
            if self._closed or self._executor is not None:
                return
            self.interprets = missing()
            self._executor = LocalExecutor(
                self._runs, self._warm_up, workers=self._workers, grace_seconds=self._grace_seconds,
                pace=_SILENT, limits=self._limits(),
            )  # fmt: skip
            self._executor.start(self)

    def renew(self) -> None:
        """Have new processes compute; what is computed now is begun again there."""
        with self._lock:
            old, self._executor = self._executor, None
        if old is not None:
            self.begin()
            old.close()

    def close(self) -> None:
        """End the processes, and what they compute; whoever waits is told."""
        with self._lock:
            self._closed = True
            left = [*self._waiting, *self._running.values()]
            self._waiting, self._running = deque(), {}
            executor, self._executor = self._executor, None
        for asked in left:
            asked.settle(Stopped())
        if executor is not None:
            executor.close()

    @contextmanager
    def _waited_for(self, asked: WarmTask) -> Iterator[None]:
        """Have it computed as long as the block lasts."""
        with self._lock:
            self._admit(asked)
            self._waiting.append(asked)
        try:
            self.begin()
            self.room()
            yield
        finally:
            self._drop(asked)

    def _drop(self, asked: WarmTask) -> None:
        """Nobody waits for it any more."""
        asked.outcome.cancel()
        with self._lock:
            if asked in self._waiting:
                self._waiting.remove(asked)
            if asked.attempt.job_id in self._running and self._executor is not None:
                self._executor.stop_attempt(asked.attempt)

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        """Tell the one who waits for it."""
        with self._lock:
            asked = self._running.pop(attempt.job_id, None)
            if asked is not None and isinstance(outcome, Stopped) and not asked.outcome.done():
                # Its process ended before it had begun: it is computed when there is another.
                self._waiting.appendleft(asked)
                return
            if asked is not None:
                self._concluded(asked, outcome)
                asked.settle(outcome)
        self.room()

    def _concluded(self, asked: WarmTask, outcome: Outcome) -> None:
        """Note how it ended; the pool's lock is held."""

    def room(self) -> None:
        """Compute what may go on."""
        with self._lock:
            executor = self._executor
            # One to a process: what waits in the pipe of one would wait for a costly one before it.
            while executor is not None and len(self._running) < self.ready:
                asked = self._next()
                if asked is None:
                    return
                self._waiting.remove(asked)
                self._running[asked.attempt.job_id] = asked
                if not asked.begun.done():
                    asked.begun.set_result(None)
                executor.submit(asked.attempt)
