"""Answers of megabytes: each body held once, however many read it, and sent as its clients take it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from weakref import WeakValueDictionary

from fastapi import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.middleware.connections import KEY, Connection

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
