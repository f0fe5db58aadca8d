"""What assembly makes of a scene: the structure without its contacts as matrices, and their derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceTerm:
    """One force amplitude * cos(harmonic * omega t + phase) along `vector`.

    Attributes
    ----------
    vector : (n,) array
        Selects the DOF.
    amplitude : float
        Force [N].
    phase : float
        Phase [rad].
    harmonic : int
        Multiple of the excitation frequency; 0 is a static load.
    """

    vector: FloatArray
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

    @property
    def interblade_phase(self) -> float:
        """Phase of harmonic 1 from one sector to the next [rad]."""
        return 2.0 * math.pi * self.engine_order / self.sectors


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
