"""Connections to PostgreSQL that wait for their server for a limited time.

The server ends a statement that takes long by itself, if it runs. One that is frozen, or behind a network
that swallows everything, says nothing at all, and TCP notices that late or never: the client must give up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import psycopg
from psycopg.errors import OperationalError

_MARGIN_SECONDS = 1.0
"""The server is the first to give up, and says why."""


def connector(seconds: float) -> Callable[..., psycopg.Connection[Any]]:
    """What opens connections whose server has so long for each answer [s]."""

    class Bounded(psycopg.Connection[Any]):
        """A connection that closes itself when its server is silent for too long."""

        def wait(self, gen: Any, interval: float = 0.1, timeout: float | None = None) -> Any:
            """Wait for the server, as every method of a connection does.

            Raises
            ------
            OperationalError
                If it does not answer in time. What became of the statement is not known; the server rolls
                its transaction back as soon as it sees that the connection is gone.
            """
            longest = seconds + _MARGIN_SECONDS
            try:
                return super().wait(gen, interval, longest if timeout is None else min(timeout, longest))
            except OperationalError as error:
                if error.sqlstate is None and not self.closed:
                    self.pgconn.finish()
                    raise OperationalError(f"the server did not answer within {longest:g} s") from error
                raise

    return Bounded.connect
