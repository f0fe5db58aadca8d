"""The structure of a scene given by its matrices or its modes."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from solver.contacts.fields import NonNegative, Part, Vector
from solver.matrices.sectors.elimination import elimination
from solver.matrices.sectors.outline import SectorOutline
from solver.matrices.sectors.sector_parts import DiameterMatrices, PartMatrices
from solver.matrices.values import (
    MOST_MODES,
    DofTable,
    Matrix,
    NormalModes,
    antisymmetric,
    check_definite,
    check_matrices,
    symmetric,
)
from solver.scene.cyclic.sector_tables import CyclicBoundary, Mistuning, Sectors

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
            for name, row in sector.dofs.write().items():
                if row in away:
                    raise ValueError(
                        f"`dofs`: {name!r} is row {row}, on the high boundary: name the DOF of the low "
                        "boundary that it is paired with; in contacts it is NAME@next"
                    )
            size = sector.M.size
            for name, matrix in zip(
                sector.parts or (), () if sector.parts is None else sector.parts.matrices, strict=True
            ):
                if matrix.size != size:
                    raise ValueError(f"`parts`: {name!r} must have {size} rows like M, got {matrix.size}")
            # M must be positive definite once the high boundary has joined the low one.
            try:
                check_definite(sector.M.array)
            except ValueError:
                joined = found.of(sector.M.array)
                for n in range(count // 2 + 1):
                    try:
                        check_definite(joined.at(n, count))
                    except ValueError as error:
                        raise ValueError(
                            f"{error} (boundaries joined, at nodal diameter {n}, rows without the high one)"
                        ) from error
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


Ratio = Annotated[float, Field(strict=True, ge=0.0, le=10.0, allow_inf_nan=False)]


def _number_or_numbers(data: Any) -> object:
    """Refuse what is no damping ratio and no list of them, in one message."""
    rows = data if isinstance(data, list | tuple) else [data]
    good = all(
        isinstance(one, int | float) and not isinstance(one, bool) and 0.0 <= one <= 10.0 for one in rows
    )
    if not good or not 0 < len(rows) <= MOST_MODES:
        raise ValueError(
            f"`damping_ratio` must be a number >= 0 and <= 10, or a list of 1 to {MOST_MODES} such numbers, "
            f"got {str(data)[:80]}"
        )
    return tuple(map(float, rows)) if rows is data else float(rows[0])


Ratios = Annotated[
    Ratio | Annotated[tuple[Ratio, ...], Field(min_length=1)], BeforeValidator(_number_or_numbers)
]
LossFactor = Annotated[float, Field(strict=True, ge=0.0, le=10.0, allow_inf_nan=False)]


class Reduction(Part):
    """What a large model was before it was reduced onto the DOFs in use when its scene was loaded."""

    dofs: Annotated[int, Field(strict=True, ge=1), "DOFs of the full model."]
    modes: Annotated[int, Field(strict=True, ge=0), "Fixed-interface modes kept beside the DOFs in use."]
    highest_hz: Annotated[NonNegative, "Frequency of the highest of them, 0 if there is none."]


class MatricesStructure(Part):
    """A structure given by its matrices, or by its modes; with `sectors` one sector of a disk."""

    kind: Literal["matrices"]
    symmetric: Annotated[
        bool, "False: K and C may differ from their transposes (bearings, circulatory forces)."
    ] = True  # read before the matrices it speaks of
    M: Annotated[Matrix | None, "Mass [kg], symmetric."] = None
    K: Annotated[Matrix | None, "Stiffness [N/m], symmetric unless `symmetric` is false."] = None
    C: Annotated[Matrix | None, "Damping [N s/m], likewise; may be left out."] = None
    G: Annotated[
        Matrix | None,
        "Gyroscopic matrix, antisymmetric: C gains it times the speed of rotation [N s/m per rad/s].",
    ] = None
    K_omega2: Annotated[
        Matrix | None,
        "Stiffness per squared speed of rotation, symmetric: K gains it times the speed squared [N/m per "
        "(rad/s)²]; stiffening by centrifugal load and softening together.",
    ] = None
    modes: Annotated[NormalModes | None, "Mass-normalised modes in place of the matrices."] = None
    dofs: Annotated[
        DofTable, "Names of the DOFs in use, each with its row (zero-based); a list names all rows."
    ]
    damping_ratio: Annotated[
        Ratios | None,
        "Damping ratio of every mode, or of each from the lowest on (the last one also of those above), "
        "added to the rest.",
    ] = None
    loss_factor: Annotated[
        LossFactor, "Structural damping: the stiffness is K (1 + i loss_factor) at every frequency above 0."
    ] = 0.0
    stiffness_proportional_damping: Annotated[NonNegative, "C gains this many K [s]."] = 0.0
    mass_proportional_damping: Annotated[NonNegative, "C gains this many M [1/s]."] = 0.0
    reduction: Annotated[Reduction | None, "Set when the model was reduced on loading."] = None
    sectors: Annotated[Sectors | None, "Number of sectors of the disk of which the matrices are one."] = None
    cyclic: Annotated[CyclicBoundary | None, "How the sectors are joined."] = None
    diameters: Annotated[
        DiameterMatrices | None,
        "In place of M, K and C: a reduced sector, its matrices at each nodal diameter that was built.",
    ] = None
    parts: Annotated[
        PartMatrices | None,
        "Stiffness [N/m] of parts of the sector, such as its blade, which `mistuning` may name; part of K.",
    ] = None
    mistuning: Annotated[Mistuning | None, "Factors that make the sectors differ."] = None
    outline: Annotated[
        SectorOutline | None,
        "Of the mesh of the sector, to be drawn; set where a deck or a reduced sector tells it.",
    ] = None

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates the matrices, or the modes, have; of a sector, without its high boundary."""
        if self.modes is not None:
            return int(self.modes.omega2.size)
        if self.diameters is not None:
            return self.diameters.size
        high = self.cyclic.high_rows if self.cyclic is not None and self.cyclic.high_rows else ()
        away = sum(row >= 0 for group in high for row in group)
        return 0 if self.M is None else self.M.size - away

    @property
    def sector_count(self) -> int:
        """Number of sectors; 1 where it is no disk."""
        return 1 if self.sectors is None else self.sectors

    @property
    def has_sectors(self) -> bool:
        """Whether it is one sector of a disk."""
        return self.sectors is not None

    @property
    def axis(self) -> Vector | None:
        """Direction of the axis of the disk."""
        return None if self.cyclic is None else self.cyclic.axis

    @field_validator("M", "K", "C", "K_omega2")
    @classmethod
    def _symmetric(cls, matrix: Matrix | None, info: ValidationInfo) -> Matrix | None:
        declared = info.field_name in ("K", "C") and info.data.get("symmetric") is False
        return matrix if matrix is None or declared else symmetric(str(info.field_name), matrix)

    @field_validator("G")
    @classmethod
    def _antisymmetric(cls, matrix: Matrix | None) -> Matrix | None:
        return None if matrix is None else antisymmetric("G", matrix)

    @model_validator(mode="after")
    def _fit(self) -> MatricesStructure:
        of_a_disk = ("cyclic", "diameters", "parts", "mistuning", "outline")
        key = next((key for key in of_a_disk if getattr(self, key) is not None), None)
        if self.sectors is None and key is not None:
            raise ValueError(
                f"`sectors` is missing: `{key}` is of one sector of a disk, of which there are so many"
            )
        spinning = {key: value for key in ("G", "K_omega2") if (value := getattr(self, key)) is not None}
        if self.sectors is not None:
            check_sector(self, spinning)
        moved = None if self.diameters is None else self.diameters.motion
        if moved is not None and self.outline is not None and moved.points != len(self.outline.points):
            drawn = len(self.outline.points)
            raise ValueError(f"`motion` of the outline must be of its {drawn} points, got {moved.points}")
        if self.outline is not None and len(self.outline.moved) and self.M is not None:
            row = int(self.outline.moved[:, 1].max())
            if row >= self.M.size:
                wanted = f"`moved` of the outline must name rows from 0 to {self.M.size - 1}"
                raise ValueError(f"{wanted}, got {row}")
        if self.diameters is None:
            joined = self.sectors is not None
            check_matrices(self.M, self.K, self.C, self.modes, self.dofs, spinning, joined=joined)
        if self.damping_ratio is not None and self.modes is not None and self.modes.damping_ratio is not None:
            raise ValueError(
                f"`damping_ratio` = {self.damping_ratio!r} is given beside that of `modes`: keep one of them"
            )
        return self
