"""Warm worker processes on this machine, one thread of the service for each."""

from __future__ import annotations

import ctypes
import itertools
import logging
import multiprocessing as mp
import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from service.checkpoints import Kept
from service.executors.base import ExecutorStatus, Failed, Finished, Lost, Outcome, Sink, Stopped
from service.jobs import Pace, RunOn, WarmUp
from service.repository import Attempt
from service.worker import THREAD_LIMITS, Done, Ready, Report, StopFlag, Task, main

log = logging.getLogger("stickslip.executor")

_BACKOFF_SECONDS = (0.2, 1.0, 3.0, 10.0)
_START_SECONDS = 1800.0

_environment_lock = threading.Lock()
_tokens = itertools.count(1)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """The environment in which workers start: one BLAS and one Numba thread each.

    It must be in place before the process starts, and this process keeps its own.
    """
    with _environment_lock:
        before = {name: os.environ.get(name) for name in THREAD_LIMITS}
        os.environ.update(THREAD_LIMITS)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


def _death(process: SpawnProcess) -> str:
    """How a process ended, as a sentence."""
    process.join(5.0)
    code = process.exitcode
    if code is not None and code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else "unknown"
        hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
        return f"worker process {process.pid} was killed by signal {-code} ({name}{hint})"
    return f"worker process {process.pid} ended with status {code}"


