"""How long a process takes from its start to its end, kernels cached, beside what cannot be left out."""

from __future__ import annotations

import resource
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.harness import expect, table
from benchmarks.service_process import LightClient, ServiceProcess
from service.db import revisions

RUNS = 7
COMMAND = "import sys; from service.cli import process; sys.exit(process())"
# what is started, and the most seconds on the wall it may take on an idle core; None: for comparison
STARTS: tuple[tuple[str, tuple[str, ...], float | None], ...] = (
    ("python", ("-c", "pass"), None),
    ("python, import numpy", ("-c", "import numpy"), None),
    ("python, import numba", ("-c", "import numba"), None),
    ("python, import stickslip", ("-c", "import stickslip"), 0.25),
    ("stickslip --help", ("-c", COMMAND, "--help"), 0.25),
    ("stickslip solve --help", ("-c", COMMAND, "solve", "--help"), 0.25),
    ("stickslip solve two-dof --frequency 1", ("-c", COMMAND, "solve", "two-dof", "--frequency", "1"), 0.8),
    (
        "stickslip solve bladed-disk --frequency 755",
        ("-c", COMMAND, "solve", "bladed-disk", "--frequency", "755"), 0.8,
    ),
    ("stickslip sweep two-dof", ("-c", COMMAND, "sweep", "two-dof"), None),
)  # fmt: skip


SERVES = 3
ASKED = {"kind": "solve", "scene": "two-dof", "frequency_hz": 1.0}


def start() -> None:
    """Time processes from start to end: help, a solve, the imports under them; a service to its answers."""
    rows = []
    for name, arguments, allowed in STARTS:
        _run(name, arguments)  # compiles what is not cached yet
        measured = [_run(name, arguments) for _ in range(RUNS)]
        wall, cpu = (min(column) for column in zip(*measured, strict=True))
        rows.append((name, f"{wall:.3f}", f"{cpu:.3f}", "" if allowed is None else f"{allowed:g}"))
    table("From start to end, cached kernels", ("process", "least s", "CPU s", "wanted s"), rows)
    heads = ("to", "least s", "CPU s of the service", "of its processes", "wanted s")
    for name, tables in (("a database with its tables", True), ("a new database", False)):
        runs = [_serve(tables=tables) for _ in range(SERVES)]
        least = [map(min, zip(*ones, strict=True)) for ones in zip(*runs, strict=True)]
        wanted = (("live", "1.5"), ("first answered POST", "3"))
        told = [
            (to, *(f"{one:.2f}" for one in found), most)
            for (to, most), found in zip(wanted, least, strict=True)
        ]
        table(f"`stickslip serve`, {name}", heads, told)


def _serve(*, tables: bool) -> tuple[tuple[float, float, float], ...]:
    """Until a service lives, and until it has answered a POST: on the wall, of the processor [s]."""
    with tempfile.TemporaryDirectory() as folder, socket.socket() as probe:
        url = f"sqlite:///{folder}/jobs.db"
        if tables:
            revisions.upgrade(url)
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
        probe.close()
        begun = time.perf_counter()
        words = ("-c", COMMAND, "serve", "--port", str(port), "--database", url, "--workers", "1")
        with Path(folder, "log").open("wb") as log:
            process = subprocess.Popen([sys.executable, *words], stderr=log)
        service = ServiceProcess(process, port, url)

        def after(ask: Callable[[LightClient], int]) -> tuple[float, float, float]:
            while True:
                try:
                    with service.client() as client:
                        status = ask(client)
                        break
                except OSError:
                    expect("the service runs", process.poll() is None)
                    time.sleep(0.01)
            expect("it is answered", status in (200, 202))
            cpu = service.cpu()
            return time.perf_counter() - begun, cpu.service, cpu.workers

        try:
            return (
                after(lambda client: client.get("/health/live").status),
                after(lambda client: client.post("/v1/jobs", ASKED).status),
            )
        finally:
            process.terminate()
            process.wait()


def _run(name: str, arguments: tuple[str, ...]) -> tuple[float, float]:
    """Return the seconds of a process on the wall and of the processor."""
    before, begun = _processor_seconds(), time.perf_counter()
    done = subprocess.run([sys.executable, *arguments], check=False, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - begun
    expect(f"{name} ends well", done.returncode == 0)
    return seconds, _processor_seconds() - before


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
