"""Factors and inverses of matrices: our own loops, and LAPACK's ``getrf`` and ``getri``.

These are called by the entries Numba itself links, which stay cacheable on disk; in the plain way of
`solver.jit.plain` our own loops stand for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from solver.jit import lapack_loading
from solver.jit.fourier import Complex, Index, Real
from solver.jit.separate import apart
from solver.jit.way import WAY, Way


@apart
def own_factors(a: Real, n: int, pivots: Index) -> None:
    """Factorise the leading block, columns exchanged for the largest pivot of a row; numbers as LAPACK's."""
    for k in range(n):
        pivot, size = k, abs(a[k, k])
        for j in range(k + 1, n):
            here = abs(a[k, j])
            if here > size:
                pivot, size = j, here
        pivots[k] = pivot + 1
        if pivot != k:
            for i in range(n):
                a[i, k], a[i, pivot] = a[i, pivot], a[i, k]
        if not size > 0.0:
            continue
        inverse = 1.0 / a[k, k]
        for j in range(k + 1, n):
            a[k, j] *= inverse
        i = k + 1
        while i + 3 < n:
            # Four rows at once: the row of the pivot is read a quarter as often.
            first, second, third, fourth = a[i, k], a[i + 1, k], a[i + 2, k], a[i + 3, k]
            for j in range(k + 1, n):
                above = a[k, j]
                a[i, j] -= first * above
                a[i + 1, j] -= second * above
                a[i + 2, j] -= third * above
                a[i + 3, j] -= fourth * above
            i += 4
        while i < n:
            factor = a[i, k]
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
            i += 1


@apart
def own_inverse(matrix: Complex, inverse: Complex) -> bool:
    """Invert by Gauss–Jordan, which destroys `matrix`."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot, size = k, abs(matrix[k, k].real) + abs(matrix[k, k].imag)
        for i in range(k + 1, n):
            here = abs(matrix[i, k].real) + abs(matrix[i, k].imag)
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


if WAY is not Way.COMPILED:
    factors_of_large, invert_large = own_factors, own_inverse
else:
    import numba

    _int, _index, _doubles = numba.types.intc, numba.types.intp, numba.types.CPointer(numba.types.float64)
    _pivots = numba.types.CPointer(numba.types.int32)
    _getrf: Callable[..., int] = numba.core.types.ExternalFunction(
        "numba_xxgetrf", _int(numba.types.char, _index, _index, _doubles, _index, _pivots)
    )
    _getri: Callable[..., int] = numba.core.types.ExternalFunction(
        "numba_ez_xxgetri", _int(numba.types.char, _index, _doubles, _index, _pivots)
    )
    _DOUBLE, _COMPLEX = np.int8(ord("d")), np.int8(ord("z"))
    lapack_loading.load()

    @apart
    def factors_of_large(a: Real, n: int, pivots: Index) -> None:
        """Factorise the leading block, as `own_factors`."""
        _getrf(_DOUBLE, n, n, a.ctypes, a.shape[1], pivots.ctypes)

    @apart
    def invert_large(matrix: Complex, inverse: Complex) -> bool:
        """Invert by LAPACK, as `invert`."""
        n = matrix.shape[0]
        work, pivots = np.empty((n, 2 * n)), np.empty(n, np.int32)
        for i in range(n):
            for j in range(n):
                work[i, 2 * j], work[i, 2 * j + 1] = matrix[i, j].real, matrix[i, j].imag
                if not math.isfinite(matrix[i, j].real + matrix[i, j].imag):
                    return False
        # What LAPACK takes for the matrix is its transpose, whose inverse is that of the inverse.
        if _getrf(_COMPLEX, n, n, work.ctypes, n, pivots.ctypes) != 0:
            return False
        if _getri(_COMPLEX, n, work.ctypes, n, pivots.ctypes) != 0:
            return False
        for i in range(n):
            for j in range(n):
                inverse[i, j] = complex(work[i, 2 * j], work[i, 2 * j + 1])
        return True
