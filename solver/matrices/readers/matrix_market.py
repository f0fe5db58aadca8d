"""Matrices in the MatrixMarket exchange format.

R. F. Boisvert, R. Pozo, K. A. Remington, The Matrix Market Exchange Formats, NISTIR 5935, 1996: a banner,
comments, a line of sizes, then the entries one a line, or all of them column by column. Read here and not by
SciPy, whose reader ends the process at some damaged files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from solver.matrices.readers.numbers_in_text import LARGEST, FormatError, ascii_lines, no_number
from solver.matrices.readers.reader_registry import Reader

_FIELDS = {"real": 1, "integer": 1, "complex": 2}
_SYMMETRIES = ("general", "symmetric", "skew-symmetric", "hermitian")

Values = NDArray[np.float64] | NDArray[np.complex128]


def read_matrix_market(path: Path) -> coo_array:
    """Read a matrix of numbers.

    Raises
    ------
    FormatError
        With the line (counted from 1) where the file leaves the format.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a MatrixMarket file")
    layout, field, symmetry = _banner(lines[0] if lines else "")
    first = next((i for i, line in enumerate(lines) if i and line.strip() and not line.startswith("%")), None)
    if first is None:
        raise FormatError(f"line {len(lines) + 1} is missing: it says how large the matrix is")
    rows, columns, *entries = _sizes(lines[first], first + 1, 3 if layout == "coordinate" else 2)
    if symmetry != "general" and rows != columns:
        raise FormatError(f"line {first + 1}: a {symmetry} matrix is square, got {rows} x {columns}")
    if entries:
        width = 2 + _FIELDS[field]
        numbers = _numbers(lines, first + 1, entries[0] * width).reshape(-1, width)
        places = [_indices(numbers[:, i], most, lines, first + 1) for i, most in ((0, rows), (1, columns))]
        row, column, values = places[0], places[1], _values(numbers[:, 2:])
    else:
        row, column = _dense_places(rows, columns, symmetry, lines, first + 1, _FIELDS[field])
        values = _values(_numbers(lines, first + 1, row.size * _FIELDS[field]).reshape(-1, _FIELDS[field]))
    return _whole(row, column, values, symmetry, (rows, columns))


def _banner(line: str) -> tuple[str, str, str]:
    words = line.lower().split()
    if len(words) != 5 or words[0] != "%%matrixmarket" or words[1] != "matrix":
        raise FormatError(f"line 1 must be '%%MatrixMarket matrix …', got {line[:80]!r}")
    layout, field, symmetry = words[2:]
    if field == "pattern":
        raise FormatError("line 1: a pattern has no values")
    if layout not in ("coordinate", "array") or field not in _FIELDS or symmetry not in _SYMMETRIES:
        raise FormatError(
            "line 1 must name coordinate or array, real, integer or complex, and the symmetry, "
            f"got {line[:80]!r}"
        )
    return layout, field, symmetry


def _sizes(line: str, number: int, count: int) -> list[int]:
    words = line.split()
    if len(words) != count or not all(word.isdigit() and int(word[:20]) <= LARGEST for word in words):
        what = "rows, columns and entries" if count == 3 else "rows and columns"
        raise FormatError(f"line {number} must hold the numbers of {what}, got {line.strip()[:80]!r}")
    return [int(word) for word in words]


def _numbers(lines: list[str], first: int, count: int) -> NDArray[np.float64]:
    """The numbers from a line on, as many as there must be."""
    words = " ".join(line for line in lines[first:] if not line.startswith("%")).split()
    if len(words) != count:
        raise FormatError(
            f"line {len(lines)}: the file ends after {len(words)} numbers, its line of sizes says {count}"
        )
    try:
        return np.array(words, dtype=np.float64)
    except ValueError as error:
        rows = ((line, n) for n, line in enumerate(lines[first:], first + 1) if not line.startswith("%"))
        bad = next(filter(None, (no_number(line.split(), n) for line, n in rows)), "a number cannot be read")
        raise FormatError(bad) from error


def _indices(values: NDArray[np.float64], most: int, lines: list[str], first: int) -> NDArray[np.int64]:
    bad = np.flatnonzero(~((values >= 1) & (values <= most) & (values == np.floor(values))))
    if bad.size:
        data = [n for n, line in enumerate(lines[first:], start=first + 1) if line.strip() and line[0] != "%"]
        number = data[min(int(bad[0]), len(data) - 1)]
        raise FormatError(
            f"line {number}: a row or column must be a whole number from 1 to {most}, got {values[bad[0]]:g}"
        )
    return values.astype(np.int64) - 1


def _values(numbers: NDArray[np.float64]) -> Values:
    return numbers[:, 0] if numbers.shape[1] == 1 else numbers[:, 0] + 1j * numbers[:, 1]


def _dense_places(
    rows: int, columns: int, symmetry: str, lines: list[str], first: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places of the numbers of a dense file, column by column; of a symmetric one the lower part."""
    strict = symmetry == "skew-symmetric"
    count = rows * columns if symmetry == "general" else rows * (rows - 1 if strict else rows + 1) // 2
    # Before anything of this size is made.
    if count * width != sum(len(line.split()) for line in lines[first:] if not line.startswith("%")):
        _numbers(lines, first, count * width)
    if symmetry == "general":
        places = np.indices((columns, rows)).reshape(2, -1)
        return places[1], places[0]
    column, row = np.triu_indices(rows, int(strict))
    return row, column


def _whole(
    row: NDArray[np.int64], column: NDArray[np.int64], values: Values, symmetry: str, shape: tuple[int, int]
) -> coo_array:
    """The matrix with both of its triangles."""
    if symmetry != "general":
        off = row != column
        other = np.conj(values[off]) if symmetry == "hermitian" else values[off]
        other = -other if symmetry == "skew-symmetric" else other
        row, column = np.concatenate([row, column[off]]), np.concatenate([column, row[off]])
        values = np.concatenate([values, other])
    return coo_array((values, (row, column)), shape=shape)


READERS = (
    Reader(
        name="MatrixMarket",
        suffixes=(".mtx",),
        word="mtx",
        media=("text/x-matrix-market", "application/x-matrix-market"),
        recognises=lambda start: start.startswith(b"%%"),
        help="MatrixMarket, which begins with `%%`.",
        matrix=lambda path, _key: read_matrix_market(path),
    ),
)
