"""What a worker of a Dask cluster does: computes one order, and says how far it is.

It never opens the database. That a task is not wanted any more, because its job was cancelled or because the
service or the scheduler is gone, shows in the worker's own state of the task: asking it costs no message and
cannot hang when the scheduler does.
"""

from __future__ import annotations

import logging
import os
import pickle
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, Status, Worker, get_client, get_worker, rejoin, secede

from service.errors import ConfigurationError
from service.jobs.checkpoints import Checkpoints, KeptPieces
from service.jobs.outputs import JobFailure, JobOutput, Pace, Report, ResultPiece
from service.jobs.kind_registry import RunOn, WarmUp
from service.settings import traces
from service.workers.process_limits import THREAD_LIMITS, ProcessLimits
from service.workers.spreading import BatchAnswer, Spreading, helped
from service.workers.worker import Throttle, checked, failure_of, out_of_memory
from solver.results.spread import spreading

TOPIC = "stickslip"

_GONE = (Status.closing, Status.closing_gracefully, Status.closed, Status.failed)

log = logging.getLogger("stickslip.worker")

_to_stop: set[str] = set()

_warming = threading.Lock()
_warmed: set[WarmUp] = set()


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """To a worker: compute this job.

    Attributes
    ----------
    token : str
        Names the order in what the worker says about it.
    saved : tuple of Piece
        What earlier orders kept.
    spec_hash : str
        Digest of what is computed, to which they belong.
    trace : str or None
        The `traceparent` it is part of, if there are traces.
    told : int
        How many points of its branch the service knows; they are not said again.
    version : str
        Of the service; a worker with another one might compute other numbers.
    threads : int
        Of all workers: some of them may help.
    pace : Pace
        How often the worker tells what, and when it keeps what it has.
    limits : ProcessLimits
        What the order may use; a worker with several threads may use as much for each of them.
    """

    token: str
    job_id: str
    kind: str
    spec: Mapping[str, Any]
    run: RunOn
    saved: tuple[ResultPiece, ...]
    spec_hash: str
    told: int
    trace: str | None
    warm_up: WarmUp
    version: str
    threads: int
    pace: Pace
    limits: ProcessLimits


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskAnswer:
    """From a worker: an output, a failure, a reason to try again, or none of them if it stopped on its way.

    What it `kept` then is for the next order.
    """

    kept: tuple[KeptPieces, ...] = ()
    output: JobOutput | None = None
    failure: JobFailure | None = None
    retry: str | None = None


class _Unwanted:
    """`should_stop` of one order: whether the cluster still wants its task; remembers that it does not."""

    def __init__(self, worker: Worker, key: object, token: str = "") -> None:
        self._worker, self._token = worker, token
        self._tasks: Mapping[object, Any] = worker.state.tasks
        self._key = key
        self.obeyed = False

    def __call__(self) -> bool:
        task = self._tasks.get(self._key)
        if self._token in _to_stop:
            self.obeyed = True
        if task is None or task.state in ("cancelled", "resumed") or self._worker.status in _GONE:
            self.obeyed = True
        return self.obeyed


class _Colleagues:
    """The threads of the cluster as `Helpers`: batches are tasks of their own, behind the orders of jobs.

    The order leaves its thread to them as long as it waits: Dask deals out what is to be done, and no batch
    waits for the thread that waits for it.
    """

    alone = False

    def __init__(self, order: Order) -> None:
        self._order = order
        self._client: Client | None = None
        self._underway: dict[int, Future] = {}
        self._back: SimpleQueue[int] = SimpleQueue()
        self._seceded = False

    def room(self) -> int:
        """How many batches may be sent now: one is computed by each thread, and one waits."""
        return 2 * self._order.threads - len(self._underway) if self._order.threads > 1 else 0

    def share(self) -> int:
        """All threads."""
        return self._order.threads

    def send(self, number: int, data: bytes) -> None:
        """Send a batch to whoever has nothing to do."""
        order = self._order
        if self._client is None:
            self._client = get_client()
        if not self._seceded:
            secede()
            self._seceded = True
        future = self._client.submit(
            assist, data, order.warm_up, order.version, order.limits, pure=False, retries=0, priority=-1,
            key=f"stickslip-batch-{order.token}-{number}-{time.time_ns()}",
        )  # fmt: skip
        self._underway[number] = future
        future.add_done_callback(lambda _: self._back.put(number))

    def answers(self, seconds: float) -> list[BatchAnswer]:
        """What came back."""
        found: list[BatchAnswer] = []
        try:
            while True:
                number = self._back.get(timeout=0.0 if found else seconds)
                if (future := self._underway.pop(number, None)) is not None:
                    found.append(BatchAnswer(number, _result_of(future)))
        except Empty:
            return found

    def end(self, *, recall: bool) -> None:
        """Let go what is underway, and take the thread again; an order that ends early needs none."""
        for future in self._underway.values():
            future.release()
        self._underway.clear()
        if self._seceded and not recall:
            self._seceded = False
            rejoin()


