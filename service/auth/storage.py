"""What an owner may store."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable

from service.auth.callers import Caller
from service.auth.shares import share
from service.db.repositories.storage import StorageRepository
from service.errors import StorageFullError
from service.settings.limits import Limits

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
        self, repository: StorageRepository, settings: Limits, steady: Callable[[], float] = time.monotonic
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
