"""The place of one worker process: how it starts and ends, the attempts it has, the conversation with it."""

from __future__ import annotations

import ctypes
import itertools
import logging
import multiprocessing as mp
import signal
import threading
import time
from collections import deque
from collections.abc import Iterable, Mapping
from ctypes import Array
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Protocol

from service.db.repositories import Attempt
from service.jobs.checkpoints import KeptPieces
from service.jobs.kind_registry import RunOn, WarmUp
from service.jobs.outputs import Pace
from service.workers.executor import Failed, Finished, Lost, Outcome, Sink, Stopped
from service.workers.process_limits import ProcessLimits
from service.workers.processes import Process, start
from service.workers.worker import (
    Batch,
    Done,
    Errand,
    ErrandDone,
    Orders,
    Recall,
    Reply,
    Task,
    WorkerReady,
    main,
)


def death(process: Process) -> str:
    """How a process that closed its pipe ended, as a sentence; it has ended then."""
    process.join(5.0)
    if process.is_alive():
        process.kill()
        process.join()
        return f"worker process {process.pid} closed its pipe and did not end"
    code = process.status()
    if code is None:
        return f"worker process {process.pid} ended, and so did what it was forked off"
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else "unknown"
        hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
        return f"worker process {process.pid} was killed by signal {-code} ({name}{hint})"
    return f"worker process {process.pid} ended with status {code}"


def ending_signal(process: Process) -> int | None:
    """The signal that ended a process, if one did."""
    code = process.status()
    return None if code is None or code >= 0 else -code


