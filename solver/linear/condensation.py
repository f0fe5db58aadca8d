"""The linear part as the compiled loops use it: modes, poles or matrices for each nodal diameter in play.

Harmonic k of a travelling wave of engine order i has the interblade phase k·i·2π/sectors, so one sector with
a Hermitian stiffness stands for the whole tuned annulus; any other structure is the case of one real
structure for every harmonic. What does not depend on contacts and forces is found once for a structure and
kept (`solver.linear.modal`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.system import DENSE
from solver.jit import eigen
from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.linear.assembly import linear_model
from solver.linear.contact_table import port_stiffnesses
from solver.linear.leading_ports import every_port, leading_ports
from solver.linear.modal import (
    Decomposition,
    HeldMatrices,
    decompose,
    held_alone,
    held_by,
    matrices_of,
    sizes_of,
)
from solver.linear.model import ForceTerm, LinearModel, LinearModelDerivative
from solver.matrices.normal_modes import hermitian, least_stiffness
from solver.scene.scene import Scene

HELD = 1e-7  # smallest squared pivot of the scaled K from which every part is held, without a closer look
BY_CONTACTS = 1e-6  # largest stiffness of a loose part, relative to the contacts' stiffness against it
CANCELLED_STIFFNESS = 1e-9  # and relative to the sum of what cancels in it: a file of ten digits leaves less
ROUNDING = 1e-12  # of the contacts' stiffness: what the modes themselves leave
_UNTOUCHED = 1e-14  # put on the scaled stiffness: what neither springs nor contacts hold is no contact's part


def loose_motions(K: NDArray[Any], L: NDArray[Any], kt: Real) -> Real:
    """Return the motions of the ports in the rigid-body motions that contacts alone hold.

    They are found by rank before anything is divided. The scales are those of the problem: of the contacts
    that hold the part, and of the part's own stiffness, of which rounding leaves a share where entries of K
    cancel. No absolute number decides.

    Parameters
    ----------
    K : (n, n) static stiffness without contacts [N/m].
    L : (nc, n) relative motion of each port.
    kt : (nc,) stiffness of each port [N/m].

    Returns
    -------
    (nr, nc) rows l_i with Σ_c l_i kt l_j = δ_ij; none where the structure holds every part.
    """
    nothing = np.zeros((0, kt.size))
    if K.shape[0] == 0 or kt.size == 0 or least_stiffness(K) > HELD:
        return nothing
    K, L = hermitian(K.real), L.real
    contact = L.T @ (kt[:, None] * L)
    diagonal = np.diag(K) + np.diag(contact)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    across = np.outer(scale, scale)
    held = across * (K + contact) + _UNTOUCHED * np.eye(scale.size)
    _, modes = eigen.pencil(across * K, held)
    modes = modes * scale[:, None]
    stiffness, against = ((modes * (matrix @ modes)).sum(axis=0) for matrix in (K, contact))
    cancelling = (np.abs(modes) * (np.abs(K) @ np.abs(modes))).sum(axis=0)
    size = np.sqrt(np.maximum(against, 0.0))
    rounding = np.maximum(CANCELLED_STIFFNESS * cancelling, ROUNDING * against)
    loose = np.abs(stiffness) <= np.minimum(BY_CONTACTS * against, rounding)
    loose &= against > 0.5 * (modes * ((contact + K) @ modes)).sum(axis=0)
    return np.ascontiguousarray((L @ modes[:, loose] / size[loose]).T)


CANCELLED = 1e-3  # a relative residual of 1e-11 of this share of what cancels in a motion is its rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class CondensedStructure:
    """The linear part in the form the loops take; see `solver.contacts.kernels.system.System` for the
    sizes. The loops do without the last two."""

    which: Integer
    shift: Real
    loose: Real
    leading: Integer
    span: Real
    least_size: float
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
    ddK: Complex
    L: Complex
    observe: Complex
    forces: Complex
    dforces: Complex
    shapes: Complex  # (ns, n, nm) the modes in the coordinates of the matrices
    sizes: Real  # (2, 3, ns, nm or n) of modes, or of coordinates, as in `solver.linear.modal.Decomposition`


def reduce_model(
    model: LinearModel,
    ks: Integer,
    kt: Real,
    derivative: LinearModelDerivative | None = None,
    *,
    whole_matrices: bool = False,
    each_port: bool = False,
    poles: bool = True,
) -> CondensedStructure:
    """Bring a linear model into the form of the compiled loops.

    Parameters
    ----------
    model : the matrices of one sector, or of the whole structure.
    ks : (nk,) harmonics kept.
    kt : (nc,) stiffness of every port of the contacts [N/m], used as the shift where contacts alone
        hold a part in place.
    derivative : by the structural parameter that is continued in; then the dense form is kept.
    whole_matrices : keep the dense form whatever the damping is.
    each_port : keep every port, even where all follow from fewer.
    poles : carry damping that couples the modes by poles where they serve.

    Raises
    ------
    numpy.linalg.LinAlgError
        The mass matrix is not positive definite.
    """
    no_modes = model.prescribed > 0 or model.line is not None
    dense_asked = whole_matrices or derivative is not None or no_modes
    apart = dense_asked or (model.extra is not None and not model.extra.is_real)
    forces = force_amplitudes(model, ks)
    which, diameters, moving, L, held = _structures(model, ks, apart=apart)
    shift, nothing = np.zeros(kt.size), np.zeros((0, kt.size))
    loose = _loose(model, held.K[which[0]], L[which[0]], kt) if 0 in ks else nothing
    if len(loose) or not (model.prescribed or held_alone(held)):
        # Also without a mean: of a light part A is 1/(m ω²) else, 1e9 times what its contacts let it move.
        shift, held = kt.copy(), held_by(held, L, kt)
    found = None if dense_asked else decompose(held, poles=poles)
    if found is None and not apart:
        which, diameters, moving, L, held = _structures(model, ks, apart=True)
        held = held_by(held, L, kt) if np.any(shift) else held
    modes: dict[str, Any]
    dense: dict[str, Any]
    if found is None:
        modes, least, seen = _no_modes(diameters.size, ks.size, kt.size), 0.0, (L, L.conj())
        dense = _dense(held, diameters, moving, L, model, forces, derivative)
        dense |= _of_harmonics(model, ks, which, diameters, moving, derivative)
        every = np.broadcast_to(np.eye(held.K.shape[1]), held.K.shape)
        modes["sizes"] = np.array([sizes_of(held, every)] * 2)
    else:
        modes, least = (
            _projected(found, L, model.observe, forces, which),
            _least_size(found, L, forces, which),
        )
        seen = modes["contact_modes"], modes["contact_duals"]
        dense = {name: np.zeros((0,) * axes, np.complex128) for name, axes in _DENSE_AXES.items()}
    ports = every_port(kt.size) if each_port else leading_ports(*seen)
    return CondensedStructure(
        which=which.astype(np.int64), shift=shift, loose=loose, least_size=least, **ports._asdict(), **modes,
        **dense,
    )  # fmt: skip


def _structures(
    model: LinearModel, ks: Integer, *, apart: bool
) -> tuple[Integer, Integer, Flags, Complex, HeldMatrices]:
    """Return the structure of each harmonic; of each the nodal diameter, whether it moves, L and matrices.

    There is one for each nodal diameter in play; the mean, which does not move, has its own where `apart`.
    """
    diameters, moving = model.diameters(ks), ks > 0
    still, which = ~moving & apart, np.arange(ks.size)
    if model.line is not None:  # each harmonic has an inertia of its own
        pass
    elif not still.any() and not diameters.any():
        which, diameters, moving = np.zeros(ks.size, np.int64), np.zeros(1, np.int64), np.ones(1, np.bool_)
    else:
        found, which = np.unique(np.where(still, -1, diameters), return_inverse=True)
        diameters, moving = np.maximum(found, 0), found >= 0
    return which, diameters, moving, model.ports_at(diameters), matrices_of(model, diameters, moving)


def _of_harmonics(
    model: LinearModel, ks: Integer, which: Integer, diameters: Integer, moving: Flags,
    derivative: LinearModelDerivative | None,
) -> dict[str, Complex]:  # fmt: skip
    """Return the inertia of each structure and the derivatives of the forces on each harmonic."""
    _, first = np.unique(which, return_index=True)
    still = 1.0 if model.line is not None else moving[:, None, None]
    given = ((), ()) if derivative is None else (derivative.forces, derivative.second_forces)
    return {
        "M": _contiguous(model.inertia(diameters, ks[first]) * still),
        "dforces": np.array([term_amplitudes(each, model.observe.size, ks) for each in given]),
    }


def _least_size(found: Decomposition, L: Complex, forces: Complex, which: Integer) -> float:
    """Return the size below which a motion of the contacts is rounding [m].

    A share of Σ |L| |x_m| |y_mᴴ| |f| / |λ_m|, the static motion of a contact if neither parts nor
    modes cancelled.
    """
    sizes = np.maximum(np.abs(found.eigenvalues), 1e-12 * np.abs(found.eigenvalues).max(initial=0.0))
    largest = 0.0
    for i in np.flatnonzero(forces.any(axis=1)):
        s = which[i]
        if not np.any(sizes[s]):
            continue
        driven = (np.abs(forces[i]) @ np.abs(found.left[s])) / np.where(sizes[s] > 0.0, sizes[s], np.inf)
        moved = np.abs(L[s]) @ (np.abs(found.right[s]) @ driven)
        largest = max(largest, float(moved.max(initial=0.0)))
    return CANCELLED * largest


def loose_ports(scene: Scene) -> tuple[Real, Real]:
    """Return the rigid-body motions at the ports of what contacts alone hold, and the ports' stiffnesses.

    See `solver.linear.condensation.loose_motions`; also where the balance has no means.
    """
    model = linear_model(scene)
    kt = port_stiffnesses(scene, model)
    static = matrices_of(model, np.zeros(1, np.int64), np.zeros(1, np.bool_))
    return _loose(model, static.K[0], model.contact_here + model.contact_next, kt), kt


def contacts_hold(model: LinearModel) -> bool:
    """Return whether the structure alone does not hold every part against the first harmonic's motion."""
    matrices = matrices_of(model, model.diameters(np.ones(1, np.int64)), np.ones(1, np.bool_))
    return not (model.prescribed or held_alone(matrices))


