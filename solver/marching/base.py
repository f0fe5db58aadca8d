"""A base that moves as prescribed, as more coordinates of the time march.

Each excitation and each phase of its shares has a motion y of its own, that of a mass on a spring and a
dashpot, driven so that its steady motion is the one prescribed, y'' + 2ω y' + ω² y = f(t): what else it does
dies out within a few periods. Its acceleration drives the rest. The last coordinate adds up the observed
motion: it has the acceleration of what is observed, and begins at rest with it.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from solver.errors import SettingError
from solver.scene.excitation import Excitation
from solver.scene.scene import Scene

FloatArray = NDArray[np.float64]
Push = tuple[int, float, float, int]  # coordinate, amplitude, phase [rad] and harmonic of a force
_ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}


def with_base(
    scene: Scene, A: csr_array, B: csr_array, W: csr_array, index: dict[str, int], omega: float
) -> tuple[csr_array, csr_array, csr_array, int, list[Push]]:
    """Return x'' = W f - A x - B x' with the base and what is observed behind x, where the latter is, and f.

    Driven DOFs are pushed by what holds their accelerations a to those prescribed: with the rows S of x they
    are, x'' = P (W f - A x - B x') + Q a, Q = W Sᵀ (S W Sᵀ)⁻¹ and P = 1 - Q S.
    """
    n = A.shape[0]
    phases = [(e, phase) for e in scene.excitation if e.base for phase in _phases(e)]
    m = n + len(phases)
    A, B, W = (_grown(each, m) for each in (A, B, W))
    shares = np.zeros((n, len(phases)))
    pushes = []
    for i, (e, turn) in enumerate(phases):
        at = n + i
        A[at, at], B[at, at], W[at, at] = omega**2, 2.0 * omega, 1.0
        pushes.append((at, *_base_force(e, turn, omega), e.harmonic))
        for dof, share, phase in e.base.shares if e.base else ():
            shares[index[dof], i] += share * (phase == turn)
    ground = any(e.ground for e, _ in phases)
    moved = {index[dof] for e, _ in phases if e.base and not ground for dof, *_ in e.base.shares}
    driven = np.array(sorted(moved), np.int64)
    pulled, points = shares.copy(), np.array([index[point] for point in scene.points], np.int64)
    if points.size:  # no inertia pulls a point, but what its dashpot joins it to is accelerated
        heavy = np.setdiff1d(np.arange(n), points)
        pulled[points] = W[np.ix_(points, heavy)] @ np.linalg.solve(W[np.ix_(heavy, heavy)], shares[heavy])
    pushed = W[:n, driven] @ np.linalg.inv(W[np.ix_(driven, driven)])
    for matrix in (A, B, W):
        if ground:  # counted from the ground
            matrix[:n] -= pulled @ matrix[n:]
        else:
            matrix[:n] += pushed @ (shares[driven] @ matrix[n:] - matrix[driven])
    seen = [(index[dof], factor) for dof, factor in scene.seen(scene.observe.dof) or ()]
    if scene.observe.relative:
        total = 0.0 if ground else sum(factor for _, factor in seen)
        of_base = np.array([-total * (turn == 0.0) for _, turn in phases])
    else:
        of_base = ground * sum((factor * shares[at] for at, factor in seen), np.zeros(len(phases)))
    terms = [*seen, *zip(range(n, m), of_base.tolist(), strict=True)]
    return *with_sum(terms, csr_array(A), csr_array(B), csr_array(W)), pushes


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


def _phases(e: Excitation) -> list[float]:
    """The phases of its shares, first 0, of what a relative motion is counted from."""
    return list(dict.fromkeys((0.0, *(phase for *_, phase in (e.base.shares if e.base else ())))))


def _base_force(force: Excitation, turn: float, omega: float) -> tuple[float, float]:
    """Return amplitude and phase of what drives the base to the motion prescribed, at ω [rad/s]."""
    if force.base is None:
        raise SettingError("excitation", force.place, "must be a base that moves")
    turning = 1j * force.harmonic * omega
    moved = force.amplitude * cmath.exp(1j * (force.phase + turn)) / turning ** _ORDERS[force.base.motion]
    push = moved * (turning + omega) ** 2
    return abs(push), cmath.phase(push)


def _grown(matrix: csr_array, n: int) -> FloatArray:
    dense = np.zeros((n, n))
    dense[: matrix.shape[0], : matrix.shape[1]] = matrix.toarray()
    return dense
