"""What rigid bodies add to the matrices of a structure."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.linear.matrix_model import MatrixModel, matrix_model
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.parts import MatricesStructure

FloatArray = NDArray[np.float64]


@lru_cache(maxsize=64)
def bodies_mass(n: int, bodies: tuple[Body, ...]) -> FloatArray:
    """Mass matrix of the bodies behind `n` DOFs of the structure, which have none of it; read-only."""
    return frozen(block_diag(np.zeros((n, n)), *(body.mass_matrix() for body in bodies)))


def mass_derivative(n: int, bodies: tuple[Body, ...], owner: str, key: str) -> FloatArray:
    """Derivative of `bodies_mass` by a number of the bodies of that name or group; read-only."""
    blocks = [
        body.mass_derivative(key) if owner in (body.name, body.group) else np.zeros((len(body.dofs),) * 2)
        for body in bodies
    ]
    return frozen(block_diag(np.zeros((n, n)), *blocks))


def matrices_with_bodies(structure: MatricesStructure, bodies: tuple[Body, ...]) -> MatrixModel:
    """The matrices of a structure and of bodies behind it; the same arrays each time, as `matrix_model`."""
    return _with_bodies(structure, bodies) if bodies else matrix_model(structure)


@lru_cache(maxsize=16)
def _with_bodies(structure: MatricesStructure, bodies: tuple[Body, ...]) -> MatrixModel:
    own = matrix_model(structure)
    n = sum(len(body.dofs) for body in bodies)
    nothing = np.zeros((n, n))
    mass = bodies_mass(0, bodies)
    return MatrixModel(
        M=frozen(block_diag(own.M, mass)), C=frozen(block_diag(own.C, nothing)),
        K=frozen(block_diag(own.K, nothing)), shapes=frozen(block_diag(own.shapes, np.eye(n))),
    )  # fmt: skip


def block_diag(*blocks: NDArray[Any]) -> NDArray[Any]:
    """Return the matrix with these blocks on its diagonal: `scipy.linalg` takes longer to load than this."""
    rows, columns = (sum(block.shape[axis] for block in blocks) for axis in (0, 1))
    out, row, column = np.zeros((rows, columns), np.result_type(*blocks, np.float64)), 0, 0
    for block in blocks:
        out[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return out
