"""Matrices given entry by entry, with the labels of their rows where the file has them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.readers.label import Label

MOST_ROWS = 10_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Labelled:
    """A matrix of a file.

    Attributes
    ----------
    matrix : sparse (n, n)
    labels : tuple of Label or None
        Node and component of each row, where the file tells.
    held : frozenset of Label
        Rows that a boundary condition holds, which are no DOFs.
    sized : bool
        Whether the file tells how many rows there are; else empty ones at the end do not show.
    """

    matrix: coo_array
    labels: tuple[Label, ...] | None = None
    held: frozenset[Label] = frozenset()
    sized: bool = True


def mirrored(
    rows: NDArray[np.int64], columns: NDArray[np.int64], values: NDArray[np.float64], size: int
) -> coo_array:
    """The symmetric matrix of which a file holds one triangle, or some entries on one side only.

    Entries whose mirror image is in the file too stay as they are; entries at the same place add up.
    """
    place = rows * size + columns
    other = columns * size + rows
    alone = ~np.isin(other, place)
    return coo_array(
        (
            np.concatenate([values, values[alone]]),
            (np.concatenate([rows, columns[alone]]), np.concatenate([columns, rows[alone]])),
        ),
        shape=(size, size),
    )
