"""Ids that sort by the time they were made (UUID version 7, RFC 9562), so that lists page by id alone."""

from __future__ import annotations

import secrets
import threading
import time
import uuid

_lock = threading.Lock()
_last = 0


def new_id() -> str:
    """A new id, larger than every id this process made before.

    48 bits of milliseconds, then 12 bits and 62 bits that start at random and count up within a
    millisecond (RFC 9562, section 6.2, method 2).
    """
    global _last
    with _lock:
        fresh = (time.time_ns() // 1_000_000) << 74 | secrets.randbits(73)
        _last = fresh if fresh >> 74 > _last >> 74 else _last + 1 + secrets.randbits(32)
        stamp = _last
    high, low = stamp >> 62, stamp & ((1 << 62) - 1)
    value = (high >> 12) << 80 | 0x7 << 76 | (high & 0xFFF) << 64 | 0b10 << 62 | low
    return str(uuid.UUID(int=value))
