"""Matrices as files hold them: maybe with labels of their rows; and which of several is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.labels import Label
from solver.matrices.readers.reader import MatrixFileError

MOST_ROWS = 10_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Labelled:
    """A matrix of a file."""

    matrix: Annotated[coo_array, "Sparse (n, n)."]
    labels: Annotated[tuple[Label, ...] | None, "Node and component of each row, where the file tells."] = (
        None
    )
    held: Annotated[frozenset[Label], "Rows that a boundary condition holds, which are no DOFs."] = (
        frozenset()
    )
    sized: Annotated[
        bool, "Whether the file tells how many rows there are; else empty ones at the end do not show."
    ] = True


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


# What names of matrices begin with in Nastran and elsewhere, for each of ours.
_NAMES = {"M": ("M",), "K": ("K", "STIF"), "C": ("C", "B", "DAMP")}


def wanted(names: Sequence[str], key: str, path: Path) -> str:
    """The name `key`, or that of an array that stands alone.

    Raises
    ------
    MatrixFileError
        There is neither.
    """
    if key in names or len(names) == 1:
        return key if key in names else names[0]
    known = ", ".join(f"`{name}`" for name in names[:20]) or "nothing"
    raise MatrixFileError(
        f"{str(path)!r} must hold an array named `{key}`, or one array alone; it holds {known}"
    )


def chosen(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    """The array of a name, or the one that stands alone; raises as `wanted` does."""
    return arrays[wanted(list(arrays), key, path)]


def chosen_by_initials(arrays: Mapping[str, Any], key: str, path: Path) -> Any:
    """A matrix by Nastran's names, of the square ones: loads and recovery matrices stand beside them.

    Raises
    ------
    MatrixFileError
        As for `wanted`.
    """
    shapes = {name: getattr(found, "matrix", found).shape for name, found in arrays.items()}
    square = {name: found for name, found in arrays.items() if shapes[name][0] == shapes[name][1]}
    arrays = square or arrays
    alike = _alike(list(arrays), key)
    return arrays[alike[0]] if len(alike) == 1 else chosen(arrays, key, path)


def named_by_role(names: Sequence[str]) -> list[str]:
    """Names with M, K or C in place of those that say so (KAAX, MAAX, BAAX)."""
    roles = {name: key for key in _NAMES for name in _alike(names, key)}
    return [roles.get(name, name) for name in names]


def _alike(names: Sequence[str], key: str) -> list[str]:
    """The names that begin as those of the matrix `key` do (K4…: structural damping); none for other keys."""
    starts = _NAMES.get(key, ())
    return [name for name in names if name.upper().startswith(starts) and not name.upper().startswith("K4")]
