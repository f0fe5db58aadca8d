"""Request bodies, read within limits of size and time."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import BinaryIO

from fastapi import Request

from service.errors import BodyTooLargeError, SlowBodyError, UnsupportedMediaError

SMALL_BYTES = 32 * 1024
"""A body that is read in a millisecond, on the event loop."""
_LARGE_AT_ONCE = 3


async def chunks(request: Request, limit: int, seconds: float) -> AsyncIterator[bytes]:
    """Yield a body piece by piece.

    Raises
    ------
    UnsupportedMediaError
        If it is compressed.
    BodyTooLargeError, SlowBodyError
        If it has more than `limit` bytes, or needs more than `seconds` to arrive.
    """
    encoding = request.headers.get("content-encoding", "identity").strip().lower()
    if encoding != "identity":
        raise UnsupportedMediaError(f"`Content-Encoding` must be left out here, got {encoding!r:.100}")
    declared = request.headers.get("content-length", "")
    if declared.isdigit() and int(declared) > limit:
        raise BodyTooLargeError(f"the body may have {limit} bytes, this one has {declared[:30]}")
    size = 0
    end = asyncio.get_running_loop().time() + seconds
    stream = request.stream()
    while True:
        try:
            async with asyncio.timeout_at(end):
                piece = await anext(stream, None)
        except TimeoutError as error:
            raise SlowBodyError(f"the body did not arrive within {seconds:g} s") from error
        if piece is None:
            return
        size += len(piece)
        if size > limit:
            raise BodyTooLargeError(f"the body may have {limit} bytes, this one has more")
        if piece:
            yield piece


async def whole(request: Request, limit: int, seconds: float) -> bytes:
    """A body at once; `chunks` lists the errors."""
    return b"".join([piece async for piece in chunks(request, limit, seconds)])


class Turns:
    """Large bodies take turns once they have arrived: parsed, each takes ten times its length.

    One of an owner at a time, a few of all.
    """

    def __init__(self, at_once: int = _LARGE_AT_ONCE) -> None:
        self._all = asyncio.Semaphore(at_once)
        self._owners: dict[str, tuple[asyncio.Lock, int]] = {}

    @asynccontextmanager
    async def of(self, owner: str, size: int) -> AsyncIterator[None]:
        """The turn of a body of `size` bytes; a small one waits for nobody."""
        if size <= SMALL_BYTES:
            yield
            return
        lock, waiting = self._owners.get(owner, (asyncio.Lock(), 0))
        self._owners[owner] = (lock, waiting + 1)
        try:
            async with lock, self._all:
                yield
        finally:
            lock, waiting = self._owners[owner]
            self._owners[owner] = (lock, waiting - 1)
            if waiting == 1:
                del self._owners[owner]


async def saved(request: Request, file: BinaryIO, limit: int, seconds: float) -> tuple[int, str]:
    """Write a body to a file; its size and SHA-256. `chunks` lists the errors."""
    size, found = 0, hashlib.sha256()
    async for piece in chunks(request, limit, seconds):
        file.write(piece)
        found.update(piece)
        size += len(piece)
    return size, found.hexdigest()
