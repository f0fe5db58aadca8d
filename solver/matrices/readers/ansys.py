"""Matrices of Ansys: ``HBMAT`` in the Harwell-Boeing format, and the ``.mapping`` that names their rows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from solver.matrices.labels import component, distinct, node_number
from solver.matrices.readers.harwell_boeing import read_harwell_boeing
from solver.matrices.readers.label import Label
from solver.matrices.readers.numbers_in_text import FormatError, ascii_lines
from solver.matrices.readers.reader import Reader


def _matrix(path: Path, _key: str) -> Any:
    return read_harwell_boeing(path)


def _labels(path: Path) -> tuple[Label, ...]:
    """A heading, then equation, node and DOF a line, as HBMAT writes them with its last argument YES."""
    lines = ascii_lines(path, "a file of DOF labels")
    labels: list[Label] = []
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or (not labels and words[0].upper().startswith("MATRIX")):
            continue
        whole = all(re.fullmatch(r"-?\d{1,10}", word) for word in words[:2])
        if len(words) != 3 or not whole:
            raise FormatError(f"line {number} must hold equation, node and DOF, got {line.strip()[:80]!r}")
        if int(words[0]) != len(labels) + 1:
            raise FormatError(f"line {number} must be equation {len(labels) + 1}, got {words[0]}")
        labels.append(Label(node_number(words[1], number), component(words[2])))
    return distinct(labels, len(lines))


READERS = (
    Reader(
        name="Ansys HBMAT",
        suffixes=(".matrix",),
        word="hb",
        help="Ansys, `HBMAT` (`ASCII`): Harwell-Boeing under Ansys' usual ending; call the file so. "
        "`name.mapping` beside it names the rows.",
        matrix=_matrix,
    ),
    Reader(
        name="Ansys mapping",
        suffixes=(".mapping",),
        word="mapping",
        help="Ansys, `HBMAT` with its last argument `YES`: names the rows (equation, node and DOF a line).",
        labels=_labels,
    ),
)
