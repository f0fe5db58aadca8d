"""Nodes of an Ansys deck (``CDWRITE``): ``NBLOCK``, ``N``, ``CMBLOCK``, with the angles of rotated nodes.

The angles turn a node's axes about z, then about the new x, then about the new y (Ansys command N). ``N``
takes its place in the active system: the global one, its cylinder ``CSYS,1``, or one of ``LOCAL``.
"""

from __future__ import annotations

import re

import numpy as np

from solver.matrices.decks.deck import (
    GLOBAL,
    CoordinateKind,
    CoordinateSystem,
    Deck,
    DeckFile,
    Members,
    ansys_axes,
    real,
)
from solver.matrices.readers.numbers_in_text import FormatError

# Commands, by the four letters that tell them, that make, move or turn nodes in ways that are not read.
_OTHERS = {
    "NGEN", "NSYM", "FILL", "NROT", "NMOD", "NANG", "NORA", "NSCA", "NUMM", "NUMC", "NREA", "NMES", "TRAN",
    "CDRE", "/INP", "*USE", "AMES", "VMES", "LMES", "VSWE", "NDEL",
}  # fmt: skip
_KINDS = {0: CoordinateKind.RECTANGULAR, 1: CoordinateKind.CYLINDRICAL}


class AnsysDeck:
    """Reads the nodes and components of a deck."""

    def __init__(self, file: DeckFile, deck: Deck) -> None:
        self._lines, self._deck = list(file.lines()), deck
        self._members = Members()
        cylinder = CoordinateSystem(CoordinateKind.CYLINDRICAL, GLOBAL.origin, GLOBAL.axes)
        self._known: dict[int, CoordinateSystem] = {0: GLOBAL, 1: cylinder}
        self._active = 0
        self._turned: dict[tuple[float, ...], CoordinateSystem] = {}

    def read(self) -> None:
        """Read all of it.

        Raises
        ------
        FormatError
            With the line that cannot be read.
        """
        at = 0
        while at < len(self._lines):
            upper = self._lines[at].strip().upper()
            if upper.startswith("NBLOCK"):
                at = self._nblock(at)
            elif upper.startswith("CMBLOCK"):
                at = self._cmblock(at)
            else:
                for text in upper.split("!")[0].split("$"):
                    self._command([part.strip() for part in text.split(",")], at + 1)
                at += 1

    def _command(self, parts: list[str], line: int) -> None:
        name = parts[0][:4]
        if name in _OTHERS:
            raise FormatError(
                f"line {line}: {parts[0]} makes or changes nodes, which is not read: write the finished "
                "nodes by CDWRITE, DB"
            )
        try:
            if name == "N":
                self._n(parts)
            elif name == "CSYS":
                self._active = int(parts[1] or 0) if len(parts) > 1 else 0
            elif name == "LOCA":
                # LOCAL,KCN,KCS,x,y,z,angles,PAR1,PAR2, which makes it the active one; or by CDWRITE.
                written = parts[1].startswith("R")
                number, kind = (
                    (int(text) for text in parts[3:5]) if written else (int(text or 0) for text in parts[1:3])
                )
                numbers = [real(text) for text in parts[5:] if written] or [real(text) for text in parts[3:]]
                numbers += [0.0] * (8 - len(numbers))
                before = self._known.get(number, GLOBAL)
                origin, angles = np.array(numbers[:3]), numbers[3:6]
                if written and parts[2] == "ANG":
                    origin, angles = before.origin, numbers[:3]
                if kind not in _KINDS or any(ratio not in (0.0, 1.0) for ratio in numbers[6:8]):
                    self._known.pop(number, None)
                else:
                    self._known[number] = CoordinateSystem(
                        _KINDS[kind], origin, ansys_axes(angles[0], angles[1], angles[2])
                    )
                self._active = self._active if written else number
            elif name in ("CLOC", "CS", "CSKP", "CSWP"):
                self._known.pop(int(parts[1]), None)  # another system under this number from here on
                self._active = int(parts[1])
        except FormatError as error:
            raise FormatError(f"line {line}: {error}") from error
        except (ValueError, IndexError) as error:
            raise FormatError(f"line {line} must hold numbers, got {','.join(parts)[:80]!r}") from error

    def _n(self, parts: list[str]) -> None:
        written = len(parts) > 2 and parts[1].startswith("R")  # by CDWRITE: N,R5.3,LOC,node,x,y,z
        at = 3 if written else 1
        node = int(parts[at]) if parts[at] else max(self._deck.nodes, default=0) + 1
        if node < 0:
            return  # the end of NBLOCK
        numbers = [real(text) for text in parts[at + 1 : at + 7]]
        numbers += [0.0] * (6 - len(numbers))
        if written and parts[2] == "ANG":
            self._turn(node, numbers[:3])
            return
        system = GLOBAL if written else self._system(self._active)
        x, y, z = system.places(np.array([numbers[:3]]))[0].tolist()
        self._deck.nodes[node] = (x, y, z)
        self._turn(node, [0.0, 0.0, 0.0] if written else numbers[3:])

    def _system(self, number: int) -> CoordinateSystem:
        if number not in self._known:
            raise FormatError(
                f"a node is placed in the coordinate system {number}, which is not read: known are 0, 1 and "
                "rectangular and circular ones of LOCAL"
            )
        return self._known[number]

    def _turn(self, node: int, angles: list[float]) -> None:
        key = tuple(angles)
        if not any(key):
            self._deck.systems.pop(node, None)
            return
        if key not in self._turned:
            self._turned[key] = CoordinateSystem(CoordinateKind.RECTANGULAR, np.zeros(3), ansys_axes(*key))
        self._deck.systems[node] = self._turned[key]

    def _form(self, at: int, pattern: str, name: str, example: str) -> tuple[int, ...]:
        """The numbers in the Fortran format of a block."""
        text = self._lines[at + 1].lower() if at + 1 < len(self._lines) else ""
        form = re.match(pattern, text)
        if form is None or "0" in form.groups():
            raise FormatError(f"line {at + 2} must hold the format of {name}, such as {example}")
        return tuple(int(one) for one in form.groups())

    def _nblock(self, at: int) -> int:
        heads, width, count, wide = self._form(
            at, r"\s*\((\d+)i(\d+),(\d+)e(\d+)", "NBLOCK", "(3i9,6e21.13e3)"
        )
        at, begin = at + 2, heads * width
        while at < len(self._lines) and not self._lines[at].strip().upper().startswith(("N,", "-1")):
            line = self._lines[at]
            try:
                given = [real(line[begin + i * wide : begin + (i + 1) * wide]) for i in range(min(count, 6))]
                given += [0.0] * (6 - len(given))
                node = int(line[:width])
            except ValueError as error:
                raise FormatError(f"line {at + 1} must hold a node of NBLOCK, got {line[:80]!r}") from error
            self._deck.nodes[node] = (given[0], given[1], given[2])
            self._turn(node, given[3:])
            at += 1
        return at

    def _cmblock(self, at: int) -> int:
        parts = [part.strip() for part in self._lines[at].split("!")[0].split(",")]
        if len(parts) < 4 or not parts[2].upper().startswith("NODE"):
            return at + 1
        _, width = self._form(at, r"\s*\((\d+)i(\d+)\)", "CMBLOCK", "(8i10)")
        members, left = list[int](), self._whole(parts[3], at)
        at += 2
        while left > 0 and at < len(self._lines):
            line = self._lines[at].rstrip()
            for begin in range(0, len(line), width):
                item = self._whole(line[begin : begin + width], at)
                if item <= 0 and not members:
                    raise FormatError(f"line {at + 1} ends a range that does not begin: {item}")
                try:
                    self._members.add(members, [item] if item > 0 else range(members[-1] + 1, 1 - item))
                except FormatError as error:
                    raise FormatError(f"line {at + 1}: {error}") from error
                left -= 1
            at += 1
        self._deck.sets[parts[1].upper()] = members
        return at

    @staticmethod
    def _whole(text: str, at: int) -> int:
        try:
            return int(text)
        except ValueError as error:
            raise FormatError(
                f"line {at + 1} of CMBLOCK must hold whole numbers, got {text[:80]!r}"
            ) from error
