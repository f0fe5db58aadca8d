"""What every answer carries or leaves out: headers, its number, a line in the log; HEAD and refusals."""

from __future__ import annotations

import json
import logging
import re
import time
import uuid
from datetime import UTC, datetime
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.auth.allowances import Buckets
from service.http.middleware.admission import address_of, by_link
from service.settings import logs
from service.settings.settings import Settings

log = logging.getLogger("stickslip.http")
_audit_log = logging.getLogger("stickslip.audit")

HEADERS_ONLY = "stickslip.headers_only"
"""Key of a request's scope: True if nobody reads the body."""


class HeadAsGet:
    """Answers HEAD as if it were GET and keeps the body back (RFC 9110, section 9.3.2)."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on."""
        if scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def without_body(message: Message) -> None:
            if message["type"] == "http.response.body":
                message = {**message, "body": b""}
            await send(message)

        # In place: what watches from outside finds the route in the same scope.
        scope[HEADERS_ONLY], scope["method"] = True, "GET"
        try:
            await self._app(scope, receive, without_body)
        finally:
            scope["method"] = "HEAD"


HEADER = "X-Request-ID"
_GOOD = re.compile(r"[A-Za-z0-9._-]{1,100}")


class RequestLog:
    """Gives a request its id, that of the client if it is a good one, and logs how it was answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, its id on every line logged meanwhile and on the answer."""
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
                # Percent-encoded: a decoded path could end the line. Without what was asked for. What is too
                # much is told by the audit.
                if status != _TOO_MANY and log.isEnabledFor(logging.INFO):
                    method, path = scope["method"][:_LONGEST_METHOD], logs.path_of(scope.get("raw_path", b""))
                    seconds = round(time.perf_counter() - begun, 6)
                    with logs.about(method=method, path=path, status=status, seconds=seconds):
                        log.info("%s %s %d in %.1f ms", method, path, status, 1e3 * seconds)


_POLICY = "default-src 'none'; frame-ancestors 'none'"
# A picture opened by itself styles itself and does nothing else.
_PICTURE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Frame-Options": "DENY",
}
_YEAR = 365 * 24 * 3600
_KEPT, _NOT_KEPT = "private, no-cache", "private, no-store"
_AUDITED = frozenset({400, 401, 403, 413, 421, 429})
_NOT_FOUND, _TOO_MANY = 404, 429
_LONGEST_METHOD = 20
_TOLD_A_MINUTE = 60
_told = Buckets()
_LONGEST = 300


class HeadersAndAudit:
    """The outermost layer: headers on every answer, a line for every refusal."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with headers on its answer."""
        state: dict[str, Any] = scope.setdefault("state", {})

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if by_link(scope["path"]):
                    headers["Cache-Control"] = _NOT_KEPT
                self._add_headers(headers, keyed="key_id" in state and state["key_id"])
                _audit(scope, state, message["status"])
            await send(message)

        await self._app(scope, receive, with_headers)

    def _add_headers(self, headers: MutableHeaders, *, keyed: object) -> None:
        for name, value in _HEADERS.items():
            headers.setdefault(name, value)
        picture = headers.get("content-type", "").startswith("image/svg")
        headers.setdefault("Content-Security-Policy", _PICTURE_POLICY if picture else _POLICY)
        if keyed:
            # What has an ETag may be kept by whoever asked, and is asked for again each time.
            headers.setdefault("Cache-Control", _KEPT if "etag" in headers else _NOT_KEPT)
            headers.add_vary_header("Authorization")
        if self._settings.https:
            headers.setdefault("Strict-Transport-Security", f"max-age={_YEAR}")


def _audit(scope: Scope, state: dict[str, Any], status: int) -> None:
    """Write a refusal as one line of JSON, which escapes every control character; never a key."""
    if status not in _AUDITED and not (status == _NOT_FOUND and state.get("withheld")):
        return
    if status == _TOO_MANY and _told.take(address_of(scope), _TOLD_A_MINUTE) > 0.0:
        return
    slug, detail = state.get("problem", ("refused", ""))
    line = {
        "time": datetime.now(UTC).isoformat(timespec="milliseconds"), "address": address_of(scope),
        "key": state.get("key_id"), "method": scope["method"][:_LONGEST_METHOD],
        "path": logs.masked(scope["path"][:_LONGEST]), "status": status,
        "reason": "of-another" if status == _NOT_FOUND else slug, "detail": logs.masked(detail[:_LONGEST]),
    }  # fmt: skip
    _audit_log.warning("%s", json.dumps(line))
