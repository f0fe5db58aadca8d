"""Admission: what every request passes before a route sees it, and what every answer carries.

It lets through what is listed here and refuses the rest: a new route needs a key without saying so.
"""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from urllib.parse import urlsplit

from fastapi import Request
from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.auth import callers
from service.auth.allowances import AtATime, share
from service.auth.authenticator import REMEMBERED_SECONDS, Authenticator, id_of
from service.auth.callers import LINK_READERS, Caller
from service.errors import OriginRefusedError, RetryLaterError, ServiceError
from service.http.middleware.connections import KEY, Connection
from service.queue.lanes import Lane
from service.schemas.problems import AWAY, answered
from service.settings.settings import Settings

STREAM = re.compile(r"/v1/.+/events/?")
"""Event streams of every kind."""
_UPLOAD = "/v1/uploads"


class ConcurrencyLimits:
    """Counts requests while they are answered.

    `settings` is the limits, of keys that have none of their own.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._requests = AtATime("requests")
        self._uploads = AtATime("uploads")
        self._streams = AtATime("event streams", settings.streams or None)

    @contextmanager
    def passed(self, caller: Caller, scope: Scope) -> Iterator[None]:
        """Count a request inside the block; a stream counts as a stream alone, it is cheap and lasts.

        TooManyRequestsError, OverloadedError if the owner, or all together, have as many as they may.
        """
        owner = caller.owner
        connection: Connection | None = scope.get("state", {}).get(KEY)
        if connection is not None:
            connection.owner = owner
            connection.all_of_them.require_taken(owner)
        if STREAM.fullmatch(scope["path"]):
            with self._streams.taken(owner, share(caller, self._settings, "streams")):
                yield
            return
        with self._requests.taken(owner, share(caller, self._settings, "requests")):
            if scope["method"] == "POST" and scope["path"].rstrip("/") == _UPLOAD:
                with self._uploads.taken(owner, share(caller, self._settings, "uploads")):
                    yield
            else:
                yield


OPEN = frozenset({"/health/live", "/health/ready", "/openapi.json", "/docs", "/docs/style.css", "/"})
"""Paths that need no key: whether the service lives, what its API is, and the page, which asks for a key."""
LOGIN = "/v1/login"
"""Below it people log in who have no key yet."""
_PAGE = "/page/"
_SHARED = "/v1/shared"
"""What a link to a run shows, by the token in the query."""
LINKED = "linked"
"""Where a request's state has the run of its link."""
OWNER = "owner"
"""Where a request's state has whose it is, once that is known."""
NO_KEY = "(no key)"
"""The owner, to those who count, of a request whose key is not known."""
_MONITORED = frozenset({"/metrics"})
_COMPUTED = re.compile(r"/v1/jobs/[^/]+/report/?")
"""What is computed when it is asked for."""
_READING = frozenset({"GET", "HEAD", "OPTIONS"})
_OURS = frozenset({"same-origin", "none"})
_BEARER = "bearer "
_REFUSED_SECONDS = 0.25
"""Before who is to come later hears of it: a loop that asks again at once would keep the event loop busy."""


def scope_of(method: str, path: str) -> callers.Scope | None:
    """The scope that a request needs; None for none."""
    if (path in OPEN or path.startswith(_PAGE) or by_link(path)) and method in _READING:
        return None
    if path == LOGIN or path.startswith(f"{LOGIN}/"):
        return None
    if path in _MONITORED:
        return callers.Scope.MONITOR
    reads = method in _READING and not _COMPUTED.fullmatch(path)
    return callers.Scope.READ if reads else callers.Scope.SUBMIT


def by_link(path: str) -> bool:
    """Whether a path is one that a link to a run opens."""
    return path == _SHARED or path.startswith(f"{_SHARED}/")


class Admission:
    """Finds out who asks and refuses who may not."""

    def __init__(
        self, app: ASGIApp, authenticator: Authenticator, concurrency: ConcurrencyLimits, reads: Lane
    ) -> None:
        self._app, self._reads = app, reads
        self._authenticator = authenticator
        self._concurrency = concurrency

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on with its caller, or answer it with a problem."""
        request = Request(scope, receive)
        with ExitStack() as held:
            try:
                token = _token(request)
                payer = caller = await self._admit(request, token)
                scope["state"][OWNER] = caller.owner if caller.scopes else NO_KEY
                needed = scope_of(scope["method"], scope["path"])
                link = (
                    request.query_params.get("token") if needed is None and by_link(scope["path"]) else None
                )
                if link is not None:
                    scope["state"][OWNER] = LINK_READERS.owner
                    payer, scope["state"][LINKED] = await self._reads.run(
                        LINK_READERS.owner, self._authenticator.reader, link, address_of(scope)
                    )
                held.enter_context(self._concurrency.passed(payer, scope))
                self._authenticator.count(payer)
                _refuse_other_pages(request)
                if needed is not None:
                    self._authenticator.require(caller, needed)
            except (ServiceError, *AWAY) as error:
                if isinstance(error, RetryLaterError):
                    await asyncio.sleep(_REFUSED_SECONDS)
                await answered(request, error)(scope, receive, send)
                return
            request.state.caller = caller
            if token is None:
                await self._app(scope, receive, send)
            else:
                await self._serve(request, token, receive, send)

    async def _admit(self, request: Request, token: str | None) -> Caller:
        request.state.key_id = None if token is None else id_of(token)
        address = address_of(request.scope)
        if self._authenticator.known(token):
            return self._authenticator.admit(token, address)
        return await run_in_threadpool(self._look_up, token, address)

    def _look_up(self, token: str | None, address: str) -> Caller:
        caller = self._authenticator.admit(token, address)
        if token is not None:
            self._authenticator.note_use(token)
        return caller

    async def _serve(self, request: Request, token: str, receive: Receive, send: Send) -> None:
        """Pass a request with a key on; an answer that goes on ends when its key does."""
        looked, ended = time.monotonic(), False

        async def watched(message: Message) -> None:
            nonlocal looked, ended
            if message.get("more_body") and time.monotonic() - looked > REMEMBERED_SECONDS:
                looked = time.monotonic()
                try:
                    await self._admit(request, token)
                except ServiceError as error:
                    ended = True
                    await send({"type": "http.response.body", "body": b"", "more_body": False})
                    raise ConnectionAbortedError(error.detail) from error
            await send(message)

        try:
            await self._app(request.scope, receive, watched)
        except Exception:
            if not ended:
                raise


def address_of(scope: Scope) -> str:
    """Where a request came from; of several proxies that are trusted, the address the first one names."""
    client = scope.get("client")
    return str(client[0]) if client else "unknown"


def _token(request: Request) -> str | None:
    """What a request says to be its key, by `Authorization: Bearer` or `X-API-Key`."""
    given = request.headers.get("authorization")
    if given is None:
        return request.headers.get("x-api-key")
    return given[len(_BEARER) :].strip() if given[: len(_BEARER)].lower() == _BEARER else given


def _refuse_other_pages(request: Request) -> None:
    """Refuse changes that a web page elsewhere has its visitor's browser ask for.

    Browsers say so: `Sec-Fetch-Site`, and older ones `Origin`. Programs send neither. OriginRefusedError if
    the page is not one of this service.
    """
    if request.method in _READING:
        return
    site, origin = request.headers.get("sec-fetch-site"), request.headers.get("origin")
    if site is not None:
        ours = site in _OURS
    else:
        ours = origin is None or urlsplit(origin).netloc.lower() == request.headers.get("host", "").lower()
    if not ours:
        raise OriginRefusedError("a web page of another origin may not ask for this")
