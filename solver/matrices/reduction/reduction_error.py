"""What a reduced model is good for: the errors of its frequencies, the mass its modes carry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.linalg import LinearOperator, cg

from solver.matrices.diagnostics import rigid_body_modes
from solver.matrices.reduction.fixed_interface_modes import Interior

FloatArray = NDArray[np.float64]
Array = NDArray[Any]  # real, or complex where the matrices are Hermitian
GOOD = 1e-3  # relative error of a frequency that is still called good


@dataclass(frozen=True, slots=True, kw_only=True)
class Quality:
    """What was kept and what it is worth."""

    held_hz: Annotated[FloatArray, "Frequencies of the modes kept, the DOFs in use held [Hz], (m,)."]
    effective_mass: Annotated[
        FloatArray,
        "Share of the inertia of the rest, when one DOF in use is moved, that each mode carries, (m, "
        "n_kept); (m, 0) where it was not asked for.",
    ]
    system_hz: Annotated[FloatArray, "Frequencies of the reduced model without contacts [Hz], (n,)."]
    system_error: Annotated[
        FloatArray, "Estimated relative error of each, (n,); infinite above the modes kept."
    ]
    good_to_hz: Annotated[float, "Frequency up to which every error is below `GOOD` [Hz]."]
    static_residual: Annotated[
        float, "Forces left over by the static solutions, relative: how exact the static stiffness is."
    ]
    rigid_body_modes: Annotated[int, "Of the reduced model."]
    shift_hz: Annotated[float, "sqrt(−σ) / 2π of the shift that a free rest needed, else 0 [Hz]."]

    @property
    def mass_carried(self) -> FloatArray:
        """Share of the inertia of the rest that all modes carry, for each DOF in use."""
        return np.asarray(self.effective_mass.sum(axis=0))


def measured(
    held: Interior, values: FloatArray, modes: Array, matrices: dict[str, Array], *, weigh: bool = True
) -> Quality:
    """Measure a reduction.

    A mode (λ, y) of the reduced model, ψ = T y in the full one, leaves the forces r = K ψ − λ M ψ on the
    rest, which the modes left out would balance: its λ is too high by rᴴ (K − λ M)⁻¹ r, and (K − λ M)⁻¹ is
    at most K⁻¹ / (1 − λ / ω_m²) for what is orthogonal to the modes kept, ω_m the highest of them.
    """
    lambdas, shapes = _modes(matrices)
    rigid = rigid_body_modes(lambdas)
    errors = _errors(held, values, modes, lambdas, shapes)
    errors[:rigid] = 0.0
    hertz = np.sqrt(np.maximum(lambdas, 0.0)) / (2.0 * math.pi)
    bad = np.flatnonzero(errors > GOOD)
    last = int(bad[0]) - 1 if bad.size else errors.size - 1
    return Quality(
        held_hz=np.sqrt(np.maximum(values, 0.0)) / (2.0 * math.pi),
        effective_mass=_effective_mass(held, modes) if weigh else np.zeros((modes.shape[1], 0)),
        system_hz=hertz,
        system_error=errors,
        good_to_hz=float(hertz[last]) if last >= 0 else 0.0,
        static_residual=held.residual,
        rigid_body_modes=rigid,
        shift_hz=math.sqrt(-held.shift) / (2.0 * math.pi),
    )


def _modes(matrices: dict[str, Array]) -> tuple[FloatArray, Array]:
    """λ, ascending, and mass-normalised shapes of the reduced model."""
    try:
        lambdas, shapes = linalg.eigh(matrices["K"], matrices["M"])
    except np.linalg.LinAlgError as error:
        least = float(linalg.eigvalsh(matrices["M"])[0])
        raise ValueError(
            f"`M` must be positive definite on the motions kept, got {least:g}: a DOF named has no mass"
        ) from error
    return np.asarray(lambdas), np.asarray(shapes)


def _errors(
    held: Interior, values: FloatArray, modes: Array, lambdas: FloatArray, shapes: Array
) -> FloatArray:
    kept = held.follow.shape[1]
    errors = np.full(lambdas.size, math.inf)
    if not held.K.shape[0] or values.size == held.K.shape[0]:
        return np.zeros(lambdas.size)
    if not values.size:
        return errors
    low = np.flatnonzero((lambdas > 0.0) & (lambdas < values[-1]))
    top = shapes[:kept, low]
    inside = held.follow @ top + modes @ shapes[kept:, low]
    forces = held.K @ inside + held.couplings["K"] @ top
    forces -= lambdas[low] * (held.M @ inside + held.couplings["M"] @ top)
    # Rounding leaves a share of the modes kept, which the inverse would enlarge where one is near zero.
    forces -= held.M @ (modes @ (modes.conj().T @ forces))
    raised = np.einsum("ij,ij->j", forces.conj(), held.solve(forces)).real / (1.0 - lambdas[low] / values[-1])
    errors[low] = np.abs(raised) / (2.0 * lambdas[low])
    errors[lambdas <= 0.0] = 0.0
    return errors


def _effective_mass(held: Interior, modes: Array) -> FloatArray:
    pushed = held.M @ held.follow + held.couplings["M"]
    carried = np.abs(modes.conj().T @ pushed) ** 2
    diagonal = held.M.diagonal().real
    scale = np.where(diagonal > 0.0, diagonal, 1.0)
    scaled = LinearOperator(held.M.shape, matvec=lambda x: x.ravel() / scale, dtype=held.M.dtype)
    totals = np.empty(pushed.shape[1])
    for column, force in enumerate(pushed.T):
        moved, _ = cg(held.M, force, M=scaled, rtol=1e-8, maxiter=2000)
        totals[column] = float(np.vdot(force, moved).real)
    return np.asarray(carried / np.where(totals > 0.0, totals, 1.0))
