"""A structure of kind ``matrices`` in the coordinates it is computed in, with its damping and its bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.errors import SettingError
from solver.matrices.normal_modes import hermitian, undamped_modes
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.matrices_structure import Ratios
from solver.scene.parts import MatricesStructure

FloatArray = NDArray[np.float64]
_SAME = 1e-9  # relative distance of two squared frequencies below which their quotient is a derivative


def ratio_of_modes(ratios: Ratios, count: int) -> FloatArray:
    """Return the damping ratio of each of `count` modes: the last one given also of those above it."""
    given = np.atleast_1d(np.asarray(ratios, dtype=np.float64))
    return np.asarray(given[np.minimum(np.arange(count), given.size - 1)])


def modal_damping(M: NDArray[Any], K: NDArray[Any], ratios: Ratios) -> NDArray[Any]:
    """Return C with damping ratios in the modes, Σ 2 ζ ω (Mφ)(Mφ)ᴴ, of Hermitian M and K.

    A rigid body has none.
    """
    found = undamped_modes(K, M)
    momenta = M @ found.phi
    omega = np.sqrt(np.maximum(found.omega2, 0.0))
    zeta = ratio_of_modes(ratios, omega.size)
    return np.asarray((momenta * (2.0 * zeta * omega)) @ momenta.conj().T)


def modal_damping_derivative(
    M: FloatArray, K: FloatArray, ratios: Ratios, dM: FloatArray, dK: FloatArray
) -> FloatArray:
    """Return the derivative of `modal_damping` where M and K change by dM and dK.

    With φᵀMφ = 1, C = Mφ F φᵀM, F = 2ζω: modes turn into each other, φ' = φB with B_ij =
    φ_iᵀ(dK − λ_j dM)φ_j / (λ_j − λ_i), B_ii = −½ φ_iᵀ dM φ_i (Fox, Kapoor, AIAA J. 6 (1968) 2426), so that
    (BF + FBᵀ + F')_ij is a quotient of differences, which for equal frequencies is a derivative.

    Raises
    ------
    SettingError
        A mode with a frequency of zero, or two of one frequency with different ratios: C has a kink there.
    """
    found = undamped_modes(K, M)
    values, phi = found.omega2, found.phi
    zeta = ratio_of_modes(ratios, values.size)
    if np.any(values <= 0.0):
        raise SettingError("damping_ratio", list(zeta[:3]), "has no derivative where a mode is a rigid body")
    f = 2.0 * zeta * np.sqrt(values)
    kappa, mu = phi.T @ dK @ phi, phi.T @ dM @ phi
    apart = values[None, :] - values[:, None]
    same = np.abs(apart) <= _SAME * np.maximum(values[None, :], values[:, None])
    if np.any(same & (zeta[:, None] != zeta[None, :])):
        raise SettingError("damping_ratio", list(zeta[:3]), "must be equal for modes of one frequency here")
    gap = np.where(same, 1.0, apart)
    # f(λ) = 2ζ√λ and λ f(λ) as quotients of differences; of one frequency ζ/√λ and 3ζ√λ.
    rise = np.where(same, zeta / np.sqrt(values), (f[None, :] - f[:, None]) / gap)
    product = values * f
    bend = np.where(same, 3.0 * zeta * np.sqrt(values), (product[None, :] - product[:, None]) / gap)
    turned = kappa * rise - mu * bend
    momenta = M @ phi
    change = dM @ phi @ np.diag(f) @ momenta.T
    return np.asarray(momenta @ turned @ momenta.T + change + change.T)


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


@lru_cache(maxsize=64)
def bodies_mass(n: int, bodies: tuple[Body, ...]) -> FloatArray:
    """Mass matrix of the bodies behind `n` DOFs of the structure, which have none of it; read-only."""
    return frozen(block_diag(np.zeros((n, n)), *(body.mass_matrix() for body in bodies)))


def mass_of_bodies(n: int, bodies: tuple[Body, ...], masses: Mapping[str, FloatArray]) -> FloatArray:
    """Mass matrices of bodies by their names as one of `n` coordinates, theirs the last; read-only."""
    blocks = [masses.get(body.name, np.zeros((len(body.dofs),) * 2)) for body in bodies]
    own = n - sum(map(len, blocks))
    return frozen(block_diag(np.zeros((own, own)), *blocks))


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
