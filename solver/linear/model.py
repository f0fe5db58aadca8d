"""What assembly makes of a scene: the structure without its contacts as matrices, and their derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solver.linear.extra_terms import ExtraTerms

FloatArray = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceTerm:
    """One force amplitude * cos(harmonic * omega t + phase) along `vector`.

    Attributes
    ----------
    vector : (n,) array
        Selects the DOF; complex where several have phases of their own.
    amplitude : float
        Force [N].
    phase : float
        Phase [rad].
    harmonic : int
        Multiple of the excitation frequency; 0 is a static load.
    """

    vector: FloatArray | Complex
    amplitude: float
    phase: float
    harmonic: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModel:
    """The structure without its contacts: one sector of a tuned disk, or the whole structure.

    A matrix at interblade phase theta is X(theta) = X0 + Xp e^{j theta} + Xp^T e^{-j theta}; the neighbour
    x of the next sector is X e^{j k i phi} for harmonic k, engine order i and phi = 2 pi / sectors. All
    arrays are read-only.

    Attributes
    ----------
    dofs : tuple of str
        Names of the DOFs.
    shapes : (n_dofs, n) array
        The DOFs in the coordinates of the matrices: the identity, or what a structure given by matrices or
        modes names.
    M : (n, n) array
        Mass [kg].
    C0, Cp : (n, n) array
        Damping [N s/m]; `Cp` couples to the next sector, 0 if lumped.
    K0, Kp : (n, n) array
        Stiffness [N/m]; `Kp` couples to the next sector, 0 if lumped.
    contact_here, contact_next : (n_ports, n) array
        L(theta) = contact_here + contact_next e^{j theta}; relative motions u = L x, x the coordinates.
    forces : tuple of ForceTerm
        The excitation.
    observe : (n,) array
        Selects the observed DOF.
    engine_order : int
        Engine order of the excitation, 0 if lumped.
    sectors : int
        Number of sectors, 1 if lumped.
    extra : ExtraTerms or None
        Terms that are not symmetric, not real or not of springs and dashpots; see `at`.
    prescribed : bool
        The last coordinate is the motion of a base; see `solver.linear.moving_base`.
    line : ExtraTerms or None
        What K gains per squared speed and C per speed where the speed follows the frequency, Ω = ω / order.
    line_order : float
        That order.
    """

    dofs: tuple[str, ...]
    shapes: FloatArray
    M: FloatArray
    C0: FloatArray
    Cp: FloatArray
    K0: FloatArray
    Kp: FloatArray
    contact_here: FloatArray
    contact_next: FloatArray
    forces: tuple[ForceTerm, ...]
    observe: FloatArray
    engine_order: int
    sectors: int
    extra: ExtraTerms | None = None
    prescribed: bool = False
    line: ExtraTerms | None = None
    line_order: float = 1.0

    @property
    def interblade_phase(self) -> float:
        """Phase of harmonic 1 from one sector to the next [rad]."""
        return 2.0 * math.pi * self.engine_order / self.sectors

    @property
    def free(self) -> NDArray[np.bool_]:
        """The coordinates that move freely, (n,): not the base nor what it drives, which have no inertia."""
        moves: NDArray[np.bool_] = np.any(self.M, axis=1)
        moves[-1] &= not self.prescribed
        return moves

    @property
    def is_symmetric(self) -> bool:
        """Whether energy is kept but for dashpots: nothing beside springs, dashpots and gyroscopic terms."""
        return not self.prescribed and (self.extra is None or self.extra.keeps_energy)

    def at(self, turns: Complex, moving: NDArray[np.bool_]) -> tuple[Complex, Complex]:
        """Return K and C, (ns, n, n), at e^{j theta} (ns,), of motions or (False) of what is at rest."""
        turn = turns[:, None, None]
        K = self.K0 + self.Kp * turn + self.Kp.T * turn.conj()
        C = self.C0 + self.Cp * turn + self.Cp.T * turn.conj()
        if self.extra is not None:
            more, further = self.extra.at(turns, moving)
            K, C = K + more, C + further
        return K, C

    def inertia(self, turns: Complex, ks: NDArray[np.int64]) -> FloatArray | Complex:
        """Return M of harmonics ks (ns,) at e^{j theta} (ns,), (ns, n, n), with what follows the speed.

        Along a line K + (ω/e)² K₂ + ikω (C + (ω/e) G) − k²ω² M has the shape of a fixed speed, with the
        inertia M − K₂/(ke)² − i G/(ke). The mean is written with k = 1 and has −K₂/e² alone.
        """
        whole = np.broadcast_to(self.M, (len(ks), *self.M.shape))
        if self.line is None:
            return whole
        K2, G = self.line.at(turns, np.ones(len(ks), np.bool_))
        moving, k = (ks > 0)[:, None, None], np.maximum(ks, 1)[:, None, None]
        per = 1.0 / (k * self.line_order)
        return np.asarray(np.where(moving, whole - 1j * per * G, 0.0) - per**2 * K2)

    def ports_at(self, turns: Complex) -> Complex:
        """Return the relative motions L of the contacts, (ns, n_ports, n), at e^{j theta} (ns,)."""
        return np.asarray(self.contact_here + self.contact_next * turns[:, None, None])

    def turns(self, ks: NDArray[np.int64]) -> Complex:
        """Return e^{j theta} of harmonics."""
        return np.asarray(np.exp(1j * ks * self.interblade_phase))


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModelDerivative:
    """Derivatives of a `LinearModel` by one structural parameter, in units per unit of the parameter.

    Attributes
    ----------
    dM, dC0, dCp, dK0, dKp : (n, n) array
        Derivatives of the matrices; read-only.
    affine : bool
        The matrices are affine in this parameter, so these derivatives are constant.
    contact_here, contact_next : (n_ports, n) array or None
        Derivatives of the relative motions; None where they do not depend on it.
    forces, second_forces : tuple of ForceTerm
        First and second derivatives of the forces [N per unit, and per unit squared].
    extra, second_extra : ExtraTerms or None
        First and second derivatives of the extra terms.
    """

    dM: FloatArray
    dC0: FloatArray
    dCp: FloatArray
    dK0: FloatArray
    dKp: FloatArray
    affine: bool
    contact_here: FloatArray | None = None
    contact_next: FloatArray | None = None
    forces: tuple[ForceTerm, ...] = ()
    second_forces: tuple[ForceTerm, ...] = ()
    extra: ExtraTerms | None = None
    second_extra: ExtraTerms | None = None

    def at(self, turns: Complex, moving: NDArray[np.bool_]) -> tuple[Complex, Complex, Complex]:
        """Return the derivatives of K, C and M, (ns, n, n), at e^{j theta} (ns,), as `LinearModel.at`."""
        turn = turns[:, None, None]
        dK = self.dK0 + self.dKp * turn + self.dKp.T * turn.conj()
        dC = self.dC0 + self.dCp * turn + self.dCp.T * turn.conj()
        if self.extra is not None:
            more, further = self.extra.at(turns, moving)
            dK, dC = dK + more, dC + further
        return dK, dC, self.dM + 0.0 * turn
