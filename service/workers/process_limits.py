"""Limits of a worker process: memory beyond what it has when it is ready, processor time of one task."""

from __future__ import annotations

import functools
import gc
import signal
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

_THREADED = ("OMP_NUM", "OPENBLAS_NUM", "MKL_NUM", "BLIS_NUM", "VECLIB_MAXIMUM", "NUMEXPR_NUM", "NUMBA_NUM")
THREAD_LIMITS = {f"{library}_THREADS": "1" for library in _THREADED}
_MATRICES = "solver.linear"
"""The modules whose caches hold matrices and modes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessLimits:
    """What a worker process may use; where the system cannot limit it, nothing happens."""

    memory_bytes: Annotated[
        int | None,
        "Address space beyond that of the process when it is ready: a task that wants more meets "
        "MemoryError.",
    ] = None
    processor_seconds: Annotated[
        float | None, "Of one task; the system ends the process that takes more, whatever it is at [s]."
    ] = None

    def for_threads(self, number: int) -> ProcessLimits:
        """Those of a process in which so many tasks are computed at a time."""
        return self if self.memory_bytes is None else replace(self, memory_bytes=number * self.memory_bytes)

    def confine(self) -> None:
        """Limit the memory of this process, beyond what it has now that it is ready."""
        if sys.platform != "linux":
            return
        # Loaded here, as below: there is none on Windows.
        import resource

        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        if self.memory_bytes is None:
            resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
            return
        limit = address_space() + self.memory_bytes
        if hard != resource.RLIM_INFINITY:
            limit = min(limit, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def forget(self) -> None:
        """Let go of the matrices that are kept for later tasks, if they take half of the memory."""
        if self.memory_bytes is None or sys.platform != "linux":
            return
        import resource

        if resource.getrlimit(resource.RLIMIT_AS)[0] - address_space() > self.memory_bytes / 2:
            return
        gc.unfreeze()  # what was loaded before this process was forked off is not looked through otherwise
        for found in gc.get_objects():
            if isinstance(found, functools._lru_cache_wrapper) and found.__module__.startswith(_MATRICES):
                found.cache_clear()

    def begin(self) -> None:
        """A task begins: count its processor time from here."""
        self._count(self.processor_seconds)

    def end(self) -> None:
        """A task ended."""
        self._count(0.0)

    def _count(self, seconds: float | None) -> None:
        # No handler: what ends the process must not wait for the interpreter to look.
        if self.processor_seconds is not None and sys.platform != "win32":
            signal.setitimer(signal.ITIMER_PROF, seconds or 0.0)

    def memory_told(self) -> str:
        """The limit of memory, for people."""
        return "there is" if self.memory_bytes is None else f"{self.memory_bytes / 1e6:.0f} MB"


UNLIMITED = ProcessLimits()


def limit_process(seconds: float, memory: int, writes: int = 0) -> None:
    """Limit the time [s], the memory and the files it writes [bytes] of this process."""
    import resource

    for what, value in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, round(seconds) + 1),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, writes),
    ):
        hard = resource.getrlimit(what)[1]
        limit = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(what, (limit, limit))


def address_space() -> int:
    """Bytes of address space of this process."""
    import resource

    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
