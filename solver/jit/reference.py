"""Numba's type of a record that the kernels take by reference, under a short name."""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable, Iterable
from typing import Any

import numba
from numba.experimental import structref

from solver.jit.plain import PLAIN


class Reference(numba.types.StructRef):
    """A record by reference.

    Numba calls such a type by the names and types of all its fields, thousands of characters, and writes them
    into the name of every function that takes it; that alone cost a tenth of the compilation.
    """

    def __init__(self, fields: Any) -> None:
        super().__init__(fields)
        if PLAIN:
            return
        long: str = self.name
        self.name: str = f"{type(self).__name__}.{zlib.crc32(long.encode()):08x}"


def referenced(
    name: str, module: str, fields: Iterable[str], proxy: type = structref.StructRefProxy
) -> Callable[..., Any]:
    """Return what makes a record by reference of its fields, for kernels and for Python.

    Parameters
    ----------
    name : of the record, unlike those of all others.
    module : where it stands, which keeps Numba's type of it.
    proxy : what Python sees of one.
    """
    kind = type(f"_{name}Type", (Reference,), {"__module__": module})
    setattr(sys.modules[module], kind.__name__, structref.register(kind))
    seen = type(f"_{name}Reference", (proxy,), {"__module__": module})
    structref.define_proxy(seen, kind, list(fields))
    return seen
