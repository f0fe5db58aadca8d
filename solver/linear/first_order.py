"""A structure of kind ``matrices`` as the equations of motion solved for the accelerations.

This is for time marching, which needs the DOFs in use as coordinates, and shares nothing with the harmonic
balance: the matrices are inverted here, not decomposed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from solver.errors import SettingError
from solver.scene.parts import MatricesStructure

FloatArray = NDArray[np.float64]
_INDEPENDENT = 1e-9  # smallest singular value of the modes at the DOFs in use, relative to the largest


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstOrderEquations:
    """x'' = W f − A x − B x', the DOFs in use among the coordinates x.

    Attributes
    ----------
    A, B, W : (n, n) array
        M⁻¹ K [1/s²], M⁻¹ C [1/s] and M⁻¹ [1/kg].
    index : dict
        Coordinate of each DOF in use.
    """

    A: FloatArray
    B: FloatArray
    W: FloatArray
    index: dict[str, int]


def equations(structure: MatricesStructure, used: Sequence[str], spin: float = 0.0) -> FirstOrderEquations:
    """The equations of motion with the DOFs `used` as coordinates, at a speed of rotation `spin` [rad/s].

    Raises
    ------
    SettingError
        The structure is given by too few modes to tell the motions of these DOFs apart.
    """
    rows = dict(zip(structure.dofs, structure.dofs.rows, strict=True))
    if structure.modes is not None:
        return _of_modes(structure, list(dict.fromkeys(used)), rows)
    if structure.M is None or structure.K is None:
        raise SettingError("structure", structure.kind, "must have M and K, or `modes`")
    M, K = structure.M.array, structure.K.array
    symmetric = 0.5 * (K + K.T)
    C = structure.stiffness_proportional_damping * symmetric + structure.mass_proportional_damping * M
    if structure.C is not None:
        C = C + structure.C.array
    if structure.damping_ratio is not None:
        # C = 2 ζ M sqrt(M⁻¹ K): the square root taken in the coordinates where M is 1.
        factor = linalg.cholesky(M, lower=True)
        half = linalg.solve_triangular(factor, symmetric, lower=True)
        C = C + factor @ modal_damping_root(linalg.solve_triangular(factor, half.T, lower=True),
                                            structure.damping_ratio) @ factor.T  # fmt: skip
    if structure.G is not None:
        C = C + spin * structure.G.array
    if structure.K_omega2 is not None:
        K = K + spin**2 * structure.K_omega2.array
    W = linalg.inv(M)
    return FirstOrderEquations(A=W @ K, B=W @ C, W=W, index={name: rows[name] for name in used})


def modal_damping_root(scaled: FloatArray, ratios: float | Sequence[float]) -> FloatArray:
    """Twice the square root of a stiffness where M is 1, each mode with its damping ratio."""
    values, vectors = linalg.eigh(scaled)
    given = np.atleast_1d(np.array(ratios, dtype=np.float64))
    zeta = np.concatenate([given, np.full(max(values.size - given.size, 0), given[-1])])[: values.size]
    return np.asarray((vectors * (2.0 * zeta * np.sqrt(np.maximum(values, 0.0)))) @ vectors.T)


def _of_modes(structure: MatricesStructure, used: list[str], rows: dict[str, int]) -> FirstOrderEquations:
    """Coordinates y = S q: the DOFs in use, and what of the modes q is orthogonal to them."""
    modes = structure.modes
    if modes is None:
        raise SettingError("structure", structure.kind, "must have `modes`")
    seen = modes.modes[[rows[name] for name in used]]
    sizes = linalg.svdvals(seen)
    if seen.shape[0] > seen.shape[1] or sizes[-1] <= _INDEPENDENT * sizes[0]:
        raise SettingError(
            "scene",
            f"{modes.omega2.size} modes at the DOFs {', '.join(used)}",
            "must have modes that tell its DOFs in use apart to be marched in time (or M and K)",
        )
    S = np.vstack([seen, linalg.null_space(seen).T])
    inverse = linalg.inv(S)
    omega = np.sqrt(modes.omega2)
    given = np.atleast_1d(np.array(structure.damping_ratio or 0.0, dtype=np.float64))
    ratio = modes.damping_ratio
    if ratio is None:
        ratio = np.concatenate([given, np.full(max(omega.size - given.size, 0), given[-1])])[: omega.size]
    damping = (
        2.0 * ratio * omega
        + structure.stiffness_proportional_damping * modes.omega2
        + structure.mass_proportional_damping
    )
    return FirstOrderEquations(
        A=(S * modes.omega2) @ inverse,
        B=(S * damping) @ inverse,
        W=S @ S.T,
        index={name: i for i, name in enumerate(used)},
    )
