"""What must hold between the parts of a structure of kind ``matrices``; the table of its DOFs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver.matrices.values import ASYMMETRY, Matrix, Named, NormalModes

_NAME = re.compile(r"[A-Za-z0-9_-]{1,80}(@[0-9]{1,9})?")


class DofTable(Named):
    """Names of DOFs in order, with the row of each in the matrices."""

    @property
    def rows(self) -> tuple[int, ...]:
        """Zero-based."""
        return self.values

    @classmethod
    def read(cls, data: object) -> DofTable:
        """Read a table ``{name: row}``, or a list of names for the rows 0, 1, 2, …"""
        if isinstance(data, DofTable):
            return data
        if isinstance(data, list | tuple):
            if not all(isinstance(name, str) for name in data):
                raise ValueError("`dofs` must be a table of names and rows, or a list of names")
            table: dict[str, int] = {}
            for row, name in enumerate(data):
                if table.setdefault(name, row) != row:
                    raise ValueError(f"`dofs` names {name[:80]!r} twice; each row needs a name of its own")
            data = table
        if not isinstance(data, dict):
            raise ValueError(f"`dofs` must be a table of names and rows, got {type(data).__name__}")
        if not data:
            raise ValueError("`dofs` must name at least one DOF, got none")
        owner: dict[int, str] = {}
        for name, row in data.items():
            if not isinstance(name, str) or not _NAME.fullmatch(name):
                raise ValueError(
                    f"`dofs`: a name may have only letters, digits, _ and -, got {str(name)[:80]!r}"
                )
            if isinstance(row, bool) or not isinstance(row, int) or row < 0:
                raise ValueError(
                    f"`dofs`: {name!r} must have a row number >= 0 (zero-based), got {str(row)[:80]}"
                )
            if row in owner:
                raise ValueError(f"`dofs`: row {row} is named twice, {owner[row]!r} and {name!r}; keep one")
            owner[row] = name
        return cls(data)

    def write(self) -> dict[str, int]:
        """The table that `read` reads."""
        return dict(zip(self, self.rows, strict=True))


def one_triangle(array: Any) -> str | None:
    """What to do about a matrix, dense or sparse, of which one triangle alone is there; None if both are."""
    rows, columns = array.nonzero()
    apart = np.sign(rows - columns)
    sides = set(apart[apart != 0].tolist())
    if len(sides) != 1:
        return None
    side = "lower" if sides == {1} else "upper"
    return (
        f"its {side} triangle alone is there; fill the other one (A + A.T - diagonal), or write a format "
        "that says it (MatrixMarket with `symmetric` in its first line, Harwell-Boeing RSA)"
    )


def symmetric(key: str, matrix: Matrix) -> Matrix:
    """The matrix without the rounding by which it differs from its transpose.

    Raises
    ------
    ValueError
        It differs by more than that.
    """
    array = matrix.array
    difference = np.abs(array - array.T)
    worst = float(difference.max())
    if worst == 0.0:
        return matrix
    if worst > ASYMMETRY * float(np.abs(array).max()):
        i, j = sorted(int(at) for at in np.unravel_index(np.argmax(difference), array.shape))
        triangle = one_triangle(array)
        if triangle is not None:
            raise ValueError(f"`{key}` must be symmetric: {triangle}")
        raise ValueError(
            f"`{key}` must be symmetric to {ASYMMETRY:g} of its largest entry, "
            f"got {array[i, j]:.10g} in row {i}, column {j} and {array[j, i]:.10g} in row {j}, column {i}"
            + ("" if key not in ("K", "C") else "; if it is meant so, set `symmetric` = false")
        )
    return Matrix(0.5 * (array + array.T))


def antisymmetric(key: str, matrix: Matrix) -> Matrix:
    """The matrix without the rounding by which it differs from minus its transpose.

    Raises
    ------
    ValueError
        It differs by more than that.
    """
    array = matrix.array
    difference = np.abs(array + array.T)
    if float(difference.max()) > ASYMMETRY * float(np.abs(array).max()):
        i, j = (int(at) for at in np.unravel_index(np.argmax(difference), array.shape))
        raise ValueError(
            f"`{key}` must be antisymmetric to {ASYMMETRY:g} of its largest entry, "
            f"got {array[i, j]:.10g} in row {i}, column {j} and {array[j, i]:.10g} in row {j}, column {i}"
        )
    return Matrix(0.5 * (array - array.T))


def check_matrices(
    M: Matrix | None,
    K: Matrix | None,
    C: Matrix | None,
    modes: NormalModes | None,
    dofs: DofTable,
    others: Mapping[str, Matrix],
    *,
    joined: bool = False,
) -> None:
    """Raise ValueError unless matrices or modes are there, of one size that has the rows of the DOFs.

    Parameters
    ----------
    joined : whether boundaries of a sector are to be joined first, before M must be definite.
    """
    given = {key: value for key, value in (("M", M), ("K", K), ("C", C)) if value is not None}
    given |= others
    if modes is not None and given:
        raise ValueError(f"`modes` stands in place of the matrices: remove {', '.join(given)} or `modes`")
    if modes is None and (M is None or K is None):
        missing = "M" if M is None else "K"
        raise ValueError(f"`{missing}` is missing: a matrices structure needs M and K, or `modes`")
    size = modes.size if modes is not None else given["M"].size
    for key, value in given.items():
        if value.size != size:
            raise ValueError(f"`{key}` must have {size} rows as `M` has, got {value.size}")
    for name, row in dofs.write().items():
        if row >= size:
            raise ValueError(f"`dofs`: {name!r} must have a row from 0 to {size - 1}, got {row}")
    if M is not None and not joined:
        check_definite(M.array)


def check_definite(M: NDArray[Any]) -> None:
    """Raise ValueError unless a mass matrix, symmetric or Hermitian, is positive definite."""
    diagonal = np.diag(M).real
    if diagonal.min() <= 0.0:
        row = int(diagonal.argmin())
        raise ValueError(
            f"`M` must be positive definite, got {diagonal[row]:g} on the diagonal of row {row}: "
            "a DOF without mass must be condensed out first"
        )
    try:
        np.linalg.cholesky(M)
    except np.linalg.LinAlgError as error:
        least = float(np.linalg.eigvalsh(M)[0])
        raise ValueError(f"`M` must be positive definite, got the eigenvalue {least:g}") from error
