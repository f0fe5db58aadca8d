"""Answers that are made once, however many ask: constants, bodies of megabytes, reports."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import re
import threading
from collections import Counter, OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from weakref import WeakValueDictionary

from fastapi import Request, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import TooManyRequestsError
from service.http.middleware.connections import KEY, Connection
from service.queue.lanes import Lane

_LEAST_COMPRESSED = 1000
_GZIP = re.compile(r"\bgzip\b(?!\s*;\s*q=0(?:\.0*)?\s*(?:,|$))")
_making = threading.Lock()  # they are made one after the other, however many ask for them meanwhile


def known_by(request: Request, tag: str) -> bool:
    """Whether a client has what an ETag names (RFC 9110, section 13.1.2)."""
    known = request.headers.get("if-none-match", "")
    return tag in known or known.strip() == "*"


class Constant:
    """One such answer.

    Parameters
    ----------
    make : its body; called in a thread when the answer is first asked for, or prepared.
    media_type : of the body.
    headers : of the answer, besides those that follow from the body.
    """

    def __init__(
        self, make: Callable[[], bytes], media_type: str = "application/json",
        headers: Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        self._make, self._media_type, self._headers = make, media_type, headers or {}
        self._lock = threading.Lock()
        self._made: Future[tuple[bytes, bytes, str]] | None = None

    def prepared(self) -> Future[tuple[bytes, bytes, str]]:
        """The body, the same compressed, and its tag without quotes, as soon as they are made."""
        with self._lock:
            if self._made is None:
                self._made = Future()
                # Of a pool's threads a process that ends waits for the last: a service that has just begun
                # would end seconds later.
                threading.Thread(target=self._fulfil, args=(self._made,), daemon=True).start()
            return self._made

    async def answer(self, request: Request, headers: Mapping[str, str] | None = None) -> Response:
        """The answer, or 304 without it if the client has the same."""
        made = self.prepared()
        # Whoever goes away must not take it from the others.
        body, packed, tag = made.result() if made.done() else await asyncio.shield(asyncio.wrap_future(made))
        kept = {**self._headers, **(headers or {}), "ETag": f'"{tag}"'}
        if packed:
            kept["Vary"] = "Accept-Encoding"
            if _GZIP.search(request.headers.get("accept-encoding", "")):
                body, kept["ETag"], kept["Content-Encoding"] = packed, f'"{tag}-gzip"', "gzip"
        if known_by(request, kept["ETag"]):
            return Response(status_code=304, headers=kept)
        return Response(body, media_type=self._media_type, headers=kept)

    def _fulfil(self, made: Future[tuple[bytes, bytes, str]]) -> None:
        with _making:
            try:
                made.set_result(self._whole())
            except BaseException as error:  # noqa: BLE001 - whoever asks is told
                made.set_exception(error)

    def _whole(self) -> tuple[bytes, bytes, str]:
        body = self._make()
        packed = gzip.compress(body, mtime=0) if len(body) >= _LEAST_COMPRESSED else b""
        return body, packed, hashlib.sha256(body).hexdigest()


_PIECE = 1 << 16


class _SharedBody:
    """A body; there for as long as an answer with it is being sent."""

    def __init__(self) -> None:
        self.body = b""
        self.making = threading.Lock()


class _Answer(Response):
    def __init__(self, held: _SharedBody, media_type: str) -> None:
        super().__init__(held.body, media_type=media_type)
        self.held = held


class LargeAnswers:
    """The bodies that are being sent, by what they show."""

    def __init__(self) -> None:
        self._held: WeakValueDictionary[str, _SharedBody] = WeakValueDictionary()
        self._lock = threading.Lock()

    def answer(self, key: str, make: Callable[[], bytes], media_type: str = "application/json") -> Response:
        """An answer whose body does not change while it is being sent; `make` makes it if nobody reads it."""
        with self._lock:
            held = self._held.setdefault(key, _SharedBody())
        with held.making:
            held.body = held.body or make()
        return _Answer(held, media_type)


class InPieces:
    """Hands the server no more of a body than the client takes, and counts the rest for its owner."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on; its answer comes in pieces."""
        connection: Connection | None = scope.get("state", {}).get(KEY)
        if connection is None:
            await self._app(scope, receive, send)
            return

        async def in_pieces(message: Message) -> None:
            body: bytes = message.get("body", b"")
            if len(body) <= _PIECE:
                connection.sent += len(body)
                await send(message)
                return
            connection.held = body
            try:
                view = memoryview(body)
                for begin in range(0, len(body), _PIECE):
                    piece = view[begin : begin + _PIECE]  # copied once, by the server
                    more = begin + _PIECE < len(body) or message.get("more_body", False)
                    connection.sent += len(piece)
                    await send({"type": message["type"], "body": piece, "more_body": more})
            finally:
                connection.held = b""

        await self._app(scope, receive, in_pieces)


MOST_BYTES = 64 * 1024**2
"""Of all that is kept."""
MOST_UNDER_WAY = 4
"""Reports that one owner may have made at a time, or wait for."""
_RETRY_SECONDS = 5
_MOST_FAILED = 64


class Reports:
    """Reports that were made, and those that are being made. All happens on one event loop.

    `lane`: in which they are made.
    """

    def __init__(self, lane: Lane) -> None:
        self._lane = lane
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._size = 0
        self._making: dict[str, asyncio.Task[bytes]] = {}
        self._owners: Counter[str] = Counter()

    async def get(
        self, key: str, owner: str, make: Callable[[], bytes], seconds: float | None, made: Callable[[], None]
    ) -> bytes | None:
        """Return a report; None if it is not there after so long.

        Parameters
        ----------
        key : says everything that is in it.
        owner : whose turn it is.
        make : makes it, in a thread.
        seconds : how long is waited; None for as long as it takes [s].
        made : called once it is there, if somebody does not wait for it any more.

        Raises
        ------
        ServiceError
            What `make` raises; TooManyRequestsError if the owner has as many under way as one may.
        """
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        task = self._making.get(key)
        if task is None:
            if self._owners[owner] >= MOST_UNDER_WAY:
                words = f"the key has as many reports under way as one may: {MOST_UNDER_WAY}"
                raise TooManyRequestsError(words, _RETRY_SECONDS)
            self._owners[owner] += 1
            task = self._making[key] = asyncio.create_task(self._make(key, owner, make))
        await asyncio.wait({task}, timeout=seconds)
        if task.done():
            self._making.pop(key, None)
            return task.result()
        task.add_done_callback(lambda _: made())
        return None

    async def _make(self, key: str, owner: str, make: Callable[[], bytes]) -> bytes:
        try:
            report = await self._lane.run(owner, make)
        finally:
            self._owners[owner] -= 1
            if not self._owners[owner]:
                del self._owners[owner]
            self._forget_failed()
        self._keep(key, report)
        return report

    def _keep(self, key: str, report: bytes) -> None:
        self._making.pop(key, None)
        self._kept[key] = report
        self._size += len(report)
        while self._size > MOST_BYTES and self._kept:
            self._size -= len(self._kept.popitem(last=False)[1])

    def _forget_failed(self) -> None:
        """Of what failed and nobody asked for again, only the newest are remembered."""
        failed = [key for key, task in self._making.items() if task.done()]
        for key in failed[:-_MOST_FAILED]:
            self._making.pop(key).exception()
