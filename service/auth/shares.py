"""What one owner may have at a time: the limits of their key, else those of the settings."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from service.auth.callers import Caller
from service.errors import OverloadedError, TooManyRequestsError
from service.settings.limits import Limits

_RETRY_SECONDS = 5


def share(caller: Caller, settings: Limits, name: str) -> int | None:
    """One limit of a caller: that of their key, else `owner_<name>` of the settings; None for no limit."""
    own: int | None = getattr(caller.limits, name)
    most: int = getattr(settings, f"owner_{name}") if own is None else own
    return most or None


def highest_priority(caller: Caller, settings: Limits) -> int:
    """The highest priority the caller may give a job."""
    own = caller.limits.priority
    return settings.owner_priority if own is None else own


class AtATime:
    """How many of something each owner has now.

    Parameters
    ----------
    words : str
        What is counted.
    most : int or None
        Of all owners together.
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

        Raises
        ------
        TooManyRequestsError
            The owner has `most` already.
        OverloadedError
            All owners together have as many as there may be.
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
