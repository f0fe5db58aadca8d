"""A base that moves as prescribed, as two more coordinates of the time march.

The first is the motion y of the base itself, that of a mass on a spring and a dashpot of its own, driven so
that its steady motion is the one prescribed, y'' + 2ω y' + ω² y = f(t): what else it does dies out within a
few periods. Its acceleration drives the rest. The second adds up the observed motion: it has the acceleration
of what is observed, and begins at rest with it.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.errors import SettingError
from solver.scene.scene import LumpedStructure, Scene
from solver.scene.terms.excitation import Excitation

FloatArray = NDArray[np.float64]
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def with_base(
    scene: Scene,
    driven_by: Excitation,
    A: csr_array,
    B: csr_array,
    W: csr_array,
    index: dict[str, int],
    omega: float,
) -> tuple[csr_array, csr_array, csr_array, int]:
    """Return x'' = W f - A x - B x' with the base and what is observed behind x, and where the latter is.

    Raises
    ------
    SettingError
        Driven DOFs of a structure that is not lumped: inertia couples them to the rest.
    """
    base = driven_by.base
    if base is None:
        raise SettingError("excitation", driven_by.place, "must be a base that moves")
    if not base.ground and not isinstance(scene.structure, LumpedStructure):
        wanted = "are marched in a lumped structure alone; march the motion of the ground instead"
        raise SettingError("driven", driven_by.place, wanted)
    n = A.shape[0]
    A, B, W = (_grown(each, n + 1) for each in (A, B, W))
    A[n, n], B[n, n], W[n, n] = omega**2, 2.0 * omega, 1.0
    shares = np.zeros(n)
    for dof, share in base.shares:
        shares[index[dof]] += share
    for row in np.flatnonzero(shares):
        for matrix in (A, B, W):
            if base.ground:  # counted from the ground
                matrix[row] -= shares[row] * matrix[n]
            else:
                matrix[row] = shares[row] * matrix[n]
    seen = [(index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ()]
    of_base = sum(float(shares[at]) * factor for at, factor in seen) * base.ground
    if scene.observe.relative:
        of_base = 0.0 if base.ground else -sum(factor for _, factor in seen)
    return with_sum([*seen, (n, of_base)], csr_array(A), csr_array(B), csr_array(W))


def with_sum(
    terms: Sequence[tuple[int, float]], A: csr_array, B: csr_array, W: csr_array
) -> tuple[csr_array, csr_array, csr_array, int]:
    """Return the equations with a sum of coordinates as one more behind them, and where it is."""
    n = A.shape[0]
    grown = [_grown(each, n + 1) for each in (A, B, W)]
    for matrix in grown:
        matrix[n] = sum(factor * matrix[at] for at, factor in terms)
    A, B, W = map(csr_array, grown)
    return A, B, W, n


def base_force(force: Excitation, omega: float) -> tuple[float, float]:
    """Return amplitude and phase of what drives the base to the motion prescribed, at ω [rad/s]."""
    if force.base is None:
        raise SettingError("excitation", force.place, "must be a base that moves")
    turning = 1j * force.harmonic * omega
    moved = force.amplitude * cmath.exp(1j * force.phase) / turning ** _ORDERS[force.base.motion]
    push = moved * (turning + omega) ** 2
    return abs(push), cmath.phase(push)


def _grown(matrix: csr_array, n: int) -> FloatArray:
    dense = np.zeros((n, n))
    dense[: matrix.shape[0], : matrix.shape[1]] = matrix.toarray()
    return dense
