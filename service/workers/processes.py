"""How the processes are made that compute: forked off one that has everything loaded.

A process that begins from nothing spends seconds of processor time on loading packages and kernels. On Linux
one process of the service does it once, without threads and without connections of the service, and every
other is forked off it: it begins at once and shares the memory of what was loaded. Elsewhere each begins
from nothing.
"""

from __future__ import annotations

import multiprocessing as mp
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any

from service.workers.worker import THREAD_LIMITS

PRELOADED = "service.workers.preloaded"
_OURS = "STICKSLIP_"

_lock = threading.Lock()
_settings_of_the_first: dict[str, str] | None = None


def start(target: Callable[..., None], args: tuple[Any, ...], name: str) -> BaseProcess:
    """Start a process that ends with this one; it has one BLAS and one Numba thread."""
    with _lock, _one_thread_each():
        # mypy: the contexts that exist all have a class `Process`; their base does not say so.
        made: BaseProcess = _context().Process(  # type: ignore[attr-defined]
            target=target, args=args, name=name, daemon=True
        )
        made.start()
    return made


def _context() -> BaseContext:
    """The way to make a process; from nothing too if settings were changed after the first one was made."""
    global _settings_of_the_first
    if sys.platform != "linux":
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
