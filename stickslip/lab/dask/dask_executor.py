"""Workers of a Dask cluster: an order for each attempt, whose worker asks others for help by itself.

The row in the database stays the truth: orders carry everything a worker needs, what comes back is written
here, and an order that was lost costs the attempt (that of a divided kind is given again once, behind what it
kept). The cluster's own second tries are not wanted: an order that begins a second time is a worker that
died.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from queue import SimpleQueue
from typing import Annotated, Any

from distributed import Future, KilledWorker, Security

from service.db.repositories import Attempt
from service.errors import UnknownKindError
from service.jobs.checkpoints import KeptPieces
from service.jobs.outputs import Pace, Report
from service.jobs.kind_registry import Registry
from service.settings.settings import Settings
from service.workers.executor import ExecutorStatus, Failed, Finished, Lost, Outcome, Sink, Stopped
from stickslip.lab.dask.cluster import Cluster, answer_of
from service.workers.process_limits import UNLIMITED, ProcessLimits
from stickslip.lab.dask.tasks import Order, TaskAnswer
from service.workers.worker import failure_of

log = logging.getLogger("stickslip.executor")

_WRITERS = 4
_LOSSES = 1  # of a divided job, that cost no attempt

_tokens = itertools.count(1)


class Work:
    """An attempt, and what is known of it.

    Parameters
    ----------
    attempt : Attempt
        What is computed.
    losses : int
        How often its worker may die without that it costs the attempt.
    """

    def __init__(self, attempt: Attempt, losses: int) -> None:
        self.attempt = attempt
        self.saved = attempt.saved
        self.told = 0  # points of its branch that the queue knows
        self.pending = True
        self._losses = losses

    def go_on(self, kept: Sequence[KeptPieces]) -> None:
        """Order again what stopped on its way, behind what it kept."""
        for one in kept:
            before = () if one.anew else self.saved
            known = {piece.part: piece for piece in (*before, *one.pieces)}
            self.saved = tuple(known[part] for part in sorted(known))
        self.pending = True

    def may_lose(self) -> bool:
        """Count a loss; whether the attempt can bear it."""
        self._losses -= 1
        return self._losses >= 0


@dataclass(slots=True, kw_only=True)
class Flight:
    """An order on its way."""

    work: Work
    future: Future
    begun: Annotated[int, "What its worker said when it began; 0 before."] = 0
    worker: Annotated[str, "The address of that."] = ""
    threads: Annotated[int, "How many orders that computes at a time."] = 0
    deadline: Annotated[float, "When it is to have ended, once it was let go (monotonic) [s]."] = 0.0

    def leaving(self, deadline: float) -> Flight:
        """This one, let go."""
        self.deadline = deadline
        return self


class DaskExecutor:
    """The workers of a Dask cluster.

    Parameters
    ----------
    registry : Registry
        The kinds; their functions are sent by name, so workers have this package.
    address : str
        Of the scheduler.
    security : Security or None
        Certificates, for a tls:// address.
    grace_seconds : float
        Time between asking an attempt to stop and ending its worker by force [s], if that has one thread and
        a nanny.
    pace : Pace
        How often workers tell what, and how much of a job is kept for later attempts.
    limits : ProcessLimits
        What an order may use of its worker.
    """

    def __init__(
        self,
        registry: Registry,
        address: str,
        *,
        security: Security | None = None,
        grace_seconds: float,
        pace: Pace,
        limits: ProcessLimits = UNLIMITED,
    ) -> None:
        self._registry = registry
        self._grace_seconds = grace_seconds
        self._pace = pace
        self._limits = limits
        self._runs = registry.runs()
        self._version = version("stickslip")
        self._cluster = Cluster(address, security, self._heard, self._looked, self._lost)
        self._lock = threading.RLock()
        self._work: list[Work] = []
        self._flights: dict[str, Flight] = {}
        self._leaving: dict[str, Flight] = {}
        self._notes: SimpleQueue[dict[str, Any] | None] = SimpleQueue()
        self._listener = threading.Thread(target=self._listen, name="stickslip notes", daemon=True)
        self._pool = ThreadPoolExecutor(_WRITERS, thread_name_prefix="stickslip outcomes")
        self._closing = False
        self._sink: Sink

    def start(self, sink: Sink) -> None:
        """Begin to connect; returns at once."""
        self._sink = sink
        self._listener.start()
        self._cluster.start()

    def free(self) -> int:
        """How many attempts could start now."""
        with self._lock:
            return max(self._cluster.threads - len(self._work), 0) if self._cluster.connected else 0

    def submit(self, attempt: Attempt) -> None:
        """Send an attempt."""
        known = attempt.kind in self._registry
        divided = known and self._registry[attempt.kind].parts is not None
        work = Work(attempt, _LOSSES if divided else 0)
        work.pending = known
        with self._lock:
            self._work.append(work)
        if known:
            self._later(self._fill)
        else:
            error = UnknownKindError(attempt.kind)
            self._later(self._end, work, Failed(failure_of(attempt.job_id, attempt.kind, error)))

    def stop_attempt(self, attempt: Attempt) -> None:
        """Let an attempt go; its workers see that it is not wanted any more."""
        with self._lock:
            work = next((work for work in self._work if work.attempt is attempt), None)
        if work is not None:
            self._later(self._end, work, Stopped())

    def close(self) -> None:
        """Let everything go and close the connection."""
        with self._lock:
            self._closing = True
            running, flights = list(self._work), dict(self._flights)
        self._take_what_is_kept(flights)
        for work in running:
            self._end(work, Stopped())
        self._pool.shutdown()
        self._cluster.close()
        self._notes.put(None)
        if self._listener.ident is not None:
            self._listener.join()

    def _take_what_is_kept(self, flights: Mapping[str, Flight]) -> None:
        """Have orders end, and store what they kept for the next attempt, within the grace."""
        begun = {token: flight for token, flight in flights.items() if flight.begun}
        workers: dict[str, list[str]] = {}
        for token, flight in begun.items():
            workers.setdefault(flight.worker, []).append(token)
        self._cluster.ask_to_stop(workers)
        end = time.monotonic() + self._grace_seconds
        for flight in begun.values():
            try:
                answer = answer_of(flight.future, max(end - time.monotonic(), 0.01))
            except Exception as error:  # noqa: BLE001 - all that may become of a future; the job is tried again
                log.info("job %s gave nothing back: %r", flight.work.attempt.job_id, error)
                continue
            for kept in answer.kept:
                self._sink.kept(flight.work.attempt, kept.pieces, anew=kept.anew)

    def status(self) -> ExecutorStatus:
        """How the cluster is."""
        threads = self._cluster.threads if self._cluster.connected else 0
        with self._lock:
            busy = len(self._flights) + len(self._leaving)
        trouble = self._cluster.trouble
        if not threads and trouble is None:
            trouble = f"there is no connection to the Dask scheduler at {self._cluster.address} yet"
        return ExecutorStatus(workers=threads, ready=threads, busy=busy, trouble=trouble)

    def _later(self, call: Callable[..., None], *arguments: object) -> None:
        """Call in another thread: it may write to the database."""
        with self._lock:
            if not self._closing:
                self._pool.submit(self._logged, call, *arguments)

    @staticmethod
    def _logged(call: Callable[..., None], *arguments: object) -> None:
        try:
            call(*arguments)
        except Exception:
            log.exception("an outcome could not be dealt with")

    def _fill(self) -> None:
        """Send orders while there are threads without one."""
        with self._lock:
            while len(self._flights) + len(self._leaving) < self._cluster.threads:
                work = next((work for work in self._work if work.pending), None)
                if work is None:
                    return
                work.pending = False
                order = self._order(work)
                try:
                    future = self._cluster.send(order, 0)
                except (OSError, RuntimeError, TypeError) as error:
                    self._later(self._end, work, Lost(f"it could not be sent: {error}"))
                    return
                self._flights[order.token] = Flight(work=work, future=future)
                future.add_done_callback(lambda _, token=order.token: self._later(self._landed, token))

    def _order(self, work: Work) -> Order:
        attempt = work.attempt
        return Order(
            token=f"{attempt.lease_owner}-{next(_tokens)}",
            job_id=attempt.job_id,
            kind=attempt.kind,
            spec=attempt.spec,
            run=self._runs[attempt.kind],
            saved=work.saved,
            spec_hash=attempt.spec_hash,
            told=work.told,
            trace=attempt.trace,
            warm_up=self._registry.warm_up,
            version=self._version,
            threads=self._cluster.threads,
            pace=self._pace,
            limits=self._limits,
        )

    def _landed(self, token: str) -> None:
        """Deal with an order that came back, in whatever way."""
        with self._lock:
            flight = self._flights.get(token)
        if flight is None:
            return
        try:
            answer = answer_of(flight.future)
        except Exception as error:  # noqa: BLE001 - all that may become of a future
            answer = TaskAnswer(retry=self._loss(flight.future, error))
        with self._lock:
            if self._flights.pop(token, None) is None:
                return
        flight.future.release()
        self._deal(flight, answer)
        self._fill()
        self._sink.room()

    def _loss(self, future: Future, error: Exception) -> str:
        if isinstance(error, KilledWorker):
            return f"Dask worker {error.last_worker.address} died"
        if future.status in ("cancelled", "lost"):
            self._cluster.look()
            return f"the connection to the Dask scheduler at {self._cluster.address} was lost"
        return f"a Dask worker could not do it: {type(error).__name__}: {error}"

    def _deal(self, flight: Flight, answer: TaskAnswer) -> None:
        """Draw the consequences of an answer."""
        work = flight.work
        if answer.failure is not None:
            self._end(work, Failed(answer.failure))
        elif answer.retry is not None:
            self._again(work, answer.retry)
        elif answer.output is None:
            # It kept something, or its worker leaves the cluster in good order; nothing was lost.
            for kept in answer.kept:
                self._sink.kept(work.attempt, kept.pieces, anew=kept.anew)
            with self._lock:
                work.go_on(answer.kept)
        else:
            self._end(work, Finished(answer.output))

    def _again(self, work: Work, reason: str) -> None:
        """Order a divided job once more, if the connection is there; else the attempt is lost."""
        with self._lock:
            if self._cluster.connected and work.may_lose():
                log.warning("job %s: %s", work.attempt.job_id, reason)
                work.pending = True
                return
        self._end(work, Lost(reason))

    def _end(self, work: Work, outcome: Outcome) -> None:
        """Report an attempt and let go what is still computed for it; nothing the second time."""
        with self._lock:
            if work not in self._work:
                return
            self._work.remove(work)
            mine = {token: flight for token, flight in self._flights.items() if flight.work is work}
            for token, flight in mine.items():
                del self._flights[token]
                if flight.begun:
                    self._leaving[token] = flight.leaving(time.monotonic() + self._grace_seconds)
        for flight in mine.values():
            flight.future.release()
        self._sink.ended(work.attempt, outcome)
        self._fill()
        self._sink.room()

    def _heard(self, note: dict[str, Any]) -> None:
        self._notes.put(note)

    def _listen(self) -> None:
        """What workers say, in the order they said it."""
        while (note := self._notes.get()) is not None:
            self._logged(self._take, note)

    def _take(self, note: dict[str, Any]) -> None:
        token = str(note.get("token"))
        found = [(float(value), float(amplitude)) for value, amplitude in note.get("found", ())]
        with self._lock:
            flight = self._flights.get(token)
            if flight is not None:
                flight.work.told += len(found)
            if note.get("over") and self._leaving.pop(token, None) is not None:
                self._later(self._fill)
        if flight is None:
            return
        if "begun" in note:
            if flight.begun and flight.begun != note["begun"]:
                self._begun_again(flight)
            flight.begun, flight.worker = note["begun"], str(note["worker"])
            flight.threads = int(note["threads"])
        elif "share" in note:
            report = Report(float(note["share"]), int(note["points"]), tuple(found), note.get("best"))
            self._sink.reported(flight.work.attempt, report)

    def _begun_again(self, flight: Flight) -> None:
        """Its worker died, and the scheduler gave the order to another one by itself."""
        reason = f"Dask worker {flight.worker} died"
        if not flight.work.may_lose():
            self._later(self._end, flight.work, Lost(reason))
        else:
            log.warning("job %s: %s", flight.work.attempt.job_id, reason)

    def _looked(self, changed: bool) -> None:
        """The connection is there: end workers that did not heed in time, use new ones."""
        now = time.monotonic()
        with self._lock:
            late = {token: flight for token, flight in self._leaving.items() if now > flight.deadline}
            for token in late:
                del self._leaving[token]
        for flight in late.values():
            if flight.threads == 1:
                log.warning("Dask worker %s did not heed a stop in time and is ended", flight.worker)
                self._later(self._cluster.restart, flight.worker)
        if changed or late:
            self._later(self._fill)
            self._sink.room()

    def _lost(self, reason: str) -> None:
        """There is no connection: what ran is lost."""
        with self._lock:
            running = list(self._work)
            self._leaving.clear()
        for work in running:
            self._later(self._end, work, Lost(reason))


def of_settings(
    settings: Settings, scheduler: str, registry: Registry, limits: ProcessLimits
) -> DaskExecutor:
    """Return the executor that settings with a scheduler ask for."""
    security = None
    if scheduler.startswith("tls://"):
        security = Security(
            tls_ca_file=str(settings.dask_ca_file),
            tls_client_cert=str(settings.dask_cert_file),
            tls_client_key=str(settings.dask_key_file),
            require_encryption=True,
        )
    return DaskExecutor(
        registry,
        scheduler,
        security=security,
        grace_seconds=settings.grace_seconds,
        pace=settings.pace,
        limits=limits,
    )
