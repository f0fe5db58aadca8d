"""The tables [structure.cyclic] and [structure.mistuning]: how sectors join, and that they may differ."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, field_validator, model_validator

from solver.contacts.fields import MemberName, NonNegative, Part, Positive, Vector

Sectors = Annotated[int, Field(strict=True, ge=1, le=10_000)]
Row = Annotated[int, Field(strict=True, ge=-1, le=10_000_000)]


class CyclicBoundary(Part):
    """The boundaries of a sector: the high one is the low one of the next sector, turned about the axis."""

    axis: Annotated[
        Vector | None,
        "Direction of the axis of the disk, through the origin; displacements turn by 2 pi / sectors about "
        "it from the low boundary to the high one.",
    ] = None
    low_rows: Annotated[
        tuple[tuple[Row, ...], ...] | None,
        "Rows (zero-based) of the boundaries in pairs: three components of a vector, -1 where a boundary "
        "condition holds one, or a row alone, which does not turn. None where the model is reduced "
        "already.",
    ] = None
    high_rows: Annotated[
        tuple[tuple[Row, ...], ...] | None,
        "Rows (zero-based) of the boundaries in pairs: three components of a vector, -1 where a boundary "
        "condition holds one, or a row alone, which does not turn. None where the model is reduced "
        "already.",
    ] = None

    @field_validator("low_rows", "high_rows", mode="before")
    @classmethod
    def _rows_alone(cls, data: Any) -> Any:
        if not isinstance(data, list | tuple):
            return data
        return [[row] if isinstance(row, int) and not isinstance(row, bool) else row for row in data]


def is_cyclic(structure: dict[str, Any]) -> bool:
    """Whether a table [structure] is one sector of a disk."""
    return structure.get("kind") == "cyclic" or (
        structure.get("kind") == "matrices" and structure.get("sectors") is not None
    )


Seed = Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)]


class Mistuning(Part):
    """Blades that are not quite equal: one factor for each sector, on the parts `of` names."""

    of: Annotated[
        tuple[MemberName, ...],
        Field(min_length=1),
        "Names of springs (the factor multiplies k), dashpots (c) and masses, or DOFs (their mass). Of a "
        "sector given by matrices: K, M, or names of its `parts`.",
    ]
    spread: Annotated[
        NonNegative | None, "Standard deviation of the factors: 1 + spread * z, z independent and normal."
    ] = None
    seed: Annotated[Seed | None, "Of the random numbers z: numpy's Generator with PCG64; 1 if left out."] = (
        None
    )
    values: Annotated[
        tuple[Positive, ...] | None,
        "The factors themselves, one for each sector, instead of `spread` and `seed`.",
    ] = None

    @model_validator(mode="after")
    def _drawn_or_given(self) -> Mistuning:
        if self.values is None and self.spread is None:
            raise ValueError("`mistuning` needs `spread` (with an optional `seed`) or `values`, got neither")
        if self.values is not None and (self.spread is not None or self.seed is not None):
            other = "spread" if self.spread is not None else "seed"
            raise ValueError(
                f"`values` and `{other}` of `mistuning` exclude each other: give one, "
                f"got {other} = {getattr(self, other)!r} beside {len(self.values)} values"
            )
        return self

    def factors(self, sectors: int) -> tuple[float, ...]:
        """The factor of each sector; those drawn may be 0 or less if the spread is large."""
        if self.values is not None:
            return self.values
        draw = np.random.Generator(np.random.PCG64(1 if self.seed is None else self.seed))
        return tuple((1.0 + (self.spread or 0.0) * draw.standard_normal(sectors)).tolist())
