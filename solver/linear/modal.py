"""Modes or poles of a structure, found once and kept.

They depend on the matrices and the interblade phases alone (`solver.linear.model.HeldMatrices`): changing
contacts, forces or the observed DOF costs no decomposition.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.system import MODES, POLES
from solver.jit import eigen
from solver.jit.fourier import Complex, Real
from solver.linear.model import HeldMatrices
from solver.matrices.normal_modes import UndampedModes, hermitian, least_stiffness, undamped_modes

CLASSICAL = 1e-11  # largest off-diagonal modal damping, relative to the diagonal, that counts as none
ROUNDING = 4.0  # the same in units of what the modes lack in orthogonality
SPAN_ERROR = 1e-11  # largest relative error of the pole form against the direct inverse
LEAST_POLE = 1e-25  # smallest |1/s| relative to the largest: below is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Decomposition:
    """Z⁻¹ = Σ right_m left_m / d_m, with d_m as `solver.linear.kernels.receptance` has it for the form."""

    form: int
    eigenvalues: Annotated[Complex, "Of every structure, (ns, nm)."]
    dampings: Annotated[Real, "Likewise, (ns, nm)."]
    right: Annotated[NDArray[Any], "Mass-normalised modes, or residues of the poles, (ns, n, nm)."]
    left: Annotated[NDArray[Any], "Their conjugates, or residues of the poles, (ns, n, nm)."]
    sizes: Annotated[Real, "Of what stands left and right, by K, C and M, as `sizes_of`, (2, 3, ns, nm)."]


@lru_cache(maxsize=32)
def least_hold(held: HeldMatrices) -> float:
    """Return by how much the stiffness of the first structure holds every part: `least_stiffness`, or 1."""
    return least_stiffness(held.K[0]) if held.K.shape[1] else 1.0


def held_by(held: HeldMatrices, L: Complex, kt: Real) -> HeldMatrices:
    """Return the matrices with the stiffness of the contacts in them."""
    extra: NDArray[Any] = (L.conj() * kt[:, None]).transpose(0, 2, 1) @ L
    if not np.iscomplexobj(held.K) and not np.any(extra.imag):
        extra = extra.real
    return HeldMatrices(held.K + extra, held.C, held.M, (held.key, L.tobytes(), kt.tobytes()))


def sizes_of(held: HeldMatrices, shapes: NDArray[Any]) -> Real:
    """Return Σ_i max_j |X_ij| |x_i|² of shapes x (ns, n, m) for X = K, C and M, (3, ns, m).

    The entries of the matrices are rounded, and sums of them are. With w² = the first + kω times the second +
    (kω)² times the third, |x| Z_k |y| is known to w_x w_y units of rounding, whatever cancels in it.
    """
    each: list[NDArray[Any]] = [np.abs(X).max(axis=2, initial=0.0) for X in (held.K, held.C, held.M)]
    squares = np.abs(shapes) ** 2
    return np.array([np.einsum("si,sim->sm", rows, squares) for rows in each])


def _flexible(undamped: UndampedModes, shapes: NDArray[Any], K: NDArray[Any], M: NDArray[Any]) -> Real:
    """Return what rounding of the flexibility adds to the third of the sizes of shapes (n, m), (m,).

    Modes are found to the rounding of the largest flexibility.
    """
    energies = (shapes.conj() * ((K + undamped.sigma * M) @ shapes)).sum(axis=0).real
    return undamped.flexibility.max(initial=0.0) * energies  # type: ignore[no-any-return]


@lru_cache(maxsize=32)
def decompose(held: HeldMatrices, *, poles: bool = True) -> Decomposition | None:
    """Return modes if the damping is classical, else `poles`; None if neither gives Z⁻¹ to rounding.

    None also of points without inertia: their matrices are kept.
    """
    if not np.all(np.any(held.M, axis=2)):  # points without inertia
        return None
    stiffness = list(held.K)
    even = [hermitian(K) for K in stiffness]
    undamped = [undamped_modes(K, M) for K, M in zip(even, held.M, strict=True)]
    skew = [
        None if part is K else u.psi.conj().T @ (K - part) @ u.psi
        for u, part, K in zip(undamped, even, stiffness, strict=True)
    ]
    damping = [u.psi.conj().T @ C @ u.psi for u, C in zip(undamped, held.C, strict=True)]
    rounding = [_rounding(u, K, M) for u, K, M in zip(undamped, even, held.M, strict=True)]
    if all(part is None for part in skew) and all(
        _classical(D, each) for D, each in zip(damping, rounding, strict=True)
    ):
        phi = np.array([u.phi for u in undamped])
        sizes = sizes_of(held, phi)
        sizes[2] += [u.flexibility.max(initial=0.0) / u.flexibility for u in undamped]
        return Decomposition(
            form=MODES,
            eigenvalues=np.array([u.omega2 for u in undamped], dtype=np.complex128),
            dampings=np.array(
                [np.diag(D).real / u.flexibility for u, D in zip(undamped, damping, strict=True)]
            ),
            right=phi,
            left=phi.conj(),
            sizes=np.array([sizes, sizes]),
        )
    if not poles:
        return None
    tried = [
        _poles(u, D, E) if u.sigma == 0.0 else _plain_poles(K, C, M)
        for u, D, E, K, C, M in zip(undamped, damping, skew, held.K, held.C, held.M, strict=True)
    ]
    found = [each for each in tried if each is not None]
    if len(found) < len(tried):
        return None
    values, right, left = (np.array([each[i] for each in found]) for i in range(3))
    sizes = np.array([sizes_of(held, left), sizes_of(held, right)])
    for s, (u, K, M) in enumerate(zip(undamped, even, held.M, strict=True)):
        sizes[0, 2, s] += _flexible(u, left[s].conj(), K, M)
        sizes[1, 2, s] += _flexible(u, right[s], K, M)
    return Decomposition(
        form=POLES, eigenvalues=values.astype(np.complex128), dampings=np.zeros(values.shape), right=right,
        left=left, sizes=sizes,
    )  # fmt: skip


def _rounding(undamped: UndampedModes, K: NDArray[Any], M: NDArray[Any]) -> float:
    """Return how far from orthogonal by K the modes are: of a fine mesh, more than the last digits."""
    gram = undamped.psi.conj().T @ (K + undamped.sigma * M if undamped.sigma else K) @ undamped.psi
    return _off_diagonal(gram)


def _classical(damping: NDArray[Any], rounding: float) -> bool:
    """Return whether modal damping is diagonal, as far as the modes themselves are orthogonal."""
    largest = np.abs(np.diag(damping)).max(initial=0.0)
    return bool(_off_diagonal(damping) <= max(CLASSICAL, ROUNDING * rounding) * largest)


def _off_diagonal(matrix: NDArray[Any]) -> float:
    return float(np.abs(matrix - np.diag(np.diag(matrix))).max(initial=0.0))


def _poles(
    undamped: UndampedModes, D: NDArray[Any], E: NDArray[Any] | None = None
) -> tuple[Complex, Complex, Complex] | None:
    """Return poles s_m, residues (x_m, y_mᴴ) with Z⁻¹(s) = Σ x_m y_mᴴ / (s − s_m); None if not to rounding.

    In the modes ψ with ψᴴ K ψ = 1 the motion z = (Ω p, p') has the inverse state matrix
    [[−D, −Ω⁻¹], [Ω⁻¹, 0]] with eigenvalues 1/s, in which the slow poles are the large and accurate ones. E
    is what K has there beside 1, where it is not Hermitian: D and the upper Ω⁻¹ are (1 + E)⁻¹ times so much.
    """
    n = undamped.flexibility.size
    slow = np.diag(np.sqrt(undamped.flexibility))
    regular = np.eye(n) if E is None else np.linalg.inv(np.eye(n) + E)
    first = (D, slow) if E is None else (regular @ D, regular @ slow)
    state = np.block([[-first[0], -first[1]], [slow, np.zeros((n, n))]])
    values, w, v = eigen.two_sided(state)
    norm = np.einsum("nm,nm->m", w.conj(), v)
    if not np.all(np.abs(norm) > 0.0):
        return None
    size = np.abs(values).max()
    values = np.where(np.abs(values) < LEAST_POLE * size, LEAST_POLE * size, values)
    x, yh = v[:n], w[:n].conj() * (-1.0 / (values * norm))
    if E is not None:
        yh = regular.T @ yh
    fast = 1.0 / np.sqrt(undamped.flexibility)
    for s in 1j * np.array([0.01 * fast[-1], 0.3 * fast[-1], 1.7 * fast[-1], 0.7 * fast[0], 3.1 * fast[0]]):
        still = np.eye(n) if E is None else np.eye(n) + E
        direct = np.linalg.inv(still + s * D + np.diag(s * s * undamped.flexibility))
        summed = (x / (s - 1.0 / values)) @ yh.T
        if np.abs(summed - direct).max() > SPAN_ERROR * np.abs(direct).max():
            return None
    return 1.0 / values, undamped.psi @ x, undamped.psi.conj() @ yh


def _plain_poles(
    K: NDArray[Any], C: NDArray[Any], M: NDArray[Any]
) -> tuple[Complex, Complex, Complex] | None:
    """Return the same as `_poles` where K is singular.

    Z⁻¹(s) = Σ x_m y_mᴴ / (y_mᴴ (C + 2 s_m M) x_m (s − s_m)) for simple poles: Tisseur, Meerbergen, SIAM Rev.
    43 (2001) 235, doi:10.1137/S0036144500381988.
    """
    n = K.shape[0]
    inverse = np.linalg.inv(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
    values, y, x = eigen.two_sided(state)
    # Left eigenvectors of the first-order form carry those of the quadratic one in their lower half.
    x, y = x[:n], inverse.conj().T @ y[n:]
    norm = np.einsum("nm,nm->m", y.conj(), C @ x + 2.0 * (M @ x) * values)
    if not np.all(np.abs(norm) > 0.0):
        return None
    yh = (y / norm.conj()).conj()
    scale = np.sqrt(np.abs(np.linalg.eigvalsh(hermitian(K))).max() / np.abs(np.linalg.eigvalsh(M)).max())
    for s in (0.3j * scale, 1.7j * scale, 0.01j * scale):
        direct = np.linalg.inv(K + s * C + s * s * M)
        summed = (x / (s - values)) @ yh.T
        if np.abs(summed - direct).max() > SPAN_ERROR * np.abs(direct).max():
            return None
    return values, x, yh
