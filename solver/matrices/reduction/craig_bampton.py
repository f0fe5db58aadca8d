"""Large models reduced onto the DOFs in use: R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313.

The DOFs in use stay as they are; the rest follows them statically and vibrates in its lowest modes with the
DOFs in use held (doi:10.2514/3.4741). All is sparse: the stiffness of the rest is factorised once, for the
static solutions, the modes (shift-invert) and the estimate of what was lost. Where the DOFs in use do not
hold the rest, K − σ M with a small negative σ takes the place of K, and the rigid-body modes of the rest are
among the modes kept: the same space of motions but for a share σ / ω² of the modes left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from solver.errors import FieldError
from solver.matrices.matrix_validation import DofTable, one_triangle
from solver.matrices.reduction.fixed_interface_modes import held_modes, interior
from solver.matrices.reduction.reduction_error import Quality, measured
from solver.matrices.values import ASYMMETRY, MOST_DOFS

Array = NDArray[Any]  # real, or complex where the matrices are Hermitian: a nodal diameter of a disk


@dataclass(frozen=True, slots=True, kw_only=True)
class Reduced:
    """Matrices of the DOFs in use, in their order, followed by one coordinate for each mode kept."""

    matrices: Annotated[dict[str, Array], "M, K and, if there was one, C, each (n, n), Hermitian."]
    modes: Annotated[int, "Modes kept."]
    highest_hz: Annotated[float, "Frequency of the highest of them; 0 if there is none."]
    quality: Annotated[Quality, "What the reduction is good for."]
    basis: Annotated[
        Array | None, "The motions of the full model that the coordinates stand for, if asked for, (rows, n)."
    ] = None


def craig_bampton(
    M: Any,
    K: Any,
    C: Any | None,
    dofs: DofTable,
    keep_modes: int | None,
    *,
    up_to_hz: float | None = None,
    others: Mapping[str, coo_array] | None = None,
    weigh: bool = True,
    keep_basis: bool = False,
) -> Reduced:
    """Reduce a model onto the DOFs named and `keep_modes` modes of the rest, or all up to `up_to_hz` [Hz].

    Parameters
    ----------
    M, K, C : sparse (n, n), symmetric or Hermitian.
    others : matrices projected beside them, symmetric or not.
    weigh : whether to find the effective masses too, which takes solutions with M.
    keep_basis : whether the motions of the coordinates are asked for.

    Raises
    ------
    ValueError
        A row out of range, matrices that are not symmetric, too many DOFs to keep, or a rest that is not
        held in place by the DOFs named; the message says which and what to do.
    """
    n = M.shape[0]
    given = {"M": M, "K": K} | ({} if C is None else {"C": C})
    _check(given, dofs, n, keep_modes or 0)
    kept = np.array(dofs.rows)
    rest = np.setdiff1d(np.arange(n), kept)
    sparse = {key: csc_array(matrix) for key, matrix in given.items()}
    held = interior(sparse["K"], sparse["M"], rest, kept)
    values, modes = held_modes(held, keep_modes, up_to_hz)
    if kept.size + values.size > MOST_DOFS:
        raise ValueError(
            f"{values.size} modes up to {up_to_hz:g} Hz are more than {MOST_DOFS}: ask for fewer"
        )
    basis = np.zeros((n, kept.size + values.size), np.result_type(held.follow, modes))
    basis[kept, np.arange(kept.size)] = 1.0
    basis[rest, : kept.size] = held.follow
    basis[rest, kept.size :] = modes
    reduced = {key: basis.conj().T @ (matrix @ basis) for key, matrix in sparse.items()}
    matrices = {key: 0.5 * (value + value.conj().T) for key, value in reduced.items()}
    matrices |= {key: basis.conj().T @ (csc_array(matrix) @ basis) for key, matrix in (others or {}).items()}
    highest = math.sqrt(max(float(values[-1]), 0.0)) / (2.0 * math.pi) if values.size else 0.0
    return Reduced(
        matrices=matrices,
        modes=values.size,
        highest_hz=highest,
        quality=measured(held, values, modes, matrices, weigh=weigh),
        basis=basis if keep_basis else None,
    )


def _check(given: dict[str, Any], dofs: DofTable, n: int, keep_modes: int) -> None:
    for name, row in dofs.write().items():
        if row >= n:
            raise FieldError(("dofs",), f"`dofs`: {name!r} must have a row from 0 to {n - 1}, got {row}")
    if len(dofs) + keep_modes > MOST_DOFS:
        raise FieldError(
            ("dofs",),
            f"names {len(dofs)} DOFs, which with {keep_modes} modes is more than {MOST_DOFS}: "
            "name those that contacts, forces and the observed amplitude need",
        )
    for key, matrix in given.items():
        difference = abs(csc_array(matrix) - csc_array(matrix).conj().T)
        worst, largest = float(difference.max()), float(abs(matrix).max())
        if worst > ASYMMETRY * largest:
            triangle = one_triangle(coo_array(matrix))
            if triangle is not None:
                raise ValueError(f"`{key}` must be symmetric: {triangle}")
            raise ValueError(
                f"`{key}` must be symmetric to {ASYMMETRY:g} of its largest entry {largest:g}, got a "
                f"difference of {worst:g} from its transpose"
            )


WRITTEN = (".npz", ".mat")


def write_reduced(path: Path, reduced: Reduced, dofs: Sequence[str]) -> None:
    """Write M, K and maybe C, with the names of the rows and the frequencies of the modes kept.

    The arrays are ``M`` [kg], ``K`` [N/m], ``C`` [N s/m], ``names`` (DOFs in use, then ``mode1`` …),
    ``held_hz``, ``system_hz`` [Hz] and ``good_to_hz``.

    Raises
    ------
    ValueError
        A suffix that is not one of `WRITTEN`.
    OSError
        The file cannot be written.
    """
    names = [*dofs, *(f"mode{i}" for i in range(1, reduced.modes + 1))]
    quality = reduced.quality
    arrays = {
        **reduced.matrices,
        "held_hz": quality.held_hz,
        "system_hz": quality.system_hz,
        "good_to_hz": np.array(quality.good_to_hz),
    }
    suffix = path.suffix.lower()
    if suffix == ".npz":
        np.savez_compressed(path, allow_pickle=False, **arrays, names=np.array(names))
    elif suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {**arrays, "names": np.array(names, dtype=object)}, do_compression=True)
    else:
        raise ValueError(f"a reduced model is written to {' or '.join(WRITTEN)}, got {path.suffix!r}")
