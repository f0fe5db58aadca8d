"""What one owner may have at a time and store: the limits of their key, else those of the settings."""

from __future__ import annotations

import threading
import time
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from service.auth.callers import Caller
from service.db.repositories.owned import StorageRepository
from service.errors import OverloadedError, StorageFullError, TooManyRequestsError
from service.settings.settings import ClientLimits

_MOST_NAMES = 10_000


class Buckets:
    """A bucket a name: it holds what a minute allows and fills at that rate.

    Of more than `most` names, those unused longest are forgotten; their buckets would be the fullest.

    Parameters
    ----------
    most : buckets kept at a time.
    steady : seconds that never jump.
    """

    def __init__(self, most: int = _MOST_NAMES, steady: Callable[[], float] = time.monotonic) -> None:
        self._most = most
        self._steady = steady
        # What is left, and when that was.
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._left)

    def take(self, name: str, per_minute: int) -> float:
        """Take one; 0 if there was one, else the time until there is [s]."""
        with self._lock:
            left = self._now(name, per_minute)
            if left < 1.0:
                return 60.0 * (1.0 - left) / per_minute
            self._keep(name, left - 1.0)
        return 0.0

    def empty(self, name: str, per_minute: int) -> float:
        """The time until something is in the bucket [s]; 0 if something is."""
        with self._lock:
            return max(0.0, -60.0 * self._now(name, per_minute) / per_minute)

    def spend(self, name: str, per_minute: int, amount: float) -> None:
        """Take out what was used already, be it more than was there."""
        with self._lock:
            self._keep(name, self._now(name, per_minute) - amount)

    def _now(self, name: str, per_minute: int) -> float:
        left, then = self._left.get(name, (float(per_minute), 0.0))
        return min(float(per_minute), left + (self._steady() - then) * per_minute / 60.0)

    def _keep(self, name: str, left: float) -> None:
        self._left[name] = (left, self._steady())
        self._left.move_to_end(name)
        while len(self._left) > self._most:
            self._left.popitem(last=False)


_RETRY_SECONDS = 5


def share(caller: Caller, settings: ClientLimits, name: str) -> int | None:
    """One limit of a caller: that of their key, else `owner_<name>` of the settings; None for no limit."""
    own: int | None = getattr(caller.limits, name)
    most: int = getattr(settings, f"owner_{name}") if own is None else own
    return most or None


def highest_priority(caller: Caller, settings: ClientLimits) -> int:
    """The highest priority the caller may give a job."""
    own = caller.limits.priority
    return settings.owner_priority if own is None else own


class AtATime:
    """How many of something each owner has now.

    Parameters
    ----------
    words : what is counted.
    most : of all owners together.
    """

    def __init__(self, words: str, most: int | None = None) -> None:
        self._words = words
        self._most = most
        self._held: Counter[str] = Counter()
        self._lock = threading.Lock()

    def __getitem__(self, owner: str) -> int:
        return self._held[owner]

    @contextmanager
    def taken(self, owner: str, most: int | None) -> Iterator[None]:
        """Count one more inside the block.

        TooManyRequestsError if the owner has `most` already; OverloadedError if all owners together have as
        many as there may be.
        """
        with self._lock:
            if most is not None and self._held[owner] >= most:
                raise TooManyRequestsError(
                    f"{most} {self._words} at a time are allowed, as many are open", _RETRY_SECONDS
                )
            if self._most is not None and self._held.total() >= self._most:
                raise OverloadedError(
                    f"the service has {self._most} {self._words} at a time, as many are open", _RETRY_SECONDS
                )
            self._held[owner] += 1
        try:
            yield
        finally:
            with self._lock:
                self._held[owner] -= 1
                if not self._held[owner]:
                    del self._held[owner]


_COUNTED_SECONDS = 5.0
_MOST_OWNERS = 10_000


class Storage:
    """Refuses what would be too much.

    What an owner stores is counted now and then; between two counts what was accepted here is added. Jobs
    are not known to be large before they end: those that wait may exceed the limit by their results.

    Parameters
    ----------
    repository : counts.
    settings : the limit of keys that have none of their own.
    steady : seconds that never jump.
    """

    def __init__(
        self, repository: StorageRepository, settings: ClientLimits,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self._repository = repository
        self._settings = settings
        self._steady = steady
        self._counted: OrderedDict[str, tuple[int, float]] = OrderedDict()
        self._lock = threading.Lock()

    def require(self, caller: Caller, more: int = 0) -> None:
        """Count `more` bytes that are about to be stored.

        StorageFullError if that is more than the caller's owner may store.
        """
        most = share(caller, self._settings, "storage_bytes")
        if most is None:
            return
        stored, at = self._counted.get(caller.owner, (0, -_COUNTED_SECONDS))
        if self._steady() - at >= _COUNTED_SECONDS or stored + more > most:
            stored, at = self._repository.of(caller.owner), self._steady()
        if stored + more > most or stored >= most:
            raise StorageFullError(
                f"{stored} bytes are in storage and {more} would come, {most} are allowed: delete uploads, "
                "or ask the keeper of the service to delete old jobs (`stickslip db prune`)"
            )
        with self._lock:
            self._counted[caller.owner] = (stored + more, at)
            while len(self._counted) > _MOST_OWNERS:
                self._counted.popitem(last=False)

    def forget(self, owner: str) -> None:
        """Something was deleted: count anew."""
        with self._lock:
            self._counted.pop(owner, None)
