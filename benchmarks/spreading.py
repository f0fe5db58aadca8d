"""What a second worker brings: studies of some ten seconds on one and on two, local ones and Dask's.

The efficiency by the clock needs two idle processors. That by processor time, what the study takes on one
worker over twice what it takes of the busier of two, tells on a busy machine too how well both are used.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from benchmarks.harness import expect, table
from service.client.embedded import EmbeddedService
from service.settings.settings import load_settings

WORKERS = 2
DISK: dict[str, Any] = {"scene": "bladed-disk", "harmonics": 5}
STUDIES: dict[str, tuple[str, dict[str, Any]]] = {
    "60 mistuned disks": (
        "mistuning",
        {**DISK, "of": ["tip_middle", "tip"], "samples": 60, "from": 700, "to": 850, "harmonics": 1},
    ),
    "map 700 × 700": (
        "map",
        {**DISK, "parameter": "shroud.N0", "from": 20, "to": 3000, "steps": 700, "frequencies": 700,
         "ridge": False},
    ),
    "map 60 × 40 with ridge": (
        "map",
        {**DISK, "parameter": "shroud.N0", "from": 20, "to": 3000, "steps": 60, "frequencies": 40},
    ),
    "robust design, 64 samples": (
        "design",
        {**DISK, "variables": {"shroud.N0": [20, 3000]}, "uncertain": {"shroud.mu": [0.2, 0.4]},
         "aim": "mean", "samples": 64},
    ),
    "design of two variables": (
        "design",
        {**DISK, "variables": {"shroud.N0": [20, 3000], "root.kt": [1e6, 1e8]}, "limit": 8e-5,
         "max_band_hz": 60},
    ),
    "front of 6 points": (
        "pareto",
        {**DISK, "variables": {"shroud.N0": [20, 3000]}, "limit": 8e-5, "points": 6},
    ),
}  # fmt: skip


def spreading() -> None:
    """Six studies on one and on two workers of each kind; they find the same."""
    rows: list[tuple[str, ...]] = []
    found: dict[str, Any] = {}
    taken: dict[tuple[str, str, int], tuple[float, float]] = {}
    for kind in ("local", "dask"):
        for count in (1, WORKERS):
            with _service(kind, count) as service:
                for name in STUDIES:
                    taken[name, kind, count], result = _computed(service, name)
                    expect(f"{name}: the same on {count} ({kind})", found.setdefault(name, result) == result)
    for name in STUDIES:
        row = [name]
        for kind in ("local", "dask"):
            one, two = taken[name, kind, 1], taken[name, kind, WORKERS]
            shares = [f"{100.0 * a / (WORKERS * b):.0f} %" for a, b in zip(one, two, strict=True)]
            row += [f"{one[0]:.2f}", f"{two[0]:.2f}", *shares]
        rows.append(tuple(row))
    columns = ("s on 1", "s on 2", "efficiency by the clock", "by processor time")
    header = ("study", *columns, *(f"Dask, {each}" for each in columns))
    table("Studies on one and on two workers", header, rows)


@contextmanager
def _service(kind: str, count: int) -> Iterator[EmbeddedService]:
    with tempfile.TemporaryDirectory() as folder:
        given: dict[str, Any] = {"database": f"sqlite:///{folder}/jobs.db", "workers": count}
        if kind == "local":
            with EmbeddedService(load_settings(**given)) as service:
                yield service
            return
        # Loaded here: an extra, which the other benchmarks do without.
        from distributed import LocalCluster

        with LocalCluster(
            n_workers=count, threads_per_worker=1, dashboard_address=None, host="127.0.0.1",
            local_directory=str(Path(folder)),
        ) as cluster:  # fmt: skip
            given |= {"executor": "dask", "dask_scheduler": cluster.scheduler_address}
            with EmbeddedService(load_settings(**given)) as service:
                yield service


def _computed(service: EmbeddedService, name: str) -> tuple[tuple[float, float], Any]:
    """What a study takes by the clock and of the busier worker [s], once all is loaded; what it finds."""
    kind, body = STUDIES[name]
    times, result = [], None
    workers = _workers(service)
    for _ in range(2):
        begun, before = time.perf_counter(), _spent(workers)
        job = service.submit(kind, {**body, "fresh": True})
        done = service.wait(job)
        spent = [after - earlier for after, earlier in zip(_spent(workers), before, strict=True)]
        times.append((time.perf_counter() - begun, max(spent)))
        expect(f"{name}: {done.status.value}", done.status.value in ("successful", "failed"))
        result = _timeless(service.results(job).result)
    return min(times), result


def _workers(service: EmbeddedService) -> list[psutil.Process]:
    executor: Any = service._service.queue._executor
    while not service._service.queue.status().ready == service._service.queue.status().workers > 0:
        time.sleep(0.1)
    if hasattr(executor, "_slots"):
        return [psutil.Process(slot._child.process.pid) for slot in executor._slots]
    return [psutil.Process(pid) for pid in executor._cluster._client.run(os.getpid).values()]


def _spent(workers: list[psutil.Process]) -> list[float]:
    """Processor time of each [s]."""
    return [sum(worker.cpu_times()[:2]) for worker in workers]


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _timeless(one) for key, one in value.items() if key != "seconds"}
    return [_timeless(one) for one in value] if isinstance(value, list) else value
