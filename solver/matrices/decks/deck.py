"""The files of a deck, and what it says of its nodes: places, sets, the axes along which each one moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from solver.matrices.decks.deck_coordinates import CoordinateSystem, FloatArray
from solver.matrices.readers.numbers_in_text import FormatError, fortran_real
from solver.matrices.sectors.elements import ElementShape, Integer

_DEEPEST = 10  # files that include each other
_MOST_MEMBERS = 2_000_000


@dataclass(frozen=True, slots=True)
class DeckFile:
    """A file of a deck."""

    path: Path
    alone: Annotated[bool, "Whether it may not include other files, as a stranger's."] = False
    depth: Annotated[int, "How many files include it."] = 0

    def lines(self) -> Iterator[str]:
        """The lines of the file, one after the other."""
        with self.path.open(encoding="latin-1") as file:
            for line in file:
                yield line.rstrip("\n")

    def other(self, name: str, line: int) -> DeckFile:
        """The file that a line includes.

        Raises
        ------
        FormatError
            It may not, or files include each other.
        """
        if self.alone:
            raise FormatError(
                f"line {line} includes another file, which is not read here: put the nodes and sets into one "
                "deck"
            )
        if self.depth == _DEEPEST:
            raise FormatError(f"{self.path.name!r} includes {name!r} too deeply")
        return DeckFile(self.path.parent / name, self.alone, self.depth + 1)


class Members:
    """Counts the members of all sets of a deck: a line can name ranges, and sets that name sets."""

    def __init__(self) -> None:
        self._count = 0

    def add(self, members: list[int], more: Sequence[int]) -> None:
        """Add to a set.

        Raises
        ------
        FormatError
            The sets then have more members than those of any deck.
        """
        self._count += len(more)
        if self._count > _MOST_MEMBERS:
            raise FormatError(f"the sets have more than {_MOST_MEMBERS} members together")
        members += more


def real(text: str) -> float:
    """A number as `fortran_real` reads it, nothing being 0."""
    return fortran_real(text) if text.strip() else 0.0


@dataclass(frozen=True, slots=True)
class Deck:
    """What a deck says of its nodes."""

    nodes: Annotated[
        dict[int, tuple[float, float, float]], "Position of each node, in the units of the deck."
    ] = field(default_factory=dict)
    sets: Annotated[dict[str, list[int]], "Nodes of each set, by its name in capitals."] = field(
        default_factory=dict
    )
    elements: Annotated[
        list[tuple[ElementShape, Integer]], "If they were asked for: those of ``*ELEMENT`` that can be drawn."
    ] = field(default_factory=list)
    systems: Annotated[
        dict[int, CoordinateSystem],
        "Coordinate system along whose axes a node moves, where it is not the global one.",
    ] = field(default_factory=dict)


def positions(deck: Deck, nodes: Sequence[int]) -> FloatArray:
    """Positions of nodes, (n, 3).

    Raises
    ------
    ValueError
        The deck does not have one of them.
    """
    missing = [node for node in nodes if node not in deck.nodes]
    if missing:
        raise ValueError(f"node {missing[0]} is not in the deck, which has {len(deck.nodes)} nodes")
    return np.array([deck.nodes[node] for node in nodes], dtype=np.float64).reshape(-1, 3)


def frames(deck: Deck, nodes: Sequence[int]) -> FloatArray:
    """The axes of nodes as columns, (n, 3, 3).

    Raises
    ------
    ValueError
        A node on the axis of its cylindrical or spherical system, where the axes are not known.
    """
    found = np.broadcast_to(np.eye(3), (len(nodes), 3, 3)).copy()
    of: dict[int, list[int]] = {}
    for i, node in enumerate(nodes):
        if node in deck.systems:
            of.setdefault(id(deck.systems[node]), []).append(i)
    for rows in of.values():
        own = [nodes[i] for i in rows]
        system = deck.systems[own[0]]
        found[rows] = system.frames(positions(deck, own))
        bad = np.flatnonzero(np.isnan(found[rows]).any(axis=(1, 2)))
        if bad.size:
            raise ValueError(
                f"node {own[bad[0]]} moves along the axes of a {system.kind.value} system and lies on its "
                "axis, where they have no direction: give it another system before the export"
            )
    return found
