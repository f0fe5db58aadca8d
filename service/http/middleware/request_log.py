"""A number for every request, and a line in the log."""

from __future__ import annotations

import logging
import re
import time
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.settings import logs

log = logging.getLogger("stickslip.http")

HEADER = "X-Request-ID"
_GOOD = re.compile(r"[A-Za-z0-9._-]{1,100}")


class RequestLog:
    """Gives a request its id, that of the client if it is a good one, and logs how it was answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, its id on every line logged meanwhile and on the answer."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        asked = Headers(scope=scope).get(HEADER, "")
        number = asked if _GOOD.fullmatch(asked) else uuid.uuid4().hex
        begun, status = time.perf_counter(), 0

        async def numbered(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = number
            await send(message)

        with logs.about(request=number):
            try:
                await self._app(scope, receive, numbered)
            finally:
                # As it came, percent-encoded: a decoded path could end the line. Without what was asked for.
                path = scope.get("raw_path", b"").decode("ascii", "replace")
                seconds = round(time.perf_counter() - begun, 6)
                with logs.about(method=scope["method"], path=path, status=status, seconds=seconds):
                    log.info("%s %s %d in %.1f ms", scope["method"], path, status, 1e3 * seconds)
