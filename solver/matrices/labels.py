"""Which node and component each row of a matrix is: labels such as ``1203.UX``, from files and in texts.

Ansys and CalculiX write them in files of their own (``name.mapping``, ``name.dof``), which have readers;
Abaqus and Nastran (DMIG) have them in the lines of the matrix.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from solver.matrices.readers.numbers_in_text import LARGEST, FormatError

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
