"""Tables whose rows are records with named fields: one piece of memory, as fast as columns by their numbers.

A kernel takes the table, of one row where there is one record: a row alone does not keep its memory.
"""

from __future__ import annotations

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
