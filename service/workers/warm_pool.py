"""What somebody waits for, in warm worker processes with limits: answers and previews, owners in turn.

Answers are what requests need before they are answered (`service.jobs.answering`). Previews are never stored;
of those of one client only the newest is computed. The processes start with the service, or with the first
task before.
"""

from __future__ import annotations

import asyncio
import json
import logging
import signal
import threading
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Any

from service.auth.allowances import Buckets
from service.db.clock import new_id, utc_now
from service.db.repositories import Attempt
from service.errors import (
    BodyTooLargeError,
    ConflictError,
    InvalidRequestError,
    JobFailedError,
    MalformedBodyError,
    PreviewError,
    QueueFullError,
    TooManyRequestsError,
)
from service.jobs.kind_registry import Registry, RunOn, WarmUp
from service.jobs.kinds.previews import PREVIEWS
from service.jobs.outputs import FailureKind, JobFailure, Pace
from service.settings.settings import Settings
from service.workers.executor import Failed, Finished, Lost, Outcome, Stopped, Unwatched
from service.workers.executors import LocalExecutor
from service.workers.process_limits import UNLIMITED, ProcessLimits
from solver.errors import Issue
from solver.jit.compiler_process import missing

_SILENT = Pace(progress_seconds=3600.0, checkpoint_seconds=3600.0, checkpoint_bytes=0)
_REMEMBERED = 64
"""Owners, by when they had their last turn."""


@dataclass(eq=False, slots=True)
class WarmTask:
    """A computation somebody waits for.

    Attributes
    ----------
    attempt : what is computed, and for which owner.
    client : of its computations only the newest counts; empty: each of them.
    most : so many of the owner may wait; None: any number.
    begun, outcome : done when it begins and when it ends.
    """

    attempt: Attempt
    client: str
    most: int | None
    begun: Future[None] = field(default_factory=Future)
    outcome: Future[Outcome] = field(default_factory=Future)

    @property
    def owner(self) -> str:
        """Whose turn it is."""
        return self.attempt.owner

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
    runs : the function of each task; sent to the processes by name.
    warm_up : called in every process before it takes a task; sent by name.
    workers : processes.
    of_one : of them, those that may compute for one owner at a time.
    grace_seconds : time between asking a computation to stop and killing its process [s].
    """

    def __init__(
        self, runs: Mapping[str, RunOn], warm_up: WarmUp, *, workers: int, of_one: int, grace_seconds: float
    ) -> None:
        self._runs, self._warm_up = runs, warm_up
        self._workers, self._of_one, self._grace_seconds = workers, of_one, grace_seconds
        self._lock = threading.RLock()
        self._waiting: deque[WarmTask] = deque()
        self._running: dict[str, WarmTask] = {}
        self._served: list[str] = []
        self._ended_one: set[str] = set()
        self._executor: LocalExecutor | None = None
        self._closed = False
        self.interprets = False

    @abstractmethod
    def _admit(self, asked: WarmTask) -> None:
        """Raise an error if it may not wait; the pool's lock is held."""

    @abstractmethod
    def _limits(self) -> ProcessLimits:
        """What each process that begins now may use."""

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

    async def run(
        self, task: str, spec: dict[str, Any], owner: str, turn_seconds: float, seconds: float, *,
        at_the_start: int = 1, client: str = "", most: int | None = None,
    ) -> Outcome | bool:  # fmt: skip
        """How a task ended; of one that is late, whether it had begun.

        Parameters
        ----------
        turn_seconds, seconds : how long is waited for its turn, and then for its end [s].
        at_the_start : so many times as long for its turn, while no process is up.
        client, most : as of `WarmTask`.
        """
        attempt = Attempt(
            job_id=new_id(), kind=task, spec=spec, attempt=1, max_attempts=1, lease_owner="warm",
            created=utc_now(), owner=owner,
        )  # fmt: skip
        asked = WarmTask(attempt, client, most)
        with self._lock:
            self._admit(asked)
            self._waiting.append(asked)
        try:
            self.begin()
            self.room()
            begun: asyncio.Future[Any] = asyncio.wrap_future(asked.begun)
            outcome: asyncio.Future[Outcome] = asyncio.wrap_future(asked.outcome)
            for _ in range(at_the_start):
                either = asyncio.FIRST_COMPLETED
                done, _ = await asyncio.wait([begun, outcome], timeout=turn_seconds, return_when=either)
                if done or self.ready:
                    break
            if begun.done():
                await asyncio.wait([outcome], timeout=seconds)
            return outcome.result() if outcome.done() else begun.done()
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
                (self._ended_one.add if isinstance(outcome, Lost) else self._ended_one.discard)(asked.owner)
                asked.settle(outcome)
        self.room()

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

    def _next(self) -> WarmTask | None:
        """The first one of the owner whose turn is longest ago, of those who may have another process."""
        busy = Counter(asked.owner for asked in self._running.values())
        # While the process that an owner ended starts anew, the one left to others is not for the same owner.
        apart = self._ended_one if self._of_one < self._workers and self.ready < self._workers else ()
        free = [one for one in self._waiting if busy[one.owner] < self._of_one and one.owner not in apart]
        turns = {owner: at for at, owner in enumerate(self._served)}
        found = min(free, key=lambda asked: turns.get(asked.owner, -1), default=None)
        if found is not None:
            self._served = [*(owner for owner in self._served if owner != found.owner), found.owner]
            del self._served[:-_REMEMBERED]
        return found


