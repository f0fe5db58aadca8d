"""Numbers in text files of matrices, quickly where all is well; labels of rows such as ``1203.UX``.

Ansys and CalculiX write them in files of their own (``name.mapping``, ``name.dof``), which have readers;
Abaqus and Nastran (DMIG) have them in the lines of the matrix.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

COMPONENTS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
OWN_COMPONENTS = ("U1", "U2", "U3", "UR1", "UR2", "UR3")
"""Along and about the axes of a node's own frame, where it could not be turned into the global one."""


class Label(NamedTuple):
    """A node and a component of its motion: ``UX`` to ``ROTZ``, or what the file calls it."""

    node: int
    component: str

    def __str__(self) -> str:
        return f"{self.node}.{self.component}"

    @property
    def rotation(self) -> bool:
        """Whether it is an angle."""
        return self.component in COMPONENTS[3:] + OWN_COMPONENTS[3:]

    @property
    def place(self) -> tuple[int, int, str]:
        """What labels are sorted by: node, then UX to ROTZ, then the rest."""
        known = self.component in COMPONENTS
        return self.node, COMPONENTS.index(self.component) if known else len(COMPONENTS), self.component


_ALIASES = {
    **{str(i): name for i, name in enumerate(COMPONENTS, start=1)},
    **{f"T{i}": name for i, name in enumerate(COMPONENTS[:3], start=1)},
    **{f"R{i}": name for i, name in enumerate(COMPONENTS[3:], start=1)},
    **{f"R{axis}": f"ROT{axis}" for axis in "XYZ"},
    **{axis: f"U{axis}" for axis in "XYZ"},
}
_TEXT = re.compile(r"(-?\d{1,10})\.([A-Za-z]{1,4}\d?|\d{1,2})")


def component(text: str) -> str:
    """The name of a component: ``1``, ``T1``, ``X`` and ``ux`` are ``UX``."""
    upper = text.strip().upper()
    return _ALIASES.get(upper, upper)


def label(text: str) -> Label | None:
    """The label a text such as ``1203.UX``, ``1203.1`` or ``1203.T1`` is; None if it is none."""
    found = _TEXT.fullmatch(text.strip())
    return Label(int(found[1]), component(found[2])) if found else None


def distinct(labels: Sequence[Label], n_lines: int) -> tuple[Label, ...]:
    """The labels of all rows, each of them one row's.

    Raises
    ------
    FormatError
        There are none in the `n_lines` of the file, or two rows have the same.
    """
    if not labels:
        raise FormatError(f"line {n_lines + 1} is missing: the file names no row")
    seen: dict[Label, int] = {}
    for row, found in enumerate(labels):
        if seen.setdefault(found, row) != row:
            raise FormatError(f"rows {seen[found] + 1} and {row + 1} are both {found}")
    return tuple(labels)


def node_number(text: str, line: int) -> int:
    """The number of a node in a line.

    Raises
    ------
    FormatError
        It is too large.
    """
    if abs(int(text)) > LARGEST:
        raise FormatError(f"line {line}: a node number may be {LARGEST}, got {text}")
    return int(text)


LARGEST = 2**31 - 1
_EXPONENT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]([+-]?\d+)|([+-]\d+))")


class FormatError(ValueError):
    """A file that does not follow its format; the message names the line or the byte."""


def ascii_lines(path: Path, what: str) -> list[str]:
    """The lines of a text file.

    Raises
    ------
    FormatError
        A byte that is not ASCII.
    OSError
        The file cannot be read.
    """
    try:
        return path.read_bytes().decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise FormatError(f"byte {error.start} is not ASCII: not {what}") from error


def fortran_real(text: str) -> float:
    """A number as Fortran and Nastran write it: 1.5E+3, 1.5D+3, 1.5+3.

    Raises
    ------
    ValueError
        It is not a number.
    """
    try:
        return float(text)
    except ValueError:
        found = _EXPONENT.fullmatch(text.strip())
        if found is None:
            raise
        return float(f"{found[1]}E{found[2] or found[3]}")


def table(lines: list[str], columns: tuple[int, ...], what: str, comment: str = "") -> NDArray[np.float64]:
    """The rows of numbers in `lines`, separated by blanks or commas; as many as one of `columns` says.

    Parameters
    ----------
    what : what a line must hold, for the message.
    comment : what lines begin with that say nothing.

    Returns
    -------
    (n, columns) array

    Raises
    ------
    FormatError
        With the line (counted from 1) that holds something else.
    """
    data = [line for line in lines if not comment or not line.startswith(comment)] if comment else lines
    first = next((line for line in data if line.strip()), None)
    if first is None:
        raise FormatError(f"line 1: the file holds no line with {what}")
    separator = "," if "," in first else None
    try:
        found = np.loadtxt(io.StringIO("\n".join(data)), delimiter=separator, comments=None, ndmin=2)
    except ValueError as error:
        raise FormatError(_first_bad(lines, columns, what, comment) or str(error)) from error
    if found.shape[1] not in columns:
        raise FormatError(_first_bad(lines, columns, what, comment) or f"every line must hold {what}")
    return np.asarray(found, dtype=np.float64)


def _first_bad(lines: list[str], columns: tuple[int, ...], what: str, comment: str) -> str | None:
    """The message about the first line that cannot be read."""
    count = 0
    for number, line in enumerate(lines, start=1):
        words = line.replace(",", " ").split()
        if not words or (comment and line.startswith(comment)):
            continue
        if len(words) not in ((count,) if count else columns):
            return f"line {number} must hold {what}, got {line.strip()[:80]!r}"
        count = len(words)
        if (bad := no_number(words, number)) is not None:
            return bad
    return None


def no_number(words: Sequence[str], line: int) -> str | None:
    """The message about the first word of a line that is no number; None if all are."""
    for word in words:
        try:
            float(word)
        except ValueError:
            return f"line {line}: {word[:40]!r} is not a number"
    return None


def whole_numbers(
    values: NDArray[np.float64], least: int, what: str, lines: list[str], comment: str = ""
) -> NDArray[np.int64]:
    """A column of a table as whole numbers.

    Raises
    ------
    FormatError
        With the line of one that is not whole, below `least` or too large.
    """
    bad = np.flatnonzero(~((values >= least) & (values <= LARGEST) & (values == np.floor(values))))
    if bad.size:
        numbers = [
            i
            for i, line in enumerate(lines, start=1)
            if line.strip() and not (comment and line.startswith(comment))
        ]
        raise FormatError(
            f"line {numbers[bad[0]]}: the {what} must be a whole number from {least}, got {values[bad[0]]:g}"
        )
    return values.astype(np.int64)
