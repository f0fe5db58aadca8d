"""The types in contracts of kernels, written without Numba."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

Form: TypeAlias = Any
"""A NumPy type of a number, ``(such a type, dimensions)`` of a contiguous array, a list of both, or None."""
FLOAT, COMPLEX, INTEGER = np.float64, np.complex128, np.int64


def of_numba(form: Form) -> Any:
    """Return Numba's type; a list is its tuple."""
    from numba import from_dtype, types

    if form is None:
        return types.none
    if isinstance(form, list):
        return types.BaseTuple.from_types([of_numba(one) for one in form])
    if isinstance(form, tuple):
        number, dimensions = form
        return types.Array(of_numba(number), dimensions, "C")
    return from_dtype(np.dtype(form))
