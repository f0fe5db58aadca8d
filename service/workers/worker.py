"""A worker process: gets attempts through a pipe, computes, sends progress and results back.

It never opens the database, ignores the terminal's Ctrl-C (the service decides when to stop) and ends
itself when its parent dies. This module imports nothing heavy: the numerical packages are loaded by
`main`, after the environment that limits their threads is in place.
"""

from __future__ import annotations

import ctypes
import logging
import multiprocessing as mp
import os
import pickle
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from ctypes import Array
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

from service.errors import UnknownKindError
from service.jobs import strict_json
from service.jobs.checkpoints import Checkpoints, KeptPieces
from service.jobs.kind_registry import RunOn, WarmUp
from service.jobs.outputs import Best, FailureKind, JobFailure, JobOutput, Pace, Point, Report, ResultPiece
from service.jobs.stored_figures import alone, figures
from service.settings import logs, traces
from service.workers.process_limits import ProcessLimits
from service.workers.spreading import BatchAnswer, Spreading, helped
from solver.errors import SceneError, SettingError, SolverError
from solver.results.spread import spreading

_PARENT_DIED = 70
_TERMINATION_SECONDS = 3.0

log = logging.getLogger("stickslip.worker")


@dataclass(frozen=True, slots=True)
class Task:
    """To a worker: compute this, from what earlier attempts at it kept; `token` is larger than any before."""

    token: int
    job_id: str
    kind: str
    spec: Mapping[str, Any]
    saved: tuple[ResultPiece, ...] = ()
    spec_hash: str = ""
    trace: str | None = None


@dataclass(frozen=True, slots=True)
class Errand:
    """To a worker that has nothing to do: compute these calls of another's task; tokens as of tasks."""

    token: int
    data: bytes


@dataclass(frozen=True, slots=True)
class ErrandDone:
    """To the worker whose batch it was, and from the one that computed it: None if it was not."""

    token: int
    number: int
    data: bytes | None


@dataclass(frozen=True, slots=True)
class Batch:
    """From a worker: calls of its task that another may compute."""

    number: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Recall:
    """From a worker: of the batches of its task none is wanted any more."""


@dataclass(frozen=True, slots=True)
class WorkerReady:
    """From a worker: everything is loaded."""


@dataclass(frozen=True, slots=True)
class Done:
    """From a worker: the output, the failure, or neither if it was told to stop."""

    output: JobOutput | None = None
    failure: JobFailure | None = None
    retry: str | None = None


@dataclass(frozen=True, slots=True)
class Reply:
    """From a worker: something about the task with this token."""

    token: int
    about: Report | KeptPieces | Done | Batch | Recall


class Orders:
    """Shared memory in which the parent writes which tasks are to stop.

    Plain numbers: reading them costs nothing, and a process killed while it looks cannot hold a lock.
    """

    SIZE = 5

    def __init__(self, numbers: Array[ctypes.c_longlong]) -> None:
        self._numbers = numbers

    def stop(self, token: int) -> None:
        """Have the task with this token stop; later ones are not meant."""
        self._numbers[0] = token

    def withdraw(self, first: int, last: int) -> None:
        """Have the tasks with these tokens and those between not begin, or stop."""
        # The range is empty in between: tokens grow, and those withdrawn before were answered by now.
        self._numbers[1] = first
        self._numbers[2] = last

    def lend(self, room: int, others: int) -> None:
        """Tell that so many batches may be sent to so many other workers."""
        self._numbers[3], self._numbers[4] = room, others

    @property
    def room(self) -> int:
        """How many batches may be sent."""
        return int(self._numbers[3])

    @property
    def others(self) -> int:
        """How many other workers there are."""
        return int(self._numbers[4])

    def stopped(self, token: int) -> bool:
        """Whether this task is to stop."""
        return self._numbers[0] == token or self.withdrawn(token)

    def withdrawn(self, token: int) -> bool:
        """Whether this task is not to begin."""
        return self._numbers[1] <= token <= self._numbers[2]


class _Stop:
    """`should_stop` of one task; remembers that it answered yes."""

    def __init__(self, orders: Orders, token: int) -> None:
        self._orders = orders
        self._token = token
        self.obeyed = False

    def __call__(self) -> bool:
        if self._orders.stopped(self._token):
            self.obeyed = True
        return self.obeyed


