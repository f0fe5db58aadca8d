"""What owners use at each of several services on one PostgreSQL database, so that limits count all of it.

Ten times a second a service tells the others in a notice what has changed, of owners who use a good part of
a limit: nothing is asked of the database when a request comes. So a limit may be exceeded by what an owner
begins at several services within that tenth of a second, and where there are more than four services, by
what is too little to be told. What is under way at a service that falls silent is forgotten after a while;
while the database cannot be reached each service keeps the limits by itself.
"""

from __future__ import annotations

import json
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from service.auth.allowances import Shared

_EVERY_SECONDS = 0.1
_MOST_BYTES = 7000  # of a notice, of which PostgreSQL takes 8000


class Together:
    """Limits that several services keep together.

    Parameters
    ----------
    tell : callable
        Sends a text to all other services, whose `heard` takes it.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._name = secrets.token_hex(4)
        self._limits: dict[str, Shared] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stickslip limits", daemon=True)

    def add(self, limits: Mapping[str, Shared]) -> None:
        """Share limits, each by the name it has at all services; before `start`."""
        for limit in limits.values():
            limit.shared = True
        self._limits.update(limits)

    def start(self) -> None:
        """Begin to tell."""
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()

    def heard(self, text: str) -> None:
        """From another service."""
        sender, name, told = json.loads(text)
        if name in self._limits:
            self._limits[name].hear(sender, told)

    def _run(self) -> None:
        while not self._over.wait(_EVERY_SECONDS):
            for name, limit in self._limits.items():
                for text in self._texts(name, limit.tell()):
                    self._tell(text)

    def _texts(self, name: str, told: Mapping[str, Any]) -> Iterator[str]:
        """In as few notices as there is room in; what fills one by itself is not told."""
        text = json.dumps([self._name, name, told])
        if len(text) <= _MOST_BYTES:
            if told:
                yield text
            return
        names = list(told)
        middle = len(names) // 2
        for half in (names[:middle], names[middle:]) if middle else ():
            yield from self._texts(name, {one: told[one] for one in half})
