"""Tables whose rows are records with named fields: one piece of memory, as fast as columns by their numbers.

A kernel takes the table, of one row where there is one record: a row alone does not keep its memory. What
is not of one size is a record by reference.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solver.jit.way import WAY, Way

Records: TypeAlias = NDArray[np.void]
Row: TypeAlias = Any  # one of them


def record(**fields: Any) -> np.dtype[np.void]:
    """Return the type of records with these fields: float, int, complex, or (one of them, how many)."""
    # Numba reads what is aligned in one instruction.
    forms = [(name, *(form if isinstance(form, tuple) else (form,))) for name, form in fields.items()]
    made = np.dtype(forms, align=True)
    # Python finds the fields of such a row by their names, as Numba does.
    return np.dtype((np.record, made)) if WAY is Way.INTERPRETED else made


if WAY is Way.INTERPRETED:

    class Referenced:
        """A record by reference: an object with the fields of its class."""

        _fields: tuple[str, ...]

        def __init__(self, *values: Any) -> None:
            for field, value in zip(self._fields, values, strict=True):
                setattr(self, field, value)

else:
    import numba
    from numba.experimental import structref

    class Structure(numba.types.StructRef):
        """Numba's type of a record that the kernels take by reference, under a short name.

        Numba calls such a type by the names and types of all its fields, thousands of characters, and writes
        them into the name of every function that takes it; that alone cost a tenth of the compilation.
        """

        def __init__(self, fields: Any) -> None:
            super().__init__(fields)
            if WAY is Way.PLAIN:
                return
            long: str = self.name
            self.name: str = f"{type(self).__name__}.{zlib.crc32(long.encode()):08x}"


def referenced(
    name: str, module: str, fields: Iterable[str], *seen_as: type, replaced: bool = False
) -> Callable[..., Any]:
    """Return what makes a record by reference of its fields, for kernels and for Python.

    Parameters
    ----------
    name : of the record, unlike those of all others.
    module : where it stands, which keeps Numba's type of it.
    seen_as : what Python sees of one besides.
    replaced : whether kernels put other arrays into its fields.
    """
    fields = tuple(fields)
    if WAY is Way.INTERPRETED:
        return type(f"_{name}Reference", (*seen_as, Referenced), {"__module__": module, "_fields": fields})
    kind = type(f"_{name}Type", (Structure,), {"__module__": module, "replaced": replaced})
    setattr(sys.modules[module], kind.__name__, structref.register(kind))
    seen = type(f"_{name}Reference", (*seen_as, structref.StructRefProxy), {"__module__": module})
    structref.define_proxy(seen, kind, list(fields))
    return seen
