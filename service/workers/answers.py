"""Computations that somebody waits for: in warm worker processes with limits, for several owners in turn."""

from __future__ import annotations

import asyncio
import json
import logging
import signal
import threading
from collections import Counter, deque
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from service.auth.rate_limit import Buckets
from service.db.repositories import Attempt
from service.errors import (
    BodyTooLargeError,
    InvalidRequestError,
    MalformedBodyError,
    QueueFullError,
    TooManyRequestsError,
)
from service.jobs.ids import new_id
from service.jobs.outputs import FailureKind, JobFailure, Pace
from service.jobs.registry import RunOn, WarmUp
from service.workers.base import Finished, Lost, Outcome, Stopped, Unwatched
from service.workers.local import LocalExecutor
from service.workers.process_limits import ProcessLimits
from solver.errors import Issue

log = logging.getLogger("stickslip.answers")

MOST_WAITING = 64
_RETRY_SECONDS = 2
_GRACE_SECONDS = 0.1
_PATIENCE_SECONDS = 30.0
"""Of who waits, the computation included: the machine may be busy, a process may hang."""
_PATIENCE_AT_THE_START = 4
"""So many times as long, while no process is up yet."""
_INLINE_BYTES = 64 * 1024
_AT_THE_TIME = ("SIGPROF", "SIGXCPU")
_WITHOUT_MEMORY = ("SIGABRT", "SIGSEGV", "SIGBUS")
"""How libraries end a process that gets no memory."""
_SILENT = Pace(progress_seconds=3600.0, checkpoint_seconds=3600.0, checkpoint_bytes=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerLimits:
    """What may be computed for answers.

    Attributes
    ----------
    workers : int
        Processes.
    seconds : float
        Processor time of one computation [s].
    memory_bytes : int
        Memory of one computation.
    budget_seconds : int
        Processor time of an owner in a minute [s].
    """

    workers: int
    seconds: float
    memory_bytes: int
    budget_seconds: int

    @property
    def of_an_owner(self) -> int:
        """Computations of one owner at a time: one process is left for the others."""
        return max(1, self.workers - 1)


@dataclass(eq=False, slots=True)
class _Asked:
    """A computation somebody waits for."""

    attempt: Attempt
    owner: str
    outcome: Future[Outcome] = field(default_factory=Future)


class Answers(Unwatched):
    """Computes answers; a `Sink` of its executor.

    Parameters
    ----------
    runs : mapping
        The function of each task; sent to the processes by name.
    warm_up : callable
        Called in every process before it takes a task; sent by name.
    limits : AnswerLimits
        What may be computed.
    """

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, limits: AnswerLimits) -> None:
        self._runs = runs
        self._warm_up = warm_up
        self._limits = limits
        self._budgets = Buckets()
        self._lock = threading.RLock()
        self._waiting: deque[_Asked] = deque()
        self._running: dict[str, _Asked] = {}
        self._ended_one: set[str] = set()
        self._executor: LocalExecutor | None = None
        self._closed = False

    async def ask(self, task: str, spec: dict[str, Any], owner: str = "", about: str = "/scene") -> Any:
        """What a task finds.

        Parameters
        ----------
        task : one of `runs`.
        spec : what it is given.
        owner : whose turn and whose budget it is.
        about : pointer of the field that makes it costly.

        Raises
        ------
        InvalidRequestError, MalformedBodyError, BodyTooLargeError
            What the task refuses; what takes more time or memory than an answer may.
        TooManyRequestsError
            If the budget of the owner is used up.
        QueueFullError
            If too many wait, or for too long.
        """
        wait = self._budgets.empty(owner, self._limits.budget_seconds)
        if wait > 0.0:
            most = f"{self._limits.budget_seconds} s of processor time a minute"
            detail = f"what was computed for answers took more than {most}: ask again in {wait:.0f} s"
            raise TooManyRequestsError(detail, retry_after=max(1, round(wait)))
        attempt = Attempt(
            job_id=new_id(), kind=task, spec=spec, attempt=1, max_attempts=1, lease_owner="answer"
        )
        asked = _Asked(attempt, owner)
        self._add(asked)
        try:
            outcome = await self._outcome(asked)
        finally:
            self._drop(asked)
        return await self._found(outcome, owner, about)

    async def _outcome(self, asked: _Asked) -> Outcome:
        """Wait for a computation; longer while the first process starts, which the kernels may hold up."""
        waiting = asyncio.wrap_future(asked.outcome)
        for _ in range(_PATIENCE_AT_THE_START):
            done, _ = await asyncio.wait([waiting], timeout=_PATIENCE_SECONDS)
            if done:
                return waiting.result()
            if self.ready:
                break
        waiting.cancel()
        raise QueueFullError("no process was free to compute the answer", _RETRY_SECONDS)

    @property
    def ready(self) -> int:
        """How many processes are up."""
        executor = self._executor
        return 0 if executor is None else executor.status().ready

    def begin(self) -> None:
        """Start the processes if they do not run."""
        with self._lock:
            if self._closed or self._executor is not None:
                return
            self._executor = LocalExecutor(
                self._runs,
                self._warm_up,
                workers=self._limits.workers,
                grace_seconds=_GRACE_SECONDS,
                pace=_SILENT,
                limits=ProcessLimits(
                    memory_bytes=self._limits.memory_bytes, processor_seconds=self._limits.seconds
                ),
            )
            self._executor.start(self)

    def close(self) -> None:
        """End the processes, and what they compute; whoever waits is told."""
        with self._lock:
            self._closed = True
            left = [*self._waiting, *self._running.values()]
            self._waiting, self._running = deque(), {}
            executor, self._executor = self._executor, None
        for asked in left:
            _settle(asked, Stopped())
        if executor is not None:
            executor.close()

    def ended(self, attempt: Attempt, outcome: Outcome) -> None:
        """Tell the one who waits for it."""
        with self._lock:
            asked = self._running.pop(attempt.job_id, None)
            if asked is not None and isinstance(outcome, Stopped) and not asked.outcome.done():
                # Its process ended before it had begun: it is computed when there is another.
                self._waiting.appendleft(asked)
                return
            if asked is not None and isinstance(outcome, Lost):
                self._ended_one.add(asked.owner)
            elif asked is not None:
                self._ended_one.discard(asked.owner)
        if asked is not None:
            _settle(asked, outcome)
        self.room()

    def room(self) -> None:
        """Compute what may go on: of each owner no more at a time than leaves a process for another."""
        with self._lock:
            executor = self._executor
            if executor is None:
                return
            # One to a process: what waits in the pipe of one would wait for a costly one before it.
            ready = executor.status().ready
            free = ready - len(self._running)
            busy = Counter(asked.owner for asked in self._running.values())
            for asked in list(self._waiting):
                if free <= 0:
                    return
                if busy[asked.owner] >= self._limits.of_an_owner:
                    continue
                # While the process that it ended starts anew, the other one is not for the same owner.
                if asked.owner in self._ended_one and ready < self._limits.workers:
                    continue
                self._waiting.remove(asked)
                self._running[asked.attempt.job_id] = asked
                busy[asked.owner] += 1
                free -= 1
                executor.submit(asked.attempt)

    def _add(self, asked: _Asked) -> None:
        with self._lock:
            if self._closed:
                raise QueueFullError("the service stops", _RETRY_SECONDS)
            others = sum(other.owner == asked.owner for other in self._waiting)
            if len(self._waiting) >= MOST_WAITING or others >= MOST_WAITING // 2:
                raise QueueFullError(f"{others} requests of yours wait to be computed", _RETRY_SECONDS)
            self._waiting.append(asked)
        self.begin()
        self.room()

    def _drop(self, asked: _Asked) -> None:
        """Nobody waits for it any more."""
        with self._lock:
            if asked in self._waiting:
                self._waiting.remove(asked)
            if asked.attempt.job_id in self._running and self._executor is not None:
                self._executor.stop_attempt(asked.attempt)

    async def _found(self, outcome: Outcome, owner: str, about: str) -> Any:
        if isinstance(outcome, Finished):
            text = outcome.output.encoded or "{}"
            told = (
                json.loads(text) if len(text) < _INLINE_BYTES else await asyncio.to_thread(json.loads, text)
            )
            self._budgets.spend(owner, self._limits.budget_seconds, told["seconds"])
            return _accepted(told)
        if isinstance(outcome, Stopped):
            raise QueueFullError("the service stops", _RETRY_SECONDS)
        self._budgets.spend(owner, self._limits.budget_seconds, self._limits.seconds)
        if isinstance(outcome, Lost):
            raise self._beyond(outcome, about)
        failure = outcome.failure
        if failure.kind is FailureKind.MEMORY_LIMIT:
            raise self._too_much_memory(about)
        raise _refusal(failure)

    def _beyond(self, lost: Lost, about: str) -> Exception:
        """A process that ended did so at one of its limits, or at what it was given."""
        name = about.strip("/")
        ended_by = "" if lost.signal is None else signal.Signals(lost.signal).name
        if ended_by in _AT_THE_TIME:
            most = f"{self._limits.seconds:g} s of processor time"
            message = f"`{name}` takes more than {most} to be looked at, the limit of an answer"
            return InvalidRequestError([Issue(pointer=about, message=message)])
        log.warning("an answer was lost: %s", lost.reason)
        if ended_by in _WITHOUT_MEMORY:
            return self._too_much_memory(about)
        return QueueFullError(f"the answer was lost: {lost.reason}", _RETRY_SECONDS)

    def _too_much_memory(self, about: str) -> InvalidRequestError:
        most = f"{self._limits.memory_bytes / 1e6:.0f} MB of memory"
        message = f"`{about.strip('/')}` takes more than {most} to be looked at, the limit of an answer"
        return InvalidRequestError([Issue(pointer=about, message=message)])


def _settle(asked: _Asked, outcome: Outcome) -> None:
    # Who waited may have gone at this moment.
    if asked.outcome.set_running_or_notify_cancel():
        asked.outcome.set_result(outcome)


def _accepted(told: Mapping[str, Any]) -> Any:
    """What a task found or needs; its refusals as errors."""
    if "issues" in told:
        raise InvalidRequestError([Issue(pointer=where, message=said) for where, said in told["issues"]])
    if "malformed" in told:
        raise MalformedBodyError(told["malformed"])
    if "too_large" in told:
        raise BodyTooLargeError(told["too_large"])
    return told


def _refusal(failure: JobFailure) -> Exception:
    if failure.kind in (FailureKind.SCENE, FailureKind.SETTING, FailureKind.GOAL):
        return InvalidRequestError(failure.issues or (Issue(pointer="", message=failure.detail),))
    return RuntimeError(failure.detail)
