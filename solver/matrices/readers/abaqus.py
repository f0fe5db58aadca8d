"""Matrices that Abaqus and CalculiX write as text.

Abaqus (``*MATRIX OUTPUT`` after ``*MATRIX GENERATE``, files ``.mtx``), from its Analysis User's Guide
("Generating matrices", and ``*MATRIX INPUT`` in the Keywords Guide): MATRIX INPUT has ``node, DOF, node, DOF,
value`` a line, COORDINATE has row, column (from 1) and value. Of a symmetric matrix one triangle or all is
there. A DOF that a boundary condition holds has 1e36 on the diagonal of the stiffness; nodes below 0 are
internal ones of Abaqus.

CalculiX (``*FREQUENCY, SOLVER=MATRIXSTORAGE``: ``.sti``, ``.mas`` and ``.dof``). As its routine
``matrixstorage`` writes them: a line for each entry of one triangle, row, column (from 1) and value; the file
``.dof`` names the rows, ``node.direction`` a line.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from solver.matrices.labels import Label, component, distinct, label, node_number
from solver.matrices.readers.numbers_in_text import LARGEST, FormatError, ascii_lines, table, whole_numbers
from solver.matrices.readers.reader_registry import MOST_ROWS, Labelled, Reader, mirrored

_HELD = 1e30  # diagonal entries from here on are the penalty of a boundary condition
_LINE = "node, DOF, node, DOF and value (or row, column and value)"
_COMMENT = "**"
_HARWELL_BOEING = ("RSA", "RUA", "RRA", "PSA", "PUA")


def read_abaqus(path: Path) -> Labelled:
    """Read a matrix in one of the text formats.

    Raises
    ------
    FormatError
        With the line that leaves the format.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a matrix of Abaqus")
    for number, line in enumerate(lines, start=1):
        if line.startswith("*") and not line.startswith(_COMMENT):
            raise FormatError(
                f"line {number}: {line.strip()[:60]!r} belongs to matrices of elements or substructures: "
                "write the assembled ones by *MATRIX GENERATE and *MATRIX OUTPUT, FORMAT=MATRIX INPUT"
            )
    _other_format(lines)
    data = table(lines, (5, 3), _LINE, _COMMENT)
    if data.shape[1] == 3:
        _refuse_counts(data)
        return _coordinate(data, lines, _COMMENT)
    rows, columns, labels = _places(data, lines)
    size = len(labels)
    matrix = mirrored(rows, columns, data[:, 4], size)
    stiff = (rows == columns) & (data[:, 4] >= _HELD)
    return Labelled(matrix=matrix, labels=labels, held=frozenset(labels[row] for row in rows[stiff]))


def _other_format(lines: list[str]) -> None:
    """Refuse what another program wrote, by its name."""
    if lines and lines[0].lstrip().startswith("%"):
        raise FormatError(
            "line 1 is a comment of MatrixMarket, whose first line must be `%%MatrixMarket matrix coordinate "
            "real symmetric` (or `general`): put it back"
        )
    if len(lines) > 2 and lines[2][:3].upper() in _HARWELL_BOEING:
        raise FormatError(
            "line 3 is that of a Harwell-Boeing matrix (HBMAT of Ansys): let its name end in .matrix or .rsa"
        )


def _refuse_counts(data: NDArray[np.float64]) -> None:
    """Refuse a first line that counts what follows."""
    if data[0, 0] == data[0, 1] == data[:, :2].max() and len(data) > 1 and data[0, 2] == len(data) - 1:
        raise FormatError(
            "line 1 counts rows, columns and entries, as in MatrixMarket: its first line, `%%MatrixMarket "
            "matrix coordinate real symmetric` (or `general`), is missing"
        )


def _coordinate(data: NDArray[np.float64], lines: list[str], comment: str = "") -> Labelled:
    rows, columns = (
        whole_numbers(data[:, i], 1, what, lines, comment) - 1 for i, what in ((0, "row"), (1, "column"))
    )
    size = int(max(rows.max(), columns.max())) + 1
    if size > MOST_ROWS:
        raise FormatError(f"a matrix may have {MOST_ROWS} rows, got {size}")
    return Labelled(matrix=mirrored(rows, columns, data[:, 2], size), sized=False)


def _places(
    data: NDArray[np.float64], lines: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[Label, ...]]:
    """Rows and columns of the entries, and the labels: those of the file, sorted by node and DOF."""
    nodes = [whole_numbers(data[:, i], -LARGEST, "node", lines, _COMMENT) for i in (0, 2)]
    dofs = [whole_numbers(data[:, i], 0, "DOF", lines, _COMMENT) for i in (1, 3)]
    width = int(max(dofs[0].max(), dofs[1].max())) + 1
    keys = [node * width + dof for node, dof in zip(nodes, dofs, strict=True)]
    known, places = np.unique(np.concatenate(keys), return_inverse=True)
    labels = tuple(Label(int(key // width), component(str(key % width))) for key in known)
    rows, columns = places[: keys[0].size], places[keys[0].size :]
    return rows.astype(np.int64), columns.astype(np.int64), labels


def _calculix(path: Path, _key: str) -> Labelled:
    lines = ascii_lines(path, "a matrix of CalculiX")
    return _coordinate(table(lines, (3,), "row, column and value"), lines)


def _labels(path: Path) -> tuple[Label, ...]:
    """``node.direction`` a line."""
    lines = ascii_lines(path, "a file of DOF labels")
    labels = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        found = label(line)
        if found is None:
            raise FormatError(f"line {number} must hold node.direction, got {line.strip()[:80]!r}")
        labels.append(Label(node_number(str(found.node), number), found.component))
    return distinct(labels, len(lines))


READERS = (
    Reader(
        name="Abaqus",
        suffixes=(".mtx",),
        word="mtx",
        help="Abaqus, `*MATRIX OUTPUT` in the formats `MATRIX INPUT` (names the rows) and `COORDINATE`; told "
        "from MatrixMarket by its first line. DOFs that a boundary condition holds (1e36 on the diagonal) "
        "are left out.",
        matrix=lambda path, _key: read_abaqus(path),
    ),
    Reader(
        name="CalculiX",
        suffixes=(".sti", ".mas"),
        word="sti",
        help="CalculiX, `*FREQUENCY, SOLVER=MATRIXSTORAGE`: stiffness and mass; `name.dof` beside them names "
        "the rows.",
        matrix=_calculix,
        global_rows=True,
        roles={".mas": "M", ".sti": "K"},
    ),
    Reader(
        name="CalculiX labels",
        suffixes=(".dof",),
        word="dof",
        help="CalculiX, or of your own: names the rows (`node.direction` a line).",
        labels=_labels,
    ),
)