class Throttle:
    """`on_progress` of one task; sends at most one report every `interval` seconds, none of a shorter one."""

    def __init__(self, send: Callable[[Report], None], interval: float) -> None:
        self._send = send
        self._interval = interval
        self._next = time.monotonic() + interval
        self._found: list[Point] = []
        self._best: Best | None = None

    def __call__(self, fraction: float, points: int) -> None:
        """Send it if the last report is long enough ago."""
        now = time.monotonic()
        if now >= self._next:
            self._next = now + self._interval
            share = min(max(float(fraction), 0.0), 1.0)
            self._send(Report(share, int(points), tuple(self._found), self._best))
            self._found.clear()
            self._best = None

    def found(self, points: Sequence[Point]) -> None:
        """Keep points for the next report."""
        self._found.extend(points)

    def best(self, found: Best) -> None:
        """Keep a design for the next report."""
        self._best = found


class _Inbox:
    """What the parent sends: tasks and errands in turn, and answers to the batches of the present task."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self._ordered: deque[Task | Errand | None] = deque()

    def ordered(self) -> Task | Errand | None:
        """The next task or errand; None at the end."""
        while not self._ordered:
            self._take(0)
        return self._ordered.popleft()

    def answers(self, token: int, seconds: float) -> list[BatchAnswer]:
        """What came back for a task, after so long at most if there is nothing yet."""
        found: list[BatchAnswer] = []
        while self.connection.poll(0.0 if found else seconds):
            found += self._take(token)
        return found

    def _take(self, token: int) -> list[BatchAnswer]:
        message = self.connection.recv()
        if not isinstance(message, ErrandDone):
            self._ordered.append(message)
            return []
        # Of a task that ended in between nobody wants to know.
        return [BatchAnswer(message.number, message.data)] if message.token == token else []


class _Neighbours:
    """The other workers of the service as `Helpers`; the parent is between."""

    alone = True

    def __init__(self, inbox: _Inbox, orders: Orders, token: int) -> None:
        self._inbox, self._orders, self._token = inbox, orders, token

    def room(self) -> int:
        """How many batches may be sent now; one that finds no place after all comes back at once."""
        return self._orders.room

    def share(self) -> int:
        """All workers."""
        return self._orders.others + 1

    def send(self, number: int, data: bytes) -> None:
        """Send a batch to whoever has nothing to do."""
        self._orders.lend(self._orders.room - 1, self._orders.others)  # until the parent says it anew
        self._inbox.connection.send(Reply(self._token, Batch(number, data)))

    def answers(self, seconds: float) -> list[BatchAnswer]:
        """What came back."""
        return self._inbox.answers(self._token, seconds)

    def end(self, *, recall: bool) -> None:
        """Tell that nothing is wanted any more."""
        if recall:
            self._inbox.connection.send(Reply(self._token, Recall()))


def main(
    connection: Connection, numbers: Array[ctypes.c_longlong], runs: Mapping[str, RunOn], warm_up: WarmUp,
    pace: Pace, limits: ProcessLimits,
) -> None:  # fmt: skip
    """The life of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave_soon)
    threading.Thread(target=_die_with_parent, name="parent watch", daemon=True).start()
    logs.configure(pace.log_level, pace.log_format)
    traces.configure(on=pace.traces)
    warm_up()
    limits.confine()
    orders = Orders(numbers)
    connection.send(WorkerReady())
    inbox = _Inbox(connection)
    while True:
        try:
            task = inbox.ordered()
        except (EOFError, OSError):
            return
        if task is None:
            return
        if isinstance(task, Errand):
            connection.send(ErrandDone(task.token, 0, _run_errand(task, _Stop(orders, task.token), limits)))
            continue
        if orders.withdrawn(task.token):
            connection.send(Reply(task.token, Done()))
            continue
        stop, reply = _Stop(orders, task.token), _replying(connection, task)
        kept = Checkpoints(task.job_id, task.saved, reply, pace, task.spec_hash)
        spread = Spreading(_Neighbours(inbox, orders, task.token), stop)
        with (
            logs.about(job=task.job_id, kind=task.kind),
            traces.span("compute", task.trace, job=task.job_id, kind=task.kind),
            spreading(spread),
        ):
            limits.begin()
            done = _compute(runs, task, Throttle(reply, pace.progress_seconds), stop, kept, limits)
            limits.end()
            limits.forget()
        try:
            connection.send(Reply(task.token, done))
        except (pickle.PicklingError, TypeError, AttributeError) as error:
            connection.send(Reply(task.token, Done(failure=failure_of(task.job_id, task.kind, error))))


