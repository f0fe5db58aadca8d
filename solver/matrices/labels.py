"""Which node and component each row of a matrix is: labels such as ``1203.UX``, from files and in texts.

Ansys writes them with HBMAT (``…,,,YES`` gives ``name.mapping``: a heading, then equation, node and DOF a
line), CalculiX beside the stored matrices (``name.dof``: ``node.direction`` a line). Abaqus and Nastran
(DMIG) have them in the lines of the matrix.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from solver.matrices.readers.numbers_in_text import LARGEST, FormatError, ascii_lines

COMPONENTS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
LABEL_SUFFIXES = (".mapping", ".dof")
_ALIASES = {
    **{str(i): name for i, name in enumerate(COMPONENTS, start=1)},
    **{f"T{i}": name for i, name in enumerate(COMPONENTS[:3], start=1)},
    **{f"R{i}": name for i, name in enumerate(COMPONENTS[3:], start=1)},
    **{f"R{axis}": f"ROT{axis}" for axis in "XYZ"},
    **{axis: f"U{axis}" for axis in "XYZ"},
}
_TEXT = re.compile(r"(-?\d{1,10})\.([A-Za-z]{1,4}\d?|\d{1,2})")


class Label(NamedTuple):
    """A node and a component of its motion: ``UX`` to ``ROTZ``, or what the file calls it."""

    node: int
    component: str

    def __str__(self) -> str:
        return f"{self.node}.{self.component}"

    @property
    def rotation(self) -> bool:
        """Whether it is an angle."""
        return self.component in COMPONENTS[3:]

    @property
    def place(self) -> tuple[int, int, str]:
        """What labels are sorted by: node, then UX to ROTZ, then the rest."""
        known = self.component in COMPONENTS
        return self.node, COMPONENTS.index(self.component) if known else len(COMPONENTS), self.component


def component(text: str) -> str:
    """The name of a component: ``1``, ``T1``, ``X`` and ``ux`` are ``UX``."""
    upper = text.strip().upper()
    return _ALIASES.get(upper, upper)


def label(text: str) -> Label | None:
    """The label a text such as ``1203.UX``, ``1203.1`` or ``1203.T1`` is; None if it is none."""
    found = _TEXT.fullmatch(text.strip())
    return Label(int(found[1]), component(found[2])) if found else None


def read_labels(path: Path) -> tuple[Label, ...]:
    """Read the labels of all rows from a ``.mapping`` file of Ansys or a ``.dof`` file of CalculiX.

    Raises
    ------
    FormatError
        With the line that holds no label, or one of another row again.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a file of DOF labels")
    labels = _of_ansys(lines) if path.suffix.lower() == ".mapping" else _of_calculix(lines)
    if not labels:
        raise FormatError(f"line {len(lines) + 1} is missing: the file names no row")
    seen: dict[Label, int] = {}
    for row, found in enumerate(labels):
        if seen.setdefault(found, row) != row:
            raise FormatError(f"rows {seen[found] + 1} and {row + 1} are both {found}")
    return tuple(labels)


def _of_ansys(lines: Sequence[str]) -> list[Label]:
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
        labels.append(Label(_node(words[1], number), component(words[2])))
    return labels


def _of_calculix(lines: Sequence[str]) -> list[Label]:
    labels = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        found = label(line)
        if found is None:
            raise FormatError(f"line {number} must hold node.direction, got {line.strip()[:80]!r}")
        labels.append(Label(_node(str(found.node), number), found.component))
    return labels


def _node(text: str, line: int) -> int:
    if abs(int(text)) > LARGEST:
        raise FormatError(f"line {line}: a node number may be {LARGEST}, got {text}")
    return int(text)


def labels_beside(path: Path) -> Path | None:
    """The file of labels that stands beside a matrix under the same name, if there is one."""
    for suffix in LABEL_SUFFIXES:
        for name in (path.with_suffix(suffix), path.with_suffix(suffix.upper())):
            if name.is_file():
                return name
    return None
