"""Answers that never change while a service runs: made once, compressed once, known by their ETag."""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import re
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future

from fastapi import Request, Response

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
    make : callable
        Its body; called in a thread when the answer is first asked for, or prepared.
    media_type : str
        Of the body.
    headers : mapping
        Of the answer, besides those that follow from the body.
    """

    def __init__(
        self,
        make: Callable[[], bytes],
        media_type: str = "application/json",
        headers: Mapping[str, str] | None = None,
    ) -> None:
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
