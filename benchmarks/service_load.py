"""The service under load: many small jobs of many clients, the latency of one, lists beside running jobs."""

from __future__ import annotations

import itertools
import multiprocessing as mp
import os
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import func, select

from benchmarks.harness import expect, table
from benchmarks.service_process import Cpu, ServiceProcess, serving
from benchmarks.stored_sweeps import fill
from service.db.engine import Database
from service.db.models import Job, JobResult, JobState, Result

JOBS = 10_000
CLIENTS = 16
CORES = os.cpu_count() or 1
SWEEPS = 100_000
_WAIT = "Prefer: wait=60\r\n"
_LISTS = (
    "",
    "scene=two-dof",
    "scene=two-dof&peak_max=3",
    "scene=bladed-disk&sort=peak",
    "peak_min=5&sort=-peak",
    "peak_at_min=1.0&peak_at_max=1.1",
    "N0_min=100&N0_max=110",
    "contact=shroud&N0_min=500&N0_max=700&sort=peak",
    "parameter=frequency&sort=-points",
    "harmonics=11&sort=band_hz",
    "band_hz_max=0.05",
    "scene=two-dof&peak_max=2.5&N0_min=100&N0_max=300&sort=-seconds",
)


def small_job(number: int) -> dict[str, Any]:
    """Return the body of a frequency response of two masses; each number has a load of its own."""
    return {"kind": "sweep", "scene": "two-dof", "set": {"damper.N0": 100.0 + number * 0.01}}


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """What came of a load: wall time [s], processor times [s], states of the jobs, latencies [s]."""

    seconds: float
    cpu: Cpu
    latencies: list[float]


def run_load(
    service: ServiceProcess,
    jobs: int,
    clients: int,
    *,
    wait: bool,
    first: int = 0,
    job: Callable[[int], dict[str, Any]] = small_job,
) -> Load:
    """Hand in small jobs by several clients at once and return when every one has ended.

    Parameters
    ----------
    wait : bool
        Whether each client waits for each result; else it hands in one job after the other.
    first : int
        Number of the first job; jobs of a number handed in before are answered from the cache.
    job : callable
        The body of a job by its number.
    """
    ids: list[list[str]] = [[] for _ in range(clients)]
    latencies: list[list[float]] = [[] for _ in range(clients)]
    errors: list[BaseException] = []

    def hand_in(client: int) -> None:
        try:
            with service.client() as http:
                for number in range(first + client, first + jobs, clients):
                    begun = time.perf_counter()
                    answer = http.post("/v1/jobs", job(number), _WAIT if wait else "")
                    latencies[client].append(time.perf_counter() - begun)
                    expect(f"answered {answer.status}", answer.status == (200 if wait else 202))
                    ids[client].append(answer.headers["location"])
        except BaseException as error:
            errors.append(error)
            raise

    before, begun = service.cpu(), time.perf_counter()
    threads = [threading.Thread(target=hand_in, args=(client,)) for client in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]
    _until_all_ended(service)
    seconds, cpu = time.perf_counter() - begun, service.cpu().since(before)
    found = {one for several in ids for one in several}
    expect(f"{len(found)} different jobs of {jobs}", len(found) == jobs)
    return Load(seconds=seconds, cpu=cpu, latencies=[one for several in latencies for one in several])


def _until_all_ended(service: ServiceProcess) -> None:
    with service.client() as http:
        while True:
            counts = http.get("/health/ready").json()["jobs"]
            if counts["accepted"] + counts["running"] == 0:
                return
            time.sleep(0.25)


def check_jobs(database: str, jobs: int) -> None:
    """Raise WrongResultError unless every job succeeded once, in one attempt, with one result and sweep."""
    opened = Database(database)
    try:
        with opened.reading() as connection:
            states = connection.execute(select(Job.state, Job.attempt, Job.result_of, func.count()).group_by(
                Job.state, Job.attempt, Job.result_of)).all()  # fmt: skip
            results = connection.execute(select(func.count()).select_from(JobResult)).scalar_one()
            sweeps = connection.execute(
                select(func.count(Result.job_id.distinct()), func.count()).where(Result.of == "sweep")
            ).one()
    finally:
        opened.close()
    expect(
        f"jobs in the database: {states}",
        [tuple(s) for s in states] == [(JobState.SUCCESSFUL, 1, None, jobs)],
    )
    expect(f"{results} results of {jobs}", results == jobs)
    expect(f"{tuple(sweeps)} sweeps of {jobs}", tuple(sweeps) == (jobs, jobs))


def seconds_of_one_job(runs: int = 200) -> float:
    """Return the median processor time [s] of a small job in a warm worker that runs alone."""
    with mp.get_context("spawn").Pool(1) as pool:
        return float(pool.apply(_time_jobs, (runs,)))


def _time_jobs(runs: int) -> float:
    from service.jobs.checkpoints import Checkpoints
    from service.jobs.common.scene_requests import shipped_scene
    from service.jobs.kinds import SHIPPED, warm_up
    from service.workers.worker import Throttle, checked

    warm_up()
    scene = shipped_scene("two-dof")
    run, seconds = SHIPPED.runs()["sweep"], []
    for number in range(runs + 20):
        changed = scene.with_values(small_job(number * 50)["set"])
        low, high = scene.observe.band
        spec = {"scene": changed.to_dict(), "parameter": "frequency", "start": low, "stop": high,
                "frequency_hz": None, "harmonics": 11, "limit": None}  # fmt: skip
        begun = time.process_time()
        output = checked(run(spec, Throttle(lambda _report: None, 0.1), lambda: False, Checkpoints.none()))
        seconds.append(time.process_time() - begun)
        expect("a small job failed", output.shortfall is None)
    return statistics.median(seconds[20:])


