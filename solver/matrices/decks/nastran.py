"""Nodes of a Nastran deck: GRID and GRDSET in the systems CORD1R … CORD2S, small, large and free fields.

A GRID is placed in one system (CP) and moves along the axes of another (CD): MSC Nastran Quick Reference
Guide, entries GRID, GRDSET, CORD1C, CORD2C, CORD2S.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from solver.arrays import Real
from solver.matrices.decks.deck import GLOBAL, CoordinateKind, CoordinateSystem, Deck, DeckFile, axes_by, real
from solver.matrices.readers.numbers_in_text import FormatError

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
            self.known[number] = self._made(number)
            self.open.pop()
        return self.known[number]

    def place(self, node: int) -> Real:
        if node not in self.grids:
            raise FormatError(f"there is no GRID {node}, by which a coordinate system is defined")
        cp, numbers, _ = self.grids[node]
        return np.asarray(self.system(cp).places(numbers[None, :])[0])

    def _made(self, number: int) -> CoordinateSystem:
        """By three points: the origin, one on z, one on the side of x in the plane of x and z."""
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
        return CoordinateSystem(_KINDS[found[2]], points[0], axes)


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
