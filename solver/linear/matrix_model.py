"""A structure of kind ``matrices`` in the coordinates it is computed in, with its damping put together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from solver.linear.modal_damping import modal_damping, ratio_of_modes
from solver.matrices.normal_modes import hermitian
from solver.matrices.values import frozen
from solver.scene.parts import MatricesStructure

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixModel:
    """M q'' + C q' + K q = shapesᵀ f, x = shapes q, of the symmetric parts; all arrays read-only.

    Attributes
    ----------
    M, C, K : (n, n) array
        In physical coordinates, or in modal ones if the structure is given by its modes.
    shapes : (n_dofs, n) array
        The DOFs in use.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    shapes: FloatArray


@lru_cache(maxsize=16)
def matrix_model(structure: MatricesStructure) -> MatrixModel:
    """The matrices of a structure; the same arrays each time, so that what follows from them can be kept."""
    M, K, own, shapes = _base(structure.model_copy(update=NO_PROPORTIONAL))
    C = own
    if structure.stiffness_proportional_damping or structure.mass_proportional_damping:
        C = frozen(
            own + structure.stiffness_proportional_damping * K + structure.mass_proportional_damping * M
        )
    return MatrixModel(M=M, C=C, K=K, shapes=shapes)


NO_PROPORTIONAL = {"stiffness_proportional_damping": 0.0, "mass_proportional_damping": 0.0}


@lru_cache(maxsize=16)
def _base(structure: MatricesStructure) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """M, K, C and shapes without proportional damping."""
    modes, rows = structure.modes, list(structure.dofs.rows)
    ratio = structure.damping_ratio
    if modes is not None:
        ratios = modes.damping_ratio
        if ratios is None:
            ratios = ratio_of_modes(0.0 if ratio is None else ratio, modes.omega2.size)
        M, K = np.eye(modes.omega2.size), np.diag(modes.omega2)
        C, shapes = np.diag(2.0 * ratios * np.sqrt(modes.omega2)), modes.modes[rows]
    elif structure.M is not None and structure.K is not None:
        M, K = structure.M.array, hermitian(structure.K.array)
        C = np.zeros_like(M) if structure.C is None else hermitian(structure.C.array)
        if ratio is not None:
            C = C + modal_damping(M, K, ratio)
        shapes = np.zeros((len(rows), M.shape[0]))
        shapes[np.arange(len(rows)), rows] = 1.0
    else:
        raise ValueError("a matrices structure needs M and K, or `modes`")
    return frozen(M), frozen(K), frozen(C), frozen(shapes)
