"""How long a process takes from its start to its end, kernels cached, beside what cannot be left out."""

from __future__ import annotations

import resource
import subprocess
import sys
import time

from benchmarks.harness import expect, table

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


def start() -> None:
    """Time processes from start to end: help, a solve, and the imports under them."""
    rows = []
    for name, arguments, allowed in STARTS:
        _run(name, arguments)  # compiles what is not cached yet
        measured = [_run(name, arguments) for _ in range(RUNS)]
        wall, cpu = (min(column) for column in zip(*measured, strict=True))
        rows.append((name, f"{wall:.3f}", f"{cpu:.3f}", "" if allowed is None else f"{allowed:g}"))
    table("From start to end, cached kernels", ("process", "least s", "CPU s", "wanted s"), rows)


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
