"""What assembly makes of a scene: the structure without its contacts as matrices, and their derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.linear.sector_matrices import ProportionalDamping, SectorMatrices

FloatArray = NDArray[np.float64]
Integer = NDArray[np.int64]


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
    sector : SectorMatrices or None
        What the matrices of a sector given by them are at each nodal diameter; M, C0, Cp, K0 and Kp are then
        empty, (0, 0).
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
    sector: SectorMatrices | None = None

    @property
    def interblade_phase(self) -> float:
        """Phase of harmonic 1 from one sector to the next [rad]."""
        return 2.0 * math.pi * self.engine_order / self.sectors

    def at(self, diameters: Integer) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """K, C and M at nodal diameters, (nd, n, n) each, real where all phases are 0 or all blocks are.

        Raises
        ------
        SettingError
            A reduced sector was not built for one of them.
        """
        if self.sector is not None:
            found = [self.sector.at(int(n)) for n in diameters]
            K, C, M = (np.array(each) for each in zip(*found, strict=True))
            return K, C, M
        turn = np.exp(2j * np.pi * np.asarray(diameters) / self.sectors)[:, None, None]

        def turned(zero: FloatArray, plus: FloatArray) -> NDArray[Any]:
            if not np.any(plus):
                return np.broadcast_to(zero, (len(turn), *zero.shape))
            return np.asarray(zero + plus * turn + plus.T * turn.conj())

        M = np.broadcast_to(self.M, (len(turn), *self.M.shape))
        return turned(self.K0, self.Kp), turned(self.C0, self.Cp), M

    @property
    def every_diameter(self) -> bool:
        """Whether the matrices of all nodal diameters are known."""
        return self.sector is None or self.sector.every_diameter


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearModelDerivative:
    """Derivatives of a `LinearModel` by one structural parameter, in units per unit of the parameter.

    Attributes
    ----------
    dM, dC0, dCp, dK0, dKp : (n, n) array
        Derivatives of the matrices; read-only.
    damping : ProportionalDamping or None
        Of a sector given by its matrices: dC at each nodal diameter, in place of dC0 and dCp.
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
    damping: ProportionalDamping | None = None

    def at(self, diameters: Integer, sectors: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """dK, dC and dM at nodal diameters, (nd, n, n) each, complex."""
        turn = np.exp(2j * np.pi * np.asarray(diameters) / sectors)[:, None, None]
        dK = self.dK0 + self.dKp * turn + self.dKp.T * turn.conj()
        dC = self.dC0 + self.dCp * turn + self.dCp.T * turn.conj()
        if self.damping is not None:
            dC = dC + np.array([self.damping.at(int(n)) for n in diameters])
        return dK, dC, self.dM + 0.0 * turn