def _loose(model: LinearModel, K: NDArray[Any], L: NDArray[Any], kt: Real) -> Real:
    """Return the rigid-body motions at the ports: of all coordinates but those of a base."""
    if not model.prescribed:
        return loose_motions(K, L, kt)
    return loose_motions(K[model.free][:, model.free], L[:, model.free], kt)


def force_amplitudes(model: LinearModel, ks: Integer) -> Complex:
    """Return the complex force amplitudes f̂_k, (nk, n), of cos(hωt + phase) terms: amplitude·e^{i phase}."""
    return term_amplitudes(model.forces, model.observe.size, ks)


def term_amplitudes(forces: tuple[ForceTerm, ...], n: int, ks: Integer) -> Complex:
    """Return the same of force terms along vectors of n coordinates."""
    amplitudes = np.zeros((ks.size, n), dtype=np.complex128)
    for term in forces:
        rows = np.flatnonzero(ks == term.harmonic)
        turn = np.exp(1j * term.phase) if term.harmonic else 1.0
        amplitudes[rows] += term.amplitude * turn * term.vector
    return amplitudes


def _projected(
    found: Decomposition, L: Complex, observe: Real, forces: Complex, which: Integer
) -> dict[str, Any]:
    """Return what the loops need of the modes: their share at contacts, forces and the observed DOF."""
    contact_modes = L @ found.right
    contact_duals = L.conj() @ found.left
    observe_modes = observe @ found.right
    modal_forces = np.zeros((which.size, found.eigenvalues.shape[1]), np.complex128)
    for s in range(L.shape[0]):
        rows = np.flatnonzero(which == s)
        modal_forces[rows] = forces[rows] @ found.left[s]
    # Exact zeros only: a mode that no contact, and not both force and observer, can see adds nothing.
    touched = np.any(contact_modes != 0.0, axis=(0, 1)) | np.any(contact_duals != 0.0, axis=(0, 1))
    seen = touched | (np.any(observe_modes != 0.0, axis=0) & np.any(modal_forces != 0.0, axis=0))
    every = bool(seen.all())

    def kept(array: NDArray[Any]) -> Complex:
        return _contiguous(array if every else array[..., seen])

    return {
        "form": found.form,
        "eigenvalues": kept(found.eigenvalues),
        "dampings": np.ascontiguousarray(found.dampings[:, seen]),
        "contact_modes": kept(contact_modes),
        "contact_duals": kept(contact_duals),
        "observe_modes": kept(observe_modes),
        "modal_forces": kept(modal_forces),
        "shapes": kept(found.right),
        "sizes": found.sizes[..., seen],
    }


