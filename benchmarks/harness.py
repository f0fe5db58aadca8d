"""How things are timed here: warm, one thread, the least of several runs, on the clock of the process.

The time of the process (CPU time) is the figure: it does not count what other programs on the machine do.
The time on the wall stands beside it where both are known.
"""

from __future__ import annotations

import json
import os
import select
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

_T = TypeVar("_T")


class WrongResultError(Exception):
    """A benchmark computed something that is not so: there is no figure then."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Seconds of one call: least and median time on the wall, least of the process, number of runs."""

    least: float
    median: float
    cpu: float
    runs: int


class Checkout:
    """A checkout of the project that does work of these benchmarks in a process of its own.

    Its process imports this folder's `benchmarks`, all else from there, and runs `serve` of a module, which
    answers a line with a line of JSON.
    """

    def __init__(self, folder: Path, module: str) -> None:
        ours = str(Path(__file__).resolve().parents[1])
        start = (
            f"import sys; sys.path[:1] = [{ours!r}]; import benchmarks; sys.path[0] = {str(folder)!r}; "
            f"from {module} import serve; serve()"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", start],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, line: str, patience: float | None = None) -> dict[str, float] | None:
        """Return the answer to a line; None, and none ever after, if it takes longer than `patience` [s]."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        if self._process.poll() is not None:
            return None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], patience)[0]:
            self._process.kill()
            self._process.wait()
            return None
        answer = self._process.stdout.readline()
        return dict(json.loads(answer)) if answer else None

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def timed(call: Callable[[], _T], *, runs: int = 9, warm_up: int = 1) -> tuple[_T, Timing]:
    """Return the result of a call and its time, after `warm_up` calls that are not counted."""
    for _ in range(warm_up):
        call()
    seconds, process = [], []
    for _ in range(runs):
        begun, begun_cpu = time.perf_counter(), time.process_time()
        result = call()
        process.append(time.process_time() - begun_cpu)
        seconds.append(time.perf_counter() - begun)
    return result, Timing(least=min(seconds), median=statistics.median(seconds), cpu=min(process), runs=runs)


def check(what: str, found: float, known: float, rel: float) -> str:
    """Return `found` and its relative distance to the known value, for a table.

    Raises
    ------
    WrongResultError
        It is further away than `rel`.
    """
    error = abs(found - known) / abs(known)
    if not error <= rel:
        raise WrongResultError(f"{what}: {found:.9g} instead of {known:.9g}, off by {error:.1e} > {rel:.0e}")
    return f"{found:.7g} (off {error:.0e})"


def expect(what: str, holds: bool) -> None:
    """Raise WrongResultError unless something holds."""
    if not holds:
        raise WrongResultError(what)


def table(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Print a table."""
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    print(f"\n{title}")
    for row in (header, tuple("-" * width for width in widths), *rows):
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
