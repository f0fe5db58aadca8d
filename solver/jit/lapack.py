"""Dense linear algebra inside compiled loops: vectors, solves with the sign of the determinant, products.

Written as plain loops: an array expression costs Numba a tenth of a second of compilation each time.

Small systems use a loop of our own (a call to LAPACK costs more than the factorisation), larger ones LAPACK.
"""

from __future__ import annotations

import math

import numpy as np

from solver.jit.decorators import compiled
from solver.jit.factors import factors_of_large, invert_large, own_factors, own_inverse
from solver.jit.fourier import Complex, Index, Integer, Real
from solver.jit.separate import apart

OWN_UP_TO = 36  # measured crossing of our loop and LAPACK
INVERTED_UP_TO = 24  # the same of a complex inverse
MULTIPLIED_UP_TO = 4000  # the same of a product: complex multiplications


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
