"""The place of one worker process: the attempts it has and the conversation with it."""

from __future__ import annotations

import itertools
import logging
import multiprocessing as mp
import threading
import time
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.reduction import ForkingPickler
from typing import Protocol

from service.db.repositories import Attempt
from service.jobs.checkpoints import KeptPieces
from service.jobs.outputs import Pace
from service.jobs.registry import RunOn, WarmUp
from service.workers.base import Failed, Finished, Lost, Outcome, Sink, Stopped
from service.workers.child import Child, death, ending_signal
from service.workers.process_limits import ProcessLimits
from service.workers.processes import Process
from service.workers.worker import Done, Reply, Task, WorkerReady

log = logging.getLogger("stickslip.executor")

AHEAD_SECONDS = 0.1
"""Work that may wait in the pipe of a busy process [s]."""
MOST_AHEAD = 8

_BACKOFF_SECONDS = (0.2, 1.0, 3.0, 10.0)
_START_SECONDS = 1800.0
_SHORT_SECONDS = 0.05
_STUCK_SECONDS = 0.25
# What waits in a pipe together must fit into its buffer: nobody should wait for a busy process to read.
_SMALL_BYTES = 8 * 1024

_tokens = itertools.count(1)


@dataclass(slots=True)
class _Held:
    """An attempt that a process has: the first is computed, the others wait in its pipe."""

    attempt: Attempt
    token: int
    began: float
    sent: bool = False
    stopping: bool = False


class Host(Protocol):
    """What a slot asks of the executor it belongs to."""

    runs: Mapping[str, RunOn]
    warm_up: WarmUp
    grace_seconds: float
    pace: Pace
    limits: ProcessLimits
    trouble: str | None
    warmed: threading.Event
    sink: Sink

    def room(self) -> None:
        """The slot may have a place."""


