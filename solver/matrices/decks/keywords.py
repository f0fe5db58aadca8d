"""Abaqus and CalculiX: nodes of a deck (``*NODE``, ``*NSET``, …), and the matrices that they write as text.

Abaqus Keywords Reference Guide under these names. ``*SYSTEM`` places the nodes behind it, ``*NODE, SYSTEM=C``
gives them by radius and angle, ``*TRANSFORM`` turns the axes along which they move, and ``*INSTANCE`` moves
and turns a part with all of it.

Abaqus (``*MATRIX OUTPUT`` after ``*MATRIX GENERATE``, files ``.mtx``), from its Analysis User's Guide
("Generating matrices", and ``*MATRIX INPUT`` in the Keywords Guide): MATRIX INPUT has ``node, DOF, node, DOF,
value`` a line, COORDINATE has row, column (from 1) and value. Of a symmetric matrix one triangle or all is
there. A DOF that a boundary condition holds has 1e36 on the diagonal of the stiffness; nodes below 0 are
internal ones of Abaqus.

CalculiX (``*FREQUENCY, SOLVER=MATRIXSTORAGE``: ``.sti``, ``.mas`` and ``.dof``). As its routine
``matrixstorage`` writes them: a line for each entry of one triangle, row, column (from 1) and value; the file
``.dof`` names the rows, ``node.direction`` a line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from solver.matrices.decks.deck import (
    GLOBAL,
    CoordinateKind,
    CoordinateSystem,
    Deck,
    DeckFile,
    Members,
    around,
    axes_by,
    elements_of,
    real,
    rotation,
    shape_of,
)
from solver.matrices.readers.numbers_in_text import (
    LARGEST,
    FormatError,
    Label,
    ascii_lines,
    component,
    distinct,
    label,
    node_number,
    table,
    whole_numbers,
)
from solver.matrices.readers.reader_registry import MOST_ROWS, Labelled, Reader, mirrored

_HELD = 1e30  # diagonal entries from here on are the penalty of a boundary condition
_LINE = "node, DOF, node, DOF and value (or row, column and value)"
_COMMENT = "**"
_HARWELL_BOEING = ("RSA", "RUA", "RRA", "PSA", "PUA")


def read_abaqus(path: Path) -> Labelled:
    """Read a matrix in one of the text formats.

    Raises
    ------
    FormatError
        With the line that leaves the format.
    OSError
        The file cannot be read.
    """
    lines = ascii_lines(path, "a matrix of Abaqus")
    for number, line in enumerate(lines, start=1):
        if line.startswith("*") and not line.startswith(_COMMENT):
            raise FormatError(
                f"line {number}: {line.strip()[:60]!r} belongs to matrices of elements or substructures: "
                "write the assembled ones by *MATRIX GENERATE and *MATRIX OUTPUT, FORMAT=MATRIX INPUT"
            )
    # What another program wrote is refused by its name.
    if lines and lines[0].lstrip().startswith("%"):
        raise FormatError(
            "line 1 is a comment of MatrixMarket, whose first line must be `%%MatrixMarket matrix coordinate "
            "real symmetric` (or `general`): put it back"
        )
    if len(lines) > 2 and lines[2][:3].upper() in _HARWELL_BOEING:
        raise FormatError(
            "line 3 is that of a Harwell-Boeing matrix (HBMAT of Ansys): let its name end in .matrix or .rsa"
        )
    data = table(lines, (5, 3), _LINE, _COMMENT)
    if data.shape[1] == 3:
        if data[0, 0] == data[0, 1] == data[:, :2].max() and len(data) > 1 and data[0, 2] == len(data) - 1:
            raise FormatError(
                "line 1 counts rows, columns and entries, as in MatrixMarket: its first line, "
                "`%%MatrixMarket matrix coordinate real symmetric` (or `general`), is missing"
            )
        return _coordinate(data, lines, _COMMENT)
    # The labels are those of the file, sorted by node and DOF.
    nodes = [whole_numbers(data[:, i], -LARGEST, "node", lines, _COMMENT) for i in (0, 2)]
    dofs = [whole_numbers(data[:, i], 0, "DOF", lines, _COMMENT) for i in (1, 3)]
    width = int(max(dofs[0].max(), dofs[1].max())) + 1
    keys = [node * width + dof for node, dof in zip(nodes, dofs, strict=True)]
    known, places = np.unique(np.concatenate(keys), return_inverse=True)
    labels = tuple(Label(int(key // width), component(str(key % width))) for key in known)
    rows, columns = places[: keys[0].size], places[keys[0].size :]
    rows, columns, labels = rows.astype(np.int64), columns.astype(np.int64), labels
    size = len(labels)
    matrix = mirrored(rows, columns, data[:, 4], size)
    stiff = (rows == columns) & (data[:, 4] >= _HELD)
    return Labelled(matrix=matrix, labels=labels, held=frozenset(labels[row] for row in rows[stiff]))


def _coordinate(data: NDArray[np.float64], lines: list[str], comment: str = "") -> Labelled:
    rows, columns = (
        whole_numbers(data[:, i], 1, what, lines, comment) - 1 for i, what in ((0, "row"), (1, "column"))
    )
    size = int(max(rows.max(), columns.max())) + 1
    if size > MOST_ROWS:
        raise FormatError(f"a matrix may have {MOST_ROWS} rows, got {size}")
    return Labelled(matrix=mirrored(rows, columns, data[:, 2], size), sized=False)


def _calculix(path: Path, _key: str) -> Labelled:
    lines = ascii_lines(path, "a matrix of CalculiX")
    return _coordinate(table(lines, (3,), "row, column and value"), lines)


def _labels(path: Path) -> tuple[Label, ...]:
    """``node.direction`` a line."""
    lines = ascii_lines(path, "a file of DOF labels")
    labels = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        found = label(line)
        if found is None:
            raise FormatError(f"line {number} must hold node.direction, got {line.strip()[:80]!r}")
        labels.append(Label(node_number(str(found.node), number), found.component))
    return distinct(labels, len(lines))


READERS = (
    Reader(
        name="Abaqus",
        suffixes=(".mtx",),
        word="mtx",
        help="Abaqus, `*MATRIX OUTPUT` in the formats `MATRIX INPUT` (names the rows) and `COORDINATE`; told "
        "from MatrixMarket by its first line. DOFs that a boundary condition holds (1e36 on the diagonal) "
        "are left out.",
        matrix=lambda path, _key: read_abaqus(path),
    ),
    Reader(
        name="CalculiX",
        suffixes=(".sti", ".mas"),
        word="sti",
        help="CalculiX, `*FREQUENCY, SOLVER=MATRIXSTORAGE`: stiffness and mass; `name.dof` beside them names "
        "the rows.",
        matrix=_calculix,
        global_rows=True,
        roles={".mas": "M", ".sti": "K"},
    ),
    Reader(
        name="CalculiX labels",
        suffixes=(".dof",),
        word="dof",
        help="CalculiX, or of your own: names the rows (`node.direction` a line).",
        labels=_labels,
    ),
)


_MAKERS = ("*NGEN", "*NFILL", "*NCOPY", "*NMAP", "*IMPERFECTION")
_BARE = re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')  # a comma outside of quotes
Data = list[tuple[int, str]]


@dataclass(slots=True)
class _Block:
    """A keyword line with its options and data lines."""

    line: int
    keyword: str
    options: dict[str, str]
    data: Data = field(default_factory=list)

    def numbers(self, row: int) -> list[float]:
        """The numbers of a data line; none where it is not there."""
        if row >= len(self.data):
            return []
        line, text = self.data[row]
        try:
            return [real(part) for part in text.rstrip(", ").split(",")]
        except ValueError as error:
            raise FormatError(f"line {line} must hold numbers, got {text[:80]!r}") from error

    def letter(self, option: str) -> str:
        """The first letter of an option, R where it is left out."""
        return self.options.get(option, "R")[:1].upper()

    def refusal(self, why: object) -> FormatError:
        return FormatError(f"line {self.line}: {self.keyword} {why}")


class KeywordDeck:
    """Reads the nodes, sets and, if they are asked for, elements of a deck."""

    def __init__(self, file: DeckFile, deck: Deck, *, elements: bool) -> None:
        self._file, self._whole, self._elements = file, deck, elements
        self._here = deck  # the part that is read, or the whole
        self._parts: dict[str, Deck] = {}
        self._instance: _Block | None = None
        self._any_instance = False
        self._system = GLOBAL
        self._transforms: list[_Block] = []
        self._members = Members()

    def read(self) -> None:
        """Read all of it.

        Raises
        ------
        FormatError
            With the line that cannot be read.
        """
        readers = {
            "*NODE": self._node, "*NSET": self._nset, "*SYSTEM": self._by_system, "*PART": self._part,
            "*TRANSFORM": self._transforms.append, "*INSTANCE": self._begin, "*END PART": self._end_part,
            "*END INSTANCE": self._end, "*ELEMENT": self._element,
        }  # fmt: skip
        wanted = set(readers) if self._elements else set(readers) - {"*ELEMENT"}
        for block in _blocks(_lines(self._file), self._file, wanted):
            if block.keyword in _MAKERS:
                raise block.refusal("makes or moves nodes, which is not read: write all nodes by *NODE")
            if block.keyword in readers:
                readers[block.keyword](block)
        self._turn_nodes()

    def _node(self, block: _Block) -> None:
        kind = {"R": CoordinateKind.RECTANGULAR, "C": CoordinateKind.CYLINDRICAL}.get(block.letter("SYSTEM"))
        if kind is None:
            raise block.refusal(
                f"has SYSTEM={block.options['SYSTEM']}, which is not read: give SYSTEM=R (x, y, z) or C"
            )
        if not block.data:
            return
        nodes, given = list[int](), np.empty((len(block.data), 3))
        for i, (number, text) in enumerate(block.data):
            node, given[i] = _node(number, text)
            nodes.append(node)
        places = self._system.places(CoordinateSystem(kind, GLOBAL.origin, GLOBAL.axes).places(given))
        if self._any_instance and self._here is self._whole:
            both = set(nodes) & set(self._whole.nodes)
            if both:
                raise block.refusal(
                    f"of the assembly has the node {min(both)}, as the instance has: give them other numbers"
                )
        self._here.nodes.update(zip(nodes, map(tuple, places.tolist()), strict=True))
        if "NSET" in block.options:
            self._here.sets.setdefault(block.options["NSET"].upper(), []).extend(nodes)

    def _nset(self, block: _Block) -> None:
        if "NSET" not in block.options:
            return
        if "ELSET" in block.options:
            raise block.refusal(f"{block.options['NSET']!r} is that of elements: list its nodes")
        members = self._here.sets.setdefault(block.options["NSET"].upper(), [])
        for number, text in block.data:
            for some in _named(self._here, text, number, generate="GENERATE" in block.options):
                try:
                    self._members.add(members, some)
                except FormatError as error:
                    raise FormatError(f"line {number}: {error}") from error

    def _element(self, block: _Block) -> None:
        shape = shape_of(block.options.get("TYPE", "")) if self._elements and block.data else None
        if shape is not None:
            self._here.elements.append((shape, elements_of(shape, _whole(block.data), block.data[0][0])))

    def _by_system(self, block: _Block) -> None:
        first, second = block.numbers(0), block.numbers(1)
        first += [0.0] * (3 - len(first))
        origin = np.array(first[:3])
        if not any(first[3:]):
            self._system = CoordinateSystem(CoordinateKind.RECTANGULAR, origin, np.eye(3))
            return
        along = np.array([*first[3:], 0.0, 0.0][:3]) - origin
        try:
            if second:
                axes = axes_by(0, along, 1, np.array([*second, 0.0, 0.0][:3]) - origin)
            else:
                axes = axes_by(2, (0.0, 0.0, 1.0), 0, along)
        except ValueError as error:
            raise block.refusal(f"is none: {error}") from error
        self._system = CoordinateSystem(CoordinateKind.RECTANGULAR, origin, axes)

    def _turn_nodes(self) -> None:
        """The systems of *TRANSFORM, when all sets are known."""
        for block in self._transforms:
            name = block.options.get("NSET", "").upper()
            if name not in self._here.sets:
                raise block.refusal(f"names the set {name!r}, which is not there")
            system = _transform(block)
            self._here.systems.update(dict.fromkeys(self._here.sets[name], system))
        self._transforms.clear()

    def _part(self, block: _Block) -> None:
        self._here = self._parts.setdefault(block.options.get("NAME", "").upper(), Deck())
        self._system = GLOBAL

    def _end_part(self, _block: _Block) -> None:
        self._turn_nodes()
        self._here, self._system = self._whole, GLOBAL

    def _begin(self, block: _Block) -> None:
        if self._any_instance:
            raise block.refusal(
                "is the second one: the nodes of the matrices then have numbers of Abaqus' own; write the "
                "model without parts and assemblies (or as one part)"
            )
        name = block.options.get("PART", "").upper()
        if "LIBRARY" in block.options or (name and name not in self._parts):
            raise block.refusal(f"is of {name or 'a library'!r}, which is not in the deck")
        self._instance, self._any_instance, self._system = block, True, GLOBAL
        self._here = self._parts.get(name, Deck())

    def _end(self, _block: _Block) -> None:
        """The instance where it stands: shifted, then turned about a line."""
        block, part = self._instance, self._here
        if block is None:
            return
        self._turn_nodes()
        shift, turn = np.zeros(3), np.eye(3)
        first, second = block.numbers(0), block.numbers(1)
        shift[: len(first)] = first[:3]
        if second:
            if len(second) != 7:
                raise block.refusal(
                    f"must be turned about two points by an angle: 7 numbers, got {len(second)}"
                )
            a, b = np.array(second[:3]), np.array(second[3:6])
            if not np.any(a != b):
                raise block.refusal("must be turned about a line through two points, which are the same")
            turn = rotation(b - a, math.radians(second[6]))
            shift = turn @ (shift - a) + a
        moved = {id(system): system.moved(turn, shift) for system in part.systems.values()}
        whole = self._whole
        both = set(whole.nodes) & set(part.nodes)
        if both:
            raise block.refusal(f"has the node {min(both)}, as the assembly has: give them other numbers")
        for node, place in part.nodes.items():
            x, y, z = (turn @ np.array(place) + shift).tolist()
            whole.nodes[node] = (x, y, z)
        if np.any(turn != np.eye(3)) or moved:
            whole.systems.update({node: moved[id(system)] for node, system in part.systems.items()})
        for name, nodes in part.sets.items():
            whole.sets[name] = list(nodes)
            whole.sets[f"{block.options.get('NAME', '').upper()}.{name}"] = list(nodes)
        whole.elements.extend(part.elements)
        self._here, self._instance = whole, None


def _transform(block: _Block) -> CoordinateSystem:
    """R: a on x, b on the side of y; C and S: a line or pole from a to b. The first axis is the radius."""
    numbers = block.numbers(0)
    a, b = (np.array([*numbers[i : i + 3], 0.0, 0.0, 0.0][:3]) for i in (0, 3))
    letter = block.letter("TYPE")
    try:
        if letter == "R":
            return CoordinateSystem(CoordinateKind.RECTANGULAR, np.zeros(3), axes_by(0, a, 1, b))
        if letter == "C":
            return CoordinateSystem(CoordinateKind.CYLINDRICAL, a, around(b - a))
        if letter == "S":
            # Abaqus' third axis goes towards the pole: radius, along the parallel, along the meridian.
            return _Meridians(CoordinateKind.SPHERICAL, a, around(b - a))
    except ValueError as error:
        raise block.refusal(f"is none: {error}") from error
    raise block.refusal(f"must have TYPE=R, C or S, got {block.options['TYPE']!r}")


class _Meridians(CoordinateSystem):
    """A spherical system whose second axis goes along the parallel and whose third one to the pole."""

    __slots__ = ()

    def frames(self, places: np.ndarray) -> np.ndarray:
        """Radius, parallel, towards the pole: (r, φ, −θ)."""
        found = CoordinateSystem.frames(self, places)
        return np.stack([found[..., 0], found[..., 2], -found[..., 1]], axis=-1)

    def moved(self, turn: np.ndarray, shift: np.ndarray) -> CoordinateSystem:
        """As of every system."""
        return _Meridians(self.kind, turn @ self.origin + shift, turn @ self.axes)


def _lines(file: DeckFile) -> Iterator[tuple[int, str]]:
    """Lines with their numbers, without comments; keyword lines joined, files included in their place."""
    open_line: tuple[int, str] | None = None
    for number, line in enumerate(file.lines(), start=1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if open_line is not None:
            number, text = open_line[0], open_line[1] + text
        open_line = None
        if text.startswith("*") and text.endswith(","):
            open_line = number, text
            continue
        if re.match(r"\*\s*INCLUDE\b", text, re.IGNORECASE):
            _, options = _parsed(text)
            if "INPUT" not in options:
                raise FormatError(f"line {number} must say which file it includes, by INPUT=")
            yield from _lines(file.other(options["INPUT"], number))
            continue
        yield number, text
    if open_line is not None:
        yield open_line


def _parsed(text: str) -> tuple[str, dict[str, str]]:
    keyword, *parameters = [part.strip() for part in _BARE.split(text)]
    pairs = [part.partition("=") for part in parameters if part]
    options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
    return re.sub(r"\s+", " ", "*" + keyword[1:].strip()).upper(), options


def _blocks(lines: Iterator[tuple[int, str]], file: DeckFile, wanted: Container[str]) -> Iterator[_Block]:
    """The keywords one after the other; the data lines of those that are wanted."""
    current: _Block | None = None
    for number, text in lines:
        if not text.startswith("*"):
            if current is not None and current.keyword in wanted:
                current.data.append((number, text))
            continue
        if current is not None:
            yield current
        current = _Block(number, *_parsed(text))
        if "INPUT" in current.options and current.keyword in ("*NODE", "*NSET", "*ELEMENT"):
            current.data += list(_lines(file.other(current.options["INPUT"], number)))
    if current is not None:
        yield current


def _node(number: int, text: str) -> tuple[int, list[float]]:
    parts = [part.strip() for part in text.rstrip(",").split(",")]
    try:
        return int(parts[0]), [*(real(part) for part in parts[1:4]), 0.0, 0.0, 0.0][:3]
    except ValueError as error:
        raise FormatError(f"line {number} must hold a node and its coordinates, got {text[:80]!r}") from error


def _whole(data: Data) -> list[int]:
    """All whole numbers of data lines, which may go on in the next one."""
    found: list[int] = []
    for number, text in data:
        try:
            found += [int(part) for part in text.split(",") if part.strip()]
        except ValueError as error:
            raise FormatError(f"line {number} must hold an element, got {text[:80]!r}") from error
    return found


def _named(deck: Deck, text: str, number: int, *, generate: bool) -> list[Sequence[int]]:
    """What a line of a set names: nodes, ranges, other sets."""
    parts = [part.strip().strip('"') for part in _BARE.split(text) if part.strip()]
    try:
        if generate:
            first, last, *step = map(int, parts)
            return [range(first, last + 1, step[0] if step else 1)]
        return [deck.sets[part.upper()] if part.upper() in deck.sets else [int(part)] for part in parts]
    except ValueError as error:
        raise FormatError(f"line {number} must hold nodes or names of sets, got {text[:80]!r}") from error
