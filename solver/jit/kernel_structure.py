"""Numba's type of a record that the kernels take by reference, under a short name."""

from __future__ import annotations

import zlib
from typing import Any

import numba

from solver.jit.way import WAY, Way


class Structure(numba.types.StructRef):
    """A record by reference.

    Numba calls such a type by the names and types of all its fields, thousands of characters, and writes them
    into the name of every function that takes it; that alone cost a tenth of the compilation.
    """

    def __init__(self, fields: Any) -> None:
        super().__init__(fields)
        if WAY is Way.PLAIN:
            return
        long: str = self.name
        self.name: str = f"{type(self).__name__}.{zlib.crc32(long.encode()):08x}"
