"""What one owner may have at a time and store: the limits of their key, else those of the settings."""

from __future__ import annotations

import threading
import time
from collections import Counter, OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from service.auth.callers import Caller
from service.db.repositories.owned import StorageRepository
from service.errors import OverloadedError, StorageFullError, TooManyRequestsError
from service.settings.settings import ClientLimits

_MOST_NAMES = 10_000
_QUIET = 0.25
"""Who has used less than this part of a limit here is not told to other services."""


class Shared(Protocol):
    """A limit that counts what other services of the same database tell (`service.queue.together`)."""

    shared: bool

    def tell(self) -> dict[str, Any]:
        """What the others are to hear now, by name."""

    def hear(self, sender: str, told: dict[str, Any]) -> None:
        """Count what another one told."""


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
        # What is left, when that was, and what was used since the others heard.
        self._left: OrderedDict[str, tuple[float, float, float]] = OrderedDict()
        self._due: dict[str, int] = {}
        self._lock = threading.Lock()
        self.shared = False

    def __len__(self) -> int:
        return len(self._left)

    def take(self, name: str, per_minute: int) -> float:
        """Take one; 0 if there was one, else the time until there is [s]."""
        with self._lock:
            left, _ = self._now(name, per_minute)
            if left < 1.0:
                return 60.0 * (1.0 - left) / per_minute
            self._use(name, per_minute, 1.0)
        return 0.0

    def empty(self, name: str, per_minute: int) -> float:
        """The time until something is in the bucket [s]; 0 if something is."""
        with self._lock:
            return max(0.0, -60.0 * self._now(name, per_minute)[0] / per_minute)

    def spend(self, name: str, per_minute: int, amount: float) -> None:
        """Take out what was used already, be it more than was there."""
        with self._lock:
            self._use(name, per_minute, amount)

    def tell(self) -> dict[str, Any]:
        """What was used here of buckets that are not nearly full: what a minute allows, and how much."""
        told: dict[str, Any] = {}
        with self._lock:
            due, self._due = self._due, {}
            for name, per_minute in due.items():
                left, then, untold = self._left.get(name, (0.0, 0.0, 0.0))
                if untold > 0.0:
                    told[name] = (per_minute, untold)
                    self._left[name] = (left, then, 0.0)
        return told

    def hear(self, _sender: str, told: dict[str, Any]) -> None:
        """Take out what was used elsewhere."""
        with self._lock:
            for name, (per_minute, amount) in told.items():
                left, untold = self._now(name, per_minute)
                self._keep(name, left - amount, untold)

    def _now(self, name: str, per_minute: int) -> tuple[float, float]:
        """What is in a bucket, and how much of what was used nobody else has heard of."""
        now = self._steady()
        left, then, untold = self._left.get(name, (float(per_minute), now, 0.0))
        left = min(float(per_minute), left + (now - then) * per_minute / 60.0)
        return left, untold if left < per_minute else 0.0

    def _use(self, name: str, per_minute: int, amount: float) -> None:
        left, untold = self._now(name, per_minute)
        self._keep(name, left - amount, untold + amount)
        if self.shared and left - amount < (1.0 - _QUIET) * per_minute:
            self._due[name] = per_minute

    def _keep(self, name: str, left: float, untold: float) -> None:
        self._left[name] = (left, self._steady(), untold)
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


_TOLD_EVERY_SECONDS = 1.0
_BELIEVED_SECONDS = 5.0
"""What a service told of things under way is forgotten so long after it: it may have died."""


