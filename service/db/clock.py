"""What time it is, for leases and dates: of this machine, or one that several machines share."""

from __future__ import annotations

import time
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
    read : callable
        The time of the server.
    steady : callable
        Seconds that never jump.
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
