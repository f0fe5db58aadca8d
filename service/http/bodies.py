"""Request bodies, read within limits of size and time."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import BinaryIO

from fastapi import Request

from service.errors import BodyTooLargeError, SlowBodyError, UnsupportedMediaError
from service.jobs import strict_json

SMALL_BYTES = 32 * 1024
"""A body that is read in a millisecond, on the event loop."""
_LARGE_AT_ONCE = 2


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

    One of an owner at a time, a few of all. They are parsed in threads of their own: what a thread has freed
    stays with it, and the many threads of the routes would keep the memory of one body each.
    """

    def __init__(self, at_once: int = _LARGE_AT_ONCE) -> None:
        self._all = asyncio.Semaphore(at_once)
        self._threads = ThreadPoolExecutor(at_once, thread_name_prefix="stickslip body")
        self._owners: dict[str, tuple[asyncio.Lock, int]] = {}

    async def parsed(self, data: bytes) -> object:
        """A body as JSON; `service.jobs.strict_json.loads` lists the errors."""
        if len(data) <= SMALL_BYTES:
            return strict_json.loads(data)
        return await asyncio.get_running_loop().run_in_executor(self._threads, strict_json.loads, data)

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
