"""Arrays as bytes: NumPy's npy format with a checksum, never pickle."""

from __future__ import annotations

import hashlib
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.errors import DatabaseError
from service.jobs.figures import StoredArray


def encode(array: NDArray[Any]) -> StoredArray:
    """An array of numbers as npy bytes; an array of objects is an error of the program (ValueError)."""
    buffer = io.BytesIO()
    np.save(buffer, np.ascontiguousarray(array), allow_pickle=False)
    data = buffer.getvalue()
    return StoredArray(sha256=hashlib.sha256(data).hexdigest(), data=data)


def decode(stored: StoredArray) -> NDArray[Any]:
    """The array of npy bytes.

    Raises
    ------
    DatabaseError
        If the bytes are not those that were stored.
    """
    if hashlib.sha256(stored.data).hexdigest() != stored.sha256:
        raise DatabaseError("a stored array does not match its checksum: the database is damaged")
    array: NDArray[Any] = np.load(io.BytesIO(stored.data), allow_pickle=False)
    return array
