"""The linear part as the compiled loops use it: modes, poles or matrices for each nodal diameter in play.

Harmonic k of a travelling wave of engine order i has the interblade phase k·i·2π/sectors, so one sector with
a Hermitian stiffness stands for the whole tuned annulus; any other structure is the case of one real
structure for every harmonic. What does not depend on contacts and forces is found once for a structure and
kept (`solver.linear.modal`).

Where few modes, coordinates or bodies move many contacts, the motions of some ports lead: those of a rigid
body's contacts follow from those of six of them, those of a structure with 40 modes from 40. With the rows of
`leading` ports, L = P L_leading, the receptance of all is A = P Â Pᵀ: an identity, no approximation (an
interpolative decomposition: Cheng, Gimbutas, Martinsson, Rokhlin, SIAM J. Sci. Comput. 26 (2005) 1389,
doi:10.1137/030602678).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.contacts.kernels.system import DENSE
from solver.jit import eigen
from solver.jit.fourier import Complex, Flags, Integer, Real
from solver.linear.assembly import linear_model
from solver.linear.modal import Decomposition, decompose, held_by, least_hold, sizes_of
from solver.linear.model import ForceTerm, HeldMatrices, LinearModel, LinearModelDerivative
from solver.matrices.normal_modes import hermitian, least_stiffness
from solver.scene.scene import Scene

HELD = 1e-7  # smallest squared pivot of the scaled K from which every part is held, without a closer look
SINGULAR = 1e-9  # the same from which they count as held in place, not by a hair
BY_CONTACTS = 1e-6  # largest stiffness of a loose part, relative to the contacts' stiffness against it
CANCELLED_STIFFNESS = 1e-9  # and relative to the sum of what cancels in it: a file of ten digits leaves less
ROUNDING = 1e-12  # of the contacts' stiffness: what the modes themselves leave
FEWEST_PORTS = 8  # below, nothing is gained (measured)
WORTHWHILE = 0.75  # of the ports: with more leading ones the larger matrices are not much dearer
_LED = 1e-13  # of a column as long as 1: what is left of one that follows from others
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
    derivative: LinearModelDerivative | None = None,
    *,
    whole_matrices: bool = False,
    each_port: bool = False,
    poles: bool = True,
) -> CondensedStructure:
    """Bring a linear model into the form of the compiled loops.

    Where contacts alone hold a part in place, the stiffnesses of their ports are taken as the shift.

    Parameters
    ----------
    model : the matrices of one sector, or of the whole structure.
    ks : (nk,) harmonics kept.
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
    kt, forces = model.port_stiffnesses, force_amplitudes(model, ks)
    which, diameters, moving, L, held = _structures(model, ks, apart=apart)
    shift, nothing = np.zeros(kt.size), np.zeros((0, kt.size))
    loose = _loose(model, held, L[0], kt) if ks[0] == 0 else nothing  # the mean has the first structure
    if len(loose) or not (model.prescribed or least_hold(held) > SINGULAR):
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
        modes = _projected(found, L, model.observe, forces, which)
        least = _least_size(found, L, forces, which)
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
    return which, diameters, moving, model.ports_at(diameters), model.matrices(diameters, moving)


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
    static = model.matrices(np.zeros(1, np.int64), np.zeros(1, np.bool_))
    kt = model.port_stiffnesses
    return _loose(model, static, model.contact_here + model.contact_next, kt), kt


def contacts_hold(model: LinearModel) -> bool:
    """Return whether the structure alone does not hold every part against the first harmonic's motion."""
    matrices = model.matrices(model.diameters(np.ones(1, np.int64)), np.ones(1, np.bool_))
    return not (model.prescribed or least_hold(matrices) > SINGULAR)


def _loose(model: LinearModel, held: HeldMatrices, L: NDArray[Any], kt: Real) -> Real:
    """Return the rigid-body motions at the ports: of all coordinates but those of a base."""
    if model.prescribed:
        return loose_motions(held.K[0][model.free][:, model.free], L[:, model.free], kt)
    if least_hold(held) > HELD:
        return np.zeros((0, kt.size))
    return loose_motions(held.K[0], L, kt)


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


class LeadingPorts(NamedTuple):
    """Which ports lead, and how the others follow.

    Attributes
    ----------
    leading : (r,) numbers of ports.
    span : (nc, r) the motion of every port as a sum of theirs; (nc, 0) if none follows from others.
    """

    leading: Integer
    span: Real


def every_port(count: int) -> LeadingPorts:
    """Return the answer that no port follows from others."""
    return LeadingPorts(np.arange(count, dtype=np.int64), np.zeros((count, 0)))


def leading_ports(motions: Complex, duals: Complex) -> LeadingPorts:
    """Return as few ports as all others follow from, or all if that saves little.

    Parameters
    ----------
    motions, duals : (ns, nc, N) rows of the ports in the modes or coordinates of each structure, to and from.
    """
    nc = motions.shape[1]
    if nc < FEWEST_PORTS:
        return every_port(nc)
    rows = _rows(motions, duals)
    if rows.shape[1] == 0:
        return every_port(nc)
    import scipy.linalg as sla  # for many contacts alone: a small response does not load SciPy's packages

    # Modes have sizes of their own: each counts as much as the others.
    sizes = np.linalg.norm(rows, axis=0)
    # One factor without exchanges first: of many modes the other would take ten times as long.
    square = np.linalg.qr((rows[:, sizes > 0.0] / sizes[sizes > 0.0]).T, mode="r")
    triangle, order = sla.qr(square, mode="r", pivoting=True)
    left = np.sqrt(np.cumsum(triangle[::-1] ** 2, axis=0)[::-1].max(axis=1))
    rank = int(np.count_nonzero(left > _LED * max(1.0, left[0])))
    if rank > WORTHWHILE * nc:
        return every_port(nc)
    span = np.zeros((nc, rank))
    span[order[:rank]] = np.eye(rank)
    span[order[rank:]] = sla.solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:]).T
    return LeadingPorts(order[:rank].astype(np.int64), np.ascontiguousarray(span))


def _rows(motions: Complex, duals: Complex) -> NDArray[np.float64]:
    """Return the real rows of all ports, without those that repeat others' columns."""
    parts = [motions] if np.array_equal(duals, motions.conj()) else [motions, duals]
    wide = np.concatenate([each for part in parts for each in part], axis=1)
    if not np.any(wide.imag):
        return np.ascontiguousarray(wide.real)
    return np.concatenate([wide.real, wide.imag], axis=1)
