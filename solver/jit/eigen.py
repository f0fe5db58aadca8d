"""Eigenvalues of two matrices, and eigenvectors from both sides: by NumPy where small, else by SciPy.

Importing `scipy.linalg` takes longer than the response of a small structure with all its contacts, so what is
small is done with what is loaded already. Both ways are backward stable; tests compare them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[Any]
Complex = NDArray[np.complex128]

SMALL = 48  # rows up to which a triangular solve row by row costs less than importing SciPy
LARGEST = 1e8  # entry of V⁻¹, the columns of V being of length 1: beyond, half of the digits are gone
ROUNDING = 16.0  # largest error of a left eigenvector, in units of n eps |A|, that counts as rounding


def pencil(A: Matrix, B: Matrix) -> tuple[NDArray[np.float64], Matrix]:
    """Solve A x = λ B x for Hermitian A and Hermitian, positive definite B.

    Parameters
    ----------
    A, B : (n, n) arrays.

    Returns
    -------
    (n,) eigenvalues, ascending, and (n, n) eigenvectors as columns with xᴴ B x = 1.

    Raises
    ------
    numpy.linalg.LinAlgError
        B is not positive definite.

    Notes
    -----
    As LAPACK's ``xSYGVD``: B = L Lᴴ, eigenvalues of L⁻¹ A L⁻ᴴ; Golub, Van Loan, Matrix Computations, 8.7.2.
    """
    if A.shape[0] > SMALL:
        from scipy import linalg

        values, vectors = linalg.eigh(A, B)
        return values, vectors
    factor = np.linalg.cholesky(B)
    half = _forward(factor, A)
    values, vectors = np.linalg.eigh(_forward(factor, half.conj().T))
    upper = factor.conj().T[::-1, ::-1]
    return values, _forward(upper, vectors[::-1])[::-1]


def two_sided(A: Matrix) -> tuple[Complex, Complex, Complex]:
    """Return the eigenvalues of A with left and right eigenvectors: wᴴ A = λ wᴴ, A v = λ v.

    The left ones are the rows of V⁻¹, unless that costs them digits: where eigenvalues meet, as those of
    equal parts do, each of these belongs to its right one, and LAPACK's need not.

    Parameters
    ----------
    A : (n, n) array.

    Returns
    -------
    (n,) eigenvalues, (n, n) left and (n, n) right eigenvectors as columns.
    """
    n = A.shape[0]
    if np.all(np.isfinite(A)):
        values, right = np.linalg.eig(A)
        try:
            rows = np.linalg.inv(right)
        except np.linalg.LinAlgError:
            rows = np.full_like(right, np.nan)
        if np.all(np.abs(rows) < LARGEST):  # the size of a row is the condition of its eigenvalue
            rows /= np.linalg.norm(rows, axis=1, keepdims=True)
            error = np.linalg.norm(rows @ A - values[:, None] * rows, axis=1).max(initial=0.0)
            if error <= ROUNDING * n * np.finfo(float).eps * np.linalg.norm(A):
                return _complex(values, rows.conj().T, right)
    from scipy import linalg

    values, left, right = linalg.eig(A, left=True, right=True)
    return _complex(values, left, right)


def _complex(values: Matrix, left: Matrix, right: Matrix) -> tuple[Complex, Complex, Complex]:
    return values.astype(np.complex128), left.astype(np.complex128), right.astype(np.complex128)


def _forward(factor: Matrix, right: Matrix) -> Matrix:
    """Solve factor @ x = right for a lower triangular factor, row by row."""
    x = np.empty(right.shape, np.result_type(factor, right))
    for i in range(factor.shape[0]):
        x[i] = (right[i] - factor[i, :i] @ x[:i]) / factor[i, i]
    return x
