"""How the processes are made that compute: forked off one that has everything loaded.

A process that begins from nothing spends seconds of processor time on loading packages and kernels. On Linux
one process of the service does it once, without threads and without connections of the service, and every
other is forked off it: it begins at once and shares the memory of what was loaded. Elsewhere each begins
from nothing.

That one process, the fork server, is the parent of the others, and the standard library hears of their ends
from it alone: when it is killed, all of them read as ended with status 255 while they compute on, and are not
killed any more. So each is watched and killed by a file descriptor of its own (pidfd), whoever its parent is;
the next start makes another fork server.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing as mp
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any

from service.workers.process_limits import THREAD_LIMITS, address_space, limit_process
from solver.jit.compiler_process import missing

PRELOADED = "service.workers.preloaded"
_OURS = "STICKSLIP_"

_STATUS_LOST = 255
"""What the standard library says of a process whose fork server is gone."""
_STATUS_SECONDS = 5.0
"""How long the fork server has to tell the status of a process that ended [s]."""
_ANOTHER_SECONDS, _BETWEEN_SECONDS = 5.0, 0.02
"""How long another fork server is tried for, and the pause between attempts [s]."""

_lock = threading.Lock()
_settings_of_the_first: dict[str, str] | None = None


class Process:
    """A process that was started; where the system has no pidfd, as the standard library sees it.

    Attributes
    ----------
    pid : its number.
    """

    def __init__(self, made: BaseProcess) -> None:
        if made.pid is None:
            raise ValueError("the process was not started")
        self._made = made
        self.pid: int = made.pid
        self._pidfd = _pidfd(made.pid, made.sentinel)

    @property
    def sentinel(self) -> int:
        """What `multiprocessing.connection.wait` finds ready when the process has ended."""
        return self._made.sentinel if self._pidfd is None else self._pidfd

    def is_alive(self) -> bool:
        """Whether it runs."""
        return not wait([self.sentinel], 0.0)

    def join(self, seconds: float | None = None) -> None:
        """Wait for its end."""
        wait([self.sentinel], seconds)

    def kill(self) -> None:
        """End it at once, if it runs."""
        if self._pidfd is None:
            self._made.kill()
            return
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._pidfd, signal.SIGKILL)

    def status(self) -> int | None:
        """The exit status, below zero if a signal ended it; None if it runs, or the status was lost."""
        if self.is_alive() or not self._told():
            return None
        return None if self._made.exitcode == _STATUS_LOST else self._made.exitcode

    def close(self) -> None:
        """Let go of it after its end."""
        # Of one whose fork server hangs and does not tell, the standard library lets go at a later start.
        if self._told():
            self._made.close()
        opened, self._pidfd = self._pidfd, None
        if opened is not None:
            os.close(opened)

    def _told(self) -> bool:
        """Whether the standard library has heard of the end, which the fork server tells it."""
        if not wait([self._made.sentinel], _STATUS_SECONDS):
            return False
        # A start looks at all processes too, and the status can be read only once.
        with _lock:
            self._made.join()
        return True


def _pidfd(pid: int, sentinel: int) -> int | None:
    """A file descriptor of a process that has just started; None if there is none or it has ended."""
    if sys.platform != "linux":
        return None
    try:
        opened = os.pidfd_open(pid)
    except OSError:  # it ended already, or the kernel has no such descriptors
        return None
    if not wait([sentinel], 0.0):
        return opened
    # It ended, or its fork server did: its number may be another's by now.
    os.close(opened)
    return None


def begin() -> None:
    """Have what processes are forked off begin to load, beside what this one loads meanwhile."""
    with _lock, _one_thread_each():
        if _context().get_start_method() == "forkserver":
            from multiprocessing.forkserver import ensure_running

            ensure_running()


def start(target: Callable[..., None], args: tuple[Any, ...], name: str) -> Process:
    """Start a process that ends with this one; it has one BLAS and one Numba thread.

    OSError if it cannot be started, or the fork server ended meanwhile.
    """
    until = time.monotonic() + _ANOTHER_SECONDS
    with _lock, _one_thread_each():
        while True:
            try:
                return _started(target, args, name)
            except (EOFError, ConnectionError) as error:
                # The fork server ended at this moment. There will be another once the system says so.
                if time.monotonic() > until:
                    raise ConnectionAbortedError("what processes are forked off keeps ending") from error
                time.sleep(_BETWEEN_SECONDS)


class EndedError(Exception):
    """A process ended without an answer."""

    def __init__(self, status: int | None) -> None:
        self.status = status
        super().__init__(str(status))


def told_apart(
    task: Callable[[Any], Any], argument: Any, name: str, *, seconds: float, most_bytes: int,
    memory: int, beside: bool = False, writes: int = 0,
) -> Any:  # fmt: skip
    """What a task finds in a process of its own, as JSON: nothing it answers is unpickled.

    Parameters
    ----------
    task : at the top level of a module.
    seconds : longest time, of the processor too [s].
    most_bytes : of the answer.
    memory, writes : most that it may have, and write to files [bytes].
    beside : whether that is memory beside what it is born with.

    Raises
    ------
    TimeoutError
        It takes longer.
    EndedError
        It ended without an answer.
    OSError
        The answer is larger.
    """
    ours, theirs = mp.Pipe(duplex=False)
    with ours:
        process = start(_tell, (theirs, task, argument, seconds, memory, beside, writes), name)
        theirs.close()
        try:
            if not ours.poll(seconds):
                raise TimeoutError
            return json.loads(ours.recv_bytes(most_bytes))
        except EOFError as error:
            process.join(1.0)
            raise EndedError(process.status()) from error
        finally:
            process.kill()
            process.join()
            process.close()


def _tell(
    connection: Connection, task: Callable[[Any], Any], argument: Any, seconds: float, memory: int,
    beside: bool, writes: int,
) -> None:  # fmt: skip
    """The life of such a process."""
    limit_process(seconds, memory + (address_space() if beside else 0), writes)
    # The other end may have lost its patience.
    with contextlib.suppress(BrokenPipeError):
        connection.send_bytes(json.dumps(task(argument), allow_nan=False).encode())


def _started(target: Callable[..., None], args: tuple[Any, ...], name: str) -> Process:
    # mypy: the contexts that exist all have a class `Process`; their base does not say so.
    made: BaseProcess = _context().Process(  # type: ignore[attr-defined]
        target=target, args=args, name=name, daemon=True
    )
    made.start()
    return Process(made)


def _context() -> BaseContext:
    """The way to make a process; from nothing too if settings were changed after the first one was made."""
    global _settings_of_the_first
    # What others are forked off has compiled kernels; while there are none, each begins from nothing.
    if sys.platform != "linux" or missing():
        return mp.get_context("spawn")
    settings = {name: value for name, value in os.environ.items() if name.startswith(_OURS)}
    if _settings_of_the_first is None:
        _settings_of_the_first = settings
        mp.get_context("forkserver").set_forkserver_preload([PRELOADED])
    return mp.get_context("forkserver" if settings == _settings_of_the_first else "spawn")


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """The environment in which workers start.

    It must be in place before the process starts, and this process keeps its own.
    """
    before = {name: os.environ[name] for name in THREAD_LIMITS if name in os.environ}
    os.environ.update(THREAD_LIMITS)
    try:
        yield
    finally:
        for name in THREAD_LIMITS.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)
