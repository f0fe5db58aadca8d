"""The lowest modes of a large Hermitian pair by shift-invert Lanczos in blocks.

ARPACK has no method of its own for complex Hermitian pairs and solves with one right-hand side at a time; a
factor serves eight of them in the time of three. All vectors are kept orthogonal: R. G. Grimes, J. G. Lewis,
H. D. Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228, doi:10.1137/S0895479888151111.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Array = NDArray[Any]
BLOCK = 8
RESIDUAL = 1e-9  # of a Ritz vector, relative to its eigenvalue: the eigenvalue is exact to its square
_MOST = 12  # blocks for each wanted one
_LEFT = 1e-22  # squared length of what is new in a block, relative to the block, that is rounding
_DEPENDENT = 1e-12  # squared length of a direction, relative to the longest of a block, that is rounding


def lowest_modes(
    M: Any, solve: Callable[[Array], Array], shift: float, count: int, dtype: Any
) -> tuple[FloatArray, Array]:
    """Return the `count` eigenvalues of K x = λ M x next above the shift, and M-orthonormal vectors.

    The vectors are columns, (n, count).

    Parameters
    ----------
    M : sparse (n, n), Hermitian, positive semidefinite.
    solve : (K − shift M)⁻¹ of several right-hand sides.

    Raises
    ------
    ValueError
        They were not found.
    """
    n = M.shape[0]
    draw = np.random.default_rng(1)  # fixed, so that the same files give the same scene
    first = solve(np.asfortranarray(M @ draw.normal(size=(n, BLOCK)).astype(dtype)))
    block = _orthonormal(first, M, [])
    basis, weighted = [block], [M @ block]
    most = max(_MOST * (count // BLOCK + 2), 8)
    projected = np.zeros((0, 0), dtype)
    for _ in range(most):
        ahead = solve(np.asfortranarray(weighted[-1]))
        column = np.vstack([w.conj().T @ ahead for w in weighted])
        size = column.shape[0]
        grown = np.zeros((size, size), dtype)
        grown[: projected.shape[0], : projected.shape[0]] = projected
        width = column.shape[1]
        grown[:, size - width :] = column
        grown[size - width :, :] = column.conj().T
        projected = 0.5 * (grown + grown.conj().T)
        following = _orthonormal(ahead, M, list(zip(basis, weighted, strict=True)))
        values, vectors = np.linalg.eigh(projected)
        coupling = (M @ following).conj().T @ ahead
        left = np.linalg.norm(coupling @ vectors[size - width :, ::-1], axis=0)[:count]
        values = values[::-1]
        found = values.size >= count and bool(np.all(left <= RESIDUAL * np.abs(values[:count])))
        if found or not following.shape[1]:
            chosen = vectors[:, ::-1][:, :count]
            ends = np.cumsum([0, *(each.shape[1] for each in basis)])
            modes = sum(
                (each @ chosen[a:b] for each, a, b in zip(basis, ends, ends[1:], strict=False)),
                np.zeros((n, chosen.shape[1]), dtype),
            )
            return shift + 1.0 / values[:count], modes
        basis.append(following)
        weighted.append(M @ following)
    raise ValueError(f"{count} modes were not found in {most} steps: ask for fewer")


def _orthonormal(block: Array, M: Any, against: list[tuple[Array, Array]]) -> Array:
    """Return an M-orthonormal basis of what of a block is M-orthogonal to others, given with M times them."""
    given = float(np.abs(np.einsum("ij,ij->j", block.conj(), M @ block)).max(initial=0.0))
    for _ in range(2):
        for vectors, weighted in against:
            block = block - vectors @ (weighted.conj().T @ block)
        gram = block.conj().T @ (M @ block)
        sizes, turned = np.linalg.eigh(0.5 * (gram + gram.conj().T))
        kept = sizes > max(_DEPENDENT * float(sizes[-1]), _LEFT * given)
        block, given = block @ (turned[:, kept] / np.sqrt(sizes[kept])), 1.0
        if not kept.any():
            break
    return np.asarray(block)
