"""All sectors of a disk that is given by the matrices of one, as matrices."""

from __future__ import annotations

from functools import lru_cache

from solver.errors import SettingError
from solver.matrices.sectors.blocks import annulus_matrices, full_elimination
from solver.matrices.validation import DofTable
from solver.matrices.values import MOST_DOFS, Matrix
from solver.scene.matrices_structure import MatricesStructure


@lru_cache(maxsize=8)
def matrices_annulus(sector: MatricesStructure) -> MatricesStructure:
    """The structure of all sectors; DOF ``tip`` of sector j is ``tip@j``.

    Raises
    ------
    SettingError
        It would be too large, or a nodal diameter is not known.
    """
    count, n = sector.sector_count, sector.n_coordinates
    if count * n > MOST_DOFS:
        raise SettingError(
            "sectors",
            count,
            f"of {n} coordinates each are {count * n} for the whole annulus, {MOST_DOFS} are the most: keep "
            "fewer modes",
        )
    K, C, M = annulus_matrices(sector)
    own = sector.dofs.rows
    if sector.diameters is None:
        eliminated = full_elimination(sector)
        own = tuple(eliminated.row(row) for row in own)
    pairs = list(zip(sector.dofs, own, strict=True))
    return MatricesStructure(
        kind="matrices",
        M=Matrix(M),
        K=Matrix(K),
        C=Matrix(C) if C.any() else None,
        dofs=DofTable({f"{name}@{j}": j * n + row for j in range(count) for name, row in pairs}),
        damping_ratio=sector.damping_ratio,
        stiffness_proportional_damping=sector.stiffness_proportional_damping,
        mass_proportional_damping=sector.mass_proportional_damping,
    )