def _contiguous(array: Any) -> Complex:
    return np.ascontiguousarray(array, dtype=np.complex128)


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
        "shapes": np.zeros((n_structures, 0, 0), np.complex128),
    }


_DENSE_AXES = {
    "K": 3, "C": 3, "M": 3, "dK": 3, "dC": 3, "dM": 3, "ddK": 3, "L": 3, "observe": 1, "forces": 2,
    "dforces": 3,
}  # fmt: skip


def _dense(
    held: HeldMatrices,
    diameters: Integer,
    moving: Flags,
    L: Complex,
    model: LinearModel,
    forces: Complex,
    derivative: LinearModelDerivative | None,
) -> dict[str, Complex]:
    """Return the matrices and their derivatives by the structural parameter (zero if there is none).

    The loops compute the mean with k = 1: its structure has no C and no M.
    """
    dK = dC = dM = np.zeros(held.K.shape, np.complex128)
    ddK = np.zeros((0, 0, 0), np.complex128)
    if derivative is not None:
        dK, dC, dM = derivative.at(diameters, moving)
        if derivative.second_extra is not None:
            ddK = _contiguous(derivative.second_extra.at(model.turns(diameters), moving, lambda: dK)[0])
    moves = moving[:, None, None]
    return {
        "K": _contiguous(held.K), "C": _contiguous(moves * held.C),
        "dK": _contiguous(dK), "dC": _contiguous(moves * dC), "dM": _contiguous(moves * dM), "ddK": ddK,
        "L": _contiguous(L), "observe": _contiguous(model.observe), "forces": forces,
    }  # fmt: skip
