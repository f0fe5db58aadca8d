"""The table [structure.cyclic]: how a sector given by its matrices joins the next one."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, field_validator

from solver.contacts.fields import Part, Vector

Sectors = Annotated[int, Field(strict=True, ge=1, le=10_000)]
Row = Annotated[int, Field(strict=True, ge=-1, le=10_000_000)]


class CyclicBoundary(Part):
    """The boundaries of a sector: the high one is the low one of the next sector, turned about the axis.

    Attributes
    ----------
    axis : (3,) tuple or None
        Direction of the axis of the disk, through the origin; displacements turn by 2 pi / sectors about it
        from the low boundary to the high one.
    low_rows, high_rows : tuple of tuples of int, or None
        Rows (zero-based) of the boundaries in pairs: three components of a vector, -1 where a boundary
        condition holds one, or a row alone, which does not turn. None where the model is reduced already.
    """

    axis: Vector | None = None
    low_rows: tuple[tuple[Row, ...], ...] | None = None
    high_rows: tuple[tuple[Row, ...], ...] | None = None

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