def _run_errand(errand: Errand, stop: _Stop, limits: ProcessLimits) -> bytes | None:
    """Compute a batch of another's task; whatever is wrong with it, that one meets it again itself."""
    limits.begin()
    try:
        return helped(errand.data, stop)
    except Exception as error:  # noqa: BLE001 - the boundary: the process lives on
        log.info("a batch of another worker's job was not computed: %s: %s", type(error).__name__, error)
        return None
    finally:
        limits.end()
        limits.forget()


def _replying(connection: Connection, task: Task) -> Callable[[Report | KeptPieces], None]:
    return lambda about: connection.send(Reply(task.token, about))


def _leave() -> None:
    traces.flush()
    os._exit(0)


def _leave_soon(_signal: int, _frame: FrameType | None) -> None:
    """On SIGTERM: leave the service, which got it too, the time to give the job back to its queue."""
    timer = threading.Timer(_TERMINATION_SECONDS, _leave)
    timer.daemon = True
    timer.start()


def _die_with_parent() -> None:
    parent = mp.parent_process()
    if parent is not None:
        parent.join()
        os._exit(_PARENT_DIED)


def _compute(
    runs: Mapping[str, RunOn], task: Task, progress: Throttle, stop: _Stop, kept: Checkpoints,
    limits: ProcessLimits,
) -> Done:  # fmt: skip
    """Run one task; every error becomes an answer, the process lives on."""
    try:
        if task.kind not in runs:
            raise UnknownKindError(task.kind)
        output = checked(runs[task.kind](task.spec, progress, stop, kept))
    except MemoryError as error:
        return out_of_memory(error, limits)
    except Exception as error:  # noqa: BLE001 - the boundary: whatever it is, the job must hear of it
        return _stopped(kept) if stop.obeyed else Done(failure=failure_of(task.job_id, task.kind, error))
    return _stopped(kept) if stop.obeyed else Done(output=output)


def out_of_memory(error: MemoryError, limits: ProcessLimits) -> Done:
    """A limit is met again by every attempt; without one, another may find more memory free."""
    if limits.memory_bytes is None:
        return Done(retry=f"the worker ran out of memory ({error})")
    detail = f"it takes more memory than {limits.memory_told()}, the limit of a worker ({error})"
    return Done(failure=JobFailure(kind=FailureKind.MEMORY_LIMIT, detail=detail))


def _stopped(kept: Checkpoints) -> Done:
    """The answer of a run that was told to stop; what it has goes before, for the next attempt."""
    kept.flush()
    return Done()


def checked(output: JobOutput) -> JobOutput:
    """The output with its result encoded, so that the service does not have to; TypeError if it cannot be."""
    told, encoded = tuple(figures(output.result)), strict_json.encoded(output.result)
    return replace(output, result={}, encoded=encoded, figures=told, alone=alone(output.result))


def failure_of(job: str, kind: str, error: Exception) -> JobFailure:
    """A deterministic error, as the job keeps it."""
    if isinstance(error, SceneError):
        return JobFailure(kind=FailureKind.SCENE, detail=str(error), issues=error.issues)
    if isinstance(error, SettingError | UnknownKindError):
        return JobFailure(kind=FailureKind.SETTING, detail=str(error))
    if isinstance(error, SolverError):
        return JobFailure(kind=FailureKind.GOAL, detail=str(error))
    log.error("job %s (%s) met an unexpected error", job, kind, exc_info=error)
    detail = f"unexpected {type(error).__name__}: {error}"
    return JobFailure(kind=FailureKind.INTERNAL, detail=f"{detail}; the service's log has the details")
