"""A format of matrix files from outside the package: the diagonals of a symmetric matrix, a line each."""

from pathlib import Path

import numpy as np

from solver.matrices.readers.reader_registry import Reader


def banded(path: Path, _key: str) -> np.ndarray:
    """Diagonals of a symmetric matrix, a line each, below the line `BANDED`."""
    head, *lines = path.read_text(encoding="ascii").splitlines()
    if head != "BANDED":
        raise ValueError(f"line 1 must be BANDED, got {head[:40]!r}")
    rows = [np.array([float(word) for word in line.split()]) for line in lines]
    matrix = np.diag(rows[0])
    for offset, row in enumerate(rows[1:], start=1):
        matrix += np.diag(row, offset) + np.diag(row, -offset)
    return matrix


def begins(start: bytes) -> bool:
    return start.startswith(b"BANDED")


BANDED = Reader(
    name="banded text", suffixes=(".mband", ".kband"), word="kband", media=("text/x-banded",),
    recognises=begins, help="A program of one's own: diagonals, a line each.", matrix=banded,
    roles={".mband": "M", ".kband": "K"},
)  # fmt: skip
