"""Large models reduced onto the DOFs in use: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313.

The DOFs in use stay as they are; the rest follows them statically and vibrates in its lowest modes with the
DOFs in use held (doi:10.2514/3.4741).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import ArpackError, eigsh, splu

from solver.matrices.structure import ASYMMETRY, DofTable
from solver.matrices.values import MOST_DOFS

FloatArray = NDArray[np.float64]
_LOOSE = 1e-8  # residual of the static solution, relative, beyond which the rest is not held in place


@dataclass(frozen=True, slots=True, kw_only=True)
class Reduced:
    """Matrices of the DOFs in use, in their order, followed by one coordinate for each mode kept.

    Attributes
    ----------
    matrices : dict
        M, K and, if there was one, C, each (n, n).
    modes : int
        Modes kept.
    highest_hz : float
        Frequency of the highest of them; 0 if there is none.
    """

    matrices: dict[str, FloatArray]
    modes: int
    highest_hz: float


def craig_bampton(
    M: coo_array, K: coo_array, C: coo_array | None, dofs: DofTable, keep_modes: int
) -> Reduced:
    """Reduce a model onto the DOFs named and `keep_modes` modes of the rest.

    Raises
    ------
    ValueError
        A row out of range, matrices that are not symmetric, too many DOFs to keep, or a rest that is not
        held in place by the DOFs named; the message says which and what to do.
    """
    n = M.shape[0]
    given = {"M": M, "K": K} | ({} if C is None else {"C": C})
    _check(given, dofs, n, keep_modes)
    kept = np.array(dofs.rows)
    rest = np.setdiff1d(np.arange(n), kept)
    keep_modes = min(keep_modes, rest.size)
    sparse = {key: csc_array(matrix) for key, matrix in given.items()}
    follow = _static(sparse["K"], rest, kept)
    values, modes = _held_modes(sparse["K"], sparse["M"], rest, keep_modes)
    basis = np.zeros((n, kept.size + keep_modes))
    basis[kept, np.arange(kept.size)] = 1.0
    basis[rest, : kept.size] = follow
    basis[rest, kept.size :] = modes
    reduced = {key: basis.T @ (matrix @ basis) for key, matrix in sparse.items()}
    highest = math.sqrt(max(float(values[-1]), 0.0)) / (2.0 * math.pi) if keep_modes else 0.0
    return Reduced(
        matrices={key: 0.5 * (value + value.T) for key, value in reduced.items()},
        modes=keep_modes,
        highest_hz=highest,
    )


def _check(given: dict[str, coo_array], dofs: DofTable, n: int, keep_modes: int) -> None:
    for name, row in dofs.write().items():
        if row >= n:
            raise ValueError(f"`dofs`: {name!r} must have a row from 0 to {n - 1}, got {row}")
    if len(dofs) + keep_modes > MOST_DOFS:
        raise ValueError(
            f"`dofs` names {len(dofs)} DOFs, which with {keep_modes} modes is more than {MOST_DOFS}: "
            "name those that contacts, forces and the observed amplitude need"
        )
    for key, matrix in given.items():
        difference = abs(csc_array(matrix) - csc_array(matrix).T)
        worst, largest = float(difference.max()), float(abs(matrix).max())
        if worst > ASYMMETRY * largest:
            raise ValueError(
                f"`{key}` must be symmetric to {ASYMMETRY:g} of its largest entry {largest:g}, got a "
                f"difference of {worst:g} from its transpose"
            )


def _block(matrix: Any, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Any:
    return csc_array(matrix[rows][:, columns])


def _static(K: Any, rest: NDArray[np.int64], kept: NDArray[np.int64]) -> FloatArray:
    """How the rest follows a unit displacement of each DOF kept, −K_rr⁻¹ K_rk."""
    if not rest.size:
        return np.zeros((0, kept.size))
    inner, coupling = _block(K, rest, rest), _block(K, rest, kept).toarray()
    loose = (
        "`keep_modes`: with the DOFs named in `dofs` held, the rest of the structure can still move freely "
        "(K is singular there): name DOFs that hold it"
    )
    try:
        follow = -splu(inner).solve(coupling)
    except RuntimeError as error:
        raise ValueError(loose) from error
    size = abs(inner) @ np.abs(follow) + np.abs(coupling)
    if not np.isfinite(follow).all() or np.any(np.abs(inner @ follow + coupling) > _LOOSE * size.max()):
        raise ValueError(loose)
    return np.asarray(follow)


def _held_modes(K: Any, M: Any, rest: NDArray[np.int64], count: int) -> tuple[FloatArray, FloatArray]:
    """The lowest `count` modes (ω², mass-normalised shapes) of the rest with the DOFs in use held."""
    if not count:
        return np.zeros(0), np.zeros((rest.size, 0))
    inner, mass = _block(K, rest, rest), _block(M, rest, rest)
    if rest.size <= MOST_DOFS:
        values, modes = linalg.eigh(inner.toarray(), mass.toarray(), subset_by_index=(0, count - 1))
        return values, modes
    start = np.linspace(1.0, 2.0, rest.size)  # fixed, so that the same files give the same scene
    try:
        values, modes = eigsh(inner, k=count, M=mass, sigma=0.0, v0=start)
    except (ArpackError, RuntimeError) as error:
        raise ValueError(f"`keep_modes` = {count}: the modes were not found ({error}); keep fewer") from error
    order = np.argsort(values)
    return values[order], modes[:, order]
