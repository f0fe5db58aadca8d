"""Positions and sets of nodes from the input deck of a finite-element program.

CalculiX and Abaqus: ``*NODE`` with numbers and coordinates, ``*NSET`` with ``GENERATE``, ``*INCLUDE``; node
sets of ``*NODE, NSET=``. Ansys (``CDWRITE``): ``NBLOCK`` and ``CMBLOCK``. Nastran: ``GRID`` in the basic
coordinate system, which has no sets.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from solver.matrices.readers.numbers_in_text import FormatError
from solver.matrices.readers.reader import Reader
from solver.matrices.sectors.elements import Integer, Shape, elements_of, shape_of

_MOST_NODES = 10_000_000
_DEEPEST = 10  # files that include each other
_EXPONENT = re.compile(r"(?<=[0-9.])([+-][0-9]+)$")  # 1.5-3 of Nastran is 1.5e-3


@dataclass(frozen=True, slots=True)
class Deck:
    """What a deck says of its nodes.

    Attributes
    ----------
    nodes : dict
        Position of each node, in the units of the deck.
    sets : dict
        Nodes of each set, by its name in capitals.
    elements : list of (Shape, (n, nodes) array)
        If they were asked for: those of ``*ELEMENT`` that can be drawn.
    """

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    sets: dict[str, list[int]] = field(default_factory=dict)
    elements: list[tuple[Shape, Integer]] = field(default_factory=list)


def read_deck(path: Path, *, elements: bool = False) -> Deck:
    """Read the nodes and sets of a deck, and the elements if they are asked for.

    Raises
    ------
    FormatError
        With the line that cannot be read, or a deck without nodes.
    OSError
        It cannot be read.
    """
    deck = Deck()
    try:
        _fill(deck, path, elements=elements)
    except FormatError:
        raise
    except (IndexError, ValueError, OverflowError) as error:
        raise FormatError(f"{path.name!r} is damaged or no deck: {error}") from error
    if not deck.nodes:
        raise FormatError(
            f"{path.name!r} has no nodes: *NODE (CalculiX, Abaqus), NBLOCK (Ansys) or GRID (Nastran)"
        )
    bad = next((node for node, place in deck.nodes.items() if not all(map(math.isfinite, place))), None)
    if bad is not None:
        raise FormatError(f"node {bad} must be at a finite place, got {deck.nodes[bad]}")
    return deck


def check_alone(path: Path) -> None:
    """Raise FormatError if a deck includes other files, which a stranger's may not.

    Raises
    ------
    FormatError
        With the line.
    OSError
        It cannot be read.
    """
    for number, line in enumerate(_lines(path), start=1):
        if line.strip().upper().startswith("*INCLUDE"):
            raise FormatError(
                f"line {number} includes another file, which is not read here: put the nodes and sets into "
                "one deck"
            )


def _fill(deck: Deck, path: Path, *, elements: bool) -> None:
    lines = _lines(path)
    if any(line.upper().startswith("NBLOCK") for line in lines):
        _ansys(lines, deck)
    elif any(line.upper().startswith("GRID") for line in lines):
        _nastran(lines, deck)
    else:
        _abaqus(path, lines, deck, 0, elements=elements)


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="latin-1").splitlines()


def _abaqus(path: Path, lines: list[str], deck: Deck, depth: int, *, elements: bool) -> None:
    for keyword, options, data in _keywords(lines):
        if keyword == "*INCLUDE" and "INPUT" in options:
            if depth == _DEEPEST:
                raise FormatError(f"{path.name!r} includes {options['INPUT']!r} too deeply")
            other = path.parent / options["INPUT"].strip('"')
            _abaqus(other, _lines(other), deck, depth + 1, elements=elements)
        elif keyword == "*NODE":
            found = [_node(number, text) for number, text in data]
            deck.nodes.update(found)
            if "NSET" in options:
                deck.sets.setdefault(options["NSET"].upper(), []).extend(node for node, _ in found)
        elif keyword == "*NSET" and "NSET" in options:
            members = deck.sets.setdefault(options["NSET"].upper(), [])
            for number, text in data:
                members += _members(deck, text, number, generate="GENERATE" in options)
        elif elements and keyword == "*ELEMENT" and data:
            shape = shape_of(options.get("TYPE", ""))
            if shape is not None:
                deck.elements.append((shape, elements_of(shape, _whole(data), data[0][0])))


def _keywords(lines: list[str]) -> Iterator[tuple[str, dict[str, str], list[tuple[int, str]]]]:
    """Keyword, its options and its data lines with their numbers."""
    current: tuple[str, dict[str, str], list[tuple[int, str]]] | None = None
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            if current is not None:
                current[2].append((number, text))
            continue
        if current is not None:
            yield current
        keyword, *parameters = [part.strip() for part in text.split(",")]
        pairs = [part.partition("=") for part in parameters]
        current = keyword.upper(), {key.strip().upper(): value.strip() for key, _, value in pairs}, []
    if current is not None:
        yield current


def _node(number: int, text: str) -> tuple[int, tuple[float, float, float]]:
    parts = [part.strip() for part in text.rstrip(",").split(",")]
    try:
        node, *place = int(parts[0]), *(float(part or 0.0) for part in parts[1:4])
    except ValueError as error:
        raise FormatError(f"line {number} must hold a node and its coordinates, got {text[:80]!r}") from error
    x, y, z = (*place, 0.0, 0.0, 0.0)[:3]
    return node, (x, y, z)


def _whole(data: list[tuple[int, str]]) -> list[int]:
    """All whole numbers of data lines, which may go on in the next one."""
    found: list[int] = []
    for number, text in data:
        try:
            found += [int(part) for part in text.split(",") if part.strip()]
        except ValueError as error:
            raise FormatError(f"line {number} must hold an element, got {text[:80]!r}") from error
    return found


def _members(deck: Deck, text: str, number: int, *, generate: bool) -> list[int]:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    try:
        if generate:
            first, last, *step = map(int, parts)
            if last - first > _MOST_NODES:
                raise FormatError(f"line {number} generates more than {_MOST_NODES} nodes")
            return list(range(first, last + 1, step[0] if step else 1))
        found: list[int] = []
        for part in parts:
            found += deck.sets[part.upper()] if part.upper() in deck.sets else [int(part)]
        return found
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"line {number} must hold nodes or names of sets, got {text[:80]!r}") from error


def _ansys(lines: list[str], deck: Deck) -> None:
    at = 0
    while at < len(lines):
        upper = lines[at].upper()
        if upper.startswith("NBLOCK"):
            at = _nblock(lines, at, deck)
        elif upper.startswith("CMBLOCK"):
            at = _cmblock(lines, at, deck)
        else:
            at += 1


def _nblock(lines: list[str], at: int, deck: Deck) -> int:
    form = re.match(r"\s*\((\d+)i(\d+),(\d+)e(\d+)", lines[at + 1].lower()) if at + 1 < len(lines) else None
    if form is None:
        raise FormatError(f"line {at + 2} must hold the format of NBLOCK, such as (3i9,6e21.13e3)")
    heads, width, _, wide = (int(text) for text in form.groups())
    at += 2
    while at < len(lines) and not lines[at].strip().startswith(("N,", "-1")):
        line = lines[at]
        try:
            begin = heads * width
            place = [float(line[begin + i * wide : begin + (i + 1) * wide].strip() or 0.0) for i in range(3)]
            deck.nodes[int(line[:width])] = (place[0], place[1], place[2])
        except ValueError as error:
            raise FormatError(f"line {at + 1} must hold a node of NBLOCK, got {line[:80]!r}") from error
        at += 1
    return at


def _cmblock(lines: list[str], at: int, deck: Deck) -> int:
    parts = [part.strip() for part in lines[at].split("!")[0].split(",")]
    if len(parts) < 4 or not parts[2].upper().startswith("NODE"):
        return at + 1
    form = re.match(r"\s*\((\d+)i(\d+)\)", lines[at + 1].lower()) if at + 1 < len(lines) else None
    if form is None:
        raise FormatError(f"line {at + 2} must hold the format of CMBLOCK, such as (8i10)")
    width, count = int(form.group(2)), int(parts[3])
    at, found = at + 2, list[int]()
    while len(found) < count and at < len(lines):
        line = lines[at].rstrip()
        found += [int(line[i : i + width]) for i in range(0, len(line), width)]
        at += 1
    members: list[int] = []
    for item in found:  # a negative number closes a range
        members += [item] if item > 0 else range(members[-1] + 1, -item + 1)
    deck.sets[parts[1].upper()] = members
    return at


def _nastran(lines: list[str], deck: Deck) -> None:
    for i, line in enumerate(lines):
        head = line.split("$")[0]
        name = re.split(r"[,\s]", head, maxsplit=1)[0].upper()
        if name not in ("GRID", "GRID*"):
            continue
        if "," in head:
            fields = [part.strip() for part in head.split(",")][1:]
        elif name == "GRID*":
            more = lines[i + 1].split("$")[0] if i + 1 < len(lines) else ""
            fields = [head[8 + 16 * j : 24 + 16 * j].strip() for j in range(4)] + [more[8:24].strip()]
        else:
            fields = [head[8 + 8 * j : 16 + 8 * j].strip() for j in range(5)]
        if len(fields) > 1 and fields[1] not in ("", "0"):
            raise FormatError(
                f"line {i + 1}: a GRID must be in the basic coordinate system, got {fields[1]!r}"
            )
        try:
            x, y, z = (
                float(_EXPONENT.sub(r"e\1", text)) if text else 0.0 for text in (*fields, "", "", "")[2:5]
            )
            deck.nodes[int(fields[0])] = (x, y, z)
        except ValueError as error:
            raise FormatError(f"line {i + 1} must hold a GRID, got {line[:80]!r}") from error


def positions(deck: Deck, nodes: list[int]) -> np.ndarray:
    """Positions of nodes, (n, 3).

    Raises
    ------
    ValueError
        The deck does not have one of them.
    """
    missing = [node for node in nodes if node not in deck.nodes]
    if missing:
        raise ValueError(f"node {missing[0]} is not in the deck, which has {len(deck.nodes)} nodes")
    return np.array([deck.nodes[node] for node in nodes]).reshape(-1, 3)


READERS = (
    Reader(
        name="a deck",
        suffixes=(".inp", ".cdb"),
        word="inp",
        help="CalculiX, Abaqus (`*NODE`, `*NSET`), Ansys (`NBLOCK`, `CMBLOCK`): positions and sets of nodes, "
        "for the boundaries of a sector of a disk; Nastran (`GRID`) too, uploaded with `?format=inp`.",
        nodes=read_deck,
    ),
)
