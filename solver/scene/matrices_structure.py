"""The structure of a scene given by its matrices or its modes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from solver.contacts.fields import NonNegative, Part, Vector
from solver.matrices.sectors.diameters import DiameterMatrices
from solver.matrices.sectors.validation import check_sector
from solver.matrices.validation import DofTable, check_matrices, symmetric
from solver.matrices.values import Matrix, Modes
from solver.scene.cyclic.boundary import CyclicBoundary, Sectors

Ratio = Annotated[float, Field(strict=True, ge=0.0, le=10.0, allow_inf_nan=False)]


class Reduction(Part):
    """What a large model was before it was reduced onto the DOFs in use when its scene was loaded.

    Attributes
    ----------
    dofs : int
        DOFs of the full model.
    modes : int
        Fixed-interface modes kept beside the DOFs in use.
    highest_hz : float
        Frequency of the highest of them, 0 if there is none.
    """

    dofs: Annotated[int, Field(strict=True, ge=1)]
    modes: Annotated[int, Field(strict=True, ge=0)]
    highest_hz: NonNegative


class MatricesStructure(Part):
    """A structure given by its matrices, or by its modes; with `sectors` one sector of a disk.

    Attributes
    ----------
    M, K, C : Matrix
        Mass [kg], stiffness [N/m] and damping [N s/m], symmetric; C may be left out.
    modes : Modes
        Mass-normalised modes in place of the matrices.
    dofs : DofTable
        Names of the DOFs in use, each with its row (zero-based); a list names all rows.
    damping_ratio : float or None
        Damping ratio of every mode, added to the rest.
    stiffness_proportional_damping, mass_proportional_damping : float
        C gains this many K [s] and M [1/s].
    reduction : Reduction or None
        Set when the model was reduced on loading.
    sectors : int or None
        Number of sectors of the disk of which the matrices are one.
    cyclic : CyclicBoundary or None
        How the sectors are joined.
    diameters : DiameterMatrices or None
        In place of M, K and C: a reduced sector, its matrices at each nodal diameter that was built.
    """

    kind: Literal["matrices"]
    M: Matrix | None = None
    K: Matrix | None = None
    C: Matrix | None = None
    modes: Modes | None = None
    dofs: DofTable
    damping_ratio: Ratio | None = None
    stiffness_proportional_damping: NonNegative = 0.0
    mass_proportional_damping: NonNegative = 0.0
    reduction: Reduction | None = None
    sectors: Sectors | None = None
    cyclic: CyclicBoundary | None = None
    diameters: DiameterMatrices | None = None

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

    @field_validator("M", "K", "C")
    @classmethod
    def _symmetric(cls, matrix: Matrix | None, info: ValidationInfo) -> Matrix | None:
        return None if matrix is None else symmetric(str(info.field_name), matrix)

    @model_validator(mode="after")
    def _fit(self) -> MatricesStructure:
        if self.sectors is None and (self.cyclic is not None or self.diameters is not None):
            key = "cyclic" if self.cyclic is not None else "diameters"
            raise ValueError(
                f"`sectors` is missing: `{key}` is of one sector of a disk, of which there are so many"
            )
        if self.sectors is not None:
            check_sector(self)
        if self.diameters is None:
            check_matrices(self.M, self.K, self.C, self.modes, self.dofs)
        if self.damping_ratio is not None and self.modes is not None and self.modes.damping_ratio is not None:
            raise ValueError(
                f"`damping_ratio` = {self.damping_ratio!r} is given beside that of `modes`: keep one of them"
            )
        return self
