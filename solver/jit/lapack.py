"""Dense linear algebra inside compiled loops: vectors, solves with the sign of the determinant, products.

Written as plain loops: an array expression costs Numba a tenth of a second of compilation each time.

Small systems use a loop of our own (a call to LAPACK costs more than the factorisation), larger ones LAPACK,
by the entries Numba itself links, which stay cacheable on disk; in the plain way our own loops stand for it.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.fourier import Complex, Index, Integer, Real
from solver.jit.separate import apart
from solver.jit.way import WAY, Way

OWN_UP_TO = 36  # measured crossing of our loop and LAPACK
INVERTED_UP_TO = 24  # the same of a complex inverse
MULTIPLIED_UP_TO = 4000  # the same of a product: complex multiplications


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

    def _load_lapack(name: str = "scipy.linalg.cython_lapack") -> None:
        """Load the module from which Numba takes LAPACK, at the first call, without the rest of SciPy.

        To import it as part of its package runs the package too, which takes ten times as long and is not
        needed here. A module that is loaded already is taken as it is, by Numba and by SciPy, whose package
        can be imported afterwards as ever. If it cannot be done nothing happens, and Numba imports all.
        """
        if name in sys.modules or "scipy.linalg" in sys.modules:
            return
        import scipy  # on Windows it says where its libraries are

        folder = Path(scipy.__file__).parent / "linalg"
        loader = (ExtensionFileLoader, EXTENSION_SUFFIXES)
        found = FileFinder(str(folder), loader).find_spec(name.rpartition(".")[2])
        spec = None if found is None else spec_from_file_location(name, found.origin)
        if spec is None or spec.loader is None:
            return
        with suppress(ImportError):
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            sys.modules.setdefault(name, module)

    _load_lapack()

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


@compiled
def are_finite(values: Real) -> bool:
    """Return whether no entry of a vector is NaN or infinite."""
    total = 0.0
    for value in values:
        total += 0.0 * value
    return total == 0.0


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
def dot(a: Real, b: Real) -> float:
    """Return a · b."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@compiled
def copy_block(target: Real, source: Real) -> None:
    """Copy a matrix into the upper left block of another."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]


@compiled
def take_block(source: Complex, rows: Integer, columns: Integer, target: Complex) -> None:
    """Copy some rows and columns of a matrix, as many as the other has."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[rows[i], columns[j]]


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


@apart
def _multiply_large(left: Complex, right: Complex, out: Complex) -> None:
    """Multiply by BLAS, as `multiply`: apart from it, as code that calls `np.dot` loads Numba's tables."""
    np.dot(left, right, out)


@apart
def multiply(left: Complex, right: Complex, out: Complex) -> None:
    """Fill `out` with left @ right, all of them row after row without gaps."""
    if left.shape[0] * left.shape[1] * right.shape[1] > MULTIPLIED_UP_TO:
        _multiply_large(left, right, out)
        return
    for a in range(left.shape[0]):
        for b in range(right.shape[1]):
            out[a, b] = 0.0
        for c in range(left.shape[1]):
            factor = left[a, c]
            for b in range(right.shape[1]):
                out[a, b] += factor * right[c, b]


@apart
def invert(matrix: Complex, inverse: Complex) -> bool:
    """Invert a complex matrix, with partial pivoting; a small one by Gauss–Jordan, which destroys `matrix`.

    Returns False, with `inverse` meaningless, if the matrix is singular or not finite.
    """
    if matrix.shape[0] > INVERTED_UP_TO:
        return invert_large(matrix, inverse)
    return own_inverse(matrix, inverse)


@apart
def factorise(a: Real, n: int, pivots: Index) -> float:
    """Factorise the leading n × n block of a row-major matrix in place, as `back_substitute` needs it.

    The rows of `a` are the columns of its transpose, which is what is factorised: LAPACK works on columns.

    Returns
    -------
    The sign of the determinant, 0.0 if the matrix is singular or not finite.
    """
    for i in range(n):
        for j in range(n):
            if not math.isfinite(a[i, j]):
                return 0.0
    if n <= OWN_UP_TO:
        own_factors(a, n, pivots)
    else:
        factors_of_large(a, n, pivots)
    sign = 1.0
    for k in range(n):
        if a[k, k] == 0.0:
            return 0.0
        if pivots[k] != k + 1:
            sign = -sign
        if a[k, k] < 0.0:
            sign = -sign
    return sign


@apart
def back_substitute(a: Real, n: int, pivots: Index, x: Real) -> None:
    """Solve matrix @ x = rhs with the factors of `factorise`; `x` (≥ n,) is the right-hand side, overwritten.

    With Mᵀ = Pᵀ L U the solution is x = Pᵀ L⁻ᵀ U⁻ᵀ rhs: dot products along rows of `a`.
    """
    for i in range(n):
        total = x[i]
        for k in range(i):
            total -= a[i, k] * x[k]
        x[i] = total / a[i, i]
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, n):
            total -= a[i, k] * x[k]
        x[i] = total
    for k in range(n - 1, -1, -1):
        other = pivots[k] - 1
        if other != k:
            x[k], x[other] = x[other], x[k]


@apart
def back_substitute_transposed(a: Real, n: int, pivots: Index, x: Real) -> None:
    """Solve matrixᵀ @ x = rhs with the factors of `factorise`, in place: x = U⁻¹ L⁻¹ P rhs."""
    for k in range(n):
        other = pivots[k] - 1
        if other != k:
            x[k], x[other] = x[other], x[k]
    for k in range(n):
        value = x[k]
        for i in range(k + 1, n):
            x[i] -= a[k, i] * value
    for k in range(n - 1, -1, -1):
        x[k] /= a[k, k]
        value = x[k]
        for i in range(k):
            x[i] -= a[k, i] * value
