"""All sectors of a disk that is given by the matrices of one, as matrices."""

from __future__ import annotations

from functools import lru_cache

from solver.errors import SettingError
from solver.matrices.sectors.blocks import added_by_mistuning, annulus_matrices, annulus_of, full_elimination
from solver.matrices.validation import DofTable
from solver.matrices.values import MOST_DOFS, Matrix
from solver.scene.matrices_structure import MatricesStructure


@lru_cache(maxsize=8)
def matrices_annulus(sector: MatricesStructure) -> MatricesStructure:
    """The structure of all sectors; DOF ``tip`` of sector j is ``tip@j``.

    Raises
    ------
    SettingError
        It would be too large, a nodal diameter is not known, modes have damping ratios of their own, or there
        is no such part to be mistuned.
    """
    count, n = sector.sector_count, sector.n_coordinates
    if count * n > MOST_DOFS:
        raise SettingError(
            "sectors",
            count,
            f"of {n} coordinates each are {count * n} for the whole annulus, {MOST_DOFS} are the most: keep "
            "fewer modes",
        )
    if isinstance(sector.damping_ratio, tuple):
        raise SettingError(
            "damping_ratio",
            list(sector.damping_ratio),
            "must be one number where all sectors are solved: modes are counted at each nodal diameter",
        )
    K, C, M = annulus_matrices(sector)
    if sector.mistuning is not None:
        more_K, more_M = added_by_mistuning(sector, sector.mistuning.of, sector.mistuning.factors(count))
        K, M = K + more_K, M + more_M
    own = sector.dofs.rows
    if sector.diameters is None:
        eliminated = full_elimination(sector)
        own = tuple(eliminated.row(row) for row in own)
    pairs = list(zip(sector.dofs, own, strict=True))
    G, K_omega2 = (
        None if given is None else Matrix(annulus_of(sector, given.array))
        for given in (sector.G, sector.K_omega2)
    )
    return MatricesStructure(
        kind="matrices",
        symmetric=sector.symmetric,
        M=Matrix(M),
        K=Matrix(K),
        C=Matrix(C) if C.any() else None,
        G=G,
        K_omega2=K_omega2,
        dofs=DofTable({f"{name}@{j}": j * n + row for j in range(count) for name, row in pairs}),
        damping_ratio=sector.damping_ratio,
        loss_factor=sector.loss_factor,
        stiffness_proportional_damping=sector.stiffness_proportional_damping,
        mass_proportional_damping=sector.mass_proportional_damping,
    )
