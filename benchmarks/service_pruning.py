"""Requests to a service while it deletes what is old."""

from __future__ import annotations

import os
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from sqlalchemy import func, select

from benchmarks.harness import expect, table
from benchmarks.service_load import small_job
from benchmarks.service_process import ServiceProcess, serving
from benchmarks.stored_sweeps import fill
from service.db.engine import Database
from service.db.models import Result

SWEEPS = 100_000
_PAUSE_SECONDS = 0.01
_BEFORE_SECONDS = 10.0
_DAYS = 0.5  # the sweeps are a day old


def pruning() -> None:
    """Single requests while 100 000 sweeps are deleted, the worst among them, beside those before."""
    rows = []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        database = f"sqlite:///{folder}/jobs.db"
        fill(database, SWEEPS)
        for words, deleted in (("nothing is old", False), ("while they are deleted", True)):
            settings = {"retention_days": _DAYS} if deleted else {}
            with serving(database, workers=1, log=folder / "log", **settings) as service:
                seconds, posts, lists = _timed(service, until_deleted=deleted)
            for name, times in (("POST /v1/jobs", posts), ("GET /v1/sweeps", lists)):
                times.sort()
                shown = (times[len(times) // 2], times[int(0.99 * len(times))], times[-1])
                late = sum(one > 0.05 for one in times)
                rows.append(
                    (words, f"{seconds:.0f} s", name, str(len(times)),
                     *(f"{one * 1e3:.1f} ms" for one in shown), str(late))
                )  # fmt: skip
    table(
        f"Requests one after the other while {SWEEPS} sweeps are deleted, {os.cpu_count()} cores",
        ("when", "for", "request", "number", "median", "99 %", "longest", "above 50 ms"),
        rows,
    )


def _timed(service: ServiceProcess, *, until_deleted: bool) -> tuple[float, list[float], list[float]]:
    """Seconds it took, times of jobs handed in (answered from the store) and of lists [s]."""
    posts: list[float] = []
    lists: list[float] = []
    begun = time.perf_counter()
    looked = begun
    with service.client() as http:
        http.post("/v1/jobs", small_job(1), "Prefer: wait=60\r\n")
        while True:
            before = time.perf_counter()
            answer = http.post("/v1/jobs", small_job(1))
            between = time.perf_counter()
            expect(f"answered {answer.status}", answer.status in (200, 202))
            expect("a list", http.get("/v1/sweeps?scene=two-dof&limit=20").status == 200)
            after = time.perf_counter()
            posts.append(between - before)
            lists.append(after - between)
            if after - looked > 1.0:
                looked = after
                if _ended(service, until_deleted, after - begun):
                    return after - begun, posts, lists
            time.sleep(_PAUSE_SECONDS)


def _ended(service: ServiceProcess, until_deleted: bool, seconds: float) -> bool:
    if not until_deleted:
        return seconds > _BEFORE_SECONDS
    opened = Database(service.database)
    try:
        with opened.reading() as connection:
            return connection.execute(select(func.count()).where(Result.of == "sweep")).scalar_one() <= 10
    finally:
        opened.close()
