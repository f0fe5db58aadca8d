"""Records that the kernels take by reference."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import Any

from solver.jit.interpreted import Referenced
from solver.jit.way import WAY, Way


def referenced(name: str, module: str, fields: Iterable[str], *seen_as: type) -> Callable[..., Any]:
    """Return what makes a record by reference of its fields, for kernels and for Python.

    Parameters
    ----------
    name : of the record, unlike those of all others.
    module : where it stands, which keeps Numba's type of it.
    seen_as : what Python sees of one besides.
    """
    fields = tuple(fields)
    if WAY is Way.INTERPRETED:
        return type(f"_{name}Reference", (*seen_as, Referenced), {"__module__": module, "_fields": fields})
    from numba.experimental import structref

    from solver.jit.kernel_structure import Structure

    kind = type(f"_{name}Type", (Structure,), {"__module__": module})
    setattr(sys.modules[module], kind.__name__, structref.register(kind))
    seen = type(f"_{name}Reference", (*seen_as, structref.StructRefProxy), {"__module__": module})
    structref.define_proxy(seen, kind, list(fields))
    return seen
