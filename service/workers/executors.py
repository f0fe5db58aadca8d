"""The executor that a service's settings ask for: processes of this machine, or a cluster."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping

from service.db.repositories import Attempt
from service.errors import ConfigurationError
from service.jobs.kind_registry import Registry, RunOn, WarmUp
from service.jobs.outputs import Pace
from service.settings.settings import Settings
from service.workers.executor import Executor, ExecutorStatus, Sink, Stopped
from service.workers.process_limits import UNLIMITED, ProcessLimits
from service.workers.slot import LentBatch, Slot
from solver.lab import from_lab

_TEND_SECONDS = 0.1


class LocalExecutor:
    """Worker processes of this machine.

    Parameters
    ----------
    runs : the function of each kind; sent to the processes by name.
    warm_up : called in every process before it takes an attempt; sent by name.
    workers : number of processes.
    grace_seconds : time between asking an attempt to stop and killing its process [s].
    pace : how often the processes tell what.
    limits : what each process may use.
    """

    def __init__(
        self, runs: Mapping[str, RunOn], warm_up: WarmUp, *, workers: int, grace_seconds: float, pace: Pace,
        limits: ProcessLimits = UNLIMITED,
    ) -> None:  # fmt: skip
        self.runs = runs
        self.warm_up = warm_up
        self.grace_seconds = grace_seconds
        self.pace = pace
        self.limits = limits
        self.trouble: str | None = None
        # The first process fills the cache of compiled loops that the others then only read.
        self.warmed = threading.Event()
        self.sink: Sink
        self._slots = [Slot(self, index) for index in range(workers)]
        self._ahead = threading.Event()
        self._closing = False
        self._tender = threading.Thread(target=self._tend, name="stickslip tender", daemon=True)

    def start(self, sink: Sink) -> None:
        """Start every process; returns at once."""
        self.sink = sink
        for slot in self._slots:
            slot.start()
        self._tender.start()

    def free(self) -> int:
        """How many attempts the processes take now; 0 while what waits in their pipes lasts.

        Once half of what may wait there is used up, so that jobs are taken from the queue several at a time.
        """
        places = [(slot.places, slot.held) for slot in self._slots]
        free = sum(max(0, most - held) for most, held in places)
        idle = any(most and not held for most, held in places)
        return free if idle or 2 * free >= sum(most for most, _ in places) else 0

    def room(self) -> None:
        """From a slot: it may have a place."""
        if self.free():
            self.sink.room()

    def lend(self, batch: LentBatch) -> None:
        """Have a process without attempts compute a batch of another's; without one it goes back."""
        others = sorted(self._slots, key=Slot.errands, reverse=True)
        if not any(slot.help(batch) for slot in others if slot is not batch.of):
            batch.of.answer(batch, None)
        self.tell_room()

    def recall(self, of: Slot, token: int) -> None:
        """Of the batches of a task none is wanted any more."""
        for slot in self._slots:
            slot.forget(of, token)

    def tell_room(self) -> None:
        """Tell every process how many batches the others would take."""
        room = [(slot, slot.errands()) for slot in self._slots]
        total, others = sum(own for _, own in room), len(room) - 1
        for slot, own in room:
            slot.lend_room(total - own, others)

    def submit(self, attempt: Attempt) -> None:
        """Give an attempt to the process with the fewest; without a place it goes back to the queue."""
        slots = sorted(self._slots, key=lambda slot: (slot.held, slot.busy))
        given = any(slot.give(attempt) for slot in slots)
        self.tell_room()
        if not given:
            self.sink.ended(attempt, Stopped())
        elif any(slot.held > 1 for slot in self._slots):
            self._ahead.set()

    def stop_attempt(self, attempt: Attempt) -> None:
        """Ask an attempt to stop; its process is killed when the grace is over."""
        any(slot.stop(attempt) for slot in self._slots)

    def close(self) -> None:
        """End every process; attempts end first."""
        self._closing = True
        self._ahead.set()
        for slot in self._slots:
            slot.close()
        self.warmed.set()
        for slot in self._slots:
            if slot.ident is not None:
                slot.join()
        if self._tender.ident is not None:
            self._tender.join()

    def status(self) -> ExecutorStatus:
        """How the processes are."""
        return ExecutorStatus(
            workers=len(self._slots),
            ready=sum(slot.ready for slot in self._slots),
            busy=sum(slot.busy for slot in self._slots),
            trouble=self.trouble,
        )

    def _tend(self) -> None:
        """While attempts wait behind others: see that none waits long."""
        while not self._closing:
            self._ahead.wait()
            self._ahead.clear()
            time.sleep(_TEND_SECONDS)
            waiting = [slot.withdraw_stuck() for slot in self._slots]
            if any(waiting):
                self._ahead.set()


def executor_of(settings: Settings, registry: Registry) -> Executor:
    """The executor that the settings ask for (ConfigurationError if what it needs is not installed)."""
    limits = ProcessLimits(memory_bytes=settings.worker_memory_bytes or None)
    if settings.executor == "local" or settings.dask_scheduler is None:
        return LocalExecutor(
            registry.runs(), registry.warm_up, workers=settings.workers,
            grace_seconds=settings.grace_seconds, pace=settings.pace, limits=limits,
        )  # fmt: skip
    try:
        made: Executor = from_lab("dask.dask_executor:of_settings")(
            settings, settings.dask_scheduler, registry, limits
        )
    except ImportError as error:
        raise ConfigurationError(
            f"`executor` 'dask' needs the extra of that name: pip install 'stickslip[dask]' ({error})"
        ) from error
    return made