class AtATime:
    """How many of something each owner has now, at this service and, as far as they tell, at others.

    Parameters
    ----------
    words : str
        What is counted.
    most : int or None
        Of all owners together, at this service.
    steady : callable
        Seconds that never jump.
    """

    def __init__(
        self, words: str, most: int | None = None, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self._words = words
        self._most = most
        self._steady = steady
        self._held: Counter[str] = Counter()
        self._lock = threading.Lock()
        self._peaks: dict[str, int] = {}
        self._told: dict[str, tuple[int, float]] = {}
        self._elsewhere: dict[str, dict[str, tuple[int, float]]] = {}
        self.shared = False

    def __getitem__(self, owner: str) -> int:
        return self._held[owner]

    @contextmanager
    def taken(self, owner: str, most: int | None) -> Iterator[None]:
        """Count one more inside the block.

        Raises
        ------
        TooManyRequestsError
            The owner has `most` already.
        OverloadedError
            All owners together have as many as there may be.
        """
        with self._lock:
            if most is not None and self._held[owner] + self._of_others(owner) >= most:
                raise TooManyRequestsError(
                    f"{most} {self._words} at a time are allowed, as many are open", _RETRY_SECONDS
                )
            if self._most is not None and self._held.total() >= self._most:
                raise OverloadedError(
                    f"the service has {self._most} {self._words} at a time, as many are open", _RETRY_SECONDS
                )
            self._add(owner, most)
        try:
            yield
        finally:
            self.drop(owner)

    def add(self, owner: str, most: int) -> None:
        """Count one more, whose place was found by other means."""
        with self._lock:
            self._add(owner, most)

    def drop(self, owner: str) -> None:
        """Count one less."""
        with self._lock:
            self._held[owner] -= 1
            if not self._held[owner]:
                del self._held[owner]

    def elsewhere(self, owner: str) -> int:
        """How many an owner has at other services."""
        with self._lock:
            return self._of_others(owner)

    def tell(self) -> dict[str, Any]:
        """How many owners have who have a good part of what they may, the most since the last time."""
        now, told = self._steady(), {}
        with self._lock:
            counts = {owner: self._held[owner] for owner in self._told} | self._peaks
            self._peaks = {}
            for owner, count in counts.items():
                before, at = self._told.get(owner, (0, now))
                if count != before or now - at >= _TOLD_EVERY_SECONDS:
                    told[owner] = count
                    self._told[owner] = (count, now)
                if not count:
                    del self._told[owner]
        return told

    def hear(self, sender: str, told: dict[str, Any]) -> None:
        """Count what owners have at another service."""
        until = self._steady() + _BELIEVED_SECONDS
        with self._lock:
            for owner, count in told.items():
                self._elsewhere.setdefault(owner, {})[sender] = (count, until)
                self._of_others(owner)

    def _of_others(self, owner: str) -> int:
        found = self._elsewhere.get(owner)
        if found is None:
            return 0
        now = self._steady()
        fresh = {sender: told for sender, told in found.items() if told[0] and told[1] > now}
        if fresh:
            self._elsewhere[owner] = fresh
        else:
            del self._elsewhere[owner]
        return sum(count for count, _ in fresh.values())

    def _add(self, owner: str, most: int | None) -> None:
        self._held[owner] += 1
        if self.shared and most is not None and self._held[owner] >= _QUIET * most:
            self._peaks[owner] = max(self._peaks.get(owner, 0), self._held[owner])


_COUNTED_SECONDS = 5.0
_MOST_OWNERS = 10_000


class Storage:
    """Refuses what would be too much.

    What an owner stores is counted now and then; between two counts what was accepted here is added. Jobs
    are not known to be large before they end: those that wait may exceed the limit by their results.

    Parameters
    ----------
    repository : StorageRepository
        Counts.
    settings : Limits
        The limit of keys that have none of their own.
    steady : callable
        Seconds that never jump.
    """

    def __init__(
        self,
        repository: StorageRepository,
        settings: ClientLimits,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._repository = repository
        self._settings = settings
        self._steady = steady
        self._counted: OrderedDict[str, tuple[int, float]] = OrderedDict()
        self._lock = threading.Lock()

    def require(self, caller: Caller, more: int = 0) -> None:
        """Count `more` bytes that are about to be stored.

        Raises
        ------
        StorageFullError
            If that is more than the caller's owner may store.
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
