"""What a deck says of its nodes: places, sets, and the axes along which each one moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solver.matrices.decks.coordinates import FloatArray, System
from solver.matrices.sectors.elements import Integer, Shape


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
    systems : dict
        Coordinate system along whose axes a node moves, where it is not the global one.
    """

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    sets: dict[str, list[int]] = field(default_factory=dict)
    elements: list[tuple[Shape, Integer]] = field(default_factory=list)
    systems: dict[int, System] = field(default_factory=dict)


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
