"""Token buckets: how often something may happen, in bounded memory."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable

_MOST_NAMES = 10_000


class Buckets:
    """A bucket a name: it holds what a minute allows and fills at that rate.

    Of more than `most` names, those unused longest are forgotten; their buckets would be the fullest.

    Parameters
    ----------
    most : int
        Buckets kept at a time.
    steady : callable
        Seconds that never jump.
    """

    def __init__(self, most: int = _MOST_NAMES, steady: Callable[[], float] = time.monotonic) -> None:
        self._most = most
        self._steady = steady
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._left)

    def take(self, name: str, per_minute: int) -> float:
        """Take one; 0 if there was one, else the time until there is [s]."""
        with self._lock:
            left = self._now(name, per_minute)
            wait = 0.0 if left >= 1.0 else 60.0 * (1.0 - left) / per_minute
            self._keep(name, left - 1.0 if wait == 0.0 else left)
        return wait

    def empty(self, name: str, per_minute: int) -> float:
        """The time until something is in the bucket [s]; 0 if something is."""
        with self._lock:
            return max(0.0, -60.0 * self._now(name, per_minute) / per_minute)

    def spend(self, name: str, per_minute: int, amount: float) -> None:
        """Take out what was used already, be it more than was there."""
        with self._lock:
            self._keep(name, self._now(name, per_minute) - amount)

    def _now(self, name: str, per_minute: int) -> float:
        """What is in a bucket."""
        now = self._steady()
        left, then = self._left.get(name, (float(per_minute), now))
        return min(float(per_minute), left + (now - then) * per_minute / 60.0)

    def _keep(self, name: str, left: float) -> None:
        self._left[name] = (left, self._steady())
        self._left.move_to_end(name)
        while len(self._left) > self._most:
            self._left.popitem(last=False)
