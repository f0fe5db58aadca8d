"""A structure given by its matrices or modes: what it is at each nodal diameter, made when it is first used.

A full sector has its high boundary eliminated (`solver.matrices.sectors.elimination`), a reduced one brings
the matrices of each nodal diameter. That of n is the complex conjugate of that of sectors − n. A structure
without sectors has the nodal diameter 0 alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from solver.linear.structure_matrices import block_diag, bodies_mass, modal_damping, ratio_of_modes
from solver.matrices.normal_modes import hermitian
from solver.matrices.values import frozen
from solver.scene.bodies.body import Body
from solver.scene.cyclic.sector_blocks import at_diameter, full_elimination
from solver.scene.scene_records import MatricesStructure

Matrices = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]
_NO_PROPORTIONAL = {"stiffness_proportional_damping": 0.0, "mass_proportional_damping": 0.0}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SectorMatrices:
    """The matrices of a structure with its bodies, and points without inertia, behind its coordinates."""

    structure: Annotated[MatricesStructure, "One sector, or the whole."]
    bodies: Annotated[tuple[Body, ...], "Of it."]
    points: Annotated[int, "How many points."]
    shapes: Annotated[
        NDArray[np.float64], "The DOFs of structure and bodies in the coordinates, (n_dofs, n)."
    ]

    @property
    def every_diameter(self) -> bool:
        """Whether all nodal diameters are known."""
        found = self.structure.diameters
        return found is None or len(found.diameters) == self.structure.sector_count // 2 + 1

    def at(self, diameter: int) -> Matrices:
        """K, C and M at a nodal diameter, their Hermitian parts, real where the phase is; read-only.

        They are the same arrays each time, so that what follows from them can be kept.

        Raises
        ------
        SettingError
            The model was not reduced for this nodal diameter.
        """
        n, count = diameter % self.structure.sector_count, self.structure.sector_count
        found = _with_damping(self.structure, self.bodies, self.points, min(n, count - n))
        return found if 2 * n <= count else (found[0].conj(), found[1].conj(), found[2].conj())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProportionalDamping:
    """The derivatives by a proportional damping: C gains K or M of the structure, without its bodies."""

    sector: SectorMatrices
    which: Literal["K", "M"]

    def at(self, diameter: int) -> Matrices:
        """Derivatives of K, C and M at a nodal diameter."""
        found = self.sector.at(diameter)[0 if self.which == "K" else 2].copy()
        found[len(found) - _behind(self.sector.bodies, self.sector.points) :] = 0.0
        nothing = np.zeros_like(found)
        return nothing, found, nothing


def _behind(bodies: tuple[Body, ...], points: int) -> int:
    """How many coordinates stand behind those of the structure."""
    return sum(len(body.dofs) for body in bodies) + points


@lru_cache(maxsize=16)
def sector_matrices(
    structure: MatricesStructure, bodies: tuple[Body, ...], points: int = 0
) -> SectorMatrices:
    """The matrices of a structure; the same object each time, so that what follows from them can be kept."""
    rows = list(structure.dofs.rows)
    if structure.modes is not None:
        own = structure.modes.modes[rows]
    else:
        if structure.has_sectors and structure.diameters is None:
            eliminated = full_elimination(structure)
            rows = [eliminated.row(row) for row in rows]
        own = np.zeros((len(rows), structure.n_coordinates))
        own[np.arange(len(rows)), rows] = 1.0
    shapes = frozen(block_diag(own, np.eye(_behind(bodies, points))))
    return SectorMatrices(structure=structure, bodies=bodies, points=points, shapes=shapes)


@lru_cache(maxsize=128)
def _with_damping(structure: MatricesStructure, bodies: tuple[Body, ...], points: int, n: int) -> Matrices:
    own = structure.model_copy(update=_NO_PROPORTIONAL)
    K, C, M = _at(own, bodies, points, n)
    inner = slice(0, K.shape[0] - _behind(bodies, points))
    if structure.stiffness_proportional_damping or structure.mass_proportional_damping:
        C = C.copy()
        C[inner, inner] += structure.stiffness_proportional_damping * K[inner, inner]
        C[inner, inner] += structure.mass_proportional_damping * M[inner, inner]
    return K, frozen(C), M


@lru_cache(maxsize=128)
def _at(structure: MatricesStructure, bodies: tuple[Body, ...], points: int, n: int) -> Matrices:
    """K, C and M without proportional damping."""
    K, C, M = _own(structure, n)
    if bodies or points:
        still, behind = np.zeros((points, points)), np.zeros((_behind(bodies, points),) * 2)
        K, C, M = (
            block_diag(K, behind), block_diag(C, behind), block_diag(M, bodies_mass(0, bodies), still)
        )  # fmt: skip
    return frozen(K), frozen(C), frozen(M)


def _own(structure: MatricesStructure, n: int) -> Matrices:
    """K, C and M of the structure alone, with its damping ratios."""
    modes, ratio = structure.modes, structure.damping_ratio
    if modes is not None:
        ratios = modes.damping_ratio
        if ratios is None:
            ratios = ratio_of_modes(0.0 if ratio is None else ratio, modes.omega2.size)
        return np.diag(modes.omega2), np.diag(2.0 * ratios * np.sqrt(modes.omega2)), np.eye(modes.omega2.size)
    # What is unsymmetric is among the extra terms; rounding must not look like it.
    K, C, M = (hermitian(matrix).copy() for matrix in at_diameter(structure, n))
    return K, C if ratio is None else C + modal_damping(M, K, ratio), M
