"""Nastran: nodes of a deck (GRID and GRDSET in CORD1R … CORD2S), and matrices as DMIG entries (``.pch`` …).

A GRID is placed in one system (CP) and moves along the axes of another (CD): MSC Nastran Quick Reference
Guide, entries GRID, GRDSET, CORD1C, CORD2C, CORD2S.

From the Quick Reference Guide: a heading ``DMIG, NAME, 0, form, type, …``, then for each column ``DMIG,
NAME, node, component`` and triples node, component, value, four fields in
(`solver.matrices.decks.nastran.bulk_entries`). Of a symmetric matrix (form 6) one triangle is given. A scalar
point has component 0 or none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array

from solver.arrays import Real
from solver.matrices.decks.deck import GLOBAL, CoordinateKind, CoordinateSystem, Deck, DeckFile, axes_by, real
from solver.matrices.readers.numbers_in_text import (
    LARGEST,
    FormatError,
    Label,
    ascii_lines,
    component,
    fortran_real,
)
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
            column = _label(fields[2], fields[3], line)
            if not any(fields[5:]):
                raise FormatError(f"line {line}: the column {column} has no entries")
            # A triple takes four fields: node, component, value, and the imaginary part, empty of real ones.
            for at in range(5, len(fields), 4):
                node, part, value, imaginary = (*fields[at : at + 4], "", "", "")[:4]
                if not any((node, part, value)):
                    continue
                if imaginary and _number(imaginary, line) != 0.0:
                    raise FormatError(f"line {line}: a real matrix has no imaginary part, got {imaginary!r}")
                entries.rows.append(_label(node, part, line))
                entries.columns.append(column)
                entries.values.append(_number(value, line))
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


_KINDS = {"R": CoordinateKind.RECTANGULAR, "C": CoordinateKind.CYLINDRICAL, "S": CoordinateKind.SPHERICAL}
_CORD = re.compile(r"CORD([12])([RCS])")
_BASIC, _FLUID = 0, -1


@dataclass(slots=True)
class BulkEntry:
    """An entry of bulk data: the line it begins in, its name, and the fields behind it."""

    line: int
    name: str
    fields: list[str]

    def field(self, i: int, default: str = "") -> str:
        """Field i, or what stands for one that is empty."""
        text = self.fields[i] if i < len(self.fields) else ""
        return text or default

    def whole(self, i: int, default: str = "0") -> int:
        """Field i as a whole number."""
        return int(self.field(i, default))


@dataclass(slots=True)
class _Bulk:
    """What the bulk data say of nodes, as they say it."""

    grids: dict[int, tuple[int, Real, int]] = field(default_factory=dict)  # CP, numbers, CD
    cords: dict[int, BulkEntry] = field(default_factory=dict)
    known: dict[int, CoordinateSystem] = field(default_factory=lambda: {_BASIC: GLOBAL})
    open: list[int] = field(default_factory=list)  # systems that are being looked up

    def system(self, number: int) -> CoordinateSystem:
        """The system of a number."""
        if number not in self.known:
            if number not in self.cords:
                raise FormatError(f"there is no coordinate system {number} (CORD1R, CORD1C … CORD2S)")
            if number in self.open:
                raise FormatError(f"coordinate system {number} is defined by itself")
            self.open.append(number)
            # By three points: the origin, one on z, one on the side of x in the plane of x and z.
            entry = self.cords[number]
            found = _CORD.fullmatch(entry.name)
            if found is None:
                raise FormatError(f"line {entry.line}: {entry.name} must be one of CORD1R, CORD1C … CORD2S")
            if found[1] == "1":
                first = 0 if entry.whole(0) == number else 4
                points = np.array([self.place(entry.whole(first + i)) for i in (1, 2, 3)])
            else:
                given = np.array([real(entry.field(i)) for i in range(2, 11)]).reshape(3, 3)
                points = self.system(entry.whole(1)).places(given)
            try:
                axes = axes_by(2, points[1] - points[0], 0, points[2] - points[0])
            except ValueError as error:
                raise FormatError(f"coordinate system {number} is none: {error}") from error
            self.known[number] = CoordinateSystem(_KINDS[found[2]], points[0], axes)
            self.open.pop()
        return self.known[number]

    def place(self, node: int) -> Real:
        if node not in self.grids:
            raise FormatError(f"there is no GRID {node}, by which a coordinate system is defined")
        cp, numbers, _ = self.grids[node]
        return np.asarray(self.system(cp).places(numbers[None, :])[0])


def read_nastran(file: DeckFile, deck: Deck) -> None:
    """Read the nodes of a deck.

    Raises
    ------
    FormatError
        A line that cannot be read, or a coordinate system that is not there.
    """
    bulk, grids = _Bulk(), list[BulkEntry]()
    default: BulkEntry | None = None
    for entry in bulk_entries(_lines(file), _tells_of_nodes):
        try:
            if entry.name == "GRID":
                grids.append(entry)
            elif entry.name == "GRDSET":
                if default is not None:
                    raise FormatError(f"line {entry.line}: there may be one GRDSET")
                default = entry
            elif entry.name.startswith("CORD"):
                for at in (0, 4) if entry.name.startswith("CORD1") and entry.field(4) else (0,):
                    bulk.cords[entry.whole(at)] = entry
        except ValueError as error:
            raise _refusal(entry, error) from error
    for entry in grids:
        _grid(entry, default, bulk)
    by_system: dict[int, list[int]] = {}
    for node, (cp, _, cd) in bulk.grids.items():
        by_system.setdefault(cp, []).append(node)
        if cd not in (_BASIC, _FLUID):
            deck.systems[node] = bulk.system(cd)
    for cp, nodes in by_system.items():
        places = bulk.system(cp).places(np.array([bulk.grids[node][1] for node in nodes]))
        deck.nodes.update(zip(nodes, map(tuple, places.tolist()), strict=True))


def _grid(entry: BulkEntry, default: BulkEntry | None, bulk: _Bulk) -> None:
    cp, cd = ("0", "0") if default is None else (default.field(1, "0"), default.field(5, "0"))
    try:
        node = entry.whole(0, "")
        given = np.array([real(entry.field(i)) for i in (2, 3, 4)])
        found = entry.whole(1, cp), given, entry.whole(5, cd)
    except ValueError as error:
        raise _refusal(entry, error) from error
    before = bulk.grids.setdefault(node, found)
    if before[0] != found[0] or before[2] != found[2] or not np.array_equal(before[1], given):
        raise FormatError(f"line {entry.line}: GRID {node} is there already, at another place")


def _refusal(entry: BulkEntry, error: ValueError) -> FormatError:
    if isinstance(error, FormatError):
        return error
    return FormatError(f"line {entry.line} must hold a {entry.name}, got {', '.join(entry.fields)[:80]!r}")


def _tells_of_nodes(name: str) -> bool:
    return name in ("GRID", "GRDSET") or name.startswith("CORD")


def _lines(file: DeckFile) -> Iterator[tuple[int, str]]:
    """The lines of the bulk data with their numbers, files included in their place."""
    lines = list(file.lines())
    begins = [i for i, line in enumerate(lines) if re.match(r"\s*BEGIN\b", line, re.IGNORECASE)]
    if len(begins) > 1:
        raise FormatError(f"line {begins[1] + 1} begins further bulk data: give a deck without superelements")
    first = begins[0] + 1 if begins else 0
    for number, line in enumerate(lines[first:], first + 1):
        if line.startswith("="):
            raise FormatError(f"line {number} repeats an entry (=), which is not read: write every GRID")
        words = line.split("$")[0].split(None, 1)
        word = words[0].rstrip("*").upper() if words else ""
        if word == "ENDDATA":
            return
        if word == "INCLUDE":
            yield number, word
            yield from _lines(file.other(words[-1].strip().strip("'\""), number))
        else:
            yield number, line


def bulk_entries(lines: Iterable[tuple[int, str]], wanted: Callable[[str], bool]) -> Iterator[BulkEntry]:
    """The entries of bulk data whose names are wanted, continued lines joined to them.

    Fields are 8 characters wide, in entries and lines marked * 16, or separated by commas; a line that begins
    with a blank, + or * continues the one before.
    """
    current: BulkEntry | None = None
    for number, line in lines:
        text = line.split("$")[0].expandtabs(8).rstrip()
        if not text:
            continue
        named = text.strip() if text[0] == " " and text[:8].strip() else text
        head = re.split(r"[,\s]", named, maxsplit=1)[0]
        name = head.rstrip("*").upper()
        if name == "" or head[0] in "+*":
            if current is not None:
                current.fields += _fields(text, large=head.startswith("*"))
            continue
        if current is not None:
            yield current
        current = BulkEntry(number, name, _fields(text, large=head.endswith("*"))) if wanted(name) else None
    if current is not None:
        yield current


def _fields(text: str, *, large: bool) -> list[str]:
    """The fields of a line behind its first one: eight, or four large ones."""
    width, count = (16, 4) if large else (8, 8)
    if "," in text:
        parts = [part.strip() for part in text.split(",")][1 : count + 1]
        return parts + [""] * (count - len(parts))
    return [text[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
