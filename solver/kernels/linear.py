"""Dense linear algebra inside compiled loops: vectors, solves with the sign of the determinant, inverses.

Written as plain loops: an array expression costs Numba a tenth of a second of compilation each time.

Small systems use a loop of our own (a call to LAPACK costs more than the factorisation), larger ones LAPACK's
``dgesv`` through the entry Numba itself links, which stays cacheable on disk.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numba
import numpy as np

from solver.fourier import Complex, Real
from solver.kernels.compiled import compiled, out_of_line

OWN_UP_TO = 36  # measured crossing of our loop and LAPACK

_int, _index, _doubles = numba.types.intc, numba.types.intp, numba.types.CPointer(numba.types.float64)
_pivots = numba.types.CPointer(numba.types.int32)
_gesv: Callable[..., int] = numba.core.types.ExternalFunction(
    "numba_xgesv", _int(numba.types.char, _index, _index, _doubles, _index, _pivots, _doubles, _index)
)
_DOUBLE = np.int8(ord("d"))


@compiled
def copy_to(target: Real, source: Real) -> None:
    """Copy a vector."""
    for i in range(target.size):
        target[i] = source[i]


@compiled
def set_to(target: Real, source: Real, factor: float, direction: Real) -> None:
    """Set target = source + factor · direction."""
    for i in range(target.size):
        target[i] = source[i] + factor * direction[i]


@compiled
def copy_block(target: Real, source: Real) -> None:
    """Copy a matrix into the upper left block of another."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@compiled
def fill(target: Real, value: float) -> None:
    """Set every entry of a vector."""
    for i in range(target.size):
        target[i] = value


@compiled
def fill_block(target: Real, value: float) -> None:
    """Set every entry of a matrix."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = value


@compiled
def largest_entry(vector: Real) -> float:
    """Return max|v|."""
    size = 0.0
    for i in range(vector.size):
        size = max(size, abs(vector[i]))
    return size


@compiled
def invert(matrix: Complex, inverse: Complex) -> bool:
    """Invert a complex matrix by Gauss–Jordan elimination with partial pivoting; `matrix` is destroyed.

    Returns False, with `inverse` meaningless, if the matrix is singular or not finite.
    """
    out_of_line()
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot, size = k, abs(matrix[k, k])
        for i in range(k + 1, n):
            here = abs(matrix[i, k])
            if here > size:
                pivot, size = i, here
        if not size > 0.0:
            return False
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
                inverse[k, j], inverse[pivot, j] = inverse[pivot, j], inverse[k, j]
        factor = 1.0 / matrix[k, k]
        for j in range(n):
            matrix[k, j] *= factor
            inverse[k, j] *= factor
        for i in range(n):
            factor = matrix[i, k]
            if i == k or factor == 0.0:
                continue
            for j in range(n):
                matrix[i, j] -= factor * matrix[k, j]
                inverse[i, j] -= factor * inverse[k, j]
    return True


@compiled
def _solve_small(matrix: Real, rhs: Real) -> float:
    """Gauss with partial pivoting on a row-major matrix; the right-hand sides are the rows of `rhs`."""
    out_of_line()
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
    out_of_line()
    n = matrix.shape[0]
    if n <= OWN_UP_TO:
        return _solve_small(matrix, rhs)
    columns = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            columns[j, i] = matrix[i, j]
            if not math.isfinite(matrix[i, j]):
                return 0.0
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
