"""The real queue and database against simulated workers: results are replayed, nothing is computed."""

from __future__ import annotations

import heapq
import importlib.util
import itertools
import multiprocessing as mp
import os
import random
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from multiprocessing.queues import Queue
from multiprocessing.synchronize import Barrier
from pathlib import Path

from sqlalchemy import Connection, func, select, text

from benchmarks.harness import WrongResultError, expect, table
from service.db import revisions
from service.db.engine import Database, is_sqlite
from service.db.models import Job, JobResult, JobState
from service.db.repositories import Attempt
from service.jobs.checkpoints import Checkpoints
from service.jobs.kinds import SHIPPED
from service.jobs.outputs import JobOutput
from service.queue.core import Service
from service.queue.queue import JobQueue
from service.settings.settings import load_settings
from service.workers.executor import ExecutorStatus, Finished, Sink, Stopped
from service.workers.worker import Throttle, checked

TIMES = 100
CORES = os.cpu_count() or 1
_JOBS = 6000
_THREADS = 16
_BODY = {"kind": "sweep", "scene": "two-dof", "fresh": True}


class ReplayExecutor:
    """So many workers that answer every attempt with the same output after waiting.

    They wait from half to one and a half of `seconds`: workers that all ended at once would come in bursts.
    """

    def __init__(self, output: JobOutput, workers: int, seconds: float) -> None:
        self._output, self._workers, self._seconds = output, workers, seconds
        self._chance = random.Random(0)
        self._running: dict[int, Attempt] = {}
        self._ends: list[tuple[float, int]] = []
        self._numbers = itertools.count()
        self._changed = threading.Condition()
        self._closing = False
        self._pool = ThreadPoolExecutor(workers)  # a thread a worker, as the local executor has
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._sink: Sink

    def start(self, sink: Sink) -> None:
        """Begin to take attempts."""
        self._sink = sink
        self._thread.start()
        sink.room()

    def free(self) -> int:
        """Return the number of idle workers."""
        return self._workers - len(self._running)

    def submit(self, attempt: Attempt) -> None:
        """Take an attempt."""
        number = next(self._numbers)
        with self._changed:
            self._running[number] = attempt
            wait = self._seconds * self._chance.uniform(0.5, 1.5)
            heapq.heappush(self._ends, (time.monotonic() + wait, number))
            self._changed.notify()

    def stop_attempt(self, attempt: Attempt) -> None:
        """End an attempt at once."""
        with self._changed:
            found = next((n for n, one in self._running.items() if one is attempt), None)
            if found is not None:
                del self._running[found]
        if found is not None:
            self._sink.ended(attempt, Stopped())

    def close(self) -> None:
        """End everything."""
        with self._changed:
            self._closing = True
            left, self._running = list(self._running.values()), {}
            self._changed.notify()
        self._thread.join()
        self._pool.shutdown()
        for attempt in left:
            self._sink.ended(attempt, Stopped())

    def status(self) -> ExecutorStatus:
        """Return how many are busy."""
        return ExecutorStatus(workers=self._workers, ready=self._workers, busy=len(self._running))

    def _run(self) -> None:
        while not self._closing:
            with self._changed:
                now = time.monotonic()
                if not self._ends or self._ends[0][0] > now:
                    self._changed.wait(self._ends[0][0] - now if self._ends else 1.0)
                    continue
                attempt = self._running.pop(heapq.heappop(self._ends)[1], None)
            if attempt is not None:
                self._pool.submit(self._end, attempt)

    def _end(self, attempt: Attempt) -> None:
        self._sink.room()
        self._sink.ended(attempt, Finished(self._output))


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What one service process does: its share of the workers, seconds of a job, jobs it hands in first."""

    url: str
    workers: int
    seconds: float
    jobs: int


def _one_output() -> tuple[dict[str, object], JobOutput]:
    """Return spec and output of a real small job."""
    from service.jobs.common.scene_requests import shipped_scene

    scene = shipped_scene("two-dof")
    spec: dict[str, object] = {
        "scene": scene.to_dict(), "parameter": "frequency", "start": scene.observe.band[0],
        "stop": scene.observe.band[1], "frequency_hz": None, "harmonics": 11, "limit": None,
    }  # fmt: skip
    run = SHIPPED.runs()["sweep"]
    return spec, checked(run(spec, Throttle(lambda _r: None, 1.0), lambda: False, Checkpoints.none()))


def _serve(work: Work, ready: Barrier, submitted: Barrier, found: Queue[tuple[float, float, float]]) -> None:
    """One service process: hands in its share of the jobs, then works off the queue with the others."""
    settings = load_settings(database=work.url, queue_limit=1_000_000, workers=1, poll_seconds=0.5)
    service = Service(settings)
    _, output = _one_output()
    service.queue = JobQueue(
        service.jobs,
        ReplayExecutor(output, work.workers, work.seconds),
        settings,
        service.waiters,
        service.meters,
    )
    service.open()
    ready.wait()
    begun, cpu = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(_THREADS) as threads:
        list(threads.map(lambda _: service.submit(_BODY), range(work.jobs)))
    handed_in = (time.perf_counter() - begun, time.process_time() - cpu)
    submitted.wait()
    cpu = time.process_time()
    service.queue.start()
    while any(service.jobs.count()[state] for state in (JobState.ACCEPTED, JobState.RUNNING)):
        time.sleep(0.1)
    found.put((*handed_in, time.process_time() - cpu))
    service.queue.stop()
    service.database.close()


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """Rates [1/s] of handing in and of working off, processor time [s] a job of both, bytes a job."""

    accepted: float
    done: float
    accept_cpu: float
    done_cpu: float
    size: float


def simulate(url: str, *, processes: int, workers: int, seconds: float, jobs: int = _JOBS) -> Simulated:
    """Have `processes` services with `workers` simulated workers in all work off `jobs` jobs."""
    revisions.upgrade(url)
    context = mp.get_context("spawn")
    ready, submitted, found = context.Barrier(processes), context.Barrier(processes), context.Queue()
    work = Work(url=url, workers=workers // processes, seconds=seconds, jobs=jobs // processes)
    running = [context.Process(target=_serve, args=(work, ready, submitted, found)) for _ in range(processes)]
    for process in running:
        process.start()
    told = [found.get(timeout=600.0) for _ in running]
    for process in running:
        process.join()
    number = work.jobs * processes
    database = Database(url)
    with database.reading() as connection:
        first_attempts = select(Job.finished).where(Job.state == JobState.SUCCESSFUL, Job.attempt == 1)
        ended = connection.execute(first_attempts.order_by(Job.finished)).scalars().all()
        results = connection.execute(select(func.count()).select_from(JobResult)).scalar_one()
        size = _size(database, connection)
    database.close()
    expect(f"{len(ended)} jobs and {results} results of {number}", len(ended) == results == number)
    first, last = number // 10, number - number // 10
    return Simulated(
        accepted=number / max(seconds for seconds, _, _ in told),
        done=(last - first) / (ended[last - 1] - ended[first]).total_seconds(),
        accept_cpu=statistics.mean(cpu for _, cpu, _ in told) / work.jobs,
        done_cpu=sum(cpu for _, _, cpu in told) / number,
        size=size / number,
    )


def _size(database: Database, connection: Connection) -> float:
    if is_sqlite(database.url):
        query = "SELECT page_count * page_size FROM pragma_page_count(), pragma_page_size()"
    else:
        query = "SELECT pg_database_size(current_database())"
    return float(connection.execute(text(query)).scalar_one())


@contextmanager
def own_postgresql() -> Iterator[Callable[[], str]]:
    """A server of the tests' kind that keeps what it says it has written; makes databases."""
    tests = Path(__file__).resolve().parent.parent / "tests"
    path = tests / "service" / "postgresql_cluster.py"
    sys.path.append(str(tests / "cases"))  # what it imports
    found = importlib.util.spec_from_file_location("postgresql_cluster", path)
    if found is None or found.loader is None:
        raise WrongResultError(f"there is no {path}")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    module._SETTINGS = ("shared_buffers=128MB", "max_connections=200")
    with module.Cluster(module.binaries()) as cluster, ExitStack() as stack:
        yield lambda: stack.enter_context(cluster.database())


