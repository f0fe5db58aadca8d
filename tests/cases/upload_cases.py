"""Files that are uploaded."""

import io
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np


def saved(write: Callable[[Any], object]) -> bytes:
    buffer = io.BytesIO()
    write(buffer)
    return buffer.getvalue()


def npz(**arrays: Any) -> bytes:
    return saved(lambda file: np.savez(file, **arrays))


def upload(client: httpx.Client, name: str, data: bytes, **params: str) -> httpx.Response:
    return client.post("/v1/uploads", params={"name": name, **params}, content=data)