def _result_of(future: Future) -> bytes | None:
    """What a batch gave; None if its worker died or could not compute it."""
    try:
        data: bytes | None = future.result()
    except Exception as error:  # noqa: BLE001 - all that may become of a future; it is computed here then
        log.warning("a batch did not come back: %s: %s", type(error).__name__, error)
        return None
    finally:
        future.release()
    return data


def assist(data: bytes, warm_up: WarmUp, service: str, limits: ProcessLimits) -> bytes | None:
    """Compute a batch of another worker's order; whatever is wrong with it, that one meets it again."""
    worker = get_worker()
    if version("stickslip") != service:
        return None
    stop = _Unwanted(worker, worker.get_current_task())
    try:
        _warm(warm_up, limits.for_threads(worker.state.nthreads))
        return helped(data, stop)
    except Exception as error:  # noqa: BLE001 - the boundary: as for a local worker
        log.info("a batch of another worker's job was not computed: %s: %s", type(error).__name__, error)
        return None
    finally:
        limits.forget()


class _OrderStop:
    """`should_stop` of one order, and the place where its run keeps what it has.

    A run that has kept something stops there: its pieces are the answer, and the next order goes on behind
    them. They so take the way of the results, are stored before a worker can take them along, and are not
    in the scheduler's log of events, which forgets little.
    """

    def __init__(self, unwanted: _Unwanted) -> None:
        self.unwanted = unwanted
        self.kept: list[KeptPieces] = []
        self.obeyed = False

    def __call__(self) -> bool:
        if self.kept or self.unwanted():
            self.obeyed = True
        return self.obeyed


async def ask_to_stop(tokens: list[str]) -> None:
    """On a worker: have orders end now, with what they kept; those of other workers are not known here."""
    _to_stop.update(tokens)


def compute(order: Order) -> bytes:
    """Compute an order; every error becomes an answer.

    The answer is pickled here: what cannot be sent is an error of the job, as it is from a local worker.
    """
    answer = _answer(order)
    try:
        return pickle.dumps(answer)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        return pickle.dumps(TaskAnswer(failure=failure_of(order.job_id, order.kind, error)))


def _answer(order: Order) -> TaskAnswer:
    worker = get_worker()
    here = f"{worker.address} (process {os.getpid()})"
    if (mine := version("stickslip")) != order.version:
        return TaskAnswer(retry=f"worker {here} has stickslip {mine}, the service {order.version}")
    try:
        traces.configure(on=order.pace.traces)
    except ConfigurationError as error:
        return TaskAnswer(retry=f"worker {here}: {error}")

    def say(**note: Any) -> None:
        worker.log_event(TOPIC, {"token": order.token, "worker": worker.address, **note})

    known = order.told

    def send(report: Report) -> None:
        nonlocal known
        found = [list(point) for point in report.found[known:]]
        known = max(known - len(report.found), 0)
        best = {} if report.best is None else {"best": dict(report.best)}
        say(share=report.fraction, points=report.points, found=found, **best)

    # The time tells a second start of an order from the first one, even in the same process.
    say(begun=time.time_ns(), threads=worker.state.nthreads)
    stop = _OrderStop(_Unwanted(worker, worker.get_current_task(), order.token))
    try:
        with traces.span("compute", order.trace, job=order.job_id, kind=order.kind):
            return _computed(order, worker.state.nthreads, Throttle(send, order.pace.progress_seconds), stop)
    finally:
        order.limits.forget()
        _to_stop.discard(order.token)
        say(over=True)


def _computed(order: Order, threads: int, progress: Throttle, stop: _OrderStop) -> TaskAnswer:
    kept = Checkpoints(order.job_id, order.saved, stop.kept.append, order.pace, order.spec_hash)
    try:
        _warm(order.warm_up, order.limits.for_threads(threads))
        with spreading(Spreading(_Colleagues(order), stop.unwanted)):
            output = checked(order.run(order.spec, progress, stop, kept))
    except MemoryError as error:
        done = out_of_memory(error, order.limits)
        return TaskAnswer(failure=done.failure, retry=done.retry)
    except Exception as error:  # noqa: BLE001 - the boundary: whatever it is, the job must hear of it
        if not stop.obeyed:
            return TaskAnswer(failure=failure_of(order.job_id, order.kind, error))
    if not stop.obeyed:
        return TaskAnswer(output=output)
    kept.flush()
    return TaskAnswer(kept=tuple(stop.kept))


def _warm(warm_up: WarmUp, limits: ProcessLimits) -> None:
    """Load and compile what the kinds need, once in this process and one thread at a time; limit its memory.

    Limited anew for each order, beyond what the process has then: services with other limits may use the same
    workers, and what it keeps from other orders must not leave Dask itself without memory.
    """
    with _warming:
        if warm_up not in _warmed:
            os.environ.update(THREAD_LIMITS)
            warm_up()
            _warmed.add(warm_up)
        limits.confine()
