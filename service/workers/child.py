"""A worker process, as the service sees it: how it starts, how it ended."""

from __future__ import annotations

import ctypes
import multiprocessing as mp
import signal
from collections.abc import Mapping
from ctypes import Array
from multiprocessing.connection import Connection

from service.jobs.kind_registry import RunOn, WarmUp
from service.jobs.outputs import Pace
from service.workers.process_limits import ProcessLimits
from service.workers.processes import Process, start
from service.workers.worker import Orders, main


def death(process: Process) -> str:
    """How a process that closed its pipe ended, as a sentence; it has ended then."""
    process.join(5.0)
    if process.is_alive():
        process.kill()
        process.join()
        return f"worker process {process.pid} closed its pipe and did not end"
    code = process.status()
    if code is None:
        return f"worker process {process.pid} ended, and so did what it was forked off"
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else "unknown"
        hint = ", perhaps for want of memory" if name == "SIGKILL" else ""
        return f"worker process {process.pid} was killed by signal {-code} ({name}{hint})"
    return f"worker process {process.pid} ended with status {code}"


def ending_signal(process: Process) -> int | None:
    """The signal that ended a process, if one did."""
    code = process.status()
    return None if code is None or code >= 0 else -code


class Child:
    """One worker process and the parent's end of its pipe."""

    def __init__(self, runs: Mapping[str, RunOn], warm_up: WarmUp, pace: Pace, limits: ProcessLimits) -> None:
        context = mp.get_context("spawn")
        numbers: Array[ctypes.c_longlong] = context.RawArray(ctypes.c_longlong, Orders.SIZE)
        self.orders = Orders(numbers)
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self.process = start(main, (theirs, numbers, runs, warm_up, pace, limits), "stickslip worker")
        theirs.close()

    def end(self, patience: float) -> None:
        """End the process: politely, then by force."""
        self.process.join(patience)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.connection.close()
        self.process.close()
