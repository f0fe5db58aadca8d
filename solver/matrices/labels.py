"""Which node and component each row of a matrix is: labels such as ``1203.UX``, from files and in texts.

Ansys and CalculiX write them in files of their own (``name.mapping``, ``name.dof``), which have readers;
Abaqus and Nastran (DMIG) have them in the lines of the matrix.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from solver.matrices.readers import registry
from solver.matrices.readers.label import COMPONENTS, Label
from solver.matrices.readers.numbers_in_text import LARGEST, FormatError

_OF_ONES_OWN = ".dof"
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


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read the labels of all rows from a file that names them; one of an unknown ending as `.dof`.

    Raises
    ------
    FormatError
        With the line that holds no label, or one of another row again.
    OSError
        The file cannot be read.
    """
    suffix = path.suffix.lower()
    suffix = suffix if suffix in registry.label_suffixes() else _OF_ONES_OWN
    read = next(one.labels for one in registry.readers() if one.labels is not None and suffix in one.suffixes)
    return read(path)


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


def labels_beside(path: Path) -> Path | None:
    """The file of labels that stands beside a matrix under the same name, if there is one."""
    for suffix in registry.label_suffixes():
        for name in (path.with_suffix(suffix), path.with_suffix(suffix.upper())):
            if name.is_file():
                return name
    return None
