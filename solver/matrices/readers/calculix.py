"""Matrices that CalculiX stores (``*FREQUENCY, SOLVER=MATRIXSTORAGE``): ``.sti``, ``.mas`` and ``.dof``.

As its routine ``matrixstorage`` writes them: a line for each entry of one triangle, row, column (from 1) and
value; the file ``.dof`` names the rows, ``node.direction`` a line.
"""

from __future__ import annotations

from pathlib import Path

from solver.matrices.labels import distinct, label, node_number
from solver.matrices.readers.label import Label
from solver.matrices.readers.numbers_in_text import FormatError, ascii_lines, table, whole_numbers
from solver.matrices.readers.reader import Reader
from solver.matrices.readers.triplets import MOST_ROWS, Labelled, mirrored


def read_calculix(path: Path) -> Labelled:
    """Read a stored matrix.

    Raises
    ------
    FormatError
        With the line that leaves the format.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a matrix of CalculiX")
    data = table(lines, (3,), "row, column and value")
    rows, columns = (whole_numbers(data[:, i], 1, what, lines) - 1 for i, what in ((0, "row"), (1, "column")))
    size = int(max(rows.max(), columns.max())) + 1
    if size > MOST_ROWS:
        raise FormatError(f"a matrix may have {MOST_ROWS} rows, got {size}")
    return Labelled(matrix=mirrored(rows, columns, data[:, 2], size), sized=False)


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
        name="CalculiX",
        suffixes=(".sti", ".mas"),
        word="sti",
        help="CalculiX, `*FREQUENCY, SOLVER=MATRIXSTORAGE`: stiffness and mass; `name.dof` beside them names "
        "the rows.",
        matrix=lambda path, _key: read_calculix(path),
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
