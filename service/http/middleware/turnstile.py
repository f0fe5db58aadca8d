"""What one owner may have under way at a time: requests, event streams, uploads, answers they do not take."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from starlette.types import Scope

from service.auth.callers import Caller
from service.auth.shares import AtATime, share
from service.http.middleware.connections import KEY, Connection
from service.settings.settings import Settings

_STREAM = re.compile(r"/v1/jobs/[^/]+/events/?")
_UPLOAD = "/v1/uploads"


class Turnstile:
    """Counts requests while they are answered.

    Parameters
    ----------
    settings : Settings
        The limits, of keys that have none of their own.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._requests = AtATime("requests")
        self._uploads = AtATime("uploads")
        self._streams = AtATime("event streams", settings.streams or None)

    @contextmanager
    def passed(self, caller: Caller, scope: Scope) -> Iterator[None]:
        """Count a request inside the block; a stream counts as a stream alone, it is cheap and lasts.

        Raises
        ------
        TooManyRequestsError, OverloadedError
            The owner, or all together, have as many as they may.
        """
        owner = caller.owner
        connection: Connection | None = scope.get("state", {}).get(KEY)
        if connection is not None:
            connection.owner = owner
            connection.all_of_them.require_taken(owner)
        if _STREAM.fullmatch(scope["path"]):
            with self._streams.taken(owner, share(caller, self._settings, "streams")):
                yield
            return
        with self._requests.taken(owner, share(caller, self._settings, "requests")):
            if scope["method"] == "POST" and scope["path"].rstrip("/") == _UPLOAD:
                with self._uploads.taken(owner, share(caller, self._settings, "uploads")):
                    yield
            else:
                yield