def load() -> None:
    """10 000 small jobs of 16 clients: every one successful, once; throughput against cores / time of one."""
    one, rows = seconds_of_one_job(), []
    for wait, words in ((False, "handed in one after the other"), (True, "each waited for (Prefer: wait)")):
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            database = f"sqlite:///{folder}/jobs.db"
            settings = {"queue_limit": 2 * JOBS}
            service = stack.enter_context(serving(database, workers=CORES, log=folder / "log", **settings))
            run_load(service, 10 * CLIENTS, CLIENTS, wait=wait)
            found = run_load(service, JOBS, CLIENTS, wait=wait, first=10 * CLIENTS)
            check_jobs(database, JOBS + 10 * CLIENTS)
            size = (folder / "jobs.db").stat().st_size
            row = _load_row(words, found, one)
            rows.append((*row, f"{size / (JOBS + 10 * CLIENTS) / 1000:.0f} kB"))
    ms = f"{one * 1e3:.2f} ms"
    table(
        f"{JOBS} small jobs by {CLIENTS} clients, {CORES} cores and workers, one job alone {ms}",
        ("how", "jobs/s", "of cores / one job", "of what others left", "of our own", "service", "workers",
         "clients", "others", "median answer", "database a job"),
        rows,
    )  # fmt: skip
    print("Processor time a job; `others` is what else ran on the machine: the second share leaves it out,")
    print("the third is that of one job in all the processor time used: what no idling would give.")


def _load_row(words: str, found: Load, one: float) -> tuple[str, ...]:
    jobs, cpu = len(found.latencies), found.cpu
    others = max(0.0, cpu.machine - cpu.total)
    share = jobs * one / (CORES * found.seconds)
    left = jobs * one / max(CORES * found.seconds - others, 1e-9)
    alone = jobs * one / cpu.total
    times = (cpu.service, cpu.workers, cpu.clients, others)
    return (
        words, f"{jobs / found.seconds:.0f}", f"{100 * share:.0f} %", f"{100 * left:.0f} %",
        f"{100 * alone:.0f} %",
        *(f"{seconds / jobs * 1e3:.2f} ms" for seconds in times),
        f"{statistics.median(found.latencies) * 1e3:.0f} ms",
    )  # fmt: skip


def latency() -> None:
    """A small job on an empty queue, from POST to its result with `Prefer: wait`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with serving(f"sqlite:///{folder}/jobs.db", workers=CORES, log=folder / "log") as service:
            run_load(service, 20, 1, wait=True)
            found = run_load(service, 300, 1, wait=True, first=20)
    ordered = sorted(found.latencies)
    shown = (ordered[len(ordered) // 2], ordered[int(0.9 * len(ordered))], ordered[-1], seconds_of_one_job())
    table(
        "A small job on an empty queue, from POST to result",
        ("median", "90 %", "longest", "one job alone", "wanted"),
        [(*(f"{seconds * 1e3:.1f} ms" for seconds in shown), "25 ms")],
    )


def lists() -> None:
    """Lists of 100 000 stored sweeps by several filters and orders, while jobs run."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        database = f"sqlite:///{folder}/jobs.db"
        fill(database, SWEEPS)
        service = stack.enter_context(serving(database, workers=CORES, log=folder / "log"))
        stop, done = threading.Event(), itertools.count()
        threads = [threading.Thread(target=_keep_busy, args=(service, stop, done)) for _ in range(2 * CORES)]
        for thread in threads:
            thread.start()
        try:
            rows, medians = _timed_lists(service)
        finally:
            stop.set()
            for thread in threads:
                thread.join()
    table(
        f"A page of 100 of {SWEEPS} stored sweeps while {next(done)} jobs ran",
        ("list", "median", "90 %"),
        rows,
    )
    print(f"Median over all lists {statistics.median(medians) * 1e3:.0f} ms, wanted 50 ms.")


def _keep_busy(service: ServiceProcess, stop: threading.Event, numbers: itertools.count[int]) -> None:
    with service.client() as http:
        while not stop.is_set():
            answer = http.post("/v1/jobs", small_job(next(numbers)), _WAIT)
            expect(f"answered {answer.status}", answer.status == 200)


def _timed_lists(service: ServiceProcess, times: int = 25) -> tuple[list[tuple[str, ...]], list[float]]:
    rows, every = [], []
    with service.client() as http:
        for query in _LISTS:
            seconds = []
            for _ in range(times):
                begun = time.perf_counter()
                answer = http.get(f"/v1/sweeps?{query}")
                seconds.append(time.perf_counter() - begun)
                expect(f"{query}: answered {answer.status}", answer.status == 200)
            expect(f"{query}: nothing found", bool(answer.json()["items"]))
            seconds.sort()
            every += seconds
            shown = (seconds[times // 2], seconds[int(0.9 * times)])
            rows.append((query or "(all)", *(f"{one * 1e3:.0f} ms" for one in shown)))
    return rows, every
