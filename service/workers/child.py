"""A worker process, as the service sees it: how it starts, how it ended."""

from __future__ import annotations

import ctypes
import multiprocessing as mp
import os
import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from ctypes import Array
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from service.jobs.outputs import Pace
from service.jobs.registry import RunOn, WarmUp
from service.workers.process_limits import ProcessLimits
from service.workers.worker import THREAD_LIMITS, Orders, main

_environment_lock = threading.Lock()


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """The environment in which workers start: one BLAS and one Numba thread each.

    It must be in place before the process starts, and this process keeps its own.
    """
    with _environment_lock:
        before = {name: os.environ.get(name) for name in THREAD_LIMITS}
        os.environ.update(THREAD_LIMITS)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


def death(process: SpawnProcess) -> str:
    """How a process ended, as a sentence."""
    process.join(5.0)
    code = process.exitcode
    if code is not None and code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else "unknown"
        hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
        return f"worker process {process.pid} was killed by signal {-code} ({name}{hint})"
    return f"worker process {process.pid} ended with status {code}"


def ending_signal(process: SpawnProcess) -> int | None:
    """The signal that ended a process, if one did."""
    return None if process.exitcode is None or process.exitcode >= 0 else -process.exitcode


class Child:
    """One worker process and the parent's end of its pipe."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, pace: Pace, limits: ProcessLimits) -> None:
        context = mp.get_context("spawn")
        numbers: Array[ctypes.c_longlong] = context.RawArray(ctypes.c_longlong, Orders.SIZE)
        self.orders = Orders(numbers)
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self.process = context.Process(
            target=main,
            args=(theirs, numbers, runs, warm_up, pace, limits),
            name="stickslip worker",
            daemon=True,
        )
        with _one_thread_each():
            self.process.start()
        theirs.close()

    def end(self, patience: float) -> None:
        """End the process: politely, then by force."""
        self.process.join(patience)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        self.process.close()
