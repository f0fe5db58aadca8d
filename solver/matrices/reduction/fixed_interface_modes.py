"""The rest of a large model with the DOFs in use held: one factorisation, static solutions, lowest modes.

The modes come from shift-invert Lanczos (ARPACK).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from solver.matrices.values import MOST_MODES

FloatArray = NDArray[np.float64]
Array = NDArray[Any]  # real, or complex where the matrices are Hermitian

DENSE = 600  # rows below which all modes are found at once
FREE = (
    "with the DOFs named in `dofs` held, the rest of the structure can still move freely {how}: name DOFs "
    "that hold it"
)
_SHIFT = 1e-13  # shift relative to the largest K_jj / M_jj, where K alone is singular
_RIGID = 0.1  # modes below this share of the shift are rigid-body modes: they are zero but for rounding
_FAR = 1e8  # a static solution larger than this, for a unit displacement, means that nothing holds the rest
_FIRST = 16  # modes looked for first when only their highest frequency is given
_BODY = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Interior:
    """K − σ M of the rest, factorised."""

    K: Annotated[Any, "Stiffness, sparse, (n, n)."]
    M: Annotated[Any, "Mass, sparse, (n, n)."]
    couplings: Annotated[dict[str, Array], "K and M between the rest and the DOFs in use, (n, n_kept)."]
    shift: Annotated[float, "σ <= 0 [rad²/s²], 0 if the DOFs in use hold the rest."]
    solve: Annotated[Any, "The inverse of K − σ M."]
    follow: Annotated[Array, "How the rest follows a unit displacement of each DOF in use, (n, n_kept)."]
    residual: Annotated[float, "Of that solution, relative to the forces it balances."]


def interior(K: Any, M: Any, rest: NDArray[np.int64], kept: NDArray[np.int64]) -> Interior:
    """Factorise the rest of a model.

    Raises
    ------
    ValueError
        Rows without stiffness, or nothing that can be factorised.
    """
    inner, mass = _block(K, rest, rest), _block(M, rest, rest)
    couplings = {"K": _block(K, rest, kept).toarray(), "M": _block(M, rest, kept).toarray()}
    stiffness, inertia = inner.diagonal().real, mass.diagonal().real
    empty = np.flatnonzero((stiffness == 0.0) & (np.diff(inner.indptr) == 0))
    if empty.size:
        how = f"in {empty.size} rows without any stiffness, the first of them row {rest[empty[0]]}"
        raise ValueError(FREE.format(how=how))
    moving = inertia > 0.0
    scale = float(np.abs(stiffness[moving] / inertia[moving]).max(initial=0.0))
    found = _factorised(inner, mass, couplings, 0.0)
    if found is None or abs(_lowest_estimate(found)) < _SHIFT * _RIGID * scale:
        found = _factorised(inner, mass, couplings, -_SHIFT * scale)
    if found is None:
        raise ValueError(FREE.format(how="(K and M are singular there)"))
    return found


def _block(matrix: Any, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> Any:
    return csc_array(matrix[rows][:, columns])


def _factorised(K: Any, M: Any, couplings: dict[str, Array], shift: float) -> Interior | None:
    """K − σ M factorised; None if it is singular to working accuracy."""
    matrix = csc_array(K - shift * M) if shift else K
    try:
        solve = factor(matrix)
    except RuntimeError:
        return None
    force = couplings["K"] - shift * couplings["M"]
    follow = -solve(force)
    size = np.abs(force).max(initial=0.0)
    residual = float(np.abs(matrix @ follow + force).max(initial=0.0) / size) if size else 0.0
    if not np.isfinite(follow).all() or np.abs(follow).max(initial=0.0) > _FAR:
        return None
    return Interior(K=K, M=M, couplings=couplings, shift=shift, solve=solve, follow=follow, residual=residual)


def factor(matrix: Any) -> Callable[[Array], Array]:
    """The inverse of a symmetric or Hermitian matrix: pivots from the diagonal, ordered for little fill.

    Raises
    ------
    RuntimeError
        The matrix is singular.
    """
    symmetric = {"diag_pivot_thresh": 1e-3, "options": {"SymmetricMode": True}}
    direct: Callable[[Array], Array] = splu(matrix, permc_spec="MMD_AT_PLUS_A", **symmetric).solve
    return direct


def _lowest_estimate(rest: Interior) -> float:
    """About the lowest ω² of the rest, by two steps of inverse iteration."""
    shape = np.linspace(1.0, 2.0, rest.K.shape[0]).astype(rest.K.dtype)
    for _ in range(2):
        shape = rest.solve(rest.M @ shape)
        shape /= np.abs(shape).max(initial=1e-300)
    inertia = float(np.vdot(shape, rest.M @ shape).real)
    return float(np.vdot(shape, rest.K @ shape).real) / inertia if inertia > 0.0 else np.inf


def held_modes(rest: Interior, count: int | None, up_to_hz: float | None) -> tuple[FloatArray, Array]:
    """The lowest modes of the rest with the DOFs in use held.

    Parameters
    ----------
    count : how many; where the rest moves freely, its rigid-body modes are kept at least.
    up_to_hz : or all up to this frequency.

    Returns
    -------
    omega2 : (m,) array
        Ascending [rad²/s²].
    modes : (n, m) array
        Mass-normalised.

    Raises
    ------
    ValueError
        Modes that ARPACK did not find, more than `values.MOST_MODES`, or a rest in several loose parts.
    """
    n = rest.K.shape[0]
    least = 0 if not rest.shift else min(n, _BODY + 1)
    limit = None if up_to_hz is None else (2.0 * math.pi * up_to_hz) ** 2
    wanted = min(n, max(count if count is not None else _FIRST, least))
    while True:
        values, modes = _lowest(rest, wanted)
        if limit is None or wanted == n or values[-1] > limit:
            break
        if wanted >= MOST_MODES:
            raise ValueError(f"there are more than {wanted} modes up to {up_to_hz:g} Hz: ask for fewer")
        wanted = min(n, 2 * wanted, MOST_MODES)
    free = int(np.count_nonzero(np.abs(values) < _RIGID * abs(rest.shift)))
    if free > _BODY:
        raise ValueError(FREE.format(how=f"in {free} or more ways, where one body has {_BODY} at most"))
    kept = count if limit is None else int(np.searchsorted(values, limit, side="right"))
    kept = min(n, max(kept or 0, free))
    return values[:kept], modes[:, :kept]


def _lowest(rest: Interior, count: int) -> tuple[FloatArray, Array]:
    n = rest.K.shape[0]
    if not count:
        return np.zeros(0), np.zeros((n, 0))
    if n <= DENSE or count > n // 2:
        values, modes = linalg.eigh(rest.K.toarray(), rest.M.toarray(), subset_by_index=(0, count - 1))
        return values, modes
    inverse = LinearOperator((n, n), matvec=rest.solve, dtype=rest.K.dtype)
    start = np.linspace(1.0, 2.0, n).astype(rest.K.dtype)  # fixed, so that the same files give the same scene
    try:
        values, modes = eigsh(rest.K, k=count, M=rest.M, sigma=rest.shift, OPinv=inverse, v0=start)
    except (ArpackError, RuntimeError) as error:
        raise ValueError(f"{count} modes were not found ({error}): ask for fewer") from error
    order = np.argsort(values)
    return values[order], modes[:, order]
