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
        rate = per_minute / 60.0
        with self._lock:
            now = self._steady()
            left, then = self._left.get(name, (float(per_minute), now))
            left = min(float(per_minute), left + (now - then) * rate)
            wait = 0.0 if left >= 1.0 else (1.0 - left) / rate
            self._left[name] = (left - 1.0 if wait == 0.0 else left, now)
            self._left.move_to_end(name)
            while len(self._left) > self._most:
                self._left.popitem(last=False)
        return wait
