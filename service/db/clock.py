"""What time it is, for leases and dates, of this machine or one that several share; ids that sort by it."""

from __future__ import annotations

import secrets
import threading
import time
import uuid
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

Clock = Callable[[], datetime]


def utc_now() -> datetime:
    """Now, aware."""
    return datetime.now(UTC)


class SharedClock:
    """The time of the database server, carried on by the steady clock of this process between two looks.

    Services on several machines judge each other's leases: a machine whose clock is an hour ahead would take
    every job away from the others. So none of them asks its own clock; nor does a step of it matter.

    Parameters
    ----------
    read : the time of the server.
    steady : seconds that never jump.
    """

    def __init__(self, read: Clock, steady: Callable[[], float] = time.monotonic) -> None:
        self._read = read
        self._steady = steady
        self._seen: tuple[datetime, float] | None = None

    def look(self) -> tuple[datetime, float]:
        """Ask the server; raises what the database raises."""
        begin = self._steady()
        seen = self._read()
        self._seen = (seen, 0.5 * (begin + self._steady()))
        return self._seen

    def __call__(self) -> datetime:
        """Now."""
        time_seen, at = self._seen or self.look()
        return time_seen + timedelta(seconds=self._steady() - at)


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
    return _as_id(stamp)


def earliest_id(when: datetime) -> str:
    """The least id that can be made from a time on, by a machine whose clock is right."""
    return _as_id(max(0, int(when.timestamp() * 1e3)) << 74)


def _as_id(stamp: int) -> str:
    high, low = stamp >> 62, stamp & ((1 << 62) - 1)
    value = (high >> 12) << 80 | 0x7 << 76 | (high & 0xFFF) << 64 | 0b10 << 62 | low
    return str(uuid.UUID(int=value))