class _Child:
    """One worker process and the parent's end of its pipe."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, pace: Pace) -> None:
        context = mp.get_context("spawn")
        number: ctypes.c_longlong = context.RawValue(ctypes.c_longlong, 0)
        self.flag = StopFlag(number)
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self.process = context.Process(
            target=main,
            args=(theirs, number, runs, warm_up, pace),
            name="stickslip worker",
            daemon=True,
        )
        with _one_thread_each():
            self.process.start()
        theirs.close()

    def end(self, patience: float) -> None:
        """End the process: politely, then by force."""
        self.process.join(patience)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        self.process.close()


class _Slot(threading.Thread):
    """One worker process after another, and the conversation with it."""

    def __init__(self, executor: LocalExecutor, index: int) -> None:
        super().__init__(name=f"stickslip slot {index}", daemon=True)
        self._executor = executor
        self._waits = index > 0
        self._lock = threading.Lock()
        self._wake_reader, self._wake_writer = mp.get_context("spawn").Pipe(duplex=False)
        self._child: _Child | None = None
        self._attempt: Attempt | None = None
        self._token = 0
        self._stopping = False
        self._closing = False
        self.ready = False

    @property
    def busy(self) -> bool:
        """Whether it has an attempt."""
        return self._attempt is not None

    def give(self, attempt: Attempt) -> bool:
        """Take the attempt if there is nothing to do; whether it was taken."""
        with self._lock:
            if self._attempt is not None or not self.ready or self._closing:
                return False
            self._attempt = attempt
            self._token = next(_tokens)
            self._stopping = False
        self._wake()
        return True

    def stop(self, attempt: Attempt) -> bool:
        """Ask its attempt to stop if it is this one; whether it is."""
        with self._lock:
            if self._attempt is not attempt or self._child is None:
                return False
            if self._stopping:
                return True
            self._stopping = True
            self._child.flag.ask(self._token)
            process, token, delay = self._child.process, self._token, self._executor.grace_seconds
        timer = threading.Timer(delay, self._kill, (process, token))
        timer.daemon = True
        timer.start()
        return True

    def close(self) -> None:
        """End the process and the thread; an attempt that runs is asked to stop first."""
        with self._lock:
            self._closing = True
            attempt = self._attempt
        if attempt is not None:
            self.stop(attempt)
        self._wake()

    def run(self) -> None:
        """Keep a worker process up."""
        failures = 0
        if self._waits:
            self._executor.warmed.wait()
        while not self._closing:
            try:
                child = _Child(self._executor.runs, self._executor.warm_up, self._executor.pace)
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

    def _wake(self) -> None:
        self._wake_writer.send_bytes(b"!")

    def _kill(self, process: SpawnProcess, token: int) -> None:
        """End the process by force if it still computes the task that was to stop."""
        with self._lock:
            if self._attempt is not None and self._token == token and self._child is not None:
                process.kill()

    def _serve(self, child: _Child) -> str | None:
        """Use one process until it ends; why it never got ready, or None."""
        try:
            trouble = self._await_ready(child)
            if trouble is None and not self._closing:
                with self._lock:
                    self._child, self.ready = child, True
                self._executor.trouble = None
                self._executor.warmed.set()
                self._executor.sink.room()
                self._converse(child)
            return trouble
        finally:
            with self._lock:
                self._child, self.ready = None, False
            child.end(0.0)

    def _await_ready(self, child: _Child) -> str | None:
        deadline = time.monotonic() + _START_SECONDS
        while not self._closing:
            events = wait([child.connection, child.process.sentinel, self._wake_reader], 1.0)
            if self._wake_reader in events:
                self._wake_reader.recv_bytes()
            if child.connection in events:
                try:
                    if isinstance(child.connection.recv(), Ready):
                        return None
                except (EOFError, OSError):
                    return f"{_death(child.process)} before it was ready"
            elif child.process.sentinel in events:
                return f"{_death(child.process)} before it was ready"
            if time.monotonic() > deadline:
                return f"worker process {child.process.pid} was not ready within {_START_SECONDS:.0f} s"
        return None

    def _converse(self, child: _Child) -> None:
        """Pass attempts to a ready process until it dies or this slot closes."""
        while not self._closing:
            if self._attempt is None:
                events = wait([self._wake_reader, child.process.sentinel])
                if self._wake_reader in events:
                    self._wake_reader.recv_bytes()
                if child.process.sentinel in events and self._attempt is None:
                    log.warning("%s while it had nothing to do", _death(child.process))
                    return
                continue
            attempt, token = self._attempt, self._token
            outcome = self._run_attempt(child, attempt, token)
            with self._lock:
                self._attempt = None
                if isinstance(outcome, Lost):
                    self.ready = False
            self._executor.sink.ended(attempt, outcome)
            self._executor.sink.room()
            if isinstance(outcome, Lost):
                return

    def _run_attempt(self, child: _Child, attempt: Attempt, token: int) -> Outcome:
        try:
            task = Task(token, attempt.job_id, attempt.kind, attempt.spec, attempt.saved)
            child.connection.send(task)
            while True:
                message = child.connection.recv()
                if isinstance(message, Report):
                    if message.found:
                        self._executor.sink.found(attempt, message.found)
                    self._executor.sink.progress(attempt, message.fraction, message.points)
                elif isinstance(message, Kept):
                    self._executor.sink.kept(attempt, message.pieces, anew=message.anew)
                elif isinstance(message, Done):
                    return _outcome(message)
        except (EOFError, OSError):
            return Lost(_death(child.process))
        except Exception as error:
            log.exception("job %s: the answer of its worker cannot be read", attempt.job_id)
            return Lost(f"the answer of worker process {child.process.pid} could not be read: {error}")


def _outcome(done: Done) -> Outcome:
    if done.output is not None:
        return Finished(done.output)
    if done.failure is not None:
        return Failed(done.failure)
    return Stopped() if done.retry is None else Lost(done.retry)


class LocalExecutor:
    """Worker processes of this machine.

    Parameters
    ----------
    runs : mapping
        The function of each kind; sent to the processes by name.
    warm_up : callable
        Called in every process before it takes an attempt; sent by name.
    workers : int
        Number of processes.
    grace_seconds : float
        Time between asking an attempt to stop and killing its process [s].
    pace : Pace
        How often the processes tell what.
    """

    def __init__(
        self,
        runs: Mapping[str, RunOn],
        warm_up: WarmUp,
        *,
        workers: int,
        grace_seconds: float,
        pace: Pace,
    ) -> None:
        self.runs = runs
        self.warm_up = warm_up
        self.grace_seconds = grace_seconds
        self.pace = pace
        self.trouble: str | None = None
        # The first process fills the cache of compiled loops that the others then only read.
        self.warmed = threading.Event()
        self.sink: Sink
        self._slots = [_Slot(self, index) for index in range(workers)]

    def start(self, sink: Sink) -> None:
        """Start every process; returns at once."""
        self.sink = sink
        for slot in self._slots:
            slot.start()

    def free(self) -> int:
        """How many processes have nothing to do."""
        return sum(slot.ready and not slot.busy for slot in self._slots)

    def submit(self, attempt: Attempt) -> None:
        """Give an attempt to a free process; without one it is lost at once."""
        if not any(slot.give(attempt) for slot in self._slots):
            self.sink.ended(attempt, Lost("no worker process was free"))

    def stop_attempt(self, attempt: Attempt) -> None:
        """Ask an attempt to stop; its process is killed when the grace is over."""
        any(slot.stop(attempt) for slot in self._slots)

    def close(self) -> None:
        """End every process; attempts end first."""
        for slot in self._slots:
            slot.close()
        self.warmed.set()
        for slot in self._slots:
            if slot.ident is not None:
                slot.join()

    def status(self) -> ExecutorStatus:
        """How the processes are."""
        return ExecutorStatus(
            workers=len(self._slots),
            ready=sum(slot.ready for slot in self._slots),
            busy=sum(slot.busy for slot in self._slots),
            trouble=self.trouble,
        )