def _refused(failure: JobFailure) -> InvalidRequestError:
    return InvalidRequestError(failure.issues or (Issue((), failure.detail, named=False),))


_answers_log = logging.getLogger("stickslip.answers")

_MOST_ANSWERS = 64
_ANSWER_RETRY_SECONDS = 2
_ANSWER_GRACE_SECONDS = 0.1
_PATIENCE_SECONDS = 30.0
"""For a turn, and for the end of what has begun: the machine may be busy, a process may hang."""
_PATIENCE_AT_THE_START = 4
"""So many times as long, while no process is up yet, which the kernels may hold up."""
_INLINE_BYTES = 64 * 1024
_AT_THE_TIME = ("SIGPROF", "SIGXCPU")
_WITHOUT_MEMORY = ("SIGABRT", "SIGSEGV", "SIGBUS")
"""How libraries end a process that gets no memory."""


class Answers(WarmPool):
    """Computes answers, as far as the settings let it; of several processes one is left for other owners."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, settings: Settings) -> None:
        workers = settings.answer_workers
        super().__init__(
            runs, warm_up, workers=workers, of_one=max(1, workers - 1), grace_seconds=_ANSWER_GRACE_SECONDS
        )
        self._settings = settings
        self._budgets = Buckets()

    async def ask(self, task: str, spec: dict[str, Any], owner: str = "", about: str = "scene") -> Any:
        """What a task finds.

        Parameters
        ----------
        task : one of `runs`.
        spec : what it is given.
        owner : whose turn and whose budget it is.
        about : the field that makes it costly.

        Raises
        ------
        InvalidRequestError, MalformedBodyError, BodyTooLargeError
            What the task refuses; what takes more time or memory than an answer may.
        TooManyRequestsError
            If the budget of the owner is used up.
        QueueFullError
            If too many wait, or for too long.
        """
        budget = self._settings.answer_budget_seconds
        wait = self._budgets.empty(owner, budget)
        if wait > 0.0:
            most = f"{budget} s of processor time a minute"
            detail = f"what was computed for answers took more than {most}: ask again in {wait:.0f} s"
            raise TooManyRequestsError(detail, retry_after=max(1, round(wait)))
        patience, more = _PATIENCE_SECONDS, _PATIENCE_AT_THE_START
        outcome = await self.run(task, spec, owner, patience, patience, at_the_start=more)
        if isinstance(outcome, bool):
            raise QueueFullError("no process was free to compute the answer", _ANSWER_RETRY_SECONDS)
        if isinstance(outcome, Stopped):
            raise QueueFullError("the service stops", _ANSWER_RETRY_SECONDS)
        if isinstance(outcome, Finished):
            text = outcome.output.encoded or "{}"
            told = (
                json.loads(text) if len(text) < _INLINE_BYTES else await asyncio.to_thread(json.loads, text)
            )
            self._budgets.spend(owner, budget, told["seconds"])
            return _accepted(told)
        self._budgets.spend(owner, budget, self._settings.answer_seconds)
        raise self._beyond(outcome, about)

    def _admit(self, asked: WarmTask) -> None:
        if self._closed:
            raise QueueFullError("the service stops", _ANSWER_RETRY_SECONDS)
        others = sum(other.owner == asked.owner for other in self._waiting)
        if len(self._waiting) >= _MOST_ANSWERS or others >= _MOST_ANSWERS // 2:
            raise QueueFullError(f"{others} requests of yours wait to be computed", _ANSWER_RETRY_SECONDS)

    def _limits(self) -> ProcessLimits:
        memory, seconds = self._settings.answer_memory_bytes, self._settings.answer_seconds
        return ProcessLimits(memory_bytes=memory, processor_seconds=seconds)

    def _beyond(self, outcome: Failed | Lost, about: str) -> Exception:
        """What is said of a task that failed, or ended its process: at a limit, or at what it was given."""
        too_much = f"{self._settings.answer_memory_bytes / 1e6:.0f} MB of memory"
        if isinstance(outcome, Failed):
            if outcome.failure.kind is FailureKind.MEMORY_LIMIT:
                return _too_costly(about, too_much)
            wrong = outcome.failure.kind in (FailureKind.SCENE, FailureKind.SETTING, FailureKind.GOAL)
            return _refused(outcome.failure) if wrong else RuntimeError(outcome.failure.detail)
        ended_by = "" if outcome.signal is None else signal.Signals(outcome.signal).name
        if ended_by in _AT_THE_TIME:
            return _too_costly(about, f"{self._settings.answer_seconds:g} s of processor time")
        _answers_log.warning("an answer was lost: %s", outcome.reason)
        if ended_by in _WITHOUT_MEMORY:
            return _too_costly(about, too_much)
        return QueueFullError(f"the answer was lost: {outcome.reason}", _ANSWER_RETRY_SECONDS)


def _too_costly(key: str, most: str) -> InvalidRequestError:
    wanted = f"takes more than {most} to be looked at, the limit of an answer"
    return InvalidRequestError.of((key,) if key else (), wanted)


def _accepted(told: Mapping[str, Any]) -> Any:
    """What a task found or needs; its refusals as errors."""
    if "issues" in told:
        raise InvalidRequestError.from_json(told["issues"])
    if "malformed" in told:
        raise MalformedBodyError(told["malformed"])
    if "too_large" in told:
        raise BodyTooLargeError(told["too_large"])
    return told


_previews_log = logging.getLogger("stickslip.previews")

MOST_WAITING = 16
"""Previews."""
_PREVIEW_WORKERS = 2
"""While one answer is put together and drawn, the next is computed."""
_PREVIEW_RETRY_SECONDS = 1
_PREVIEW_GRACE_SECONDS = 0.5
_LONGEST_WAIT_SECONDS = 120.0
_INTERPRETED = 20.0  # times as long one may take while kernels are interpreted


class Previews(WarmPool):
    """Computes previews.

    Parameters
    ----------
    seconds : longest time one may take [s].
    registry : the kinds of preview.
    memory_bytes : most memory one may take.
    workers : processes.
    """

    def __init__(
        self, seconds: float, registry: Registry = PREVIEWS, memory_bytes: int | None = None,
        workers: int = _PREVIEW_WORKERS,
    ) -> None:  # fmt: skip
        super().__init__(
            registry.runs(), registry.warm_up, workers=workers, of_one=workers,
            grace_seconds=_PREVIEW_GRACE_SECONDS,
        )  # fmt: skip
        self.registry = registry
        self._given_seconds, self._memory_bytes = seconds, memory_bytes

    @property
    def _seconds(self) -> float:
        """Longest time one may take [s]: more of it while kernels are interpreted."""
        return self._given_seconds * (_INTERPRETED if self.interprets else 1.0)

    def _limits(self) -> ProcessLimits:
        seconds = self._seconds + _PREVIEW_GRACE_SECONDS
        return replace(UNLIMITED, memory_bytes=self._memory_bytes, processor_seconds=seconds)

    async def compute(
        self, kind: str, spec: dict[str, Any], client: str = "", owner: str = "", most: int | None = None
    ) -> bytes:
        """The answer to a preview, as JSON; `most` of an owner may wait.

        Raises
        ------
        QueueFullError
            If too many wait.
        TooManyRequestsError
            If too many of the owner wait.
        ConflictError
            If a newer one of the same client took its place.
        PreviewError
            If it took too long, or its worker died.
        InvalidRequestError, JobFailedError
            If it cannot be computed.
        """
        wait = _LONGEST_WAIT_SECONDS
        self.begin()
        outcome = await self.run(kind, spec, owner, wait, self._seconds, client=client, most=most)
        if outcome is True:
            raise PreviewError(f"the preview took longer than {self._seconds:g} s: submit it as a job")
        if outcome is False:
            raise PreviewError(f"no worker was free for it within {wait:g} s")
        if isinstance(outcome, Finished):
            return (outcome.output.encoded or "{}").encode()
        if isinstance(outcome, Stopped):
            raise PreviewError("the service stops")
        if isinstance(outcome, Lost):
            _previews_log.warning("a preview was lost: %s", outcome.reason)
            raise PreviewError(outcome.reason)
        failure = outcome.failure
        if failure.kind is FailureKind.MEMORY_LIMIT:
            raise InvalidRequestError.of(("scene",), f"`scene`: {failure.detail}", named=False)
        if failure.kind in (FailureKind.SCENE, FailureKind.SETTING):
            raise _refused(failure)
        raise JobFailedError(failure.detail, failure.to_json())

    def _admit(self, asked: WarmTask) -> None:
        if self._closed:
            raise PreviewError("the service stops")
        if asked.client:
            for other in [*self._waiting, *self._running.values()]:
                if other.client == asked.client:
                    other.settle(ConflictError("a newer preview of the same client took its place"))
                    self._drop(other)
        own = sum(other.owner == asked.owner for other in self._waiting)
        if asked.most is not None and own >= asked.most:
            raise TooManyRequestsError(f"{own} previews of yours wait already", _PREVIEW_RETRY_SECONDS)
        if len(self._waiting) >= MOST_WAITING:
            raise QueueFullError(f"{MOST_WAITING} previews wait already", _PREVIEW_RETRY_SECONDS)