class Slot(threading.Thread):
    """One worker process after another, and the conversation with it.

    While its attempts are short, further ones wait in the pipe of the process, so that it does not idle
    until the service has noticed an end, written it and taken the next job. They are taken back if the one
    before them turns out long.
    """

    def __init__(self, executor: Host, index: int) -> None:
        super().__init__(name=f"stickslip slot {index}", daemon=True)
        self._executor = executor
        self._waits = index > 0
        self._lock = threading.Lock()
        self._wake_reader, self._wake_writer = mp.get_context("spawn").Pipe(duplex=False)
        self._child: Child | None = None
        self._held: deque[_Held] = deque()
        self._withdrawn: set[int] = set()
        self._usual = _SHORT_SECONDS
        self._closing = False

    @property
    def ready(self) -> bool:
        """Whether its process is up."""
        return self._child is not None

    @property
    def held(self) -> int:
        """How many attempts it has."""
        return len(self._held)

    @property
    def places(self) -> int:
        """How many attempts it may have."""
        if self._child is None or self._closing or self._withdrawn:
            return 0
        if self._usual >= _SHORT_SECONDS:
            return 1
        return 1 + min(MOST_AHEAD, max(1, int(AHEAD_SECONDS / self._usual)))

    def give(self, attempt: Attempt) -> bool:
        """Take the attempt if there is a place; whether it was taken."""
        with self._lock:
            child = self._child
            if child is None or len(self._held) >= self.places:
                return False
            held = _Held(attempt, next(_tokens), time.monotonic())
            in_order = not self._held or self._held[-1].sent
            self._held.append(held)
            if in_order:
                self._send(child, held)
        return True

    def stop(self, attempt: Attempt) -> bool:
        """Ask its attempt to stop if it has it; whether it has."""
        with self._lock:
            held = next((one for one in self._held if one.attempt is attempt), None)
            if held is None:
                return False
            if not held.stopping:
                held.stopping = True
                if held is self._held[0]:
                    self._enforce(held)
        return True

    def withdraw_stuck(self) -> bool:
        """Take back what waits behind an attempt that takes long; whether something waits still."""
        with self._lock:
            child = self._child
            if child is None or len(self._held) < 2:
                return False
            if time.monotonic() - self._held[0].began < _STUCK_SECONDS:
                return True
            behind = [self._held.pop() for _ in range(len(self._held) - 1)]
            sent = [held.token for held in behind if held.sent]
            self._withdrawn.update(sent)
            if sent:
                child.orders.withdraw(min(sent), max(sent))
            self._usual = _STUCK_SECONDS
        self._give_back(reversed(behind))
        return False

    def close(self) -> None:
        """End the process and the thread; an attempt that runs is asked to stop first."""
        with self._lock:
            self._closing = True
            current = self._held[0].attempt if self._held else None
            if current is None and self._child is not None:
                self._child.process.kill()
        if current is not None:
            self.stop(current)
        self._wake_writer.send_bytes(b"!")

    def run(self) -> None:
        """Keep a worker process up."""
        failures = 0
        if self._waits:
            self._executor.warmed.wait()
        while not self._closing:
            try:
                child = Child(
                    self._executor.runs, self._executor.warm_up, self._executor.pace, self._executor.limits
                )
            except OSError as error:
                trouble = f"a worker process could not be started: {error}"
            else:
                served = self._serve(child)
                if served is None:
                    failures = 0
                    continue
                trouble = served
            self._executor.trouble = trouble
            self._executor.warmed.set()
            log.error("%s", trouble)
            delay = _BACKOFF_SECONDS[min(failures, len(_BACKOFF_SECONDS) - 1)]
            failures += 1
            wait([self._wake_reader], delay)

    def _send(self, child: Child, held: _Held) -> None:
        """Send the task of an attempt; a large one only when its turn has come, and without waiting."""
        attempt = held.attempt
        task = bytes(
            ForkingPickler.dumps(
                Task(held.token, attempt.job_id, attempt.kind, attempt.spec, attempt.saved, attempt.trace)
            )
        )
        if len(task) <= _SMALL_BYTES:
            self._write(child, held, task)
        elif held is self._held[0]:
            # The process may have been stopped and read nothing: nobody else waits for it then.
            threading.Thread(target=self._write, args=(child, held, task), daemon=True).start()

    @staticmethod
    def _write(child: Child, held: _Held, task: bytes) -> None:
        try:
            child.connection.send_bytes(task)
        except OSError:
            return  # the process died: its end of the pipe says so to the thread that reads
        held.sent = True

    def _enforce(self, held: _Held) -> None:
        """Ask the process to stop what it computes, and kill it when the grace is over."""
        child = self._child
        if child is None:
            return
        child.orders.stop(held.token)
        self._kill_after_grace(child, held.token)

    def _kill_after_grace(self, child: Child, token: int) -> None:
        timer = threading.Timer(self._executor.grace_seconds, self._kill, (child.process, token))
        timer.daemon = True
        timer.start()

    def _kill(self, process: Process, token: int) -> None:
        """End the process by force if it still computes the task that was to stop."""
        with self._lock:
            computes = bool(self._held) and self._held[0].token == token
            if self._child is not None and (computes or token in self._withdrawn):
                process.kill()

    def _serve(self, child: Child) -> str | None:
        """Use one process until it ends; why it never got ready, or None."""
        try:
            trouble = self._await_ready(child)
            if trouble is None and not self._closing:
                with self._lock:
                    self._child = None if self._closing else child
                self._executor.trouble = None
                self._executor.warmed.set()
                if self._child is not None:
                    self._executor.room()
                    self._converse(child)
            return trouble
        finally:
            with self._lock:
                self._child = None
            child.end(0.0)

    def _await_ready(self, child: Child) -> str | None:
        deadline = time.monotonic() + _START_SECONDS
        while not self._closing:
            events = wait([child.connection, child.process.sentinel, self._wake_reader], 1.0)
            if self._wake_reader in events:
                self._wake_reader.recv_bytes()
            if child.connection in events:
                try:
                    if isinstance(child.connection.recv(), WorkerReady):
                        return None
                except (EOFError, OSError):
                    return f"{death(child.process)} before it was ready"
            elif child.process.sentinel in events:
                return f"{death(child.process)} before it was ready"
            if time.monotonic() > deadline:
                return f"worker process {child.process.pid} was not ready within {_START_SECONDS:.0f} s"
        return None

    def _converse(self, child: Child) -> None:
        """Hear a ready process out until it dies or this slot closes."""
        while not (self._closing and not self._held):
            try:
                message = child.connection.recv()
            except (EOFError, OSError):
                reason = death(child.process)
                self._lose_all(reason, ending_signal(child.process))
                return
            except Exception as error:
                log.exception("the answer of worker process %s cannot be read", child.process.pid)
                reason = f"the answer of worker process {child.process.pid} could not be read: {error}"
                child.process.kill()
                child.process.join()  # before its attempt is made again
                self._lose_all(reason)
                return
            if isinstance(message, Reply):
                self._hear(child, message)

    def _hear(self, child: Child, reply: Reply) -> None:
        current = next(iter(self._held), None)
        about = reply.about
        if isinstance(about, Done):
            self._conclude(child, reply.token, about)
        elif current is None or current.token != reply.token:
            return
        elif isinstance(about, KeptPieces):
            self._executor.sink.kept(current.attempt, about.pieces, anew=about.anew)
        else:
            if about.found:
                self._executor.sink.found(current.attempt, about.found)
            if about.best is not None:
                self._executor.sink.best(current.attempt, about.best)
            self._executor.sink.progress(current.attempt, about.fraction, about.points)

    def _conclude(self, child: Child, token: int, done: Done) -> None:
        """An attempt ended: go on with the next one, then say what became of it."""
        now, leftover = time.monotonic(), []
        with self._lock:
            self._withdrawn.discard(token)
            if not self._held or self._held[0].token != token:
                ended = None
            else:
                ended = self._held.popleft()
                seconds = now - ended.began
                self._usual = max(seconds, 0.8 * self._usual + 0.2 * seconds)
                if self._closing:
                    leftover = list(self._held)
                    self._held.clear()
            if self._held:
                self._begin(child, self._held[0], now)
            elif self._withdrawn:
                self._expect_withdrawn(child)
        self._give_back(leftover)
        self._executor.room()
        if ended is not None:
            self._executor.sink.ended(ended.attempt, _outcome(done))

    def _begin(self, child: Child, held: _Held, now: float) -> None:
        held.began = now
        if not held.sent:
            self._send(child, held)
        if held.stopping:
            self._enforce(held)

    def _expect_withdrawn(self, child: Child) -> None:
        """A task taken back too late is computed all the same: it has the grace to notice."""
        self._kill_after_grace(child, min(self._withdrawn))

    def _lose_all(self, reason: str, ended_by: int | None = None) -> None:
        """The process is gone: what it computed is lost, what waited behind goes back to the queue."""
        with self._lock:
            self._child = None
            held = list(self._held)
            self._held.clear()
            self._withdrawn.clear()
            self._usual = _SHORT_SECONDS
        if not held and not self._closing:
            log.warning("%s while it had nothing to do", reason)
        lost = held[:1] if held and held[0].sent else []
        for one in lost:
            self._executor.sink.ended(one.attempt, Lost(reason, ended_by))
        self._give_back(held[len(lost) :])

    def _give_back(self, several: Iterable[_Held]) -> None:
        for held in several:
            self._executor.sink.ended(held.attempt, Stopped())


def _outcome(done: Done) -> Outcome:
    if done.output is not None:
        return Finished(done.output)
    if done.failure is not None:
        return Failed(done.failure)
    return Stopped() if done.retry is None else Lost(done.retry)
