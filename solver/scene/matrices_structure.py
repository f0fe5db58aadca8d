"""The structure of a scene given by its matrices or its modes."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from solver.contacts.fields import NonNegative, Part
from solver.matrices.validation import DofTable, check_matrices, symmetric
from solver.matrices.values import Matrix, Modes

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
    """A structure given by its matrices, or by its modes.

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

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates the matrices, or the modes, have."""
        if self.modes is not None:
            return int(self.modes.omega2.size)
        return 0 if self.M is None else self.M.size

    @field_validator("M", "K", "C")
    @classmethod
    def _symmetric(cls, matrix: Matrix | None, info: ValidationInfo) -> Matrix | None:
        return None if matrix is None else symmetric(str(info.field_name), matrix)

    @model_validator(mode="after")
    def _fit(self) -> MatricesStructure:
        check_matrices(self.M, self.K, self.C, self.modes, self.dofs)
        if self.damping_ratio is not None and self.modes is not None and self.modes.damping_ratio is not None:
            raise ValueError(
                f"`damping_ratio` = {self.damping_ratio!r} is given beside that of `modes`: keep one of them"
            )
        return self