def workers() -> None:
    """Queue and database with 100 times as many simulated workers as there are cores."""
    rows = []
    with tempfile.TemporaryDirectory() as folder, own_postgresql() as new_database:
        names = itertools.count()
        urls: dict[str, Callable[[], str]] = {
            "SQLite": lambda: f"sqlite:///{folder}/{next(names)}.db", "PostgreSQL": new_database,
        }  # fmt: skip
        for backend, processes in (("SQLite", 1), ("PostgreSQL", 1), ("PostgreSQL", 2), ("PostgreSQL", 4)):
            rows.append(_row(backend, processes, urls[backend]))
            print(*rows[-1], file=sys.stderr)
    workers = TIMES * CORES
    table(
        f"{workers} simulated workers, results of small jobs replayed, everything on {CORES} cores",
        ("database", "services", "accepted/s", "done/s", "service CPU a job", "bytes a job", "job time",
         "predicted/s", "measured/s"),
        rows,
    )  # fmt: skip
    print("Job time: the mean that asks for 70 % of what can be done; service CPU: handing in + working off.")
    print("Rates leave out the first and the last tenth of the jobs, in which workers begin or have no more.")


def _row(backend: str, processes: int, url: Callable[[], str]) -> tuple[str, ...]:
    workers = TIMES * CORES
    most = simulate(url(), processes=processes, workers=workers, seconds=0.0)
    seconds = workers / (0.7 * most.done)
    found = simulate(url(), processes=processes, workers=workers, seconds=seconds)
    return (
        backend, str(processes), f"{most.accepted:.0f}", f"{most.done:.0f}",
        f"{most.accept_cpu * 1e3:.2f} + {most.done_cpu * 1e3:.2f} ms", f"{most.size / 1000:.0f} kB",
        f"{seconds * 1e3:.0f} ms", f"{workers / seconds:.0f}", f"{found.done:.0f}",
    )  # fmt: skip
