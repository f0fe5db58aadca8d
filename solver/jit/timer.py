"""The clock of what is reported: it stands still while kernels are compiled."""

from __future__ import annotations

import threading
import time


class _Compiled(threading.local):
    """Seconds that this thread has compiled for."""

    seconds = 0.0


_compiled = _Compiled()


def clock() -> float:
    """Return seconds since some instant, of which none are the compiler's."""
    return time.perf_counter() - _compiled.seconds


def took(seconds: float) -> None:
    """Take out what this thread has just compiled for."""
    _compiled.seconds += seconds
