"""The linear part as the compiled loops use it: modes, poles or matrices for each nodal diameter in play.

Harmonic k of a travelling wave of engine order i has the interblade phase k·i·2π/sectors, so one sector with
a Hermitian stiffness stands for the whole tuned annulus; a lumped structure is the case of one real structure
for every harmonic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg

from solver.fourier import Complex, Integer, Real
from solver.kernels.system import DENSE, MODES, POLES
from solver.parametric import LinearModel, LinearModelDerivative

CLASSICAL = 1e-11  # largest off-diagonal modal damping, relative to the diagonal, that counts as none
SPAN_ERROR = 1e-11  # largest relative error of the pole form against the direct inverse
SINGULAR = 1e-11  # smallest eigenvalue of K, relative to the largest, that counts as held in place


@dataclass(frozen=True, slots=True, kw_only=True)
class Reduced:
    """The linear part in the form the loops take; see `solver.kernels.system.System` for the shapes."""

    which: Integer
    shift: Real
    form: int
    eigenvalues: Complex
    dampings: Real
    contact_modes: Complex
    contact_duals: Complex
    observe_modes: Complex
    modal_forces: Complex
    K: Complex
    C: Complex
    M: Complex
    dK: Complex
    dC: Complex
    dM: Complex
    L: Complex
    observe: Complex
    forces: Complex


@dataclass(frozen=True, slots=True, kw_only=True)
class _Matrices:
    """The matrices of each nodal diameter: (ns, n, n) each, L (ns, nc, n)."""

    K: Complex
    C: Complex
    M: Complex
    L: Complex


def reduce_model(
    model: LinearModel,
    ks: Integer,
    kt: Real,
    derivative: LinearModelDerivative | None = None,
) -> Reduced:
    """Bring a linear model into the form of the compiled loops.

    Parameters
    ----------
    model : the matrices of one sector, or of the whole lumped structure.
    ks : (nk,) harmonics kept.
    kt : (nc,) contact stiffnesses [N/m], used as the shift where contacts alone hold a part in place.
    derivative : by the structural parameter that is continued in; then the dense form is kept.

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass matrix is not positive definite.
    """
    diameters, which = np.unique((ks * model.engine_order) % model.sectors, return_inverse=True)
    theta = 2.0 * np.pi * diameters / model.sectors
    forces = force_amplitudes(model, ks)
    held = _matrices(model, theta)
    shift = _shift(held, kt) if 0 in ks else np.zeros(kt.size)
    shifted = _Matrices(
        K=held.K + np.einsum("sci,c,scj->sij", held.L.conj(), shift, held.L), C=held.C, M=held.M, L=held.L
    )
    dense: dict[str, Any] = _dense(shifted, theta, model, forces, derivative)
    modes: dict[str, Any] | None = (
        None if derivative is not None else _modes(shifted, forces, which, model.observe)
    )
    if modes is None and derivative is None:
        modes = _poles(shifted, forces, which, model.observe)
    if modes is not None:
        dense = {name: np.zeros((0,) * value.ndim, np.complex128) for name, value in dense.items()}
    else:
        modes = _no_modes(theta.size, ks.size, kt.size)
    return Reduced(which=which.astype(np.int64), shift=shift, **modes, **dense)


def force_amplitudes(model: LinearModel, ks: Integer) -> Complex:
    """Return the complex force amplitudes f̂_k, (nk, n), of cos(hωt + phase) terms: amplitude·e^{i phase}."""
    amplitudes = np.zeros((ks.size, len(model.dofs)), dtype=np.complex128)
    for term in model.forces:
        rows = np.flatnonzero(ks == term.harmonic)
        turn = np.exp(1j * term.phase) if term.harmonic else 1.0
        amplitudes[rows] += term.amplitude * turn * term.vector
    return amplitudes


def _matrices(model: LinearModel, theta: Real) -> _Matrices:
    """Return the matrices at each interblade phase."""
    turn = np.exp(1j * theta)[:, None, None]

    def at(zero: Real, plus: Real) -> Complex:
        matrices: Complex = zero + plus * turn + plus.T * turn.conj()
        return matrices

    return _Matrices(
        K=at(model.K0, model.Kp),
        C=at(model.C0, model.Cp),
        M=np.ascontiguousarray(np.broadcast_to(model.M, (theta.size, *model.M.shape)), dtype=np.complex128),
        L=model.contact_here + model.contact_next * turn,
    )


def _shift(held: _Matrices, kt: Real) -> Real:
    """Return kt where the static stiffness alone does not hold every part in place, else 0."""
    values = np.linalg.eigvalsh(held.K[0])
    loose = values.size > 0 and values[0] <= SINGULAR * max(values[-1], 0.0)
    return kt.copy() if loose else np.zeros(kt.size)


def _modes(held: _Matrices, forces: Complex, which: Integer, observe: Real) -> dict[str, Any] | None:
    """Return the undamped modes of every structure, or None if the damping is not classical."""
    eigenvalues, dampings, vectors = [], [], []
    for K, C, M in zip(held.K, held.C, held.M, strict=True):
        values, phi = linalg.eigh(K, M)
        damping = phi.conj().T @ C @ phi
        diagonal = np.diag(damping).real
        if np.abs(damping - np.diag(diagonal)).max(initial=0.0) > CLASSICAL * np.abs(diagonal).max(
            initial=0.0
        ):
            return None
        eigenvalues.append(values.astype(np.complex128))
        dampings.append(diagonal)
        vectors.append(phi)
    phi = np.array(vectors)
    return {
        "form": MODES,
        "eigenvalues": np.array(eigenvalues),
        "dampings": np.array(dampings),
        "contact_modes": np.ascontiguousarray(held.L @ phi),
        "contact_duals": np.ascontiguousarray((held.L @ phi).conj()),
        "observe_modes": np.ascontiguousarray(observe @ phi),
        "modal_forces": np.ascontiguousarray(np.einsum("knm,kn->km", phi[which].conj(), forces)),
    }


def _poles(held: _Matrices, forces: Complex, which: Integer, observe: Real) -> dict[str, Any] | None:
    """Return poles and residues of every structure, or None if they do not give Z⁻¹ to rounding.

    Z⁻¹(s) = Σ x_m y_mᴴ / (y_mᴴ (C + 2 s_m M) x_m (s − s_m)) for simple poles: Tisseur, Meerbergen, SIAM Rev.
    43 (2001) 235, doi:10.1137/S0036144500381988.
    """
    n = held.K.shape[1]
    poles, right, left = [], [], []
    for K, C, M in zip(held.K, held.C, held.M, strict=True):
        inverse = np.linalg.inv(M)
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -inverse @ C]])
        values, y, x = linalg.eig(state, left=True, right=True)
        # Left eigenvectors of the first-order form carry those of the quadratic one in their lower half.
        x, y = x[:n], inverse.conj().T @ y[n:]
        norm = np.einsum("nm,nm->m", y.conj(), C @ x + 2.0 * (M @ x) * values)
        if not np.all(np.abs(norm) > 0.0):
            return None
        y = y / norm.conj()
        scale = np.sqrt(np.abs(np.linalg.eigvalsh(K)).max() / np.abs(np.linalg.eigvalsh(M)).max())
        for s in (0.3j * scale, 1.7j * scale, 0.01j * scale):
            direct = np.linalg.inv(K + s * C + s * s * M)
            summed = (x / (s - values)) @ y.conj().T
            if np.abs(summed - direct).max() > SPAN_ERROR * np.abs(direct).max():
                return None
        poles.append(values)
        right.append(x)
        left.append(y)
    x, yh = np.array(right), np.array(left).conj()
    return {
        "form": POLES,
        "eigenvalues": np.array(poles, dtype=np.complex128),
        "dampings": np.zeros(np.array(poles).shape),
        "contact_modes": np.ascontiguousarray(held.L @ x),
        "contact_duals": np.ascontiguousarray(held.L.conj() @ yh),
        "observe_modes": np.ascontiguousarray(observe @ x),
        "modal_forces": np.ascontiguousarray(np.einsum("knm,kn->km", yh[which], forces)),
    }


def _no_modes(n_structures: int, n_harmonics: int, n_contacts: int) -> dict[str, Any]:
    """Return empty modes for the dense form."""
    return {
        "form": DENSE,
        "eigenvalues": np.zeros((n_structures, 0), np.complex128),
        "dampings": np.zeros((n_structures, 0)),
        "contact_modes": np.zeros((n_structures, n_contacts, 0), np.complex128),
        "contact_duals": np.zeros((n_structures, n_contacts, 0), np.complex128),
        "observe_modes": np.zeros((n_structures, 0), np.complex128),
        "modal_forces": np.zeros((n_harmonics, 0), np.complex128),
    }


def _dense(
    held: _Matrices,
    theta: Real,
    model: LinearModel,
    forces: Complex,
    derivative: LinearModelDerivative | None,
) -> dict[str, Complex]:
    """Return the matrices and their derivatives by the structural parameter (zero if there is none)."""
    turn = np.exp(1j * theta)[:, None, None]
    dK, dC, dM = np.zeros_like(held.K), np.zeros_like(held.K), np.zeros_like(held.K)
    if derivative is not None:
        dK = dK + derivative.dK0 + derivative.dKp * turn + derivative.dKp.T * turn.conj()
        dC = dC + derivative.dC0 + derivative.dCp * turn + derivative.dCp.T * turn.conj()
        dM = dM + derivative.dM
    return {
        "K": held.K, "C": held.C, "M": held.M, "dK": dK, "dC": dC, "dM": dM,
        "L": np.ascontiguousarray(held.L), "observe": model.observe.astype(np.complex128), "forces": forces,
    }  # fmt: skip
