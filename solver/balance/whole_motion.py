"""The whole linear part at one frequency, in modes or as matrices, with its derivatives by ω and structure.

Of the motion x = Z⁻¹ φ of every kept harmonic, φ = f − Lᴴ F the forces. In modes Z⁻¹ = R D⁻¹ Sᵀ, D diagonal
and alone dependent on ω: the same formulas hold with D for Z and Rᵀ, Sᵀ taken into L, Lᴴ, f and the observed
DOF, so one class serves both. Only a structural parameter needs the matrices themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from solver.balance.parameter_derivatives import HarmonicMatrices
from solver.contacts.kernels.system import DENSE, MODES, System
from solver.jit.fourier import Complex, Real
from solver.linear.model import dynamic_stiffness


@dataclass(frozen=True, slots=True, kw_only=True)
class WholeMotion:
    """Z and what stands around it for each of nk harmonics; N modes or coordinates.

    A matrix is kept as its diagonal (nk, N) in modes, else whole (nk, N, N).
    """

    inverse: Annotated[Complex, "Z⁻¹."]
    by_omega: Annotated[Complex, "∂Z/∂ω."]
    by_omega_twice: Annotated[Complex, "∂²Z/∂ω²."]
    by_structure: Annotated[
        dict[int, tuple[Complex, Complex]],
        "(∂Z/∂q, ∂²Z/∂q∂ω) of each structural path by its number; ∂²Z/∂q² = 0.",
    ]
    contact: Annotated[Complex, "(nk, nc, N) u = L x."]
    back: Annotated[Complex, "(nk, nc, N) the rows of (Lᴴ)ᵀ."]
    observe: Annotated[Complex, "(nk, N)."]
    forces: Annotated[Complex, "(nk, N)."]
    forces_by: Annotated[dict[int, Complex], "∂f/∂q, (nk, N), of those that change them."] = field(
        default_factory=dict
    )
    motions_by: Annotated[dict[int, Complex], "∂L/∂q, (nk, nc, N), likewise."] = field(default_factory=dict)

    def push(self, i: int, x: Complex, forces: Complex) -> Complex:
        """Return what path i pushes at the motion x: ∂f/∂q − (∂L/∂q)ᴴ F − (∂Z/∂q) x, (nk, N).

        `forces` (nc, nk) are those of the contacts less the stiffness that was moved into Z.
        """
        total = -times(self.by_structure[i][0], x)
        if i in self.forces_by:
            total = total + self.forces_by[i]
        if i in self.motions_by:
            total = total - np.einsum("kcn,ck->kn", self.motions_by[i].conj(), forces)
        return np.asarray(total)

    def moved(self, i: int, x: Complex) -> Complex | None:
        """Return (∂L/∂q) x, (nc, nk), where path i moves the contacts."""
        return np.asarray(np.einsum("kcn,kn->ck", self.motions_by[i], x)) if i in self.motions_by else None

    def solve(self, phi: Complex) -> Complex:
        """Return Z⁻¹ φ, (..., nk, N)."""
        return times(self.inverse, phi)

    def solve_transposed(self, eta: Complex) -> Complex:
        """Return Z⁻ᵀ η, (..., nk, N)."""
        return times_transposed(self.inverse, eta)

    def pushed(self, forces: Complex) -> Complex:
        """Return Lᴴ F, (..., nk, N), of amplitudes (..., nc, nk)."""
        return np.asarray(np.einsum("kcn,...ck->...kn", self.back, forces))

    def relative(self, x: Complex) -> Complex:
        """Return the relative motions L x, (..., nc, nk)."""
        return np.asarray(np.einsum("kcn,...kn->...ck", self.contact, x))

    def seen(self, turn: Complex, pulls: Complex) -> Complex:
        """Return the weights η = turn·observe − Lᵀ pull, (nk, N), of turns (nk,) and pulls (nc, nk)."""
        return np.asarray(turn[:, None] * self.observe - np.einsum("kcn,ck->kn", self.contact, pulls))


def times(matrix: Complex, x: Complex) -> Complex:
    """Return matrix @ x for each harmonic, of a diagonal or whole matrix and x (..., nk, N)."""
    if matrix.ndim == 2:
        return np.asarray(matrix * x)
    return np.asarray(np.einsum("kab,...kb->...ka", matrix, x))


def times_transposed(matrix: Complex, x: Complex) -> Complex:
    """Return matrixᵀ @ x for each harmonic, as `times`."""
    if matrix.ndim == 2:
        return np.asarray(matrix * x)
    return np.asarray(np.einsum("kab,...ka->...kb", matrix, x))


def whole_motion(
    system: System, matrices: HarmonicMatrices | None, dampings: dict[int, Complex], omega: float
) -> WholeMotion:
    """Return the linear part at ω [rad/s].

    Parameters
    ----------
    system : of a frequency response.
    matrices : where a path needs them; else the modes of `system` serve, or its matrices if it has none.
    dampings : ∂C/∂q in the modes, (nk, nm), of each path that is a proportional damping, by its number.

    Raises
    ------
    numpy.linalg.LinAlgError
        Z is singular.
    """
    ks = system.ks.astype(np.float64)
    levels = system.level[np.where((system.ks == 0) & bool(system.constant_mean), 1, 0)]
    given = (levels @ omega ** np.arange(3))[:, None]  # 1 but along an engine-order line
    measured = ((system.only < 0) | (system.ks == system.only))[:, None]
    if matrices is None and system.form == DENSE:
        which = system.which
        matrices = HarmonicMatrices(
            K=system.K[which], C=system.C[which], M=system.M[which], L=system.L[which],
            observe=system.observe, forces=system.forces, by={},
        )  # fmt: skip
    if matrices is not None:
        # The mean has k = 1 and matrices without C and M, as in the compiled loops.
        found = _of_matrices(matrices, np.maximum(ks, 1.0)[:, None, None], omega)
        turned = {i: given * forces for i, forces in found.forces_by.items()}
        observe = measured * found.observe
        return replace(found, forces=given * found.forces, forces_by=turned, observe=observe)
    values, which, k = system.eigenvalues[system.which], system.which, ks[:, None]
    alike = np.ones_like(values.real)
    modes = system.form == MODES
    K, C, M = (values.real, system.dampings[which], alike) if modes else (-values, alike, 0.0 * alike)
    d, slope, bend = dynamic_stiffness(K, C, M, k, omega)
    by = {i: dynamic_stiffness(0.0, dC, 0.0, k, omega)[:2] for i, dC in dampings.items()}
    if np.any(d == 0.0):
        raise np.linalg.LinAlgError("Z is singular")
    return WholeMotion(
        inverse=np.asarray(1.0 / d, np.complex128), by_omega=slope, by_omega_twice=bend, by_structure=by,
        contact=system.contact_modes[which], back=system.contact_duals[which],
        observe=measured * system.observe_modes[which], forces=given * system.modal_forces,
    )  # fmt: skip


def _of_matrices(matrices: HarmonicMatrices, k: Real, omega: float) -> WholeMotion:
    """Return the linear part of matrices; `k` (nk, 1, 1)."""
    Z, by_omega, by_omega_twice = dynamic_stiffness(matrices.K, matrices.C, matrices.M, k, omega)
    return WholeMotion(
        inverse=np.asarray(np.linalg.inv(Z), np.complex128), by_omega=by_omega, by_omega_twice=by_omega_twice,
        by_structure={i: dynamic_stiffness(*each, k, omega)[:2] for i, each in matrices.by.items()},
        contact=matrices.L, back=matrices.L.conj(),
        observe=np.broadcast_to(matrices.observe, matrices.forces.shape), forces=matrices.forces,
        forces_by=matrices.forces_by, motions_by=matrices.motions_by,
    )  # fmt: skip
