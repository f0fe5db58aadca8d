"""Memory of large answers, given back to the system when they are sent."""

from __future__ import annotations

import ctypes
import sys

_M_MMAP_THRESHOLD = -3
_LARGE_BYTES = 256 * 1024


def give_back_large_blocks() -> None:
    """Have glibc map large blocks by themselves, whatever came before.

    By default it raises the size from which it does so to that of the largest block that was freed, up to
    32 MB; below it what a thread has freed stays in the arena of that thread, and a service has many.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