class Child:
    """One worker process and the parent's end of its pipe."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, pace: Pace, limits: ProcessLimits) -> None:
        context = mp.get_context("spawn")
        numbers: Array[ctypes.c_longlong] = context.RawArray(ctypes.c_longlong, Orders.SIZE)
        self.orders = Orders(numbers)
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self.process = start(main, (theirs, numbers, runs, warm_up, pace, limits), "stickslip worker")
        theirs.close()

    def end(self, patience: float) -> None:
        """End the process: politely, then by force."""
        self.process.join(patience)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        self.process.close()


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

_MOST_ERRANDS = 2  # one is computed, one waits

_tokens = itertools.count(1)


@dataclass(frozen=True, slots=True)
class LentBatch:
    """Calls of the task of one process that another one may compute, with the number it knows them by."""

    of: Slot
    token: int
    number: int
    data: bytes


@dataclass(slots=True)
class _Held:
    """An attempt that a process has, or a batch: the first is computed, the others wait in its pipe."""

    work: Attempt | LentBatch
    token: int
    began: float
    sent: bool = False
    stopping: bool = False

    def task(self) -> Task | Errand:
        """What is sent to the process."""
        work = self.work
        if isinstance(work, LentBatch):
            return Errand(self.token, work.data)
        return Task(self.token, work.job_id, work.kind, work.spec, work.saved, work.spec_hash, work.trace)


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

    def lend(self, batch: LentBatch) -> None:
        """Have another slot's process compute a batch, or answer it."""

    def recall(self, of: Slot, token: int) -> None:
        """Of the batches of a task none is wanted any more."""

    def tell_room(self) -> None:
        """Something changed in who has nothing to do."""


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
        self._writing = threading.Lock()
        self._lends = 0  # token of its task, if that has lent something
        self._usual = _SHORT_SECONDS
        self._closing = False

    @property
    def ready(self) -> bool:
        """Whether its process is up."""
        return self._child is not None

    @property
    def held(self) -> int:
        """How many attempts it has."""
        return sum(isinstance(one.work, Attempt) for one in tuple(self._held))

    @property
    def busy(self) -> bool:
        """Whether its process computes."""
        return len(self._held) > 0

    @property
    def places(self) -> int:
        """How many attempts it may have."""
        if self._child is None or self._closing or self._withdrawn:
            return 0
        if self._usual >= _SHORT_SECONDS or self._lends:
            return 1
        return 1 + min(MOST_AHEAD, max(1, int(AHEAD_SECONDS / self._usual)))

    def give(self, attempt: Attempt) -> bool:
        """Take the attempt if there is a place; whether it was taken."""
        with self._lock:
            child = self._child
            if child is None or self.held >= self.places:
                return False
            self._add(child, attempt)
        return True

    def errands(self) -> int:
        """How many batches of others it takes: none while it has an attempt."""
        if self._child is None or self._closing or self._withdrawn or self.held:
            return 0
        return max(_MOST_ERRANDS - len(self._held), 0)

    def help(self, batch: LentBatch) -> bool:
        """Take a batch if there is nothing else to do; whether it was taken."""
        with self._lock:
            child = self._child
            if child is None or not self.errands():
                return False
            self._add(child, batch)
        return True

    def answer(self, batch: LentBatch, data: bytes | None) -> None:
        """Give a batch back to the process whose it is, if it computes that task still."""
        with self._lock:
            child = self._child
            if child is None or not self._held or self._held[0].token != batch.token:
                return
        told = bytes(ForkingPickler.dumps(ErrandDone(batch.token, batch.number, data)))
        # It reads between two calls: nobody else waits for it.
        threading.Thread(target=self._write, args=(child, told), daemon=True).start()

    def forget(self, of: Slot, token: int) -> None:
        """Stop the batches of a task."""
        with self._lock:
            for held in self._held:
                work = held.work
                if isinstance(work, LentBatch) and work.of is of and work.token == token:
                    self._ask_to_stop(held)

    def lend_room(self, room: int, others: int) -> None:
        """Tell the process how many batches others would take."""
        child = self._child
        if child is not None:
            child.orders.lend(room, others)

    def _add(self, child: Child, work: Attempt | LentBatch) -> None:
        held = _Held(work, next(_tokens), time.monotonic())
        in_order = not self._held or self._held[-1].sent
        self._held.append(held)
        if in_order:
            self._send(child, held)

    def _ask_to_stop(self, held: _Held) -> None:
        if not held.stopping:
            held.stopping = True
            if held is self._held[0]:
                self._enforce(held)

    def stop(self, attempt: Attempt) -> bool:
        """Ask its attempt to stop if it has it; whether it has."""
        with self._lock:
            held = next((one for one in self._held if one.work is attempt), None)
            if held is None:
                return False
            self._ask_to_stop(held)
        return True

    def withdraw_stuck(self) -> bool:
        """Take back what waits behind an attempt that takes long; whether something waits still."""
        with self._lock:
            child = self._child
            if child is None or self.held < 2:
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
            if self._held:
                self._ask_to_stop(self._held[0])
            elif self._child is not None:
                self._child.process.kill()
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
        task = bytes(ForkingPickler.dumps(held.task()))
        if len(task) <= _SMALL_BYTES:
            self._write(child, task, held)
        elif held is self._held[0]:
            # The process may have been stopped and read nothing: nobody else waits for it then.
            threading.Thread(target=self._write, args=(child, task, held), daemon=True).start()

    def _write(self, child: Child, message: bytes, held: _Held | None = None) -> None:
        try:
            with self._writing:
                child.connection.send_bytes(message)
        except OSError:
            return  # the process died: its end of the pipe says so to the thread that reads
        if held is not None:
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
                    self._executor.tell_room()
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
            elif isinstance(message, ErrandDone):
                self._conclude(child, message.token, message)

    def _hear(self, child: Child, reply: Reply) -> None:
        current = next(iter(self._held), None)
        about = reply.about
        if isinstance(about, Done):
            self._conclude(child, reply.token, about)
        elif current is None or current.token != reply.token or isinstance(current.work, LentBatch):
            return
        elif isinstance(about, Batch):
            self._lends = reply.token
            self._executor.lend(LentBatch(self, reply.token, about.number, about.data))
        elif isinstance(about, Recall):
            self._executor.recall(self, reply.token)
        elif isinstance(about, KeptPieces):
            self._executor.sink.kept(current.work, about.pieces, anew=about.anew)
        else:
            self._executor.sink.reported(current.work, about)

    def _conclude(self, child: Child, token: int, done: Done | ErrandDone) -> None:
        """An attempt or a batch ended: go on with the next one, then say what became of it."""
        now, leftover = time.monotonic(), []
        with self._lock:
            self._withdrawn.discard(token)
            if not self._held or self._held[0].token != token:
                ended = None
            else:
                ended = self._held.popleft()
                if isinstance(ended.work, Attempt):
                    self._lends, seconds = 0, now - ended.began
                    self._usual = max(seconds, 0.8 * self._usual + 0.2 * seconds)
                if self._closing:
                    leftover = list(self._held)
                    self._held.clear()
            if self._held:
                self._begin(child, self._held[0], now)
            elif self._withdrawn:
                # One taken back too late is computed all the same: it has the grace to notice.
                self._kill_after_grace(child, min(self._withdrawn))
        self._give_back(leftover)
        self._executor.tell_room()
        self._executor.room()
        if ended is not None:
            self._end(ended, done)

    def _begin(self, child: Child, held: _Held, now: float) -> None:
        held.began = now
        if not held.sent:
            self._send(child, held)
        if held.stopping:
            self._enforce(held)

    def _lose_all(self, reason: str, ended_by: int | None = None) -> None:
        """The process is gone: what it computed is lost, what waited behind goes back to the queue."""
        with self._lock:
            self._child = None
            held = list(self._held)
            self._held.clear()
            self._withdrawn.clear()
            self._usual = _SHORT_SECONDS
            lends, self._lends = self._lends, 0
        if lends:
            self._executor.recall(self, lends)
        self._executor.tell_room()
        if not held and not self._closing:
            log.warning("%s while it had nothing to do", reason)
        first = held.pop(0) if held and held[0].sent else None
        if first is not None and isinstance(first.work, Attempt):
            self._executor.sink.ended(first.work, Lost(reason, ended_by))
        elif first is not None:
            held.insert(0, first)
        self._give_back(held)

    def _give_back(self, several: Iterable[_Held]) -> None:
        for held in several:
            self._end(held, Done())

    def _end(self, held: _Held, done: Done | ErrandDone) -> None:
        """Say what became of an attempt or a batch."""
        work = held.work
        if isinstance(work, LentBatch):
            work.of.answer(work, done.data if isinstance(done, ErrandDone) else None)
        elif isinstance(done, Done):
            self._executor.sink.ended(work, _outcome(done))


def _outcome(done: Done) -> Outcome:
    if done.output is not None:
        return Finished(done.output)
    if done.failure is not None:
        return Failed(done.failure)
    return Stopped() if done.retry is None else Lost(done.retry)
