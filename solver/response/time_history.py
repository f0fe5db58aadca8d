"""What moves behind a solution: every degree of freedom, time histories, the loop of force over slip.

A solution keeps the contacts and the observed DOF; the rest of the structure follows from the contact forces,
Z_k x̂_k = f̂_k − Lᴴ F̂_k for each harmonic k.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from solver.balance.balance import contact_index
from solver.errors import check_count
from solver.jit import fourier
from solver.jit.fourier import Complex, Real
from solver.linear.assembly import linear_model, row_of
from solver.linear.condensation import contacts_hold, force_amplitudes
from solver.linear.model import LinearModel, dynamic_stiffness
from solver.response.solution import Solution, check_converged
from solver.results.told import Piece

LARGEST_SAMPLES = 10_000_000


def motion(solution: Solution) -> Real:
    """Return the coefficients of every DOF [m], (n_dofs, 2H + 1), of one sector if the structure is cyclic.

    Raises
    ------
    SettingError
        The solution did not converge.
    """
    return fourier.to_real(linear_model(solution.scene).shapes @ all_coordinates(solution).T)


def time_history(solution: Solution, dof: str, *, samples: int = 512) -> tuple[Real, Real]:
    """Return instants [s] and motion [m] of a DOF over one period, (samples,) each, evenly spaced from 0.

    Of a recovered quantity of the scene it is that, in its unit.

    Raises
    ------
    SettingError
        The solution did not converge, an unknown DOF, or a bad number of samples.
    """
    row = row_of(solution.scene, dof)
    tau = _angles(samples)
    x = fourier.basis(tau, solution.highest_harmonic) @ (row @ motion(solution))
    return tau / (2.0 * math.pi * solution.frequency_hz), x


def hysteresis_loop(solution: Solution, contact: str, *, samples: int = 512) -> tuple[Real, Real]:
    """Return motion [m] and force [N] of a contact over one period, (samples,) each.

    Of a contact with two relative motions they are the first. The force is the one the law gives for the
    motion of the solution, with its corners, not the sum of the harmonics kept; but of a rigid contact.

    Raises
    ------
    SettingError
        The solution did not converge, an unknown contact, or a bad number of samples.
    """
    tau = _angles(samples)
    check_converged(solution)
    at = contact_index(solution.scene, contact)
    given, found = solution.scene.contacts[at], solution.contacts[at]
    basis, omega = fourier.basis(tau, solution.highest_harmonic), 2.0 * math.pi * solution.frequency_hz
    return basis @ found.slip, found.force_over(given.at_frequency(omega), tau)


def all_coordinates(solution: Solution, *, first: int = 0) -> Complex:
    """Return the complex amplitudes of all coordinates of every harmonic from `first` on, a row each.

    They are the DOFs, or those of the matrices or modes a structure is given by. The mean, and every
    harmonic of a structure that contacts alone hold, is found with contact stiffnesses on both sides,
    (Z_k + Lᵀ kt L) x̂_k = f̂_k − Lᵀ (F̂_k − kt û_k): without, all would be the difference of forces that
    nearly balance over an inertia that may be next to nothing.

    Raises
    ------
    SettingError
        The solution did not converge.
    """
    check_converged(solution)
    model = linear_model(solution.scene)
    ks = np.arange(first, solution.highest_harmonic + 1)
    diameters = model.diameters(ks)
    K, C, M = model.at(diameters, ks > 0)
    K, L = K.astype(np.complex128), model.ports_at(diameters)
    forces = [fourier.to_complex(force)[first:] for c in solution.contacts for force in c.forces]
    friction = np.array(forces, dtype=np.complex128).reshape(len(forces), ks.size).T
    if solution.contacts:
        kt = model.port_stiffnesses
        slips = [fourier.to_complex(each)[first:] for c in solution.contacts for each in c.motions]
        held = np.flatnonzero((ks == 0) | contacts_hold(model))
        friction[held] -= kt * np.array(slips).T[held]
        K[held] += np.swapaxes(L[held].conj(), 1, 2) @ (kt[:, None] * L[held])
    pushes = force_amplitudes(model, ks) - np.einsum("kpn,kp->kn", L.conj(), friction)
    moved = np.flatnonzero(pushes.any(axis=1))  # of odd harmonics alone, every second is nothing
    omega = 2.0 * math.pi * solution.frequency_hz
    dynamic, *_ = dynamic_stiffness(K[moved], C[moved], M[moved], ks[moved][:, None, None], omega)
    motions: Complex = np.zeros_like(pushes)
    motions[moved] = np.linalg.solve(dynamic, pushes[moved, :, None])[:, :, 0]
    return motions


def matrices(model: LinearModel, k: int) -> tuple[Complex, Complex, Complex]:
    """Return K [N/m], C [N s/m] and the contact rows L as harmonic k sees them (its interblade phase)."""
    n = model.diameters(np.array([k], dtype=np.int64))
    (K,), (C,), _ = model.at(n, np.array([k > 0]))
    return K, C, model.ports_at(n)[0]


def _angles(samples: int) -> Real:
    check_count("samples", samples, 2, LARGEST_SAMPLES)
    return np.asarray(2.0 * math.pi / samples * np.arange(samples))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PowerBalance(Piece):
    """Mean power over a period, of one sector if the structure is cyclic.

    A solution of the balance loses none: input = viscous + friction to rounding, whatever the number of
    harmonics.
    """

    input_w: Annotated[
        float,
        "Put in by the excitation [W]; of a base that moves what it puts into the coordinates that move "
        "freely, in which dashpots to the base then take out.",
    ]
    viscous_w: Annotated[
        float, "Taken out by the dampers of the structure, structural damping and gas included [W]."
    ]
    friction_w: Annotated[float, "Taken out by all contacts [W]."]
    contacts_w: Annotated[dict[str, float], "Taken out by each contact [W]."]

    @property
    def imbalance(self) -> float:
        """What is unaccounted for, relative to the largest of the three (0 if nothing moves)."""
        largest = max(abs(self.input_w), abs(self.viscous_w), abs(self.friction_w))
        return abs(self.input_w - self.viscous_w - self.friction_w) / largest if largest > 0.0 else 0.0


def power_balance(solution: Solution) -> PowerBalance:
    """Return the mean powers of a periodic response.

    With velocities v̂_k = ikω x̂_k: input ½ Re Σ f̂ᴴ v̂, viscous ½ Σ v̂ᴴ (C + K/(ikω)) v̂ (of
    which a symmetric, real K takes nothing), friction ½ Re Σ F̂* ikω û.

    Raises
    ------
    SettingError
        The solution did not converge.
    """
    model = linear_model(solution.scene)
    free, omega = model.free, 2.0 * math.pi * solution.frequency_hz
    put_in = taken = 0.0
    ks = np.arange(1, solution.highest_harmonic + 1)
    diameters = model.diameters(ks)
    given = model.at(diameters, ks > 0)
    parts = *given, dynamic_stiffness(*given, ks[:, None, None], omega)[0], model.ports_at(diameters)
    forces = force_amplitudes(model, ks)
    for k, motion, force, K, C, _, Z, L in zip(
        ks.tolist(), all_coordinates(solution, first=1), forces, *parts, strict=True
    ):
        velocity, moved = 1j * k * omega * motion[free], motion[~free]
        put_in += 0.5 * float(np.vdot(velocity, force[free] - Z[np.ix_(free, ~free)] @ moved).real)
        rubbing = [fourier.to_complex(each)[k] for contact in solution.contacts for each in contact.forces]
        if moved.size and rubbing:
            put_in += 0.5 * float(np.vdot(1j * k * omega * L[:, ~free] @ moved, rubbing).real)
        taken += 0.5 * float(np.vdot(velocity, C[np.ix_(free, free)] @ velocity).real)
        if model.extra is not None:  # what a stiffness that is not symmetric or not real takes out
            taken += 0.5 / (k * omega) * float(np.vdot(velocity, K[np.ix_(free, free)] @ velocity).imag)
    friction = {}
    for contact in solution.contacts:
        friction[contact.name] = 0.5 * sum(
            float(force[1:] @ (omega * fourier.derivative(motion))[1:])
            for motion, force in zip(contact.motions, contact.forces, strict=True)
        )
    return PowerBalance(
        input_w=put_in, viscous_w=taken, friction_w=sum(friction.values()), contacts_w=friction
    )
