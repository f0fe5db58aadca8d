"""One sector of a disk given by matrices: what it is at each nodal diameter, made when it is first used.

A full sector has its high boundary eliminated (`solver.matrices.sectors.elimination`), a reduced one brings
the matrices of each nodal diameter. That of n is the complex conjugate of that of sectors − n.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from solver.linear.matrix_model import NO_PROPORTIONAL, block_diag, bodies_mass, modal_damping
from solver.matrices.normal_modes import hermitian
from solver.matrices.sectors.blocks import at_diameter, full_elimination
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.parts import MatricesStructure

Matrices = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SectorMatrices:
    """The matrices of a sector with its bodies behind its coordinates.

    Attributes
    ----------
    structure : MatricesStructure
        With `sectors`.
    bodies : tuple of Body
        Of one sector.
    shapes : (n_dofs, n) array
        The DOFs of structure and bodies in the coordinates.
    """

    structure: MatricesStructure
    bodies: tuple[Body, ...]
    shapes: NDArray[np.float64]

    @property
    def every_diameter(self) -> bool:
        """Whether all nodal diameters are known."""
        found = self.structure.diameters
        return found is None or len(found.diameters) == self.structure.sector_count // 2 + 1

    def at(self, diameter: int) -> Matrices:
        """K, C and M at a nodal diameter, their Hermitian parts, real where the phase is; read-only.

        Raises
        ------
        SettingError
            The model was not reduced for this nodal diameter.
        """
        n, count = diameter % self.structure.sector_count, self.structure.sector_count
        found = _with_damping(self.structure, self.bodies, min(n, count - n))
        return found if 2 * n <= count else (found[0].conj(), found[1].conj(), found[2].conj())

    def own(self, diameter: int, which: Literal["K", "M"]) -> NDArray[Any]:
        """K or M without what bodies add, in the rows of the structure, zero elsewhere."""
        matrix = self.at(diameter)[0 if which == "K" else 2].copy()
        behind = sum(len(body.dofs) for body in self.bodies)
        if behind:
            matrix[-behind:] = 0.0
        return matrix


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProportionalDamping:
    """The derivative of C by a proportional damping: K or M of the structure at each nodal diameter."""

    sector: SectorMatrices
    which: Literal["K", "M"]

    def at(self, diameter: int) -> NDArray[Any]:
        """dC at a nodal diameter."""
        return self.sector.own(diameter, self.which)


@lru_cache(maxsize=16)
def sector_matrices(structure: MatricesStructure, bodies: tuple[Body, ...]) -> SectorMatrices:
    """The matrices of a sector; the same object each time, so that what follows from them can be kept."""
    rows = list(structure.dofs.rows)
    if structure.diameters is None:
        eliminated = full_elimination(structure)
        rows = [eliminated.row(row) for row in rows]
    own = np.zeros((len(rows), structure.n_coordinates))
    own[np.arange(len(rows)), rows] = 1.0
    shapes = frozen(block_diag(own, np.eye(sum(len(body.dofs) for body in bodies))))
    return SectorMatrices(structure=structure, bodies=bodies, shapes=shapes)


@lru_cache(maxsize=128)
def _with_damping(structure: MatricesStructure, bodies: tuple[Body, ...], n: int) -> Matrices:
    own = structure.model_copy(update=NO_PROPORTIONAL)
    K, C, M = _at(own, bodies, n)
    behind = sum(len(body.dofs) for body in bodies)
    inner = slice(0, K.shape[0] - behind)
    if structure.stiffness_proportional_damping or structure.mass_proportional_damping:
        C = C.copy()
        C[inner, inner] += structure.stiffness_proportional_damping * K[inner, inner]
        C[inner, inner] += structure.mass_proportional_damping * M[inner, inner]
    return K, frozen(C), M


@lru_cache(maxsize=128)
def _at(structure: MatricesStructure, bodies: tuple[Body, ...], n: int) -> Matrices:
    """K, C and M without proportional damping."""
    # What is unsymmetric is among the extra terms; rounding must not look like it.
    K, C, M = (hermitian(matrix).copy() for matrix in at_diameter(structure, n))
    if structure.damping_ratio is not None:
        C = C + modal_damping(M, K, structure.damping_ratio)
    if bodies:
        behind = np.zeros((sum(len(body.dofs) for body in bodies),) * 2)
        K, C, M = block_diag(K, behind), block_diag(C, behind), block_diag(M, bodies_mass(0, bodies))
    return frozen(K), frozen(C), frozen(M)
