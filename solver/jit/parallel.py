"""Compile kernels in several processes at once; they meet in the cache on disk.

One process calls kernels as any program does. Of each that it compiles it learns which others are called
there; those go to a pool of processes, which report what they find in turn. Before a kernel runs for the
first time it is taken back from the pool, or waited for, and what waits in the meantime is compiled here.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor

from solver.jit.way import WAY, Way

if WAY is Way.COMPILED:
    from solver.jit.compiler_process import note
    from solver.jit.slots import make, watched

MOST_PROCESSES = 4  # each compiles the short kernels for itself, and takes 600 MB at most
# A compiler makes many objects that live for long: collected as often as usual they take 8 % of the time.
_COLLECT = (20_000, 20, 1000)


def cores() -> int:
    """Return how many processes may run at once on this machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compile_together(
    calls: Sequence[Callable[[], object]], *, listed: bool = True, processes: int | None = None
) -> None:
    """Make these calls, each in one process, and compile every kernel that lies under them.

    Parameters
    ----------
    calls : functions of modules, so that another process finds them.
    listed : whether kernels are compiled that none of the calls reached, also those that are called by a
        number, such as those of contact laws.
    processes : how many; one for each core, up to `MOST_PROCESSES`, if left out.

    Raises
    ------
    Exception
        What a call or the compilation of a kernel raised, in whatever process.
    """
    if WAY is not Way.COMPILED:  # nothing is kept that another process could use
        for call in calls:
            call()
        return
    count = min(cores(), MOST_PROCESSES) if processes is None else processes
    spawning = multiprocessing.get_context("spawn")
    with contextlib.ExitStack() as stack:
        pool = None
        stack.callback(gc.set_threshold, *gc.get_threshold())
        gc.set_threshold(*_COLLECT)
        if count > 1:
            pool = stack.enter_context(
                ProcessPoolExecutor(
                    count - 1, mp_context=spawning, initializer=gc.set_threshold, initargs=_COLLECT
                )
            )
            stack.callback(pool.shutdown, wait=False, cancel_futures=True)
        team = _Team(pool, listed=listed)
        with watched(team):
            team.hand_out(calls[1:])
            calls[0]()
            team.finish()


class _Noted:
    """Keeps the names of the kernels called."""

    def __init__(self, *, also_listed: bool) -> None:
        self.names: list[bytes] = []
        self._also_listed = also_listed

    def called(self, name: bytes) -> None:
        self.names.append(name)

    def listed(self, name: bytes) -> None:
        if self._also_listed:
            self.names.append(name)

    def needed(self, name: bytes) -> None:
        """Nobody else makes it."""


def _elsewhere(task: Callable[[], object] | bytes, listed: bool) -> list[bytes]:
    """Make a call or a kernel in a process of the pool; return the names of the kernels called there."""
    noted = _Noted(also_listed=listed)
    with watched(noted):
        if isinstance(task, bytes):
            make(task)
        else:
            task()
    return noted.names


class _Team:
    """The tasks of all processes, from the view of the first."""

    def __init__(self, pool: ProcessPoolExecutor | None, *, listed: bool) -> None:
        self._pool, self._also_listed = pool, listed
        self._lock = threading.Lock()
        self._seen: set[bytes] = set()
        self._open: dict[Callable[[], object] | bytes, Future[list[bytes]] | None] = {}
        self._done = 0

    def hand_out(self, tasks: Sequence[Callable[[], object] | bytes]) -> None:
        """Offer tasks to the pool."""
        for task in tasks:
            with self._lock:
                if isinstance(task, bytes):
                    if task in self._seen:
                        continue
                    self._seen.add(task)
                future = None
                if self._pool is not None:
                    future = self._pool.submit(_elsewhere, task, self._also_listed)
                self._open[task] = future
            if future is not None:
                future.add_done_callback(self._more)

    def _more(self, future: Future[list[bytes]]) -> None:
        """Offer what a process found; what it raised is raised where its task is waited for."""
        if not future.cancelled() and future.exception() is None:
            self._tell()
            self.hand_out(future.result())

    def _tell(self) -> None:
        """Tell other processes that a kernel more is compiled."""
        with self._lock:
            self._done += 1
            done, found = self._done, max(len(self._seen), self._done)
        note(done, found)

    def called(self, name: bytes) -> None:
        """Offer the kernel to the pool."""
        self.hand_out([name])

    def listed(self, name: bytes) -> None:
        """Offer the kernel to the pool if such ones are wanted."""
        if self._also_listed:
            self.hand_out([name])

    def needed(self, name: bytes) -> None:
        """Wait until the kernel is compiled if another process is at it; compile others meanwhile."""
        with self._lock:
            future = self._open.pop(name, None)
        if future is None or future.cancel():
            self._tell()
            return
        while not future.done() and self._help():
            pass
        future.result()

    def _help(self) -> bool:
        """Do a task here that no process has begun; False if there is none."""
        with self._lock:
            mine = next(
                (task for task, future in self._open.items() if future is None or future.cancel()), None
            )
            if mine is None:
                return False
            del self._open[mine]
        if isinstance(mine, bytes):
            make(mine)
        else:
            mine()
        self._tell()
        return True

    def finish(self) -> None:
        """Return when nothing is left to do: of the calls alone if nothing else is wanted."""
        if not self._also_listed:
            with self._lock:
                self._pool = None
                self._open = {task: each for task, each in self._open.items() if not isinstance(task, bytes)}
        while True:
            while self._help():
                pass
            with self._lock:
                if not self._open:
                    return
                _, future = self._open.popitem()
            if future is not None:
                self.hand_out(future.result())  # `_more` may be on its way
