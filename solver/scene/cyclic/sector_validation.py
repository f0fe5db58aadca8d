"""What must hold between the parts of a sector given by its matrices."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from solver.matrices.matrix_validation import DofTable, check_definite
from solver.matrices.sectors.diameters import DiameterMatrices
from solver.matrices.sectors.elimination import Elimination, elimination
from solver.matrices.sectors.sector_parts import PartMatrices
from solver.matrices.values import Matrix

if TYPE_CHECKING:
    from solver.scene.matrices_structure import MatricesStructure

_REAL = 1e-9  # imaginary part, relative to the largest entry, that counts as none


def check_sector(sector: MatricesStructure, spinning: Collection[str]) -> None:
    """Raise ValueError unless matrices with boundaries, or those of nodal diameters, are there and fit.

    `spinning` names the matrices given that go with the speed of rotation.
    """
    count = sector.sectors or 1
    if sector.modes is not None:
        raise ValueError(f"`sectors` = {count}: a sector is given by its matrices, not by `modes`")
    low, high = (None, None) if sector.cyclic is None else (sector.cyclic.low_rows, sector.cyclic.high_rows)
    if sector.diameters is None:
        if sector.cyclic is None or low is None or high is None:
            raise ValueError(
                f"`sectors` = {count} needs the boundaries in [structure.cyclic]: `low` and `high` in a "
                "scene file, `low_rows` and `high_rows` in a request"
            )
        if sector.M is not None:
            found = elimination(sector.M.size, low, high, sector.cyclic.axis, count)
            away = np.setdiff1d(np.arange(sector.M.size), found.kept).tolist()
            _check_kept(sector.dofs, set(away))
            _check_parts(sector.parts, sector.M.size)
            _check_mass(sector.M, found, count)
        return
    if sector.M is not None or low is not None or high is not None:
        raise ValueError(
            "`diameters` stands in place of M, K, C, `low_rows` and `high_rows`: remove one or other"
        )
    if spinning:
        raise ValueError(
            f"`{next(iter(spinning))}` is a matrix of a full sector, not of a reduced one (`diameters`): "
            "give it as [[couplings]] of the DOFs in use, or the sector by M and K"
        )
    if sector.parts is not None:
        raise ValueError(
            "`parts` are of a full sector: those of a reduced one stand in `diameters` with the rest"
        )
    if not sector.symmetric:
        raise ValueError(
            "`symmetric` = false is for K and C of a full sector: those of `diameters` are Hermitian; give "
            "what is unsymmetric as [[couplings]] of the DOFs in use"
        )
    _check_diameters(sector.diameters, count, sector.dofs)


def _check_kept(dofs: DofTable, away: set[int]) -> None:
    for name, row in dofs.write().items():
        if row in away:
            raise ValueError(
                f"`dofs`: {name!r} is row {row}, on the high boundary: name the DOF of the low boundary that "
                "it is paired with; in contacts it is NAME@next"
            )


def _check_mass(M: Matrix, found: Elimination, count: int) -> None:
    """Raise ValueError unless M is positive definite once the high boundary has joined the low one."""
    try:
        check_definite(M.array)
    except ValueError:
        joined = found.of(M.array)
        for n in range(count // 2 + 1):
            try:
                check_definite(joined.at(n, count))
            except ValueError as error:
                raise ValueError(
                    f"{error} (boundaries joined, at nodal diameter {n}, rows without the high one)"
                ) from error


def _check_parts(parts: PartMatrices | None, size: int) -> None:
    for name, matrix in zip(parts or (), () if parts is None else parts.matrices, strict=True):
        if matrix.size != size:
            raise ValueError(f"`parts`: {name!r} must have {size} rows like M, got {matrix.size}")


def _check_diameters(found: DiameterMatrices, count: int, dofs: DofTable) -> None:
    if found.diameters[-1] > count // 2:
        raise ValueError(
            f"`diameters` must be from 0 to {count // 2}, half of {count} sectors, got {found.diameters[-1]}"
        )
    for n, M, K in zip(found.diameters, found.M, found.K, strict=True):
        for key, matrix in (("M", M), ("K", K)):
            if 2 * n % count == 0 and np.abs(matrix.imag).max() > _REAL * np.abs(matrix).max():
                raise ValueError(f"`{key}` must be real at nodal diameter {n} of {count} sectors")
    for name, row in dofs.write().items():
        if row >= found.size:
            raise ValueError(f"`dofs`: {name!r} must have a row from 0 to {found.size - 1}, got {row}")
