"""Computations that somebody waits for: in warm worker processes with limits, for several owners in turn."""

from __future__ import annotations

import asyncio
import json
import logging
import signal
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from service.auth.allowances import Buckets
from service.errors import (
    BodyTooLargeError,
    InvalidRequestError,
    MalformedBodyError,
    QueueFullError,
    TooManyRequestsError,
)
from service.jobs.kind_registry import RunOn, WarmUp
from service.jobs.outputs import FailureKind, JobFailure
from service.workers.executor import Finished, Lost, Outcome, Stopped
from service.workers.process_limits import ProcessLimits
from service.workers.warm_pool import WarmPool, WarmTask
from solver.errors import Issue

if TYPE_CHECKING:
    from service.settings.settings import Settings

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


class Answers(WarmPool):
    """Computes answers, as far as the settings let it; further parameters are those of `WarmPool`."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, settings: Settings) -> None:
        super().__init__(
            runs, warm_up, workers=settings.answer_workers, grace_seconds=_GRACE_SECONDS,
            limits=ProcessLimits(
                memory_bytes=settings.answer_memory_bytes, processor_seconds=settings.answer_seconds
            ),
        )  # fmt: skip
        self._settings = settings
        self._budgets = Buckets()
        self._ended_one: set[str] = set()

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
        wait = self._budgets.empty(owner, self._settings.answer_budget_seconds)
        if wait > 0.0:
            most = f"{self._settings.answer_budget_seconds} s of processor time a minute"
            detail = f"what was computed for answers took more than {most}: ask again in {wait:.0f} s"
            raise TooManyRequestsError(detail, retry_after=max(1, round(wait)))
        asked = WarmTask.of(task, spec, owner)
        with self._waited_for(asked):
            outcome = await self._outcome(asked)
        return await self._found(outcome, owner, about)

    async def _outcome(self, asked: WarmTask) -> Outcome:
        """Wait for a computation; longer while the first process starts, which the kernels may hold up."""
        waiting = asyncio.wrap_future(asked.outcome)
        for _ in range(_PATIENCE_AT_THE_START):
            done, _ = await asyncio.wait([waiting], timeout=_PATIENCE_SECONDS)
            if done:
                return waiting.result()
            if self.ready:
                break
        raise QueueFullError("no process was free to compute the answer", _RETRY_SECONDS)

    def _admit(self, asked: WarmTask) -> None:
        if self._closed:
            raise QueueFullError("the service stops", _RETRY_SECONDS)
        others = sum(other.owner == asked.owner for other in self._waiting)
        if len(self._waiting) >= MOST_WAITING or others >= MOST_WAITING // 2:
            raise QueueFullError(f"{others} requests of yours wait to be computed", _RETRY_SECONDS)

    def _next(self) -> WarmTask | None:
        """The first, but of each owner no more at a time than leaves a process for another."""
        most = max(1, self._settings.answer_workers - 1)
        busy = Counter(asked.owner for asked in self._running.values())
        # While the process that an owner ended starts anew, the other one is not for the same owner.
        whole = self.ready >= self._settings.answer_workers
        for asked in self._waiting:
            if busy[asked.owner] < most and (whole or asked.owner not in self._ended_one):
                return asked
        return None

    def _concluded(self, asked: WarmTask, outcome: Outcome) -> None:
        if isinstance(outcome, Lost):
            self._ended_one.add(asked.owner)
        else:
            self._ended_one.discard(asked.owner)

    async def _found(self, outcome: Outcome, owner: str, about: str) -> Any:
        if isinstance(outcome, Finished):
            text = outcome.output.encoded or "{}"
            told = (
                json.loads(text) if len(text) < _INLINE_BYTES else await asyncio.to_thread(json.loads, text)
            )
            self._budgets.spend(owner, self._settings.answer_budget_seconds, told["seconds"])
            return _accepted(told)
        if isinstance(outcome, Stopped):
            raise QueueFullError("the service stops", _RETRY_SECONDS)
        self._budgets.spend(owner, self._settings.answer_budget_seconds, self._settings.answer_seconds)
        if isinstance(outcome, Lost):
            raise self._beyond(outcome, about)
        failure = outcome.failure
        if failure.kind is FailureKind.MEMORY_LIMIT:
            raise self._too_much_memory(about)
        raise _refusal(failure)

    def _beyond(self, lost: Lost, about: str) -> Exception:
        """A process that ended did so at one of its limits, or at what it was given."""
        ended_by = "" if lost.signal is None else signal.Signals(lost.signal).name
        if ended_by in _AT_THE_TIME:
            most = f"{self._settings.answer_seconds:g} s of processor time"
            return _too_costly(about, most)
        log.warning("an answer was lost: %s", lost.reason)
        if ended_by in _WITHOUT_MEMORY:
            return self._too_much_memory(about)
        return QueueFullError(f"the answer was lost: {lost.reason}", _RETRY_SECONDS)

    def _too_much_memory(self, about: str) -> InvalidRequestError:
        most = f"{self._settings.answer_memory_bytes / 1e6:.0f} MB of memory"
        return _too_costly(about, most)


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


def _refusal(failure: JobFailure) -> Exception:
    if failure.kind in (FailureKind.SCENE, FailureKind.SETTING, FailureKind.GOAL):
        return InvalidRequestError(failure.issues or (Issue((), failure.detail, named=False),))
    return RuntimeError(failure.detail)
