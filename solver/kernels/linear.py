"""Dense linear solves inside compiled loops, with the sign of the determinant.

Small systems use a loop of our own (a call to LAPACK costs more than the factorisation), larger ones LAPACK's
``dgesv`` through the entry Numba itself links, which stays cacheable on disk.
"""

from __future__ import annotations

import numpy as np
from numba import types
from numba.core.types import ExternalFunction

from solver.fourier import Real
from solver.kernels.compiled import compiled

OWN_UP_TO = 36  # measured crossing of our loop and LAPACK

_gesv = ExternalFunction(
    "numba_xgesv",
    types.intc(
        types.char, types.intp, types.intp, types.CPointer(types.float64), types.intp,
        types.CPointer(types.int32), types.CPointer(types.float64), types.intp,
    ),
)  # fmt: skip
_DOUBLE = np.int8(ord("d"))


@compiled
def _solve_small(matrix: Real, rhs: Real) -> float:
    """Gauss with partial pivoting on a row-major matrix; the right-hand sides are the rows of `rhs`."""
    n = matrix.shape[0]
    sign = 1.0
    for k in range(n):
        pivot, size = k, abs(matrix[k, k])
        for i in range(k + 1, n):
            here = abs(matrix[i, k])
            if here > size:
                pivot, size = i, here
        if not size > 0.0:
            return 0.0
        if pivot != k:
            sign = -sign
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for b in range(rhs.shape[0]):
                rhs[b, k], rhs[b, pivot] = rhs[b, pivot], rhs[b, k]
        if matrix[k, k] < 0.0:
            sign = -sign
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for b in range(rhs.shape[0]):
                    rhs[b, i] -= factor * rhs[b, k]
    for b in range(rhs.shape[0]):
        for i in range(n - 1, -1, -1):
            total = rhs[b, i]
            for j in range(i + 1, n):
                total -= matrix[i, j] * rhs[b, j]
            rhs[b, i] = total / matrix[i, i]
    return sign


@compiled
def solve(matrix: Real, rhs: Real) -> float:
    """Solve ``matrix @ x = rhs[b]`` for every row b of `rhs`, in place.

    Parameters
    ----------
    matrix : (n, n), row-major, destroyed.
    rhs : (n_rhs, n), overwritten with the solutions.

    Returns
    -------
    The sign of the determinant, 0.0 if the matrix is singular or not finite (then `rhs` is meaningless).
    """
    n = matrix.shape[0]
    if n <= OWN_UP_TO:
        return _solve_small(matrix, rhs)
    if not np.isfinite(matrix.sum()):
        return 0.0
    columns = np.ascontiguousarray(matrix.T)
    pivots = np.empty(n, np.int32)
    info = _gesv(_DOUBLE, n, rhs.shape[0], columns.ctypes, n, pivots.ctypes, rhs.ctypes, n)
    if info != 0:
        return 0.0
    sign = 1.0
    for k in range(n):
        if pivots[k] != k + 1:
            sign = -sign
        if columns[k, k] < 0.0:
            sign = -sign
    return sign
