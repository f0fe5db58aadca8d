"""Request bodies, read within limits of size and time."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import AsyncIterator
from typing import BinaryIO

from fastapi import Request

from service.errors import BodyTooLargeError, SlowBodyError, UnsupportedMediaError


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


async def saved(request: Request, file: BinaryIO, limit: int, seconds: float) -> tuple[int, str]:
    """Write a body to a file; its size and SHA-256. `chunks` lists the errors."""
    size, found = 0, hashlib.sha256()
    async for piece in chunks(request, limit, seconds):
        file.write(piece)
        found.update(piece)
        size += len(piece)
    return size, found.hexdigest()
