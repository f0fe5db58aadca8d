"""Undamped modes whose low frequencies are accurate however stiff the model is elsewhere.

The modes are found from M ψ = μ (K + σ M) ψ, so that rounding is relative to the flexibility of the lowest
mode, not to the stiffness of the highest: a fine mesh may spread ω² over twelve decades, of which the lowest
few carry the response.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Real
from solver.jit import eigen

# Not that of `solver.jit.fourier`, which brings the compiled loops along: files of strangers are read
# without.
SMALL_PIVOT = 1e-12  # of the scaled K: below it K alone may be singular, and is shifted
SHIFT = 1e-10  # shift σ relative to the largest K_ii / M_ii
LEAST = 1e-16  # smallest flexibility relative to the largest: below is rounding, only the static share counts


@dataclass(frozen=True, slots=True, kw_only=True)
class UndampedModes:
    """Modes ψ with ψᴴ (K + σ M) ψ = 1 and ψᴴ M ψ = 1 / (ω² + σ), lowest frequency first."""

    flexibility: Annotated[Real, "1 / (ω² + σ) [s²], (m,)."]
    psi: Annotated[NDArray[Any], "One mode a column, (n, m)."]
    sigma: Annotated[float, "σ [rad²/s²], 0 if K alone is positive definite."]

    @property
    def omega2(self) -> Real:
        """Squares of the natural frequencies [rad²/s²]."""
        return 1.0 / self.flexibility - self.sigma

    @property
    def phi(self) -> NDArray[Any]:
        """Mass-normalised modes, (n, m)."""
        return self.psi / np.sqrt(self.flexibility)


def undamped_modes(K: NDArray[Any], M: NDArray[Any]) -> UndampedModes:
    """Find all modes of Hermitian K and M.

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass matrix is not positive definite.
    """
    # Whatever the units of the rows are, with room to spare.
    definite = least_stiffness(K) > SMALL_PIVOT
    sigma = 0.0 if definite else SHIFT * float(np.max(np.abs(np.diag(K)) / np.diag(M).real, initial=0.0))
    try:
        found, psi = eigen.pencil(M, K + sigma * M if sigma else K)
    except np.linalg.LinAlgError:
        # K has eigenvalues well below zero: the plain problem, mass-normalised.
        values, phi = eigen.pencil(K, M)
        sigma = float(-2.0 * values[0] + SHIFT * np.abs(values).max()) or 1.0
        found = 1.0 / (values + sigma)
        return UndampedModes(flexibility=found, psi=phi * np.sqrt(found), sigma=sigma)
    found, psi = np.maximum(found[::-1], LEAST * found[-1]), np.ascontiguousarray(psi[:, ::-1])
    return UndampedModes(flexibility=found, psi=psi, sigma=sigma)


def hermitian(K: NDArray[Any]) -> NDArray[Any]:
    """Return the Hermitian part of a matrix: the same array where that is all of it."""
    turned = K.conj().T
    return K if np.array_equal(K, turned) else 0.5 * (K + turned)


def least_stiffness(K: NDArray[Any]) -> float:
    """Return the smallest squared pivot of K scaled to a unit diagonal; 0 if it is not positive definite.

    Of a K that is not Hermitian that of its Hermitian part: where that is definite, K is regular (Bendixson).
    """
    K = hermitian(K)
    diagonal = np.diag(K).real
    if not np.all(diagonal > 0.0):
        return 0.0
    scale = 1.0 / np.sqrt(diagonal)
    try:
        factor = np.linalg.cholesky(K * scale[:, None] * scale)
    except np.linalg.LinAlgError:
        return 0.0
    return float(np.min(np.diag(factor).real, initial=1.0) ** 2)
