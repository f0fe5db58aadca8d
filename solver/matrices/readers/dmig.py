"""Matrices as DMIG entries of Nastran's bulk data: punch files ``.pch``, or ``.dmig`` and ``.bdf``.

From the Quick Reference Guide: a heading ``DMIG, NAME, 0, form, type, …``, then for each column ``DMIG,
NAME, node, component`` and triples node, component, value, four fields in
(`solver.matrices.decks.nastran.bulk_entries`). Of a symmetric matrix (form 6) one triangle is given. A scalar
point has component 0 or none.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array

from solver.matrices.decks.nastran import bulk_entries
from solver.matrices.labels import Label, component
from solver.matrices.readers.numbers_in_text import LARGEST, FormatError, ascii_lines, fortran_real
from solver.matrices.readers.output4 import SQUARE, SYMMETRIC
from solver.matrices.readers.reader_registry import (
    Labelled,
    Reader,
    chosen_by_initials,
    mirrored,
    named_by_role,
)


@dataclass(slots=True)
class _Entries:
    """A matrix that is read entry by entry."""

    form: int
    rows: list[Label] = field(default_factory=list)
    columns: list[Label] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def matrix(self) -> Labelled:
        """What was read, its rows sorted by node and component."""
        labels = tuple(sorted({*self.rows, *self.columns}, key=lambda label: label.place))
        row = {label: i for i, label in enumerate(labels)}
        rows, columns = (
            np.array([row[label] for label in side], dtype=np.int64) for side in (self.rows, self.columns)
        )
        values, size = np.array(self.values), len(labels)
        if self.form == SYMMETRIC:
            return Labelled(matrix=mirrored(rows, columns, values, size), labels=labels)
        return Labelled(matrix=coo_array((values, (rows, columns)), shape=(size, size)), labels=labels)


def read_dmig(path: Path) -> dict[str, Labelled]:
    """Read all square real matrices of a file, by name; other entries are passed over.

    Raises
    ------
    FormatError
        With the line that leaves the format.
    OSError
        The file cannot be read.
    """
    found: dict[str, _Entries | None] = {}
    others: list[str] = []
    lines = enumerate(ascii_lines(path, "a file of DMIG entries"), start=1)
    for entry in bulk_entries(lines, "DMIG".__eq__):
        line, fields = entry.line, [entry.name, *entry.fields]
        name = fields[1].upper()
        if fields[2] == "0":
            if name in found:
                raise FormatError(f"line {line}: the file holds two matrices {name!r}")
            why = _passed_over(fields)
            found[name] = None if why else _Entries(form=int(fields[3]))
            if why:
                others.append(f"line {line}: {name!r} {why}")
            continue
        if name not in found:
            raise FormatError(f"line {line}: a column of {name!r} stands before its heading")
        entries = found[name]
        if entries is not None:
            _column(entries, fields, line)
    kept = {name: entries for name, entries in found.items() if entries is not None}
    if not kept:
        raise FormatError("; ".join(others[:3]) or "line 1: the file holds no DMIG entry")
    for name, entries in kept.items():
        if not entries.values:
            raise FormatError(f"the matrix {name!r} has a heading but no entries")
    return {name: entries.matrix() for name, entries in kept.items()}


def _passed_over(fields: list[str]) -> str:
    """Why a matrix is none of M, K and C: loads are rectangular, some are complex; empty if it may be one."""
    form, kind = fields[3], fields[4]
    if form not in ("1", "6"):
        return f"must have the form {SQUARE} (square) or {SYMMETRIC} (symmetric), got {form!r}"
    if kind not in ("1", "2"):
        return f"must be of the type 1 or 2 (real), got {kind!r}"
    return ""


def _column(entries: _Entries, fields: list[str], line: int) -> None:
    column = _label(fields[2], fields[3], line)
    if not any(fields[5:]):
        raise FormatError(f"line {line}: the column {column} has no entries")
    # A triple takes four fields: node, component, value, and the imaginary part that real ones leave empty.
    for at in range(5, len(fields), 4):
        node, part, value, imaginary = (*fields[at : at + 4], "", "", "")[:4]
        if not any((node, part, value)):
            continue
        if imaginary and _number(imaginary, line) != 0.0:
            raise FormatError(f"line {line}: a real matrix has no imaginary part, got {imaginary!r}")
        entries.rows.append(_label(node, part, line))
        entries.columns.append(column)
        entries.values.append(_number(value, line))


def _label(node: str, part: str, line: int) -> Label:
    if not node.isdecimal() or not 0 < int(node) <= LARGEST:
        raise FormatError(f"line {line}: a node must be a whole number from 1, got {node!r}")
    text = part or "0"
    if not text.isdecimal() or int(text) > 6:
        raise FormatError(f"line {line}: a component must be 1 to 6, or 0 of a scalar point, got {text!r}")
    return Label(int(node), component(text))


def _number(text: str, line: int) -> float:
    try:
        return fortran_real(text)
    except ValueError:
        raise FormatError(f"line {line}: {text!r} is not a number") from None


READERS = (
    Reader(
        name="Nastran DMIG",
        suffixes=(".pch", ".dmig", ".bdf"),
        word="pch",
        help="Nastran, `DMIG` entries in small, large or free fields, symmetric or square; other entries are "
        "passed over. They name the rows.",
        matrix=lambda path, key: chosen_by_initials(read_dmig(path), key, path),
        names=lambda path: named_by_role(list(read_dmig(path))),
    ),
)
